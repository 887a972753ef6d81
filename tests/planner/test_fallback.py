import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from planner.contact_check import Contact
from planner.fallback import (
    EASY_GAP,
    EMERGENCY_JERK,
    HARD_GAP,
    STOP_JERK,
    Brake,
    brake_down,
    braking_on_arc,
    evasions,
    fallback,
    shifted_plan,
    stopping_trajectory,
)
from planner.interface import PlanStatus
from planner.states import CartesianState, FrenetState, Trajectory
from tests.planner.lane_change.roads import on_lanes
from tests.planner.scenes import STEP, bend, ego_on, make_scene, straight, winding

HORIZON = 5.0
COLUMNS = ("x", "y", "heading", "curvature", "speed", "acceleration", "s", "l")


def free(trajectory):
    return None


def plan_along(path, s, speed, l=0.0):
    """An even drive along the path, as a last plan."""
    t = STEP * np.arange(51)
    states = [ego_on(path, s + speed * time, l, speed) for time in t]
    names = ("x", "y", "heading", "curvature", "speed", "acceleration")
    columns = [np.array([getattr(state, name) for state in states]) for name in names]
    return Trajectory(t, *columns, s + speed * t, np.full_like(t, l))


def scene_after(path, last):
    """The scene one step after `last` was made, driven perfectly."""
    return make_scene(path, last.at(STEP), near=float(last.s[1]))


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


@pytest.mark.parametrize(
    ("aside", "faster"), [(0.2, 0.0), (0.0, 0.5), (-0.2, 0.0), (0.0, -0.5)]
)
def test_a_plan_that_the_ego_is_not_on_is_not_shifted(aside, faster):
    path = straight()
    last = plan_along(path, 50.0, 10.0)
    ego = ego_on(path, 51.0, aside, 10.0 + faster)
    assert shifted_plan(make_scene(path, ego), last) is None


def test_a_plan_that_is_used_up_is_not_shifted():
    path = straight()
    last = plan_along(path, 50.0, 10.0)
    short = Trajectory(last.t[:2], *(getattr(last, name)[:2] for name in COLUMNS))
    assert shifted_plan(scene_after(path, last), short) is None


@pytest.mark.parametrize("time_step", [0.07, 0.3])
def test_a_plan_at_other_times_than_the_loop_begins_where_the_ego_is(time_step):
    path = straight(200.0)
    fine = plan_along(path, 10.0, 8.0)
    t = time_step * np.arange(8)
    columns = [np.interp(t, fine.t, getattr(fine, name)) for name in COLUMNS]
    last = Trajectory(t, *columns)
    scene = make_scene(path, last.at(STEP), near=10.0)
    shifted = shifted_plan(scene, last)
    later = t[t > STEP] - STEP
    np.testing.assert_allclose(shifted.t, [0.0, *later], atol=1e-12)
    assert shifted.t[0] == 0.0
    np.testing.assert_allclose(shifted.s, 10.0 + 8.0 * (shifted.t + STEP))
    np.testing.assert_allclose(shifted.x, [scene.ego.x, *last.x[t > STEP]])
    assert shifted.at(0.0) == last.at(STEP)


def test_a_plan_can_be_shifted_again_and_again():
    path = straight()
    plan = plan_along(path, 50.0, 10.0)
    first = plan
    for k in range(1, 20):
        plan = shifted_plan(make_scene(path, plan.at(STEP)), plan)
        np.testing.assert_allclose(plan.x, first.x[k:])
        assert plan.t[0] == pytest.approx(0.0, abs=1e-12)


@given(
    speed=st.floats(0.5, 20.0),
    l=st.floats(-3.0, 3.0),
    offset=st.floats(-3.0, 3.0),
    error=st.floats(-0.1, 0.1),
    deceleration=st.sampled_from([4.5, 8.0]),
)
def test_a_stop_on_a_straight_brakes_as_it_says(speed, l, offset, error, deceleration):
    path = straight()
    scene = make_scene(path, ego_on(path, 50.0, l, speed, error))
    stop = stopping_trajectory(scene, offset, deceleration, HORIZON)
    assert stop.t.size == 51
    assert math.isclose(stop.x[0], scene.ego.x, abs_tol=1e-9)
    assert math.isclose(stop.y[0], scene.ego.y, abs_tol=1e-9)
    assert math.isclose(stop.heading[0], scene.ego.heading, abs_tol=1e-9)
    assert math.isclose(stop.speed[0], speed, abs_tol=1e-9)
    assert np.all(np.diff(stop.s) >= -1e-12)
    assert stop.speed[-1] == 0.0
    slower = -np.diff(stop.speed) / STEP
    assert slower.max() < 1.25 * deceleration  # the way bends, the share of s is kept


@pytest.mark.parametrize("speed", [3.0, 8.0])
def test_a_stop_in_a_bend_follows_the_road_and_moves_as_it_says(speed):
    path = winding()
    scene = make_scene(path, ego_on(path, 40.0, 1.0, speed))
    stop = stopping_trajectory(scene, 1.0, 4.5, HORIZON)
    np.testing.assert_allclose(stop.l, 1.0, atol=1e-9)
    s, l = path.project(stop.x, stop.y)
    np.testing.assert_allclose(s, stop.s, atol=1e-6)
    np.testing.assert_allclose(l, stop.l, atol=1e-6)
    driven = np.hypot(np.diff(stop.x), np.diff(stop.y))
    mean = 0.5 * (stop.speed[1:] + stop.speed[:-1]) * STEP
    moving = stop.speed[1:] > 0.0
    # while the deceleration grows, the mean of the ends is too small by jerk · step³/12
    np.testing.assert_allclose(driven[moving], mean[moving], rtol=2e-3, atol=9e-4)


def test_a_standing_ego_stays_where_it_is():
    path = straight()
    scene = make_scene(path, ego_on(path, 50.0, 1.0, 0.0))
    stop = stopping_trajectory(scene, 0.0, 4.5, HORIZON)
    np.testing.assert_allclose(stop.x, 50.0)
    np.testing.assert_allclose(stop.y, 1.0)


@given(st.floats(0.0, 20.0), st.floats(-0.2, 0.2), st.floats(1.0, 9.0))
def test_braking_on_an_arc_in_closed_form(speed, curvature, deceleration):
    ego = CartesianState(3.0, -2.0, 0.7, curvature, speed, 1.0)
    stop = braking_on_arc(ego, deceleration, STEP, 25.0)
    driven, _, _ = brake_down(
        speed, Brake(1.0, deceleration, EMERGENCY_JERK), np.array([1e3])
    )
    driven = float(driven[0])
    assert math.isclose(stop.s[-1], driven, abs_tol=1e-9)
    assert math.isclose(stop.heading[-1], 0.7 + curvature * driven, abs_tol=1e-9)
    if abs(curvature) > 1e-3:
        heading = 0.7 + curvature * stop.s
        x = 3.0 + (np.sin(heading) - math.sin(0.7)) / curvature
        y = -2.0 - (np.cos(heading) - math.cos(0.7)) / curvature
        np.testing.assert_allclose(stop.x, x, atol=1e-6)
        np.testing.assert_allclose(stop.y, y, atol=1e-6)
    slower = -np.diff(stop.speed) / STEP
    assert slower.max(initial=0.0) <= deceleration + 1e-9


@given(
    speed=st.floats(0.0, 20.0),
    first=st.floats(-6.0, 3.0),
    deceleration=st.floats(1.0, 9.0),
    jerk=st.floats(5.0, 50.0),
)
def test_braking_keeps_its_jerk_and_drives_what_its_speed_says(
    speed, first, deceleration, jerk
):
    t = np.arange(0.0, 25.0, 1e-3)
    way, v, a = brake_down(speed, Brake(first, deceleration, jerk), t)
    assert np.all(v >= 0.0)
    assert v[-1] == 0.0
    assert (
        np.abs(way - np.concatenate([[0.0], np.cumsum(v[1:] + v[:-1]) * 5e-4])).max()
        < 1e-2
    )
    moving = v[1:] > 0.0
    assert np.abs(np.diff(a)[moving]).max(initial=0.0) <= jerk * 1e-3 + 1e-9
    assert a.min() >= min(first, -deceleration) - 1e-9


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
