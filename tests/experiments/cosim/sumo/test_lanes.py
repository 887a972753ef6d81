import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from experiments.cosim.sumo.lanes import Lane, edge_of
from planner.errors import InvalidInputError

BEND = Lane("e_0", "e", 0, 3.0, np.array([(0, 0), (50, 0), (80, 40), (80, 90)], float))


def brute_force(lane: Lane, x: float, y: float) -> float:
    stations = np.linspace(0.0, lane.length, 20001)
    px = np.interp(stations, lane.stations, lane.points[:, 0])
    py = np.interp(stations, lane.stations, lane.points[:, 1])
    return float(np.hypot(px - x, py - y).min())


def test_length_is_that_of_the_polyline():
    assert BEND.length == pytest.approx(50.0 + 50.0 + 50.0)


@given(st.floats(0.0, 100.0), st.floats(0.0, 90.0))
def test_offset_is_the_distance_to_the_nearest_point(x, y):
    station, offset = BEND.project(x, y)
    if 0.0 < station < BEND.length:
        assert abs(offset) == pytest.approx(brute_force(BEND, x, y), abs=5e-3)
        foot = BEND.at(station)
        assert math.hypot(x - foot[0], y - foot[1]) == pytest.approx(
            abs(offset), abs=1e-9
        )


def test_left_is_positive():
    assert BEND.project(20.0, 2.0) == pytest.approx((20.0, 2.0))
    assert BEND.project(20.0, -2.0) == pytest.approx((20.0, -2.0))


def test_ends_are_carried_on_for_the_rear_of_a_body():
    assert BEND.project(-4.0, 1.0) == pytest.approx((-4.0, 1.0))
    assert BEND.project(79.0, 95.0) == pytest.approx((155.0, 1.0))


@given(st.floats(0.0, 150.0))
def test_projecting_a_point_of_the_lane_finds_it_again(station):
    x, y, _ = BEND.at(station)
    assert BEND.project(x, y) == pytest.approx((station, 0.0), abs=1e-6)


def test_repeated_points_are_dropped():
    lane = Lane("e_0", "e", 0, 3.0, np.array([(0, 0), (0, 0), (9, 0), (9, 0)], float))
    assert lane.points.shape == (2, 2)


@pytest.mark.parametrize("points", [[(1.0, 1.0), (1.0, 1.0)], [(0.0, 0.0, 0.0)]])
def test_a_point_is_no_lane(points):
    with pytest.raises(InvalidInputError, match="centre line"):
        Lane("e_0", "e", 0, 3.0, np.array(points))


@pytest.mark.parametrize("lane", ["own_2", "a_b_10", ":c_4_0"])
def test_edge_of_keeps_underscores(lane):
    edge, index = edge_of(lane), lane.split("_")[-1]
    assert f"{edge}_{index}" == lane
