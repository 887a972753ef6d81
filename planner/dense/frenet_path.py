"""A path l(s), and the check that every method's result has to pass."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from planner.dense.field import (
    Cover,
    Discs,
    FrenetObstacles,
    ObstacleColumns,
    disc_centre,
    half_span,
    path_curvature,
    squared_distance,
)
from planner.dense.lattice.edge_check import MIN_STRETCH, RoadAlong, road_along
from planner.errors import InvalidInputError
from planner.numerics.compiled import compiled
from planner.states import FloatArray, freeze

SUBDIVISION = 4  # checked points per knot interval
FAR = 100.0  # clearance of a path without obstacles near it [m]


@dataclass(frozen=True, slots=True, eq=False)
class FrenetPath:
    """A path of constant third derivative between its knots; arrays are (n,)."""

    s: FloatArray  # strictly growing [m]
    l: FloatArray  # [m]
    slope: FloatArray  # dl/ds [-]
    second: FloatArray  # d²l/ds² [1/m]

    def __post_init__(self) -> None:
        """Copy, check and freeze the columns."""
        for name in ("s", "l", "slope", "second"):
            column = freeze(getattr(self, name))
            if column.ndim != 1 or column.shape != np.shape(self.s):
                raise InvalidInputError(f"{name} has shape {column.shape}")
            object.__setattr__(self, name, column)
        self._check()

    @classmethod
    def from_rows(cls, rows: FloatArray) -> "FrenetPath":
        """Make a path of a table, (4, n), rows in the order of the fields.

        Raises:
            InvalidInputError: If s does not grow.
        """
        made = object.__new__(cls)
        for name, row in zip(cls.__slots__, freeze(rows), strict=True):
            object.__setattr__(made, name, row)
        made._check()
        return made

    def _check(self) -> None:
        """Refuse arc lengths that do not grow."""
        if self.s.size < 2 or (self.s[1:] <= self.s[:-1]).any():
            raise InvalidInputError("s must be at least two strictly growing numbers")

    def subdivided(self, parts: int) -> "FrenetPath":
        """Return the same path with `parts` times as many intervals; eq. 5.24."""
        rows = subdivide(self.s, self.l, self.slope, self.second, parts)
        return FrenetPath.from_rows(rows)


class FrenetColumns(NamedTuple):
    """A path as compiled code takes it; arrays are (n,)."""

    s: FloatArray  # [m]
    l: FloatArray  # [m]
    slope: FloatArray  # dl/ds [-]
    second: FloatArray  # d²l/ds² [1/m]


@dataclass(frozen=True, slots=True)
class PathCheck:
    """Worst values of a path; the first knot, where the ego is, left out."""

    clearance: float  # from the ego's discs to the obstacles', negative inside [m]
    road_room: float  # from the body to the road's edge, negative outside [m]
    curvature: float  # largest absolute value [1/m]


def check_path(path: FrenetPath, field: FrenetObstacles, cover: Cover) -> PathCheck:
    """Measure a path against obstacles, road and curvature, knots and between."""
    fine = path.subdivided(SUBDIVISION)
    discs = cover.discs()
    road = road_along(fine.s, field.road_columns(), discs.offset)
    columns = FrenetColumns(fine.s, fine.l, fine.slope, fine.second)
    return PathCheck(*worst_of(columns, road, field.obstacle_columns(), discs))


@compiled
def subdivide(
    s: FloatArray, l: FloatArray, slope: FloatArray, second: FloatArray, parts: int
) -> FloatArray:
    """Interpolate with the third derivative constant between knots; eq. 5.24, 5.25."""
    n = (s.size - 1) * parts + 1
    out = np.empty((4, n))
    for k in range(s.size - 1):
        h = s[k + 1] - s[k]
        third = (second[k + 1] - second[k]) / h
        for p in range(parts):
            x, j = h * p / parts, k * parts + p
            out[0, j] = s[k] + x
            out[1, j] = l[k] + x * (slope[k] + x * (second[k] / 2.0 + x * third / 6.0))
            out[2, j] = slope[k] + x * (second[k] + x * third / 2.0)
            out[3, j] = second[k] + x * third
    out[0, n - 1], out[1, n - 1] = s[-1], l[-1]
    out[2, n - 1], out[3, n - 1] = slope[-1], second[-1]
    return out


@compiled
def worst_of(
    path: FrenetColumns, road: RoadAlong, obstacles: ObstacleColumns, discs: Discs
) -> tuple[float, float, float]:
    """Find the smallest clearance and road room and the largest curvature.

    Args:
        path: At n points.
        road: At the same points.
        obstacles: Of the field.
        discs: Of the ego.

    Returns:
        (clearance [m], road room [m], curvature [1/m]).
    """
    s, l, slope = path.s, path.l, path.slope
    clearance, room, sharpest = FAR, np.inf, 0.0
    for j in range(1, s.size):
        curvature = road.curvature[j]
        rho = 1.0 - curvature * l[j]
        if rho < MIN_STRETCH:
            return -FAR, -FAR, np.inf
        bent = path_curvature(l[j], slope[j], path.second[j], curvature, road.rate[j])
        sharpest = max(sharpest, abs(bent))
        for d in range(discs.offset.size):
            offset, reach = discs.offset[d], road.reach[d, j]
            at_s, at_l = disc_centre(s[j], l[j], slope[j], offset, reach)
            need = half_span(discs, slope[j], rho, road.turned[d, j], reach)
            room = min(room, road.left[d, j] - at_l - need)
            room = min(room, at_l - need - road.right[d, j])
            for i in range(obstacles.s.size):
                touching = obstacles.radius[i] + discs.radius
                if abs(at_l - obstacles.l[i]) >= touching + clearance:
                    continue
                between = 0.5 * (curvature + obstacles.curvature[i])
                away2 = squared_distance(
                    at_s, at_l, obstacles.s[i], obstacles.l[i], between
                )
                if away2 < (touching + clearance) ** 2:
                    clearance = np.sqrt(away2) - touching
    return clearance, room, sharpest
