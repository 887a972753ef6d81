"""Paths by the sides on which obstacles are passed; beyond [Thesis] ch. 5.

Which obstacles are passed to the left and which to the right decides everything: with
the sides given, the best path is the solution of one convex program, free of
collisions by construction. No edges are sampled, so that no density of waypoints limits
what can be found.
"""

import math
from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from planner.dense.field import Cover, FrenetObstacles
from planner.dense.frenet_path import FrenetPath, PathCheck, check_path
from planner.dense.lattice.coarse_path import PathStart
from planner.dense.settings import SideSettings
from planner.dense.sides.branch_and_bound import (
    Leaves,
    NodeCounts,
    SearchOptions,
    branch_and_bound,
)
from planner.dense.tube.corridor import PathGuess
from planner.dense.tube.program import (
    PathWeights,
    Tube,
    knots_between,
    tube_about,
    tube_arrays,
    tube_program,
)
from planner.dense.turning import Momentum, Turning, curvature_bounds
from planner.piecewise_jerk.problem import JerkProgram
from planner.piecewise_jerk.solve import (
    QpStatus,
    solve,
)
from planner.states import FloatArray

MAX_STEPS = 500  # of the active set in one program
TOLERANCE = 1e-9  # of its bounds
CHECK_TOLERANCE = 1e-3  # what rounding and linearisation may take [m]


class SideStatus(StrEnum):
    """Outcome of a search for sides."""

    OK = "ok"
    BLOCKED = "blocked"  # proven: no sequence has a path
    UNDECIDED = "undecided"  # none was found, but not all were decided
    CHECK_FAILED = "check_failed"  # the turning body touches something after all


@dataclass(frozen=True, slots=True, eq=False)
class SideSequence:
    """One sequence of sides and its path."""

    sides: FloatArray  # 1 to the left of an obstacle, -1 to its right, (n_obstacles,)
    cost: float
    path: FrenetPath
    check: PathCheck


@dataclass(frozen=True, slots=True)
class SideSearch:
    """Outcome of a search; `best` is None unless the status is OK.

    `programs` were solved; `empty` and `infeasible` count the partial sequences that
    were dropped because their tube is empty somewhere, or because no path is smooth
    enough for it. `exact`: the cheapest was proven to be the cheapest.
    """

    status: SideStatus
    best: SideSequence | None
    alternatives: tuple[SideSequence, ...]
    programs: int
    empty: int
    infeasible: int
    exact: bool


@dataclass(frozen=True, slots=True, eq=False)
class SideTask:
    """Data that the searches of one cycle share."""

    field: FrenetObstacles
    cover: Cover
    start: PathStart
    settings: SideSettings
    weights: PathWeights
    sharpest: FloatArray  # curvature at the knots, (n,) [1/m]
    tube: Tube  # about the road's direction
    root: JerkProgram  # with the road alone


def plan_sides(
    field: FrenetObstacles,
    cover: Cover,
    start: PathStart,
    s_end: float,
    settings: SideSettings,
) -> SideSearch:
    """Find the cheapest sequence of sides and its path.

    Args:
        field: Obstacles and road.
        cover: Of the ego.
        start: Where the ego is.
        s_end: Where the path shall end [m].
        settings: See there.
    """
    return search_sides(side_task(field, cover, start, s_end, settings))


def side_task(
    field: FrenetObstacles,
    cover: Cover,
    start: PathStart,
    s_end: float,
    settings: SideSettings,
    turning: tuple[Momentum, Turning] | None = None,
) -> SideTask:
    """Prepare what searches share.

    Args:
        field: As for `plan_sides`, as are the next four.
        cover: Of the ego.
        start: Where the ego is.
        s_end: Where the path shall end [m].
        settings: See there.
        turning: Bounds the curvature also by how fast the ego will be.
    """
    s = knots_between(start[0], s_end, settings.knot_step)
    sharpest = np.full(s.size, settings.max_curvature)
    if turning is not None:
        sharpest = curvature_bounds(s - start[0], *turning, settings.max_curvature)
    along_road = PathGuess.of(s, np.zeros(s.size), np.zeros(s.size))
    margin = _margin(field, cover, settings)
    plane = settings.in_plane
    tube = tube_about(along_road, field, cover, margin, sharpest, plane=plane)
    weights = PathWeights(
        settings.offset_weight,
        settings.slope_weight,
        settings.bend_weight,
        settings.jerk_weight,
    )
    root = tube_arrays(tube, tube.low, tube.high, start, weights)
    return SideTask(field, cover, start, settings, weights, sharpest, tube, root)


def search_sides(
    task: SideTask,
    given: FloatArray | None = None,
    ceiling: float = math.inf,
) -> SideSearch:
    """Search for the cheapest sides.

    Discs off the ego's point are placed to first order about the road's direction in
    the search, and about the path found afterwards, until it passes the check.

    Args:
        task: As `side_task` makes it.
        given: Sides that are already decided, 0 where open, (n_obstacles,).
        ceiling: Only sequences cheaper than this are looked for.
    """
    if given is None:
        given = np.zeros(task.field.n_obstacles)
    leaves, counts = search_leaves(task, given, ceiling)
    s, found = task.tube.guess.s, []
    for cost, chosen, state in zip(*leaves, strict=True):
        if not math.isfinite(cost):
            break
        path = FrenetPath(s, *(state - task.tube.turn).T)
        check = check_path(path, task.field, task.cover)
        refined = _refined(SideSequence(chosen, float(cost), path, check), task)
        if refined is not None:
            found.append(refined)
    any_leaf = bool(np.isfinite(leaves.cost[0]))
    return _outcome(found, any_leaf, counts, task.settings)


def search_leaves(
    task: SideTask, given: FloatArray, ceiling: float
) -> tuple[Leaves, NodeCounts]:
    """Run `branch_and_bound` on a task; see there."""
    settings = task.settings
    options = SearchOptions(
        ceiling, 1 + settings.alternatives, settings.max_programs, MAX_STEPS, TOLERANCE
    )
    return branch_and_bound(task.root, task.tube.passages, given, options)


def _margin(field: FrenetObstacles, cover: Cover, settings: SideSettings) -> float:
    """Return the room beyond the discs; a turning body needs a little more."""
    turning = any(cover.offsets) or bool((field.curvature != 0.0).any())
    return settings.margin + (settings.turn_margin if turning else 0.0)


def _refined(sequence: SideSequence, task: SideTask) -> SideSequence | None:
    """Place the discs about the path itself until the path passes the check.

    Between knots a path bulges; by as much as it was short, the next one keeps away.
    """
    field, cover, settings = task.field, task.cover, task.settings
    margin, inset = _margin(field, cover, settings), 0.0
    for _ in range(settings.passes):
        check = sequence.check
        if passes_check(check, settings):
            return sequence
        margin += max(settings.margin - check.clearance, 0.0)
        inset += max(-check.road_room, 0.0)
        path = sequence.path
        guess = PathGuess.of(path.s, path.l, path.slope)
        keep = margin, task.sharpest, inset, settings.in_plane
        tube = tube_about(guess, field, cover, *keep)
        low, high = tube.between(sequence.sides)
        if (low > high).any():
            return None
        problem = tube_program(tube, low, high, task.start, task.weights)
        solution = solve(problem, solver=settings.solver)
        if solution.status is not QpStatus.SOLVED:
            return None
        path = FrenetPath(path.s, *(solution.state - tube.turn).T)
        check = check_path(path, field, cover)
        sequence = SideSequence(sequence.sides, solution.objective, path, check)
    return sequence if passes_check(sequence.check, settings) else None


def passes_check(check: PathCheck, settings: SideSettings) -> bool:
    """Check whether a path may be returned."""
    return (
        check.clearance >= settings.margin - CHECK_TOLERANCE
        and check.road_room >= -CHECK_TOLERANCE
        and check.curvature <= settings.max_curvature
    )


def _outcome(
    found: list[SideSequence],
    any_leaf: bool,  # noqa: FBT001 - a fact, not a choice
    counts: NodeCounts,
    settings: SideSettings,
) -> SideSearch:
    """Make the outcome of a search."""
    exact = counts.undecided == 0 and counts.programs < settings.max_programs
    status = SideStatus.BLOCKED if exact else SideStatus.UNDECIDED
    if any_leaf:
        status = SideStatus.CHECK_FAILED
    best = None
    if found:
        found.sort(key=lambda one: one.cost)
        best, status = found[0], SideStatus.OK
    return SideSearch(
        status,
        best,
        tuple(found[1:]),
        counts.programs,
        counts.tube_empty,
        counts.infeasible,
        exact,
    )
