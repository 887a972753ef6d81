"""Join the centre lines of lanes to one line without gaps, doubles and kinks.

Lanes of imported networks overlap or miss each other by decimetres where they meet:
joined as they are, the line would turn back or sideways for a moment.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import cos, pi

import numpy as np

from sumo_nets.centre_line import FloatArray

# Points nearer than this to the one before are dropped [m]: over such a distance the
# millimetres of sideways misfit between two lanes would be a sharp bend.
CLOSEST = 0.2

# A corner is an artefact of the joint if a side of it is shorter than this [m] ...
SHORT = 0.5

# ... and it turns by more than this [rad]: no road does so on so little way.
KINK = pi / 4

# Length over which the line moves one lane over [m].
CHANGE_LENGTH = 50.0

# Rows about the last one of a piece among which its end is looked for.
NEARBY = 4


@dataclass(frozen=True, slots=True, eq=False)
class Piece:
    """Centre line and road edges on one lane; arrays are (n,), `points` (n, 2)."""

    name: str
    points: FloatArray
    left: FloatArray
    right: FloatArray
    lines: tuple[float, ...]


@dataclass(frozen=True, slots=True, eq=False)
class JoinedLine:
    """Pieces joined; all arrays but `points` are (n,).

    `ends` holds the arc lengths at which the pieces end, in their order.
    """

    points: FloatArray
    s: FloatArray  # arc length [m]
    left: FloatArray
    right: FloatArray
    ends: tuple[float, ...]


def densify(piece: Piece, spacing: float) -> Piece:
    """Insert points so that none are farther apart than `spacing` [m]."""
    lengths = np.linalg.norm(np.diff(piece.points, axis=0), axis=1)
    counts = np.maximum(1, np.ceil(lengths / spacing - 1e-9)).astype(int)
    # Parameter: number of the polyline's corner plus the share of the way to the next.
    at = np.concatenate(
        [place + np.arange(count) / count for place, count in enumerate(counts)]
        + [np.array([float(len(lengths))])]
    )
    return _take(piece, at, np.arange(len(piece.points), dtype=np.float64))


def resample(piece: Piece, spacing: float, like: Piece) -> Piece:
    """Sample `piece` evenly with as many points as `like` needs for `spacing` [m]."""
    total = float(np.linalg.norm(np.diff(like.points, axis=0), axis=1).sum())
    lengths = np.linalg.norm(np.diff(piece.points, axis=0), axis=1)
    along = np.concatenate(([0.0], np.cumsum(lengths)))
    count = max(2, int(np.ceil(total / spacing)) + 1)
    return _take(piece, np.linspace(0.0, along[-1], count), along)


def change_span(length: float, lanes: int) -> tuple[float, float]:
    """Return from where to where a line moves over on an edge, in its middle [m].

    Args:
        length: Of the edge [m]; no move is longer.
        lanes: By how many it moves over.
    """
    half = 0.5 * min(CHANGE_LENGTH * lanes, length)
    return 0.5 * length - half, 0.5 * length + half


def blend(first: Piece, second: Piece, lanes: int) -> Piece:
    """Move from one piece over to another beside it, in the middle of both.

    Args:
        first: Piece at the begin, (n,) points.
        second: Piece at the end, as many points.
        lanes: By how many lanes; see `change_span`.

    Returns:
        A piece with no step in position, direction or curvature, named as `second`.
    """
    lengths = np.linalg.norm(np.diff(first.points, axis=0), axis=1)
    along = np.concatenate(([0.0], np.cumsum(lengths)))
    begin, end = change_span(float(along[-1]), lanes)
    x = np.clip((along - begin) / max(end - begin, 1e-9), 0.0, 1.0)
    share = x**3 * (10.0 - 15.0 * x + 6.0 * x**2)
    return Piece(
        second.name,
        first.points + share[:, None] * (second.points - first.points),
        first.left + share * (second.left - first.left),
        first.right + share * (second.right - first.right),
        second.lines,
    )


def stitch(pieces: Sequence[Piece]) -> JoinedLine:
    """Join pieces that follow each other, dropping doubles and kinks."""
    points = np.concatenate([piece.points for piece in pieces])
    owner = np.concatenate(
        [np.full(len(piece.points), place) for place, piece in enumerate(pieces)]
    )
    rows = _clean(points)
    left = np.concatenate([piece.left for piece in pieces])[rows]
    right = np.concatenate([piece.right for piece in pieces])[rows]
    joined = points[rows]
    lengths = np.linalg.norm(np.diff(joined, axis=0), axis=1)
    s = np.concatenate(([0.0], np.cumsum(lengths)))
    last = np.searchsorted(owner[rows], np.arange(len(pieces)), side="right") - 1
    ends = [
        _nearest(joined, s, max(0, int(row)), piece.points[-1])
        for row, piece in zip(last[:-1], pieces, strict=False)
    ]
    ends = [float(end) for end in np.maximum.accumulate([0.0, *ends])[1:]]
    return JoinedLine(joined, s, left, right, (*ends, float(s[-1])))


def _take(piece: Piece, at: FloatArray, knots: FloatArray) -> Piece:
    """Interpolate a piece, given at `knots`, at other places."""
    return Piece(
        piece.name,
        np.column_stack([np.interp(at, knots, axis) for axis in piece.points.T]),
        np.interp(at, knots, piece.left),
        np.interp(at, knots, piece.right),
        piece.lines,
    )


def _nearest(points: FloatArray, s: FloatArray, row: int, place: FloatArray) -> float:
    """Find the arc length nearest to `place` about `row`; cleaning moves few rows."""
    rows = range(max(0, row - NEARBY), min(len(points) - 1, row + NEARBY))
    best, at = float(np.linalg.norm(points[row] - place)), float(s[row])
    for begin in rows:
        side = points[begin + 1] - points[begin]
        share = float((place - points[begin]) @ side) / float(side @ side)
        share = min(1.0, max(0.0, share))
        distance = float(np.linalg.norm(points[begin] + share * side - place))
        if distance < best:
            best, at = distance, float(s[begin] + share * (s[begin + 1] - s[begin]))
    return at


def _clean(points: FloatArray) -> list[int]:
    """List the rows that stay; without a kink, its ends may have become doubles."""
    rows = list(range(len(points)))
    while True:
        kept = _drop_kinks(points, _drop_doubles(points, rows))
        if len(kept) == len(rows):
            return rows
        rows = kept


def _drop_doubles(points: FloatArray, rows: list[int]) -> list[int]:
    """Keep the rows that are CLOSEST away from the row before, and the last one."""
    kept = rows[:1]
    for row in rows[1:]:
        if np.linalg.norm(points[row] - points[kept[-1]]) >= CLOSEST:
            kept.append(row)
    if kept[-1] != rows[-1]:
        if len(kept) > 1:
            kept.pop()
        kept.append(rows[-1])
    return kept


def _drop_kinks(points: FloatArray, rows: list[int]) -> list[int]:
    """Remove sharp corners at short sides: reversals and sideways jogs."""
    rows = list(rows)
    place = 1
    while place < len(rows) - 1:
        before = points[rows[place]] - points[rows[place - 1]]
        after = points[rows[place + 1]] - points[rows[place]]
        sides = float(np.linalg.norm(before)), float(np.linalg.norm(after))
        sharp = float(before @ after) < cos(KINK) * sides[0] * sides[1]
        if sharp and min(sides) < SHORT:
            del rows[place]
            place = max(1, place - 1)  # the corner before has a new neighbour
        else:
            place += 1
    return rows
