"""The records of a scene: what they refuse, and what they say between samples."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from planner.errors import InvalidInputError
from planner.scene import (
    COLUMNS,
    Lanes,
    Obstacles,
    Prediction,
    RoadBounds,
    RoadUsers,
    SpeedLimits,
    Vehicles,
)

S = np.array([0.0, 10.0, 30.0])
TWO = np.array([[0.0, 0.0, 1.0], [3.5, 3.5, 4.0]])
WIDE = np.full((2, 3), 3.5)
LIMITS = SpeedLimits(S, np.array([20.0, 8.0, 14.0]))


def users(n):
    table = np.arange(8.0 * n).reshape(8, n)
    return RoadUsers.from_table(tuple(f"v{k}" for k in range(n)), table)


def prediction(n, steps=4):
    return Prediction.from_table(0.1, np.arange(5.0 * n * steps).reshape(5, n, steps))


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: RoadBounds(S, S + 1, S[:2]), r"right has shape \(2,\), not \(3,\)"),
        (lambda: RoadBounds(S[::-1], S + 1, S), "must grow strictly"),
        (lambda: RoadBounds(S, S, S), "left bounds must exceed right bounds"),
        (lambda: RoadBounds(S[:0], S[:0], S[:0]), "must grow strictly"),
        (lambda: SpeedLimits(S, np.zeros(3)), "must be positive"),
        (lambda: SpeedLimits(S, np.full(3, np.nan)), "must be positive"),
        (lambda: SpeedLimits(S[::-1], S + 1), "must grow strictly"),
        (lambda: Lanes(S[::-1], TWO, WIDE), "must grow strictly"),
        (lambda: Lanes(S, TWO[::-1], WIDE), "from right to left"),
        (lambda: Lanes(S, TWO, WIDE[:1]), r"width has shape|shape of the widths"),
        (
            lambda: Lanes(S, TWO, WIDE, solid_left=np.zeros((1, 3), dtype=bool)),
            "solid_left must have the shape of the widths",
        ),
        (lambda: Obstacles(("a",), *[np.zeros(2)] * 6), r"x has shape \(2,\)"),
        (lambda: Prediction(0.1, *[np.zeros(3)] * 5), r"must be \(n, n_steps\)"),
        (
            lambda: RoadUsers.from_table(("a",), np.zeros((8, 2))),
            r"table: \(8, 2\) for 1 vehicles",
        ),
        (
            lambda: Vehicles.predicted(users(2), prediction(1)),
            "1 predictions for 2 vehicles",
        ),
    ],
)
def test_records_that_do_not_fit_together_are_refused(make, words):
    with pytest.raises(InvalidInputError, match=words):
        make()


@given(st.floats(-5.0, 40.0))
def test_bounds_and_lanes_are_linear_between_samples_and_held_beyond(s):
    held = min(max(s, 0.0), 30.0)
    share = max(held - 10.0, 0.0) / 20.0  # between the second and the third sample
    left, right = RoadBounds(S, [5.0, 5.0, 7.0], [-2.0, -2.0, 0.0]).at(np.array([s]))
    assert (left[0], right[0]) == pytest.approx((5.0 + 2.0 * share, -2.0 + 2.0 * share))
    centres, widths = Lanes(S, TWO, WIDE).at(s)
    assert centres == pytest.approx([share, 3.5 + 0.5 * share])
    assert widths == pytest.approx([3.5, 3.5])


def test_arrays_are_copies_that_cannot_be_changed():
    left = np.full(3, 5.0)
    bounds = RoadBounds(S, left, left - 7.0)
    left[:] = 0.0
    assert bounds.left.tolist() == [5.0] * 3
    for record in (bounds, LIMITS, Lanes(S, TWO, WIDE), users(2), prediction(2)):
        name = next(x for x in ("left", "limit", "centre", "x") if hasattr(record, x))
        with pytest.raises(ValueError, match="read-only"):
            getattr(record, name)[0] = 1.0


@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_records_tell_whether_all_numbers_are_finite(value):
    assert RoadBounds(S, S + 9.0, S - 9.0).is_finite
    assert not RoadBounds([0.0], [np.inf], [-1.0]).is_finite
    assert Obstacles.none().is_finite
    assert not Obstacles(("a",), *([value], *[[0.0]] * 5)).is_finite


@given(st.floats(-5.0, 40.0))
def test_a_limit_holds_from_its_place_to_the_next(s):
    expected = 20.0 if s < 10.0 else 8.0 if s < 30.0 else 14.0
    assert LIMITS.at_one(s) == expected
    assert LIMITS.at(np.array([[s]])).tolist() == [[expected]]
    assert SpeedLimits.none().at_one(s) == math.inf


@given(st.floats(-5.0, 40.0), st.floats(0.5, 8.0))
def test_from_the_allowed_speed_every_limit_can_be_kept(s, braking):
    allowed = LIMITS.allowed(s, braking)
    ways = [(place - s, limit) for place, limit in zip(S, LIMITS.limit, strict=True)]
    ahead = [math.sqrt(v**2 + 2.0 * braking * way) for way, v in ways if way > 0.0]
    expected = min([LIMITS.at_one(s), *ahead])
    if s < 0.0:  # the first limit holds before it, too
        expected = min(expected, ahead[0])
    assert allowed <= LIMITS.at_one(s) or s < 0.0
    assert allowed == pytest.approx(expected if s >= 0.0 else min(ahead))


def test_solid_lines_are_looked_at_between_two_places():
    solid = np.zeros((2, 3), dtype=bool)
    solid[0, 1] = True  # the right lane's left line, from 10 m to 30 m
    lanes = Lanes(S, TWO, WIDE, solid_left=solid)
    assert lanes.may_change(0, 1, 0.0, 10.0)
    assert not lanes.may_change(0, 1, 0.0, 10.1)
    assert not lanes.may_change(0, 1, 29.9, 40.0)
    assert lanes.may_change(0, 1, 30.0, 40.0)
    assert lanes.may_change(0, -1, 0.0, 40.0)
    assert lanes.may_change(1, 1, 0.0, 40.0)


@given(st.lists(st.booleans(), min_size=0, max_size=6))
def test_those_kept_have_their_own_rows(marks):
    kept = np.array(marks, dtype=bool)
    found = users(len(marks)).among(kept)
    assert found.ids == tuple(f"v{k}" for k in np.flatnonzero(kept))
    for row, name in enumerate(COLUMNS):
        assert getattr(found, name).tolist() == [
            row * len(marks) + k for k in np.flatnonzero(kept)
        ]


def test_a_record_of_a_table_is_that_of_its_columns():
    table = np.arange(16.0).reshape(8, 2)
    by_columns = RoadUsers(("a", "b"), *table)
    by_table = RoadUsers.from_table(("a", "b"), table.copy())
    np.testing.assert_array_equal(by_columns.table, by_table.table)
    layers = np.arange(30.0).reshape(5, 2, 3)
    one = Prediction(0.1, *layers)
    np.testing.assert_array_equal(one.table, layers)
    whole = Vehicles(("a", "b"), *table, prediction=one)
    same = Vehicles.predicted(by_table, one)
    np.testing.assert_array_equal(whole.table, same.table)
    assert same.prediction is one
