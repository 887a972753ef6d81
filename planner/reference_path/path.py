"""Reference path: a chain of linear-curvature pieces with exact evaluation."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from planner.reference_path.linear_curvature import IndexArray, point_at, points_at
from planner.reference_path.projection import (
    EVERYWHERE,
    NO_DIRECTION,
    feet,
    foot,
    search_tables,
)
from planner.reference_path.segments import (
    Knots,
    Segment,
    knot_table,
    knots_of_segments,
)
from planner.states import FloatArray, freeze

EMPTY = freeze(())
PROJECTION_REACH = 30.0  # from a guess of s, within which feet are looked for [m]


class PathTable(NamedTuple):
    """Arrays that the compiled functions of this package read."""

    knots: FloatArray  # (n, 8), columns named in `pieces`
    bins: IndexArray  # arc length -> piece
    blocks: FloatArray  # groups of pieces for the search


@dataclass(frozen=True, slots=True, eq=False)
class PathPoints:
    """Points of a path; all arrays have the shape of the arc lengths asked for."""

    x: FloatArray  # [m]
    y: FloatArray  # [m]
    heading: FloatArray  # unwrapped along the path [rad]
    cos_heading: FloatArray
    sin_heading: FloatArray
    curvature: FloatArray  # positive to the left [1/m]
    curvature_rate: FloatArray  # d(curvature)/ds [1/m²]


@dataclass(frozen=True, slots=True, eq=False)
class ReferencePath:
    """A curve parametrised by arc length, s = 0 at its start.

    Between knots the curvature is linear. Beyond both ends the path goes straight on,
    so that every s is valid. Knot arrays are (n,); the curvature and its rate at a
    knot are those of the piece that begins there.
    """

    s: FloatArray  # [m]
    x: FloatArray
    y: FloatArray
    heading: FloatArray  # unwrapped [rad]
    curvature: FloatArray  # [1/m]
    curvature_rate: FloatArray  # [1/m²]
    table: PathTable = field(init=False, repr=False)

    def __post_init__(self) -> None:
        """Copy and freeze the knots and build the tables of the compiled code."""
        names = ("s", "x", "y", "heading", "curvature", "curvature_rate")
        for name in names:
            object.__setattr__(self, name, freeze(getattr(self, name)))
        knots = Knots(*(getattr(self, name) for name in names))
        table = PathTable(*search_tables(knot_table(knots)))
        object.__setattr__(self, "table", table)

    @classmethod
    def from_segments(
        cls,
        segments: Sequence[Segment],
        start: tuple[float, float, float] = (0.0, 0.0, 0.0),
    ) -> "ReferencePath":
        """Chain lines, arcs and clothoids; exact to 1e-12 m.

        Args:
            segments: Made by `line`, `arc` and `clothoid` of `segments`.
            start: (x [m], y [m], heading [rad]) of the first point.

        Returns:
            The path.

        Raises:
            InvalidInputError: If there is no segment or a number is not finite.
        """
        return cls._from_knots(knots_of_segments(segments, start))

    @classmethod
    def from_polyline(
        cls, points: ArrayLike, max_deviation: float = 0.10
    ) -> "ReferencePath":
        """Smooth a polyline of lane points.

        Args:
            points: (n, 2), at least two distinct points [m].
            max_deviation: Bound of the distance between polyline and path [m].

        Returns:
            The path.

        Raises:
            InvalidInputError: If the points make no line, or if the bound cannot be
                met; the message names the place.
        """
        from planner.reference_path.smoothing import smooth_polyline  # takes scipy

        return cls._from_knots(smooth_polyline(points, max_deviation)[0])

    @classmethod
    def _from_knots(cls, knots: Knots) -> "ReferencePath":
        """Unpack the record of knots."""
        return cls(
            knots.s,
            knots.x,
            knots.y,
            knots.heading,
            knots.curvature,
            knots.curvature_rate,
        )

    @property
    def length(self) -> float:
        """Arc length from the first to the last knot [m]."""
        return float(self.s[-1])

    def at(self, s: ArrayLike) -> PathPoints:
        """Evaluate the path at arc lengths `s` [m], in their shape."""
        wanted = np.asarray(s, dtype=np.float64)
        x, y, cos, sin, curvature, rate, heading = points_at(
            self.table.knots, self.table.bins, as_input(wanted)
        ).reshape(7, *wanted.shape)
        return PathPoints(x, y, heading, cos, sin, curvature, rate)

    def project(
        self,
        x: ArrayLike,
        y: ArrayLike,
        near: ArrayLike | None = None,
        reach: float = PROJECTION_REACH,
        heading: ArrayLike | None = None,
    ) -> tuple[FloatArray, FloatArray]:
        """Find the nearest foot points; implements [Thesis] eq. 3.22 as corrected.

        Points before the start and beyond the end project on the straight
        extensions. Where no foot lies within `reach` of `near`, the nearest of the
        whole path is taken.

        Args:
            x: (n,) [m].
            y: (n,) [m].
            near: Guesses of s, (n,) or one for all; keeps a point on its own leg
                where the route turns back or crosses itself [m].
            reach: Only feet with |s - near| <= reach are considered [m].
            heading: (n,) or one for all: among feet about equally near, prefer
                those along it, at a crossing for example [rad].

        Returns:
            (s, l), each (n,): arc length of the foot point and signed distance,
            positive to the left [m].
        """
        shape = np.shape(x)
        s, l = feet(
            *self.table,
            as_input(x),
            as_input(y),
            EMPTY if near is None else _spread(near, shape),
            float(reach),
            EMPTY if heading is None else _spread(heading, shape),
        )
        return s.reshape(shape), l.reshape(shape)

    def project_one(
        self,
        x: float,
        y: float,
        near: float | None = None,
        reach: float = PROJECTION_REACH,
    ) -> tuple[float, float]:
        """Find the nearest foot point of one point, as `project` does."""
        limits = (
            EVERYWHERE if near is None else (float(near - reach), float(near + reach))
        )
        return foot(*self.table, float(x), float(y), limits, NO_DIRECTION)

    def pose(self, s: float) -> tuple[float, float, float]:
        """Return (x [m], y [m], heading [rad], unwrapped) at one arc length."""
        x, y, _, _, _, _, heading = point_at(
            self.table.knots, self.table.bins, float(s)
        )
        return x, y, heading


def as_input(values: ArrayLike) -> FloatArray:
    """View values as one read-only row, the one array type that is compiled for."""
    row = np.ascontiguousarray(values, dtype=np.float64).reshape(-1)
    view = row.view()
    view.setflags(write=False)
    return view


def _spread(values: ArrayLike, shape: tuple[int, ...]) -> FloatArray:
    """Repeat one value for all points, or keep one for each."""
    return as_input(np.broadcast_to(np.asarray(values, dtype=np.float64), shape))
