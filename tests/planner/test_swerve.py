"""Swerves: out of the lane, inside the road and the limits, behind nobody's bumper."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from planner.contact_check import Contact
from planner.fallback import EASY_GAP, fallback, swerving
from planner.interface import PlanStatus
from planner.swerve import EDGE_GAP, has_room_behind, swerves
from tests.planner.lane_change.roads import on_lanes
from tests.planner.scenes import Car

HORIZON = 5.0
LANE = -1.75  # middle of the ego's one, the other is to its left


@given(st.floats(-0.5, 0.5), st.floats(1.0, 35.0))
def test_swerves_stay_on_the_road_and_within_the_limits(offset, speed):
    scene = on_lanes(speed=speed, offset=offset, target_speed=speed)
    limits, half = scene.vehicle.limits, 0.5 * scene.vehicle.width
    left, right = scene.road.at(np.array([scene.ego_frenet.s]))
    for way in swerving(scene, HORIZON):
        assert right[0] + EDGE_GAP <= way.l[-1] - half + 1e-6
        assert way.l[-1] + half <= left[0] - EDGE_GAP + 1e-6
        assert np.abs(way.curvature).max() <= limits.max_curvature + 1e-9
        lateral = np.abs(way.curvature) * way.speed**2
        assert lateral.max() <= limits.max_lateral_acceleration + 1e-9


def test_the_ego_swerves_where_only_the_lane_beside_is_free():
    scene = on_lanes(speed=25.0)
    margins = set()

    def contacts(way, margin):
        margins.add(margin)
        return () if way.l[-1] > LANE + 2.4 else (Contact("other", 1.0, 5.0),)

    status, found = fallback(scene, None, lambda _: "other", HORIZON, contacts)
    assert status is PlanStatus.EVASION
    assert found.l[-1] > LANE + 2.4
    assert found.speed[10] == pytest.approx(25.0, abs=0.3)
    assert EASY_GAP in margins


@pytest.mark.parametrize(
    ("behind", "speed", "is_free"),
    [(10.0, 25.0, False), (80.0, 25.0, True), (80.0, 40.0, False), (10.0, 5.0, True)],
)
def test_nobody_behind_is_cut_off(behind, speed, is_free):
    """The ego has 15 m/s; a follower in its own lane sees it anyway."""
    scene = on_lanes(speed=15.0)
    rear = scene.ego_frenet.s - scene.vehicle.rear_overhang
    beside = Car(rear - behind - 2.4, LANE + 3.5, speed)
    follower = Car(rear - 3.0, LANE, 15.0)
    crowded = on_lanes(speed=15.0, cars=[beside, follower])
    assert has_room_behind(crowded, LANE + 3.5) == is_free
    into_the_lane = [l for l, _ in swerves(crowded) if l > LANE + 2.0]
    assert bool(into_the_lane) == is_free
    assert has_room_behind(on_lanes(speed=15.0, cars=[follower]), LANE + 3.5)
