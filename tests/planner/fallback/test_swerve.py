"""Swerves: out of the lane, inside the road and the limits, behind nobody's bumper."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from planner.contact_check import Contact
from planner.fallback.evasions import swerving
from planner.fallback.ladder import EASY_GAP, fallback
from planner.fallback.swerve import has_room_behind
from planner.interface import PlanStatus
from planner.scene import RoadBounds
from tests.planner.lane_change.roads import on_lanes
from tests.planner.scenes import Car

HORIZON = 5.0
LANE = -1.75  # middle of the ego's one, the other is to its left


def narrowing(scene, begin, end):
    """The same where the lane beside closes between two places [m]."""
    left, right = scene.road.at(np.array([scene.ego_frenet.s]))
    s = np.array([0.0, begin, end, scene.path.length])
    left = left[0] + np.array([0.0, 0.0, -3.5, -3.5])
    return replace(scene, road=RoadBounds(s, left, np.full(4, right[0])))


def corners(scene, way):
    """Places along the road and offsets of the body's corners, (4 * n,)."""
    vehicle, half = scene.vehicle, 0.5 * scene.vehicle.width
    places = []
    for along in (vehicle.front_reach, -vehicle.rear_overhang):
        for across in (half, -half):
            cos, sin = np.cos(way.heading), np.sin(way.heading)
            x = way.x + along * cos - across * sin
            y = way.y + along * sin + across * cos
            places.append(scene.path.project(x, y))
    return np.concatenate(places, axis=1)


@given(st.floats(-0.5, 0.5), st.floats(1.0, 35.0), st.floats(105.0, 300.0))
def test_swerves_stay_on_the_road_and_within_the_limits(offset, speed, closes):
    wide = on_lanes(speed=speed, offset=offset, target_speed=speed)
    limits = wide.vehicle.limits
    for scene in (wide, narrowing(wide, closes, closes + 15.0)):
        for way in swerving(scene, HORIZON):
            s, l = corners(scene, way)
            left, right = scene.road.at(s)
            assert np.all(l <= left + 0.02)
            assert np.all(l >= right - 0.02)
            assert np.abs(way.curvature).max() <= limits.max_curvature + 1e-9
            lateral = np.abs(way.curvature) * way.speed**2
            assert lateral.max() <= limits.max_lateral_acceleration + 1e-9


def test_a_lane_that_closes_is_not_swerved_into():
    wide = on_lanes(speed=25.0)
    over = [way for way in swerving(wide, HORIZON) if way.l[-1] > LANE + 2.4]
    assert over
    closing = narrowing(wide, 125.0, 140.0)
    assert not [w for w in swerving(closing, HORIZON) if w.l[-1] > LANE + 2.4]


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
    ("behind", "speed", "braking", "is_free"),
    [
        (10.0, 25.0, 4.5, False),
        (80.0, 25.0, 4.5, True),
        (80.0, 40.0, 4.5, False),
        (10.0, 5.0, 4.5, True),
        (20.0, 15.0, 4.5, True),
        (20.0, 15.0, 8.0, False),  # who comes from behind brakes less hard
    ],
)
def test_nobody_behind_is_cut_off(behind, speed, braking, is_free):
    """The ego has 15 m/s; a follower in its own lane sees it anyway."""
    scene = on_lanes(speed=15.0)
    rear = scene.ego_frenet.s - scene.vehicle.rear_overhang
    beside = Car(rear - behind - 2.4, LANE + 3.5, speed)
    follower = Car(rear - 3.0, LANE, 15.0)
    crowded = on_lanes(speed=15.0, cars=[beside, follower])
    assert has_room_behind(crowded, LANE + 3.5, braking) == is_free
    alone = on_lanes(speed=15.0, cars=[follower])
    assert has_room_behind(alone, LANE + 3.5, braking)


def test_who_is_not_cut_off_is_swerved_before():
    scene = on_lanes(speed=15.0)
    rear = scene.ego_frenet.s - scene.vehicle.rear_overhang

    def lefts(behind):
        cars = [Car(rear - behind - 2.4, LANE + 3.5, 25.0)]
        ways = swerving(on_lanes(speed=15.0, cars=cars), HORIZON)
        return [way for way in ways if way.l[-1] > LANE + 2.0]

    assert lefts(120.0)
    assert not lefts(10.0)


def test_a_car_of_the_next_lane_is_behind_an_ego_at_its_line_too():
    """It is near the ego's corridor already, but follows somebody else."""
    scene = on_lanes(speed=15.0, offset=1.4)
    rear = scene.ego_frenet.s - scene.vehicle.rear_overhang
    cars = [Car(rear - 3.0 - 2.4, LANE + 3.5, 25.0)]
    assert not has_room_behind(
        on_lanes(speed=15.0, offset=1.4, cars=cars), LANE + 3.5, 4.5
    )
