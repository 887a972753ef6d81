"""Fallbacks in a field of obstacles keep to the path of the last cycle."""

import numpy as np

from planner.bodies import bodies_of
from planner.dense.planner import touched_body
from planner.fallback.ladder import fallback
from planner.interface import PlanStatus
from planner.reference_path.frenet_lines import line_in_plane
from planner.states import Trajectory
from tests.planner.scenes import STEP, Car, Disc, ego_on, make_scene, straight

PATH, SPEED = straight(), 6.0
# Between the two only a path that changes over to the right and back is free.
GATE = [Disc(26.0, 1.3, 1.2), Disc(42.0, -3.2, 1.2)]


def last_plan(duration=6.0):
    """Make a plan that passes the gate: to l = -1.6 m and back."""
    t = STEP * np.arange(round(duration / STEP) + 1)
    s = 10.0 + SPEED * (t - STEP)
    phase = np.clip((s - 8.0) / 36.0, 0.0, 1.0) * 2.0 * np.pi
    rate = np.where((phase > 0.0) & (phase < 2.0 * np.pi), 2.0 * np.pi / 36.0, 0.0)
    l = -0.8 * (1.0 - np.cos(phase))
    line = line_in_plane(
        PATH, s, l, -0.8 * np.sin(phase) * rate, -0.8 * np.cos(phase) * rate**2
    )
    still = np.zeros_like(t)
    return Trajectory(
        t, line.x, line.y, line.heading, line.curvature, still + SPEED, still, s, l
    )


def scene_on(plan, cars=()):
    here = plan.at(STEP)
    l = float(np.interp(STEP, plan.t, plan.l))
    ego = ego_on(PATH, s=10.0, l=l, speed=SPEED, error=here.heading)
    return make_scene(PATH, ego, GATE, list(cars), target_speed=8.0)


def blocker_of(scene):
    bodies = bodies_of(scene, 61)
    return lambda trajectory: touched_body(scene, bodies, trajectory)


def test_a_plan_whose_path_has_room_to_stop_is_driven_on():
    scene = scene_on(last_plan())
    kept = fallback(scene, last_plan(), blocker_of(scene), 6.0)
    assert kept[0] is PlanStatus.LAST_PLAN_SHIFTED


def test_at_the_end_of_a_plan_the_ego_stops_gently_where_that_is_free():
    plan = last_plan(0.6)  # shorter than a gentle stop
    scene = scene_on(plan)
    blocker = blocker_of(scene)
    status, stop = fallback(scene, plan, blocker, 6.0)
    assert status is PlanStatus.FULL_STOP
    assert stop.speed[-1] == 0.0
    assert blocker(stop) is None


def test_a_car_on_the_path_is_stopped_for():
    scene = scene_on(last_plan(), [Car(24.0, -1.4, 0.0)])
    status, stop = fallback(scene, last_plan(), blocker_of(scene), 6.0)
    assert status is PlanStatus.FULL_STOP
    assert stop.s[-1] + scene.vehicle.front_reach < 24.0 - 2.4
