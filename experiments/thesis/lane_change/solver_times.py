"""Table 6.1 over grids of the search and solvers of the quadratic program."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from time import perf_counter

import numpy as np

from experiments.thesis.lane_change.published_cases import EGO, SPEED, WISH, solve_case
from experiments.thesis.lane_change.random_scenes import GRIDS
from experiments.thesis.lane_change.speed_study import START_SPEEDS
from planner.errors import InvalidInputError
from planner.lane_change.speed.area_rule import sides_by_area
from planner.lane_change.speed.dynamic_programming import sides_by_search
from planner.lane_change.speed.passing_orders import (
    DriveLimits,
    Side,
    demands,
    order_of,
    reachable,
)
from planner.lane_change.speed.program import (
    SpeedTask,
    knot_times,
    program,
    speed_caps,
    start_state,
)
from planner.piecewise_jerk.solve import QpStatus, solve
from planner.piecewise_jerk.sparse_solvers import SOLVERS

OWN = "riccati"
ALL_SOLVERS = (OWN, *SOLVERS)


@dataclass(frozen=True, slots=True)
class Timed:
    """Times of one case [ms]; nan where a solver is not installed or fails."""

    start_speed: float  # [m/s]
    direct: float  # the convex space of 6.4.2, without the program
    search: dict[str, float]  # grid -> time of the search
    qp: dict[str, float]  # solver -> time of the program
    missing: dict[str, str]  # solver -> why it has no time


def time_case(start_speed: float, repeats: int) -> Timed:
    """Time the parts of one published case."""
    case = solve_case(start_speed, SPEED)
    graph, times = case.plan.graph, knot_times(SPEED)
    task = SpeedTask(start_speed, 0.0, WISH)
    start = start_state(task, EGO, SPEED)
    limits = DriveLimits.of(EGO)
    end = float(case.path.distance[-1])

    def direct() -> tuple[Side, ...]:
        return sides_by_area(
            graph, start.speed, limits.braking, limits.acceleration, end, times
        )

    def searching(name: str) -> Callable[[], object]:
        grid = GRIDS[name]
        return lambda: sides_by_search(
            graph, start.speed, limits, WISH, end, SPEED, grid, times
        )

    reach = reachable(start.speed, start.acceleration, limits, SPEED.max_jerk, times)
    bounds = demands(graph, SPEED, start.speed, times)
    order = order_of(tuple(side for _, side in case.plan.order), bounds, reach, end)
    problem = program(
        order, start, speed_caps(case.path, EGO, task, times), task, EGO, SPEED
    )
    qp, missing = {}, {}
    for solver in ALL_SOLVERS:
        try:
            found = solve(problem, solver)
        except InvalidInputError as error:
            missing[solver] = str(error)
            continue
        if found.status is not QpStatus.SOLVED:
            missing[solver] = f"solver {solver}: {found.status}"
            continue
        qp[solver] = _fastest(partial(solve, problem, solver), repeats)
    return Timed(
        start_speed,
        _fastest(direct, repeats),
        {name: _fastest(searching(name), repeats) for name in GRIDS},
        qp,
        missing,
    )


def time_cases(repeats: int) -> list[Timed]:
    """Time both published cases."""
    return [time_case(speed, repeats) for speed in START_SPEEDS]


def mean_over(cases: list[Timed], part: Callable[[Timed], float]) -> float:
    """Average over the cases; nan if one has no time."""
    values = [part(case) for case in cases]
    return float(np.mean(values)) if values else math.nan


def _fastest(call: Callable[[], object], repeats: int) -> float:
    """Return the shortest of some calls [ms]; the first one is not counted."""
    call()
    took = math.inf
    for _ in range(repeats):
        start = perf_counter()
        call()
        took = min(took, perf_counter() - start)
    return 1e3 * took
