import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from experiments.config.search import SearchRange
from experiments.sweep.search.space import (
    SearchSpace,
    extremes,
    rounded,
    share_of,
    value_at,
)

FLOATS = SearchRange(range=(2.0, 50.0))
LOG = SearchRange(range=(0.1, 100.0), log=True)
WHOLE = SearchRange(range=(3, 9))
WHOLE_LOG = SearchRange(range=(1, 1000), log=True)
CHOICE = SearchRange(choice=("a", 2, (1.0, 2.0), None))
ALL = [FLOATS, LOG, WHOLE, WHOLE_LOG, CHOICE]
shares = st.floats(0.0, 1.0)


@pytest.mark.parametrize("one", ALL)
@given(share=shares)
def test_values_are_in_their_range_and_grow_with_the_share(one, share):
    value = value_at(one, share)
    if one.choice is not None:
        assert value in ["a", 2, [1.0, 2.0], None]
        return
    assert one.range[0] <= value <= one.range[1]
    assert value <= value_at(one, min(share + 0.1, 1.0))
    assert isinstance(value, int) is isinstance(one.range[0], int)


@pytest.mark.parametrize("one", ALL)
@given(share=shares)
def test_a_value_lies_at_a_share_that_gives_it_again(one, share):
    value = value_at(one, share)
    back = share_of(one, value)
    assert 0.0 <= back <= 1.0
    again = value_at(one, back)
    exact = one.range is None or isinstance(value, int)
    assert again == (value if exact else pytest.approx(value, rel=1e-4))


@pytest.mark.parametrize(("one", "count"), [(WHOLE, 7), (CHOICE, 4)])
def test_each_of_some_values_has_the_same_part(one, count):
    drawn = [str(value_at(one, (k + 0.5) / 7000)) for k in range(7000)]
    sizes = {value: drawn.count(value) for value in drawn}
    assert len(sizes) == count
    assert max(sizes.values()) - min(sizes.values()) <= 1


def test_logarithms_have_the_same_part_for_each_factor():
    ten = [value_at(LOG, share) for share in (0.0, 1 / 3, 2 / 3, 1.0)]
    assert ten == pytest.approx([0.1, 1.0, 10.0, 100.0], rel=1e-4)


def test_ends_are_those_of_the_range_or_all_of_a_choice():
    assert extremes(FLOATS) == [2.0, 50.0]
    assert extremes(WHOLE_LOG) == [1, 1000]
    assert extremes(CHOICE) == ["a", 2, [1.0, 2.0], None]


def test_shares_beyond_both_ends_are_the_ends():
    assert value_at(FLOATS, -1.0) == 2.0
    assert value_at(FLOATS, 2.0) == 50.0
    assert value_at(CHOICE, 2.0) is None


@given(st.floats(1e-6, 1e6))
def test_numbers_are_short_enough_to_be_typed(value):
    assert rounded(value) == pytest.approx(value, rel=1e-4)
    assert len(f"{rounded(value):e}".split("e")[0].rstrip("0")) <= 6


def test_a_space_has_its_keys_in_order_and_goes_both_ways():
    space = SearchSpace({"a.b": FLOATS, "c": CHOICE, "d": WHOLE})
    assert space.keys == ("a.b", "c", "d")
    assert space.is_choice == (False, True, False)
    assert space.counts == (None, 4, 7)
    point = space.point(np.array([0.5, 0.3, 0.99]))
    assert point == {"a.b": 26.0, "c": 2, "d": 9}
    assert space.point(space.coordinates(point)) == point


@pytest.mark.parametrize(
    ("one", "own", "expected"),
    [
        (FLOATS, 7.0, 7.0),
        (FLOATS, 70.0, 50.0),
        (FLOATS, None, 26.0),
        (FLOATS, True, 26.0),
        (FLOATS, "max", 26.0),
        (WHOLE, 1, 3),
        (WHOLE, 5.2, 5),
        (SearchRange(range=(2.0, 50.0), mild=9.0), 7.0, 9.0),
        (CHOICE, 2, 2),
        (CHOICE, "z", "a"),
    ],
)
def test_the_mild_end_is_the_scenarios_own_value_moved_into_the_range(
    one, own, expected
):
    scenario = {"list": [{"key": own}]}
    assert SearchSpace({"list[0].key": one}).mild_point(scenario) == {
        "list[0].key": expected
    }


@pytest.mark.parametrize("key", ["gone", "list[3]", "list[0].key.deeper", "list.key"])
def test_keys_that_a_scenario_has_not_are_mild_in_the_middle(key):
    space = SearchSpace({key: FLOATS})
    assert space.mild_point({"list": [{"key": 1.0}]}) == {key: 26.0}
