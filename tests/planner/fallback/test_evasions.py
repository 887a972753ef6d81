"""Evasions: inside the lane and the limits, and never on towards a closed line."""

from dataclasses import replace

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from planner.fallback.evasions import evasions
from tests.planner.lane_change.roads import on_lanes

HORIZON = 5.0


@given(st.floats(-0.5, 0.5), st.floats(1.0, 30.0))
def test_evasions_stay_in_the_lane_and_within_the_limits(offset, speed):
    scene = on_lanes(speed=speed, offset=offset, target_speed=speed)
    found = list(evasions(scene, HORIZON))
    limits = scene.vehicle.limits
    assert len(found) >= 3
    for way in found:
        reach = np.abs(way.l + 1.75) + 0.5 * scene.vehicle.width
        assert reach.max() <= 1.75
        assert np.abs(way.curvature).max() <= limits.max_curvature
        lateral = np.abs(way.curvature) * way.speed**2
        assert lateral.max() <= limits.max_lateral_acceleration + 1e-6


def test_speed_is_not_held_towards_a_closed_stop_line():
    scene = on_lanes(speed=15.0)
    line = scene.ego_frenet.s + scene.vehicle.front_reach + 20.0
    stopping = replace(scene, stop_lines=(line,))
    assert any(way.speed[5] == 15.0 for way in evasions(scene, HORIZON))
    assert not any(way.speed[5] == 15.0 for way in evasions(stopping, HORIZON))
