"""Study of one layout of chapter 5: all methods, waypoints, sensitivity."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from experiments.thesis.dense.layouts import (
    EGO_RADIUS,
    HALF_WIDTH,
    LENGTH,
    random_layout,
)
from experiments.thesis.dense.methods import (
    COVER,
    METHODS,
    START,
    Measured,
    MethodPath,
    lattice_method,
    measured,
    timed,
)
from planner.dense.field import FrenetObstacles, straight_field
from planner.dense.frenet_path import FrenetPath
from planner.dense.lattice.waypoints import (
    Waypoints,
    adaptive_waypoints,
    uniform_waypoints,
)
from planner.dense.lattice_methods import plan_adaptive, plan_uniform
from planner.dense.settings import LatticeSettings
from planner.states import FloatArray

FEWER, MORE = 11, 12  # waypoints a layer in Fig. 5.1
FINE = 20  # parts of a knot interval in which a path is looked at
LATTICES = {"uniform": plan_uniform, "adaptive": plan_adaptive}


@dataclass(frozen=True, slots=True)
class RandomLayout:
    """A random layout by its numbers."""

    n: int
    seed: int
    same_size: bool
    repeats: int = 1  # of each timed call

    def obstacles(self) -> FloatArray:
        """Draw it, (n, 3): s, l, r_ob [m]."""
        return random_layout(self.n, seed=self.seed, same_size=self.same_size)


@dataclass(frozen=True, slots=True, eq=False)
class Studied:
    """Result of one layout."""

    layout: RandomLayout
    methods: Mapping[str, Measured]
    waypoints: Mapping[str, int]
    occupied: int  # adaptive waypoints nearer to an obstacle than the discs allow
    clearance: float  # least, of the path of the side sequences [m]; nan without one
    changed: Mapping[str, bool | None]  # see `side_changes`


def study(layout: RandomLayout) -> Studied:
    """Run every method on one layout."""
    obstacles = layout.obstacles()
    field = straight_field(obstacles, HALF_WIDTH, LENGTH)
    results = {
        name: timed(method, field, layout.repeats) for name, method in METHODS.items()
    }
    settings = LatticeSettings()
    spread = {
        "uniform": uniform_waypoints(field, COVER, START[0], LENGTH, settings),
        "adaptive": adaptive_waypoints(field, COVER, START[:2], LENGTH, settings),
    }
    sides = results["sides"][0].path
    return Studied(
        layout,
        {name: measured(name, *found) for name, found in results.items()},
        {name: waypoints.total for name, waypoints in spread.items()},
        occupied_waypoints(spread["adaptive"], obstacles),
        float("nan") if sides is None else path_clearance(sides, obstacles),
        {name: side_changes(name, field, obstacles) for name in LATTICES},
    )


def occupied_waypoints(waypoints: Waypoints, obstacles: FloatArray) -> int:
    """Count waypoints at which the ego's disc would touch an obstacle's."""
    count = 0
    for s, row, n in zip(
        waypoints.s, waypoints.l, waypoints.count.tolist(), strict=True
    ):
        away = np.hypot(s - obstacles[:, :1], row[:n] - obstacles[:, 1:2])
        near = away < obstacles[:, 2:] + EGO_RADIUS - 1e-9
        count += int(near.any(axis=0).sum())
    return count


def path_clearance(path: FrenetPath, obstacles: FloatArray) -> float:
    """Return the minimum distance between the ego's disc and obstacles [m]."""
    fine = path.subdivided(FINE)
    away = np.hypot(fine.s - obstacles[:, :1], fine.l - obstacles[:, 1:2])
    return float((away - obstacles[:, 2:] - EGO_RADIUS).min())


def side_changes(
    name: str, field: FrenetObstacles, obstacles: FloatArray
) -> bool | None:
    """Check whether one more waypoint per layer changes a side; None without a path.

    Args:
        name: Of `LATTICES`.
        field: The layout.
        obstacles: The same, (n, 3).
    """
    few, many = (lattice_with(name, points)(field).path for points in (FEWER, MORE))
    if few is None or many is None:
        return None
    return passed_left(few, obstacles) != passed_left(many, obstacles)


def lattice_with(name: str, points: int) -> Callable[[FrenetObstacles], MethodPath]:
    """Build a lattice method with other free layers."""
    settings = replace(LatticeSettings(), free_points=points)
    return lattice_method(LATTICES[name], settings)


def passed_left(path: FrenetPath, obstacles: FloatArray) -> tuple[bool, ...]:
    """Return for each obstacle whether a path passes to its left."""
    l = np.interp(obstacles[:, 0], path.s, path.l)
    return tuple((l > obstacles[:, 1]).tolist())
