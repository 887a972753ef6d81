"""The speed plan of chapter 6, its program, and a whole cycle; one core, warm."""

from dataclasses import replace

import numpy as np
import pytest

from planner.lane_change import proposed
from planner.lane_change.path import ChangeTarget, best_change
from planner.lane_change.settings import (
    GridSettings,
    OrderRule,
    PathSettings,
    SpeedSettings,
)
from planner.lane_change.speed.plan import plan_speed
from planner.lane_change.speed.program import SpeedTask, knot_times
from planner.lane_change.speed.st_graph import in_time
from planner.piecewise_jerk.solve import QpStatus, solve
from planner.vehicle import Vehicle
from tests.planner.lane_change.roads import on_lanes
from tests.planner.lane_change.speed.test_plan import random_scene
from tests.planner.lane_change.test_planner import wall
from tests.planner.piecewise_jerk.programs import KINDS
from tests.planner.scenes import Car

pytestmark = pytest.mark.bench

CAR = Vehicle()
SOLVE_ALL = SpeedSettings()
RULES = {
    "ours": SOLVE_ALL,
    "area": replace(SOLVE_ALL, order_rule=OrderRule.AREA),
    **{
        f"dp_{times}x{places}": replace(
            SOLVE_ALL,
            order_rule=OrderRule.DYNAMIC_PROGRAMMING,
            grid=GridSettings(times, places),
        )
        for times, places in ((11, 161), (17, 321), (21, 641))
    },
}


@pytest.mark.parametrize("kind", KINDS)
def test_programs_that_have_a_solution(benchmark, kind):
    rng = np.random.default_rng(7)
    programs = [KINDS[kind](rng) for _ in range(40)]
    found = [solve(p) for p in programs]
    solved = [
        p
        for p, s in zip(programs, found, strict=True)
        if s.status is QpStatus.SOLVED and s.iterations > 0
    ]
    benchmark(lambda: [solve(p) for p in solved])
    benchmark.extra_info["programs"] = len(solved)
    benchmark.extra_info["iterations"] = float(
        np.mean([s.iterations for s in found if s.status is QpStatus.SOLVED])
    )
    if benchmark.stats is not None:  # none with --benchmark-disable
        median = benchmark.stats.stats.median
        benchmark.extra_info["ms_a_program"] = 1e3 * median / len(solved)


def speed_tasks(n):
    """The first twenty random scenes with n vehicles."""
    for seed in range(20):
        scene = random_scene(np.random.default_rng(seed), n)
        change, _ = best_change(
            scene.path,
            scene.ego_frenet,
            ChangeTarget(1.75, 0.0, 220.0),
            CAR,
            PathSettings(),
        )
        assert change is not None
        task = SpeedTask(scene.ego.speed, scene.ego.acceleration, 13.9)
        yield change.path, scene.vehicles, np.ones(n, np.bool_), task


def plan(path, vehicles, everyone, task, settings):
    """A speed plan, and what a cycle works out once for all its speed plans."""
    users = in_time(vehicles, knot_times(settings))
    return plan_speed(path, CAR, users, everyone, task, settings)


@pytest.mark.parametrize("rule", RULES)
@pytest.mark.parametrize("n", [1, 8])
def test_speed_plans_of_101_knots(benchmark, n, rule):
    tasks = list(speed_tasks(n))
    plans = [plan(*task, RULES[rule]) for task in tasks]
    best = [plan(*task, SOLVE_ALL) for task in tasks]
    benchmark(lambda: [plan(*task, RULES[rule]) for task in tasks])
    both = [
        (p.cost, b.cost)
        for p, b in zip(plans, best, strict=True)
        if p.profile is not None and b.profile is not None
    ]
    benchmark.extra_info["plans"] = len(tasks)
    benchmark.extra_info["found"] = f"{len(both)} of {len(tasks)}"
    gaps = [cost / least - 1.0 for cost, least in both]
    benchmark.extra_info["cost_gap_mean"] = float(np.mean(gaps))
    if benchmark.stats is not None:
        median = benchmark.stats.stats.median
        benchmark.extra_info["ms_a_plan"] = 1e3 * median / len(tasks)


SCENES = {
    "keeping": on_lanes(cars=[Car(85.0, 1.75, 14.0)]),
    "seeking": on_lanes(
        cars=[
            Car(85.0, 1.75, 14.0),
            Car(60.0, 1.75, 12.0),
            Car(150.0, 1.75, 13.0),
            Car(190.0, -1.75, 6.0),
            Car(30.0, 1.75, 12.0),
            Car(40.0, -1.75, 10.0),
        ],
        obstacles=wall(300.0),
    ),
}


@pytest.mark.parametrize("name", SCENES)
def test_a_whole_cycle(benchmark, name):
    planner = proposed()
    memory = planner.plan(SCENES[name], None).memory
    plan = benchmark(lambda: planner.plan(SCENES[name], memory))
    benchmark.extra_info["phase"] = str(plan.memory.phase)
