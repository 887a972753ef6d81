"""From a coarse path to a smooth one inside its tube; [Thesis] 5.6.

The coarse path says on which side each obstacle is passed and how the body turns; the
quadratic program of `planner.piecewise_jerk.solve` finds the path.
"""

import math
from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from planner.dense.field import Cover, FrenetObstacles
from planner.dense.frenet_path import FrenetPath, PathCheck, check_path
from planner.dense.lattice.coarse_path import CoarsePath, PathStart
from planner.dense.lattice.edge_check import road_along
from planner.dense.settings import SmoothingSettings
from planner.dense.tube.corridor import PathGuess, sides_of
from planner.dense.tube.program import (
    PathWeights,
    knots_between,
    tube_about,
    tube_program,
)
from planner.piecewise_jerk.solve import (
    PiecewiseJerkProblem,
    PiecewiseJerkSolution,
    QpStatus,
    solve,
    solve_soft,
)
from planner.states import FloatArray

CHECK_TOLERANCE = 1e-3  # what rounding and linearisation may take [m]


class SmoothingStatus(StrEnum):
    """Outcome of the smoothing."""

    OK = "ok"
    TUBE_EMPTY = "tube_empty"  # somewhere both sides leave no room
    INFEASIBLE = "infeasible"  # the tube is open, but no path is smooth enough for it
    NOT_CONVERGED = "not_converged"  # the solver gave up
    CHECK_FAILED = "check_failed"  # the turning body touches something after all


_FAILURES = {
    QpStatus.INFEASIBLE: SmoothingStatus.INFEASIBLE,
    QpStatus.NOT_CONVERGED: SmoothingStatus.NOT_CONVERGED,
}


@dataclass(frozen=True, slots=True)
class Smoothing:
    """Outcome of the smoothing; there is a path where the status is OK."""

    status: SmoothingStatus
    path: FrenetPath | None
    check: PathCheck | None
    objective: float  # of eq. 5.27; inf without a path
    slack: float  # by which the tube was exceeded, 0 unless that is allowed [m]
    passes: int


def smooth(
    field: FrenetObstacles,
    cover: Cover,
    coarse: CoarsePath,
    settings: SmoothingSettings,
) -> Smoothing:
    """Smooth a coarse path, keeping its sides.

    The place of a disc off the ego's point depends on the path's slope. It is taken
    to first order about the coarse path, then about the last result, until the
    result passes the check.

    Args:
        field: Obstacles and road.
        cover: Of the ego.
        coarse: Free of collisions.
        settings: See there.
    """
    s = knots_between(coarse.s[0], coarse.s[-1], settings.knot_step)
    l, slope, _ = coarse.at(s)
    wanted = l
    for passed in range(1, settings.passes + 1):
        problem = smoothing_problem(
            field, cover, coarse.start, PathGuess.of(s, l, slope), wanted, settings
        )
        crossed = _crossed(problem)
        if crossed and settings.allowed_slack == 0.0:
            return _failed(SmoothingStatus.TUBE_EMPTY, passed)
        solution = _solve(problem, settings)
        if solution.status is not QpStatus.SOLVED:
            return _failed(_FAILURES[solution.status], passed)
        path = FrenetPath(s, *solution.state.T)
        check = check_path(path, field, cover)
        if passes_check(check, settings):
            objective, slack = solution.objective, solution.slack
            return Smoothing(SmoothingStatus.OK, path, check, objective, slack, passed)
        l, slope = path.l, path.slope
    return _failed(SmoothingStatus.CHECK_FAILED, settings.passes)


def _crossed(problem: PiecewiseJerkProblem) -> bool:
    """Check whether some bounds of the program cross."""
    state = problem.lower[1:] > problem.upper[1:]
    return bool(state.any() or np.any(problem.row_lower > problem.row_upper))


def _solve(
    problem: PiecewiseJerkProblem, settings: SmoothingSettings
) -> PiecewiseJerkSolution:
    """Solve with a hard tube, and with a soft one only where that has no solution."""
    solution = solve(problem, solver=settings.solver)
    if solution.status is QpStatus.SOLVED or settings.allowed_slack == 0.0:
        return solution
    return solve_soft(problem)


def _failed(status: SmoothingStatus, passes: int) -> Smoothing:
    """Make the outcome without a path."""
    return Smoothing(status, None, None, math.inf, 0.0, passes)


def passes_check(check: PathCheck, settings: SmoothingSettings) -> bool:
    """Check whether a path may be returned."""
    allowed = settings.allowed_slack + CHECK_TOLERANCE
    return (
        check.clearance >= -allowed
        and check.road_room >= -allowed
        and check.curvature <= settings.max_curvature
    )


def smoothing_problem(
    field: FrenetObstacles,
    cover: Cover,
    start: PathStart,
    about: PathGuess,
    wanted: FloatArray,
    settings: SmoothingSettings,
) -> PiecewiseJerkProblem:
    """Build the program of [Thesis] eq. 5.26 to 5.32, as corrected.

    Args:
        field: Obstacles and road.
        cover: Of the ego.
        start: Where the path begins, fixed.
        about: The path that sets the sides.
        wanted: l of the coarse path, (n,) [m].
        settings: See there.
    """
    offsets = np.array(cover.offsets)
    road = road_along(about.s, field.road_columns(), offsets)
    turning = bool(np.any(offsets != 0.0)) or bool(np.any(road.curvature != 0.0))
    margin = settings.turn_margin if turning else 0.0
    tube = tube_about(about, field, cover, margin, settings.max_curvature)
    sides = sides_of(about, road, field.obstacle_columns(), offsets)
    smoothness = settings.smoothness_weight
    return tube_program(
        tube,
        *tube.between(sides),
        start,
        PathWeights(settings.offset_weight, smoothness, smoothness, smoothness),
        (wanted, settings.coarse_weight),
    )
