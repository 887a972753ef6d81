"""The order of the fallbacks, and what is driven where nothing is free."""

import math
from dataclasses import replace

import numpy as np
import pytest

from planner.contact_check import Contact
from planner.fallback.braking import (
    EMERGENCY_JERK,
    STOP_JERK,
    braking_on_arc,
)
from planner.fallback.evasions import evasions
from planner.fallback.ladder import EASY_GAP, HARD_GAP, fallback
from planner.interface import PlanStatus
from planner.states import FrenetState, Trajectory
from tests.planner.fallback.last_plans import COLUMNS, plan_along, scene_after
from tests.planner.lane_change.roads import on_lanes
from tests.planner.scenes import STEP, bend, ego_on, make_scene, straight, winding

HORIZON = 5.0


def free(trajectory):
    return None


def stopping_way(speed, deceleration, jerk):
    """From even motion to a stand, the deceleration reached with a jerk [m]."""
    even = speed**2 / (2.0 * deceleration)
    return (
        even + speed * deceleration / (2.0 * jerk) - deceleration**3 / (24.0 * jerk**2)
    )


class Refusing:
    """Refuses the first `n` trajectories that it is asked about."""

    def __init__(self, n):
        self.asked = []
        self.n = n

    def __call__(self, trajectory):
        self.asked.append(trajectory)
        return "something" if len(self.asked) <= self.n else None


def test_the_first_rung_is_the_last_plan_shifted():
    path = winding()
    last = plan_along(path, 10.0, 8.0)
    status, trajectory = fallback(scene_after(path, last), last, free, HORIZON)
    assert status is PlanStatus.LAST_PLAN_SHIFTED
    np.testing.assert_allclose(trajectory.t, last.t[:-1], atol=1e-12)
    for name in COLUMNS:
        expected = getattr(last, name)[1:]
        np.testing.assert_array_equal(getattr(trajectory, name), expected)


@pytest.mark.parametrize("refused", [1, 2])
def test_the_second_rung_is_a_full_stop(refused):
    path = straight()
    last = plan_along(path, 50.0, 10.0, l=1.0)
    scene = scene_after(path, last)
    blocker = Refusing(refused)
    status, trajectory = fallback(scene, last, blocker, HORIZON)
    assert status is PlanStatus.FULL_STOP
    assert trajectory is blocker.asked[-1]
    assert trajectory.speed[-1] == 0.0
    stopped = trajectory.s[-1] - scene.ego_frenet.s
    limit = scene.vehicle.limits.max_deceleration
    assert math.isclose(stopped, stopping_way(10.0, limit, STOP_JERK), rel_tol=1e-6)


@pytest.mark.parametrize("speed", [6.0, 10.0, 16.0])
def test_a_plan_that_ends_too_near_does_not_cost_the_last_stop(speed):
    # it is free as far as it reaches, and never slower: what stands is just behind
    path = straight()
    last = plan_along(path, 20.0, speed)
    end = float(last.s[-1])
    wall = end + 0.5

    def blocker(trajectory):
        return "wall" if trajectory.s[-1] > wall else None

    scene, statuses = scene_after(path, last), []
    for _ in range(120):
        status, last = fallback(scene, last, blocker, HORIZON)
        statuses.append(status)
        scene = scene_after(path, last)
    assert scene.ego.speed < 0.01
    assert scene.ego_frenet.s <= wall + 1e-6
    assert statuses[0] is PlanStatus.LAST_PLAN_SHIFTED, "as long as it may wait"
    assert PlanStatus.EMERGENCY_BRAKING not in statuses
    stop = stopping_way(speed, scene.vehicle.limits.max_deceleration, STOP_JERK)
    begun = statuses.index(PlanStatus.FULL_STOP)
    assert end - stop - (20.0 + speed * STEP * (begun + 1)) < 1.01 * speed * STEP


@pytest.mark.parametrize(("speed", "duration"), [(14.0, 1.5), (20.0, 2.0)])
def test_a_short_plan_on_a_free_road_ends_in_no_emergency(speed, duration):
    # its line is shorter than any stop
    path = straight()
    whole = plan_along(path, 20.0, speed)
    n = round(duration / STEP) + 1
    last = Trajectory(whole.t[:n], *(getattr(whole, name)[:n] for name in COLUMNS))
    scene, statuses = scene_after(path, last), []
    for _ in range(40):
        status, last = fallback(scene, last, free, HORIZON)
        statuses.append(status)
        scene = scene_after(path, last)
    assert statuses[0] is PlanStatus.LAST_PLAN_SHIFTED
    assert PlanStatus.FULL_STOP in statuses
    assert PlanStatus.EMERGENCY_BRAKING not in statuses


def test_a_plan_that_winds_past_bodies_is_driven_as_far_as_a_stop_fits_on_it():
    # stops settle on an offset, and would hit what the plan itself goes round
    path = winding()
    last = plan_along(path, 10.0, 8.0, l=1.5)

    def blocker(trajectory):
        near = np.abs(trajectory.l - 1.5).max() < 1e-6
        return None if near else "beside"

    scene = scene_after(path, last)
    for k in range(30):
        status, last = fallback(scene, last, blocker, HORIZON)
        assert status is PlanStatus.LAST_PLAN_SHIFTED, k
        scene = scene_after(path, last)


def test_without_a_last_plan_the_ladder_begins_with_the_stop():
    path = straight()
    status, _ = fallback(make_scene(path, ego_on(path, 50.0)), None, free, HORIZON)
    assert status is PlanStatus.FULL_STOP


def test_the_last_rung_is_emergency_braking_whatever_stands_there():
    path = straight()
    last = plan_along(path, 50.0, 10.0)
    scene = scene_after(path, last)
    status, trajectory = fallback(scene, last, lambda _: "a wall", HORIZON)
    assert status is PlanStatus.EMERGENCY_BRAKING
    stopped = trajectory.s[-1] - scene.ego_frenet.s
    limit = scene.vehicle.limits.emergency_deceleration
    assert math.isclose(
        stopped, stopping_way(10.0, limit, EMERGENCY_JERK), rel_tol=1e-6
    )


def test_where_the_frame_ends_the_ego_brakes_on_its_arc():
    path = bend(6.0, before=10.0)
    ego = ego_on(path, 15.0, 0.0, 5.0)
    beyond = FrenetState(15.0, 5.0, 0.0, 6.5, 0.0, 0.0, 0.0, 0.0)
    scene = make_scene(path, ego, frenet=beyond)
    status, trajectory = fallback(scene, None, free, HORIZON)
    assert status is PlanStatus.EMERGENCY_BRAKING
    expected = braking_on_arc(ego, 8.0, STEP, HORIZON)
    np.testing.assert_array_equal(trajectory.x, expected.x)


def test_an_ego_that_stands_is_in_no_emergency():
    path = straight()
    scene = make_scene(path, ego_on(path, 50.0, 0.0, 0.05))
    status, stop = fallback(scene, None, lambda _: "a vehicle beside", HORIZON)
    assert status is PlanStatus.FULL_STOP
    assert stop.speed[-1] == 0.0


def test_the_ladder_does_not_touch_its_inputs():
    path = straight()
    last = plan_along(path, 50.0, 10.0)
    scene = scene_after(path, last)
    before = {name: getattr(last, name).tobytes() for name in COLUMNS}
    fallback(scene, last, Refusing(3), HORIZON)
    assert before == {name: getattr(last, name).tobytes() for name in COLUMNS}
    assert replace(scene) is not scene


class Contacts:
    """Tells of a contact with each trajectory that is not `free`."""

    def __init__(self, free=lambda _: False, speed=lambda _: 1.0):
        self.free, self.speed = free, speed
        self.margins = set()

    def __call__(self, trajectory, margin):
        self.margins.add(margin)
        if self.free(trajectory):
            return ()
        speeds = self.speed(trajectory)
        many = speeds if isinstance(speeds, tuple) else (speeds,)
        return tuple(Contact("other", 1.0 + k, v) for k, v in enumerate(many))


def refuse(trajectory):
    return "other"


def test_speed_is_held_where_braking_is_not_free():
    scene = on_lanes(speed=15.0)
    contacts = Contacts(free=lambda trajectory: trajectory.speed[5] == 15.0)
    status, found = fallback(scene, None, refuse, HORIZON, contacts)
    assert status is PlanStatus.EVASION
    assert found.speed[19] == pytest.approx(15.0)
    assert found.speed[-1] < 5.0  # after two seconds it brakes
    assert contacts.margins == {EASY_GAP, HARD_GAP}


def test_emergency_braking_comes_before_an_evasion():
    scene = on_lanes(speed=15.0)
    status, _ = fallback(scene, None, refuse, HORIZON, Contacts(free=lambda _: True))
    assert status is PlanStatus.EMERGENCY_BRAKING


def test_where_nothing_is_free_the_slowest_impact_is_taken():
    scene = on_lanes(speed=15.0)
    contacts = Contacts(speed=lambda trajectory: abs(trajectory.l[-1] + 2.5))
    _, found = fallback(scene, None, refuse, HORIZON, contacts)
    offsets = [abs(way.l[-1] + 2.5) for way in evasions(scene, HORIZON)]
    assert abs(found.l[-1] + 2.5) == pytest.approx(min(offsets))


def test_all_that_a_way_hits_counts_not_only_what_it_hits_first():
    scene = on_lanes(speed=15.0)

    def speeds(trajectory):  # held speed touches gently, and then hits what stands
        return (1.0, 5.0) if trajectory.speed[5] == 15.0 else 3.0

    _, found = fallback(scene, None, refuse, HORIZON, Contacts(speed=speeds))
    assert found.speed[5] < 15.0


def test_the_last_plan_is_driven_on_where_only_its_margins_are_missing():
    path = straight()
    last = plan_along(path, 50.0, 10.0)
    scene = scene_after(path, last)
    contacts = Contacts(free=lambda trajectory: trajectory.speed[20] == 10.0)
    status, driven = fallback(scene, last, refuse, HORIZON, contacts)
    assert status is PlanStatus.LAST_PLAN_SHIFTED
    assert driven.speed[-1] == pytest.approx(0.0, abs=1e-6)


def test_the_end_of_a_last_plan_is_not_the_end_of_the_road():
    """Driven on, 0.4 s of a plan at 10 m/s hit what is behind its end hardest."""
    path = straight()
    whole = plan_along(path, 50.0, 10.0)
    short = [getattr(whole, name)[:6] for name in COLUMNS]
    last = Trajectory(whole.t[:6], *short)
    scene = scene_after(path, last)
    wall = scene.ego.x + 6.0

    def closing(trajectory):
        over = np.flatnonzero(trajectory.x > wall)
        return float(trajectory.speed[over[0]]) if over.size else 0.0

    contacts = Contacts(free=lambda way: way.x.max() <= wall, speed=closing)
    status, driven = fallback(scene, last, refuse, HORIZON, contacts)
    assert status is not PlanStatus.LAST_PLAN_SHIFTED
    braking = braking_on_arc(
        scene.ego, scene.vehicle.limits.emergency_deceleration, STEP, HORIZON
    )
    assert closing(driven) <= closing(braking)
