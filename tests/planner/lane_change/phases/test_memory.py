import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from planner.lane_change.phases.memory import (
    about_to_enter,
    lane_line,
    progress_on,
    reaches_over,
    settled,
)
from planner.lane_change.place_on_path import rest_from
from planner.states import Path
from planner.vehicle import Vehicle
from tests.planner.lane_change.roads import on_lanes


def arc_path(radius: float = 40.0, length: float = 60.0, spacing: float = 0.5) -> Path:
    distance = np.arange(0.0, length, spacing)
    angle = distance / radius
    curvature = np.full_like(distance, 1.0 / radius)
    x, y = radius * np.sin(angle), radius * (1.0 - np.cos(angle))
    return Path(distance, x, y, angle, curvature, 100.0 + distance, 0.0 * distance)


def test_what_is_left_of_a_path_lies_on_it():
    path = arc_path()
    rest = rest_from(path, 20.2)
    assert rest is not None
    np.testing.assert_allclose(np.diff(rest.distance), 0.5)
    np.testing.assert_allclose(np.hypot(rest.x, rest.y - 40.0), 40.0, atol=1e-3)
    assert rest.s[0] == pytest.approx(120.2)
    assert rest.distance[-1] == pytest.approx(path.distance[-1] - 20.2, abs=0.5)


def test_nothing_is_left_at_the_end():
    path = arc_path()
    assert rest_from(path, float(path.distance[-1]) - 0.3) is None


def test_progress_is_where_the_ego_is():
    scene = on_lanes(lane=0, s=130.0)
    distance = np.arange(0.0, 80.0, 0.5)
    zero = np.zeros_like(distance)
    line = Path(
        distance,
        100.0 + distance,
        zero - 1.75,
        zero,
        zero,
        100.0 + distance,
        zero - 1.75,
    )
    assert progress_on(line, scene) == pytest.approx(30.0)
    beside = Path(distance, 100.0 + distance, zero, zero, zero, 100.0 + distance, zero)
    assert progress_on(beside, scene) is None


@given(
    st.floats(-3.0, 3.0),
    st.floats(-0.3, 0.3),
    st.floats(-2.0, 2.0),
    st.sampled_from([-1, 1]),
)
def test_reach_over_the_line_is_that_of_the_corners(l, slope, line, side):
    vehicle = Vehicle()
    angle = math.atan(slope)
    corners = [
        l + along * math.sin(angle) + across * math.cos(angle)
        for along in (vehicle.front_reach, -vehicle.rear_overhang)
        for across in (0.5 * vehicle.width, -0.5 * vehicle.width)
    ]
    expected = max(side * (corner - line) for corner in corners)
    assert reaches_over(vehicle, l, slope, line, side) == pytest.approx(expected)


def test_the_change_binds_when_the_body_reaches_the_line():
    middle = on_lanes(lane=0)
    assert lane_line(middle, 0, 1) == pytest.approx(0.0)
    assert not about_to_enter(middle, 0, 1, 0.1)
    near = on_lanes(lane=0, offset=0.85)  # 1.75 - 0.95 - 0.85 < 0
    assert about_to_enter(near, 0, 1, 0.1)


def test_settled_means_in_the_middle_and_parallel():
    assert settled(on_lanes(lane=1), 1)
    assert not settled(on_lanes(lane=1, offset=0.3), 1)
    assert not settled(on_lanes(lane=1, error=0.1), 1)
