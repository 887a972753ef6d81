"""The two lattice methods from end to end: waypoints, edges, coarse path, smoothing."""

from dataclasses import dataclass
from enum import StrEnum

from planner.dense.field import Cover, FrenetObstacles
from planner.dense.frenet_path import FrenetPath
from planner.dense.lattice.coarse_path import PathStart
from planner.dense.lattice.search import LatticeSearch, search_lattice
from planner.dense.lattice.waypoints import (
    Waypoints,
    adaptive_waypoints,
    uniform_waypoints,
)
from planner.dense.settings import LatticeSettings, SmoothingSettings
from planner.dense.tube.smoothing import Smoothing, SmoothingStatus, smooth


class LatticeStatus(StrEnum):
    """Outcome of a lattice method."""

    OK = "ok"  # smooth path to the end
    BLOCKED = "blocked"  # no chain of free edges to the end; a path as far as it goes
    NO_FREE_EDGE = "no_free_edge"  # not even one edge leads away from the ego
    NOT_SMOOTHED = "not_smoothed"  # there is a coarse path, but no smooth one


@dataclass(frozen=True, slots=True)
class LatticePlan:
    """Outcome of a lattice method; `path` is checked, None where there is none."""

    status: LatticeStatus
    reason: str  # in words, empty where the status is OK
    path: FrenetPath | None
    search: LatticeSearch
    smoothing: Smoothing | None


def plan_uniform(
    field: FrenetObstacles,
    cover: Cover,
    start: PathStart,
    s_end: float,
    lattice: LatticeSettings,
    smoothing: SmoothingSettings,
) -> LatticePlan:
    """Plan by the conventional method [104].

    Args:
        field: Obstacles and road.
        cover: Of the ego.
        start: Where the ego is.
        s_end: Where the path shall end [m].
        lattice: Of the coarse path.
        smoothing: Of the smooth one.
    """
    waypoints = uniform_waypoints(field, cover, start.s, s_end, lattice)
    return plan_over(waypoints, field, cover, start, lattice, smoothing)


def plan_adaptive(
    field: FrenetObstacles,
    cover: Cover,
    start: PathStart,
    s_end: float,
    lattice: LatticeSettings,
    smoothing: SmoothingSettings,
) -> LatticePlan:
    """Plan by the adaptive method; arguments as for `plan_uniform`."""
    waypoints = adaptive_waypoints(field, cover, start[:2], s_end, lattice)
    return plan_over(waypoints, field, cover, start, lattice, smoothing)


def plan_over(
    waypoints: Waypoints,
    field: FrenetObstacles,
    cover: Cover,
    start: PathStart,
    lattice: LatticeSettings,
    smoothing: SmoothingSettings,
) -> LatticePlan:
    """Search the lattice over given waypoints and smooth what it finds."""
    search = search_lattice(field, cover, start, waypoints, lattice)
    if search.path is None:
        reason = f"none of {search.edges} edges is free at s = {start.s:.1f} m"
        return LatticePlan(LatticeStatus.NO_FREE_EDGE, reason, None, search, None)
    result = smooth(field, cover, search.path, smoothing)
    reach = search.path.s[-1]
    if not search.complete:
        reason = f"no chain of free edges beyond s = {reach:.1f} m"
        return LatticePlan(LatticeStatus.BLOCKED, reason, result.path, search, result)
    if result.status is not SmoothingStatus.OK:
        reason = f"smoothing: {result.status} after {result.passes} passes"
        return LatticePlan(LatticeStatus.NOT_SMOOTHED, reason, None, search, result)
    return LatticePlan(LatticeStatus.OK, "", result.path, search, result)
