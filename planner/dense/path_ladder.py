"""The path of one cycle, by any method, and how far along it the ego may go.

Every method gets the same ladder: the widest margin to obstacles that has a path. Where
the road is blocked, the way leads as far as it can and ends before what blocks it.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from planner.dense.field import (
    Cover,
    Discs,
    FrenetObstacles,
    ObstacleColumns,
    disc_centre,
    squared_distance,
)
from planner.dense.frenet_path import SUBDIVISION, FrenetPath
from planner.dense.lattice.coarse_path import PathStart
from planner.dense.lattice.edge_check import RoadAlong, road_along
from planner.dense.lattice_methods import LatticeStatus, plan_adaptive, plan_uniform
from planner.dense.settings import DenseSettings, PathMethod, SideSettings
from planner.dense.sides.sequences import SideSearch, search_sides, side_task
from planner.dense.tube.corridor import PathGuess
from planner.dense.turning import Momentum, Turning
from planner.numerics.compiled import compiled
from planner.states import FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class ChosenPath:
    """The path that a method chose."""

    path: FrenetPath
    end_s: float  # of the ego's point; the path's end where nothing blocks it [m]
    ended: bool  # before the road does, because something blocks it
    blocked_by: str | None  # the obstacle that ends it, if it has a name
    sides: Mapping[str, float]  # obstacle -> 1 passed to its left, -1 to its right
    margin: float  # kept to obstacles [m]
    candidates: int  # programs or edges looked at
    cost: float


@dataclass(frozen=True, slots=True)
class PathTask:
    """Where a path has to lead, whatever the method."""

    field: FrenetObstacles
    cover: Cover
    start: PathStart
    s_end: float
    max_curvature: float  # [1/m]
    momentum: Momentum
    turnings: tuple[Turning, ...]  # what may be taken, the gentlest first
    turning: Turning | None = None  # what is taken, None: only the sharpest counts


def choose_path(
    task: PathTask, last: Mapping[str, float], settings: DenseSettings
) -> ChosenPath | None:
    """Choose the path of this cycle; None where not even standing still has one.

    Args:
        task: Obstacles, road, start and end.
        last: Sides of the last cycle by obstacle.
        settings: See there.
    """
    if settings.method is not PathMethod.SIDE_SEQUENCES:
        return _by_lattice(task, settings)
    *gentler, hardest = task.turnings
    for gentle in gentler:
        calm = replace(task, turning=gentle)
        found = _by_sides(calm, last, settings.margins[0], settings)
        if found is not None:
            return found
    for turning in (hardest, None):
        one = replace(task, turning=turning)
        found = _widest(one, last, settings)
        if found is None:
            found = _as_far_as_possible(one, last, settings)
        if found is not None:
            return found
    return None


def _widest(
    task: PathTask, last: Mapping[str, float], settings: DenseSettings
) -> ChosenPath | None:
    """Find the path with the widest margin that has one."""
    widest, *narrower = settings.margins
    found = _by_sides(task, last, widest, settings)
    if found is not None or not narrower:
        return found
    # What has no path with the least margin has none with more.
    tight = _by_sides(task, last, narrower[-1], settings)
    if tight is None:
        return None
    for margin in narrower[:-1]:
        found = _by_sides(task, last, margin, settings)
        if found is not None:
            return found
    return tight


def _by_sides(
    task: PathTask, last: Mapping[str, float], margin: float, settings: DenseSettings
) -> ChosenPath | None:
    """Find the cheapest sides; those of the last cycle win unless others save enough.

    Without that a path flips where two ways cost about the same.
    """
    limits = _only_best(settings.sides, margin, task.max_curvature)
    turning = None if task.turning is None else (task.momentum, task.turning)
    sides = side_task(task.field, task.cover, task.start, task.s_end, limits, turning)
    given = np.array([last.get(name, 0.0) for name in task.field.ids])
    if not (given != 0.0).any():
        return _chosen(task, search_sides(sides), margin, 0)
    kept = search_sides(sides, given)
    if kept.best is None:
        return _chosen(task, search_sides(sides), margin, kept.programs)
    ceiling = (1.0 - settings.change_gain) * kept.best.cost
    other = search_sides(sides, ceiling=ceiling)
    better = other if other.best is not None else kept
    return _chosen(task, better, margin, kept.programs + other.programs)


@lru_cache(maxsize=32)
def _only_best(
    sides: SideSettings, margin: float, max_curvature: float
) -> SideSettings:
    """Return settings of a search for one sequence; they are checked when made."""
    return replace(sides, margin=margin, max_curvature=max_curvature, alternatives=0)


def _chosen(
    task: PathTask, search: SideSearch, margin: float, programs: int
) -> ChosenPath | None:
    """Make the record of a search's winner."""
    best = search.best
    if best is None:
        return None
    return ChosenPath(
        best.path,
        task.s_end,
        False,  # noqa: FBT003 - a column
        None,
        dict(zip(task.field.ids, best.sides.tolist(), strict=True)),
        margin,
        programs + search.programs,
        best.cost,
    )


def _as_far_as_possible(
    task: PathTask, last: Mapping[str, float], settings: DenseSettings
) -> ChosenPath | None:
    """Pass as many obstacles as can be passed, and end before the next one.

    What can be passed with more obstacles on the road can be passed with fewer, so that
    the number is found by bisection.
    """
    margin = settings.margins[-1]
    field, found = task.field, None
    passed, blocked = -1, field.n_obstacles
    while blocked - passed > 1:
        number = (passed + blocked) // 2
        first = np.arange(field.n_obstacles) < number
        fewer = replace(task, field=field.only(first))
        one = _by_sides(fewer, last, margin, settings)
        if one is None:
            blocked = number
        else:
            passed, found = number, one
    if found is None:
        return None
    fewer = replace(task, field=field.only(np.arange(field.n_obstacles) < passed))
    for wider in settings.margins[:-1]:
        roomy = _by_sides(fewer, last, wider, settings)
        if roomy is not None:
            found = roomy
            break
    return _before_what_is_ahead(task, found, passed, settings.stop_gap)


def _before_what_is_ahead(
    task: PathTask, found: ChosenPath, passed: int, gap: float
) -> ChosenPath:
    """End a path before the obstacles that it does not pass, or only would beyond.

    Of obstacles side by side a path may pass the first and end before the next; where
    it ends, the first is still ahead, and it must not be stopped at any nearer.
    """
    number, front = np.arange(task.field.n_obstacles), max(task.cover.offsets)
    ahead = number >= passed
    while True:
        ended = _ended(task, found, task.field.only(ahead), gap)
        more = ahead | (task.field.s > ended.end_s + front)
        if np.array_equal(more, ahead):
            return ended
        ahead = more


def _by_lattice(task: PathTask, settings: DenseSettings) -> ChosenPath | None:
    """Search the lattice of a method; its margin takes the same ladder."""
    plan = plan_uniform if settings.method is PathMethod.UNIFORM else plan_adaptive
    smoothing = replace(settings.smoothing, max_curvature=task.max_curvature)
    farthest: ChosenPath | None = None
    for margin in settings.margins:
        lattice = replace(
            settings.lattice, max_curvature=task.max_curvature, margin=margin
        )
        cover = replace(task.cover, radius=task.cover.radius + margin)
        planned = plan(task.field, cover, task.start, task.s_end, lattice, smoothing)
        path = planned.path
        if path is None or planned.search.path is None:
            continue
        found = ChosenPath(
            path,
            float(path.s[-1]),
            False,  # noqa: FBT003 - a column
            None,
            {},
            margin,
            planned.search.edges,
            planned.search.path.cost,
        )
        if planned.status is LatticeStatus.OK:
            return found
        if farthest is None or found.end_s > farthest.end_s:
            farthest = _ended(task, found, task.field, settings.stop_gap)
    return farthest


def _ended(
    task: PathTask, found: ChosenPath, rest: FrenetObstacles, gap: float
) -> ChosenPath:
    """End a path before the obstacles that it does not pass."""
    fine = found.path.subdivided(SUBDIVISION)
    discs = task.cover.discs(gap)
    road = road_along(fine.s, rest.road_columns(), discs.offset)
    index, which = first_nearer(
        PathGuess.of(fine.s, fine.l, fine.slope),
        road,
        rest.obstacle_columns(),
        discs,
    )
    ahead = rest.s > fine.s[-1]
    name = rest.ids[which] if which >= 0 else _first(rest, ahead)
    end = float(fine.s[index]) if which >= 0 else float(fine.s[-1])
    return replace(found, end_s=min(end, found.end_s), ended=True, blocked_by=name)


def _first(field: FrenetObstacles, ahead: FloatArray) -> str | None:
    """Name the first obstacle that is ahead."""
    where = np.flatnonzero(ahead)
    return field.ids[int(where[0])] if where.size and field.ids else None


@compiled
def first_nearer(
    path: PathGuess, road: RoadAlong, obstacles: ObstacleColumns, discs: Discs
) -> tuple[int, int]:
    """Find the first point of a path that has a disc too near to an obstacle.

    Args:
        path: At n points.
        road: At the same points.
        obstacles: Of the field.
        discs: Of the ego, with the gap to keep.

    Returns:
        (point, obstacle); -1 for both if there is none.
    """
    s, l, slope = path
    for j in range(s.size):
        for d in range(discs.offset.size):
            at_s, at_l = disc_centre(
                s[j], l[j], slope[j], discs.offset[d], road.reach[d, j]
            )
            for i in range(obstacles.s.size):
                between = 0.5 * (road.curvature[j] + obstacles.curvature[i])
                away2 = squared_distance(
                    at_s, at_l, obstacles.s[i], obstacles.l[i], between
                )
                if away2 < (obstacles.radius[i] + discs.radius) ** 2:
                    return j, i
    return -1, -1
