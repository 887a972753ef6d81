from hypothesis import given
from hypothesis import strategies as st

from experiments.cosim.fleet.records import HUMAN
from experiments.cosim.fleet.selection import EgoSelection, GroupShare, lot

NAMES = [f"own.{k}" for k in range(2000)]
share = st.floats(0.0, 1.0)


def chosen(groups: list[GroupShare], seed: int, names=NAMES) -> dict[str, int]:
    selection = EgoSelection(groups, seed)
    return {name: selection.choose(name, "car") for name in names}


@given(share, share, st.integers(0, 2**31 - 1))
def test_a_smaller_share_is_part_of_a_larger_one(one, other, seed):
    names = NAMES[:200]
    less, more = sorted((one, other))
    few = chosen([GroupShare(penetration=less)], seed, names)
    many = chosen([GroupShare(penetration=more)], seed, names)
    assert all(many[name] == 0 for name in names if few[name] == 0)


@given(st.integers(0, 10**6))
def test_shares_are_kept_and_seeds_choose_others(seed):
    groups = [GroupShare(penetration=0.2), GroupShare(penetration=0.3)]
    found = chosen(groups, seed)
    counts = [list(found.values()).count(group) for group in (0, 1, HUMAN)]
    for count, expected in zip(counts, (0.2, 0.3, 0.5), strict=True):
        assert abs(count / len(NAMES) - expected) < 0.06  # five standard deviations
    assert found != chosen(groups, seed + 1)


@given(st.permutations(NAMES[:30]))
def test_the_order_of_entering_does_not_choose(names):
    groups = [GroupShare(penetration=0.4)]
    assert chosen(groups, 3, names) == chosen(groups, 3, NAMES[:30])


def test_everybody_and_nobody():
    assert set(chosen([GroupShare(penetration=1.0)], 1).values()) == {0}
    assert set(chosen([GroupShare(penetration=0.0)], 1).values()) == {HUMAN}
    assert all(0.0 <= lot(5, name) < 1.0 for name in NAMES)


def test_a_count_takes_the_first_that_enter():
    found = chosen([GroupShare(count=3)], 1)
    assert [name for name in NAMES if found[name] == 0] == NAMES[:3]


def test_a_vehicle_that_cannot_be_an_ego_leaves_its_place_to_the_next():
    selection = EgoSelection([GroupShare(count=1)], 0)
    assert selection.choose("own.0", "car") == 0
    selection.release(0)
    assert selection.choose("own.1", "car") == 0
    assert selection.choose("own.2", "car") == HUMAN


def test_a_group_is_of_types_flows_and_vehicles():
    selection = EgoSelection([GroupShare(("truck", "ramp", "own.7"), 1.0)], 0)
    assert selection.choose("own.1", "truck") == 0
    assert selection.choose("ramp.12", "car") == 0
    assert selection.choose("own.7", "car") == 0
    assert selection.choose("own.71", "car") == HUMAN
    assert selection.choose("ramps.1", "car") == HUMAN
    assert selection.never_met() == []


def test_a_group_that_nobody_belongs_to_is_named():
    groups = [GroupShare(of=("trukc", "ramp"), penetration=1.0), GroupShare(count=1)]
    selection = EgoSelection(groups, 0)
    selection.choose("own.1", "car")
    selection.choose("own.2", "truck")
    (words,) = selection.never_met()
    assert words == "no vehicle was of trukc, ramp (types that entered: car, truck)"
