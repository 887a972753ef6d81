"""Random scenes of chapter 6, planned with every rule for the passing order."""

import itertools
import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from time import perf_counter

import numpy as np

from experiments.thesis.lane_change.published_cases import (
    EGO,
    LANE,
    PATH_LENGTH,
    SHAPE,
    SPEED,
)
from planner.lane_change.path import ChangeTarget, best_change
from planner.lane_change.settings import GridSettings, OrderRule, SpeedSettings
from planner.lane_change.speed.passing_orders import (
    DriveLimits,
    Side,
    demands,
    order_of,
    reachable,
)
from planner.lane_change.speed.plan import SpeedPlan, plan_speed
from planner.lane_change.speed.program import (
    SpeedTask,
    knot_times,
    program,
    speed_caps,
    start_state,
)
from planner.lane_change.speed.st_graph import in_time
from planner.piecewise_jerk.solve import QpStatus, solve
from planner.reference_path.path import ReferencePath
from planner.reference_path.segments import line
from planner.scene import Prediction, Vehicles
from planner.states import FrenetState, Path

START = 100.0  # s of the ego [m]
NEAREST = 8.0  # between vehicles of one lane, centre to centre [m]
AHEAD = 12.0  # least distance of a vehicle ahead in the ego's lane [m]
GRIDS = {
    "9 x 81": GridSettings(9, 81),
    "17 x 161": GridSettings(17, 161),
    "17 x 321": GridSettings(),
    "34 x 641": GridSettings(34, 641),
}
SETTINGS = SPEED  # of the published cases: margins, but no gaps and headways
ALL_ORDERS, AREA = "every order", "area"
SAME = 1e-6  # relative difference of costs that solvers leave


def dp_name(grid: str) -> str:
    """Return the name of the search on one grid."""
    return f"DP {grid}"


RULES: Mapping[str, SpeedSettings] = {
    ALL_ORDERS: SETTINGS,
    AREA: replace(SETTINGS, order_rule=OrderRule.AREA),
    **{
        dp_name(name): replace(
            SETTINGS, order_rule=OrderRule.DYNAMIC_PROGRAMMING, grid=grid
        )
        for name, grid in GRIDS.items()
    },
}


@dataclass(frozen=True, slots=True, eq=False)
class SpeedScene:
    """A path and the vehicles around it."""

    path: Path
    users: Vehicles
    task: SpeedTask

    def plan(self, settings: SpeedSettings) -> SpeedPlan:
        """Plan the speed among all vehicles."""
        everyone = np.ones(len(self.users.ids), np.bool_)
        users = in_time(self.users, knot_times(settings))
        return plan_speed(self.path, EGO, users, everyone, self.task, settings)


@dataclass(frozen=True, slots=True)
class Asked:
    """A random scene by its numbers."""

    seed: int
    vehicles: int
    repeats: int  # of timed calls
    brute_force: bool = False


@dataclass(frozen=True, slots=True)
class Found:
    """Results of a scene by rule."""

    cost: Mapping[str, float]  # inf without a solution
    time_ms: Mapping[str, float]
    nodes: int  # that the tree of orders looked at
    orders: int  # that were left to solve
    on_path: int  # vehicles that come onto the path
    brute_force: float | None  # least cost over all 2^m orders


def study_scene(asked: Asked) -> Found:
    """Plan one scene by every rule."""
    scene = random_scene(asked.seed, asked.vehicles)
    plans, times = {}, {}
    for name, settings in RULES.items():
        times[name] = math.inf
        for _ in range(asked.repeats):
            start = perf_counter()
            plans[name] = scene.plan(settings)
            times[name] = min(times[name], 1e3 * (perf_counter() - start))
    full = plans[ALL_ORDERS]
    return Found(
        {name: plan.cost for name, plan in plans.items()},
        times,
        full.nodes,
        full.solved,
        len(full.graph.ids),
        brute_force(scene) if asked.brute_force else None,
    )


def change_path(speed: float) -> Path:
    """Build the path of the published cases at the ego's `speed` [m/s]."""
    road = ReferencePath.from_segments([line(2.0 * PATH_LENGTH)])
    ego = FrenetState(START, speed, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    change, refused = best_change(
        road, ego, ChangeTarget(LANE, 0.0, PATH_LENGTH), EGO, SHAPE
    )
    if change is None:
        raise ValueError(f"no path at {speed} m/s: {refused}")
    return change.path


def random_scene(seed: int, n: int) -> SpeedScene:
    """Draw n vehicles in both lanes, none beside the ego in its own."""
    rng = np.random.default_rng([seed, n, 6])
    speed = float(rng.uniform(2.0, 16.0))
    cars: list[tuple[float, float, float]] = []
    while len(cars) < n:
        s, l = float(rng.uniform(20.0, 220.0)), float(rng.choice([0.0, LANE]))
        near = any(l == other[1] and abs(s - other[0]) < NEAREST for other in cars)
        if not near and (l == LANE or s > START + AHEAD):
            cars.append((s, l, float(rng.uniform(4.0, 16.0))))
    task = SpeedTask(speed, 0.0, float(rng.uniform(8.0, 16.0)))
    return SpeedScene(change_path(speed), vehicles(cars), task)


def vehicles(cars: list[tuple[float, float, float]]) -> Vehicles:
    """Build vehicles at constant speed; rows are centre s, l [m], speed [m/s]."""
    times = knot_times(SETTINGS)
    s0, l, v = np.array(cars).T
    s = s0[:, None] + v[:, None] * times
    across, none = np.repeat(l[:, None], times.size, axis=1), np.zeros(len(cars))
    return Vehicles(
        tuple(f"car.{k}" for k in range(len(cars))),
        s0,
        l,
        none,
        v,
        none,
        none,
        np.full(len(cars), EGO.length),
        np.full(len(cars), EGO.width),
        Prediction(float(times[1]), s, across, np.zeros_like(s), s, across),
    )


def brute_force(scene: SpeedScene) -> float:
    """Return the minimum cost over all 2^m orders, solved without pruning."""
    times = knot_times(SETTINGS)
    graph = scene.plan(SETTINGS).graph
    start = start_state(scene.task, EGO, SETTINGS)
    limits = DriveLimits.of(EGO)
    reach = reachable(start.speed, start.acceleration, limits, SETTINGS.max_jerk, times)
    bounds = demands(graph, SETTINGS, start.speed, times)
    caps = speed_caps(scene.path, EGO, scene.task, times)
    best = math.inf
    for sides in itertools.product(Side, repeat=len(graph.ids)):
        order = order_of(sides, bounds, reach, float(scene.path.distance[-1]))
        task = scene.task
        found = solve(program(order, start, caps, task, EGO, SETTINGS), "piqp")
        if found.status is QpStatus.SOLVED:
            best = min(best, found.objective)
    return best


def same_cost(one: float, other: float) -> bool:
    """Check whether two costs agree within solver tolerance."""
    if not (math.isfinite(one) and math.isfinite(other)):
        return one == other
    return abs(one - other) <= SAME * max(one, other, 1.0)
