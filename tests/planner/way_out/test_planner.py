"""An ego that stands before obstacles gets out, whatever planner it has."""

from dataclasses import replace
from itertools import pairwise

import numpy as np

from planner.fallback import braking_on_arc
from planner.interface import PlanResult, PlanStats, PlanStatus
from planner.way_out import WayOutPlanner
from tests.planner.scenes import (
    Car,
    Disc,
    clearance_now,
    ego_on,
    make_scene,
    road,
    straight,
)

PATH = straight()
DISC = Disc(56.0, 0.3, 0.8)


class Stands:
    """A planner that stays where it is."""

    def plan(self, scene, memory):
        stop = braking_on_arc(scene.ego, 2.0, scene.step, 5.0)
        stop = replace(stop, s=stop.s + scene.ego_frenet.s)
        return PlanResult(PlanStatus.OK, stop, (memory or 0) + 1, PlanStats("none"))


def scene_at(state, near=None, **more):
    return make_scene(
        PATH, state, [DISC], bounds=road(PATH, 5.0, -5.0), near=near, **more
    )


def drive(n, **more):
    """Drive the plans from a stand at s = 40 m."""
    planner, memory = WayOutPlanner(Stands()), None
    scene, seen = scene_at(ego_on(PATH, 40.0, speed=0.0), **more), []
    for _ in range(n):
        plan = planner.plan(scene, memory)
        seen.append((scene, plan))
        memory, near = plan.memory, scene.ego_frenet.s
        scene = scene_at(plan.trajectory.at(scene.step), near, **more)
    return seen


def test_it_waits_two_seconds_and_drives_past():
    seen = drive(250)
    moves = [k for k, (scene, _) in enumerate(seen) if scene.ego.speed > 0.0]
    assert 18 <= moves[0] <= 23
    assert seen[-1][0].ego_frenet.s > DISC.s + 3.0
    assert min(clearance_now(scene) for scene, _ in seen) > 0.1
    assert max(scene.ego.speed for scene, _ in seen) < 2.1
    ways = [plan for _, plan in seen if plan.stats.explanation.startswith("way out")]
    assert all(plan.status is PlanStatus.OK for plan in ways)
    assert seen[-1][1].memory.way is None  # it is over, and nothing is ahead
    assert seen[-1][1].memory.inner > 20


def test_a_plan_depends_on_scene_and_memory_alone():
    seen = drive(60)
    planner = WayOutPlanner(Stands())
    for (_, before), (scene, plan) in pairwise(seen):
        again = planner.plan(scene, before.memory)
        assert again.trajectory.x.tobytes() == plan.trajectory.x.tobytes()


def test_before_a_closed_line_it_waits():
    assert all(scene.ego.speed == 0.0 for scene, _ in drive(60, stop_lines=(48.0,)))


def test_it_stops_on_its_way_while_others_pass():
    """One stands where the way leads, from when it is on it."""
    seen = drive(60)
    scene, plan = seen[-1]
    car = Car(scene.ego_frenet.s + 9.0, scene.ego_frenet.l + 0.5, 0.0)
    blocked = scene_at(scene.ego, scene.ego_frenet.s, vehicles=[car])
    stop = WayOutPlanner(Stands()).plan(blocked, seen[-2][1].memory)
    assert plan.trajectory.speed[-1] > 1.0
    assert stop.trajectory.speed[-1] == 0.0
    assert np.ptp(stop.trajectory.s) < 5.0
