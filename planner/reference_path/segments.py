"""Road segments of linear curvature, and their exact knots."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from planner.errors import InvalidInputError
from planner.reference_path.linear_curvature import (
    MAX_SPACING,
    MAX_TURN,
    MAX_TURN_BY_RATE,
)
from planner.states import FloatArray, freeze

# A piece turns by less than 0.15 rad: eight Gauss points integrate it to rounding.
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(8)


class SegmentKind(StrEnum):
    """Shape of a segment."""

    LINE = "line"
    ARC = "arc"
    CLOTHOID = "clothoid"


@dataclass(frozen=True, slots=True)
class Segment:
    """A stretch of path whose curvature is linear in arc length."""

    kind: SegmentKind
    length: float  # [m]
    curvature: float  # at its start, positive to the left [1/m]
    end_curvature: float  # [1/m]

    def __post_init__(self) -> None:
        """Refuse a segment that is no curve."""
        if not (0.0 < self.length < math.inf):
            raise InvalidInputError(f"length = {self.length} must be positive")
        if not (math.isfinite(self.curvature) and math.isfinite(self.end_curvature)):
            raise InvalidInputError(
                f"curvatures {self.curvature}, {self.end_curvature} must be finite"
            )

    @property
    def rate(self) -> float:
        """Change of the curvature per metre [1/m²]."""
        return (self.end_curvature - self.curvature) / self.length

    @property
    def turn(self) -> float:
        """Change of the heading from start to end [rad]."""
        return 0.5 * (self.curvature + self.end_curvature) * self.length


def line(length: float) -> Segment:
    """Make a straight segment of `length` [m]."""
    return Segment(SegmentKind.LINE, length, 0.0, 0.0)


def arc(length: float, curvature: float) -> Segment:
    """Make an arc of `length` [m] and `curvature` [1/m], positive to the left."""
    return Segment(SegmentKind.ARC, length, curvature, curvature)


def clothoid(length: float, curvature: float, end_curvature: float) -> Segment:
    """Make a clothoid of `length` [m] between two curvatures [1/m]."""
    return Segment(SegmentKind.CLOTHOID, length, curvature, end_curvature)


@dataclass(frozen=True, slots=True, eq=False)
class Knots:
    """Ends of linear-curvature pieces; arrays are (n,).

    `curvature` and `curvature_rate` of a knot hold from there to the next one; the
    last knot repeats the end of the last piece.
    """

    s: FloatArray  # [m]
    x: FloatArray
    y: FloatArray
    heading: FloatArray  # unwrapped [rad]
    curvature: FloatArray  # [1/m]
    curvature_rate: FloatArray  # [1/m²]


def knot_table(knots: Knots) -> FloatArray:
    """Return knots as the table of `linear_curvature`, (n, 8), and check them."""
    columns = (
        knots.s,
        knots.x,
        knots.y,
        np.cos(knots.heading),
        np.sin(knots.heading),
        knots.curvature,
        knots.curvature_rate,
        knots.heading,
    )
    table = freeze(np.stack(columns, axis=1))
    if table.shape[0] < 2 or not np.all(np.diff(knots.s) > 0.0):
        raise InvalidInputError("a path needs at least two knots of growing s")
    return table


def knots_of_segments(
    segments: Sequence[Segment], start: tuple[float, float, float]
) -> Knots:
    """Place knots along a chain of segments.

    Args:
        segments: At least one, joined with a common tangent.
        start: (x [m], y [m], heading [rad]) of the first point.

    Returns:
        Knots at most `MAX_SPACING` apart, exact to rounding.

    Raises:
        InvalidInputError: If there is no segment or `start` is not finite.
    """
    if not segments:
        raise InvalidInputError("a path needs at least one segment")
    if not all(math.isfinite(value) for value in start):
        raise InvalidInputError(f"start = {start} must be finite")
    s, (x, y, heading) = 0.0, start
    rows: list[FloatArray] = []
    for segment in segments:
        u, dx, dy = _local_points(segment)
        cos, sin = math.cos(heading), math.sin(heading)
        rate = segment.rate
        columns = (
            s + u,
            x + dx * cos - dy * sin,
            y + dx * sin + dy * cos,
            heading + u * (segment.curvature + 0.5 * rate * u),
            segment.curvature + rate * u,
            np.full(u.size, rate),
        )
        block = np.stack(columns)
        rows.append(block[:, :-1])
        s, x, y = s + segment.length, float(block[1, -1]), float(block[2, -1])
        heading += segment.turn
    last = np.array([s, x, y, heading, segments[-1].end_curvature, 0.0])
    return Knots(*np.hstack([*rows, last[:, None]]))


def _local_points(segment: Segment) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return (u, x, y) of the knots of one segment in its own frame."""
    sharpest = max(abs(segment.curvature), abs(segment.end_curvature))
    n_pieces = max(
        1,
        math.ceil(segment.length / MAX_SPACING),
        math.ceil(segment.length * sharpest / MAX_TURN),
        math.ceil(segment.length * math.sqrt(abs(segment.rate) / MAX_TURN_BY_RATE)),
    )
    u = segment.length * np.arange(n_pieces + 1) / n_pieces
    if segment.rate == 0.0:
        # chord of the arc: exact also where the curvature tends to zero
        half = 0.5 * segment.curvature * u
        chord = u * np.sinc(half / np.pi)
        return u, chord * np.cos(half), chord * np.sin(half)
    step = segment.length / n_pieces
    v = u[:-1, None] + 0.5 * step * (1.0 + _NODES)  # (n_pieces, 8)
    turn = v * (segment.curvature + 0.5 * segment.rate * v)
    x = np.concatenate([[0.0], np.cumsum(0.5 * step * np.cos(turn) @ _WEIGHTS)])
    y = np.concatenate([[0.0], np.cumsum(0.5 * step * np.sin(turn) @ _WEIGHTS)])
    return u, x, y
