"""Sides of bends that are kept free leave the path itself free."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planner.reference_path.path import ReferencePath
from planner.route.lane_frame import INNER_SPARE, SPARE, _inner_sides
from planner.vehicle import Vehicle

CAR = Vehicle()


def s_bend(first: float, second: float, between: float) -> ReferencePath:
    """Straight, a bend to the left, one to the right, straight; (curvatures) [1/m]."""
    s = np.arange(0.0, 90.0, 0.1)
    knots = [0.0, 30.0, 34.0, 42.0, 46.0 + between, 50.0 + between, 58.0 + between]
    values = [0.0, 0.0, first, first, -second, -second, 0.0]
    heading = np.concatenate([[0.0], np.cumsum(0.1 * np.interp(s, knots, values))])[:-1]
    x, y = np.cumsum(0.1 * np.cos(heading)), np.cumsum(0.1 * np.sin(heading))
    return ReferencePath.from_polyline(np.column_stack([x, y]))


@settings(deadline=None, max_examples=25)
@given(st.floats(0.05, 0.13), st.floats(0.125, 0.16), st.floats(0.0, 10.0))
def test_the_front_may_sweep_out_before_a_bend_to_the_other_side(first, second, gap):
    """Between them the ego stood for good: the next bend's side was kept free of it."""
    path = s_bend(first, second, gap)
    s = np.arange(0.0, path.length - 5.0, 1.0)
    left, right = _inner_sides(path, s, CAR, np.full((2, s.size), 5.0))
    at = path.at(s).curvature
    half, reach = 0.5 * CAR.width, CAR.front_reach
    assert np.all(right >= half + SPARE + 0.5 * reach**2 * np.maximum(at, 0.0) - 1e-9)
    assert np.all(left >= half + SPARE + 0.5 * reach**2 * np.maximum(-at, 0.0) - 1e-9)


def test_the_inner_side_of_a_sharp_bend_is_kept_free():
    path = s_bend(0.0, 0.15, 0.0)
    s = np.arange(0.0, path.length - 5.0, 1.0)
    _, right = _inner_sides(path, s, CAR, np.full((2, s.size), 5.0))
    sharpest = int(np.argmin(path.at(s).curvature))
    assert right[sharpest] == pytest.approx(0.5 * CAR.width + INNER_SPARE)
    assert right[0] > right[sharpest]


def test_a_narrow_bend_is_entered_in_its_middle():
    path = s_bend(0.0, 0.08, 0.0)
    s = np.arange(0.0, path.length - 5.0, 1.0)
    bent = path.at(s).curvature < -0.05
    road = np.full((2, s.size), 2.0)
    road[1, bent] = 0.5 * CAR.width + 0.15
    left, right = _inner_sides(path, s, CAR, road)
    np.testing.assert_allclose(right[bent], road[1, bent])
    first = int(np.argmax(bent))
    assert np.all(np.diff(right[:first]) <= 0.0)
    assert right[first - 10] < road[1, first] + 0.5
    assert np.all(left > 50.0)
