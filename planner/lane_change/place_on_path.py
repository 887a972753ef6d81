"""Where the ego is on a planned path, and what is left of it, in compiled code."""

import math

import numpy as np

from planner.numerics.compiled import compiled, inlined
from planner.numerics.interpolation import interpolate, interpolated
from planner.states import FloatArray, Path

ROUNDS = 2  # of a foot point's search: a path is nearly straight within a step


def place_on(
    path: Path, s: float, x: float, y: float
) -> tuple[float, tuple[float, float]]:
    """Find the foot point of the ego on a path itself, not on the road.

    Args:
        path: Of the ego.
        s: Of the ego on the road, where the search begins [m].
        x: Of the ego [m].
        y: Of the ego [m].

    Returns:
        The distance along the path, and the point there [m].
    """
    return _place(
        path.distance, path.s, (path.x, path.y, path.heading), float(s), float(x), y
    )


@compiled
def _place(
    distance: FloatArray,
    path_s: FloatArray,
    line: tuple[FloatArray, FloatArray, FloatArray],
    s: float,
    x: float,
    y: float,
) -> tuple[float, tuple[float, float]]:
    """Compute what `place_on` returns; `line` holds x, y and heading, (n,) each."""
    line_x, line_y, heading = line
    turned = _unwrapped(heading)
    at = interpolated(np.array([s]), path_s, distance)
    for _ in range(ROUNDS):
        ahead = x - interpolated(at, distance, line_x)[0]
        aside = y - interpolated(at, distance, line_y)[0]
        angle = interpolated(at, distance, turned)[0]
        at[0] += ahead * math.cos(angle) + aside * math.sin(angle)
    at[0] = min(max(at[0], 0.0), distance[-1])
    there = (
        interpolated(at, distance, line_x)[0],
        interpolated(at, distance, line_y)[0],
    )
    return at[0], there


def rest_from(path: Path, place: float) -> Path | None:
    """Cut off what is driven: the path from `place` on, in its own even spacing.

    Returns:
        The path; None where hardly any of it is left.
    """
    spacing = float(path.distance[1] - path.distance[0])
    left = float(path.distance[-1]) - place
    if left < 2.0 * spacing:
        return None
    columns = (path.x, path.y, path.heading, path.curvature, path.s, path.l)
    n = math.floor(left / spacing + 1e-9) + 1
    return Path.from_rows(_rest(path.distance, columns, float(place), spacing, n))


@compiled
def _rest(
    distance: FloatArray,
    columns: tuple[FloatArray, ...],
    place: float,
    spacing: float,
    n: int,
) -> FloatArray:
    """Fill the rows of the rest of a path, (7, n), in the order of `Path`."""
    x, y, heading, curvature, s, l = columns
    rows, at = np.empty((7, n)), np.empty(n)
    for i in range(n):
        rows[0, i] = spacing * i
        at[i] = rows[0, i] + place
    interpolate(at, 0.0, distance, x, rows[1])
    interpolate(at, 0.0, distance, y, rows[2])
    interpolate(at, 0.0, distance, _unwrapped(heading), rows[3])
    interpolate(at, 0.0, distance, curvature, rows[4])
    interpolate(at, 0.0, distance, s, rows[5])
    interpolate(at, 0.0, distance, l, rows[6])
    return rows


@inlined
def _unwrapped(angles: FloatArray) -> FloatArray:
    """Return angles without jumps of more than half a turn, as `numpy.unwrap`."""
    out = np.empty(angles.size)
    turns, out[0] = 0.0, angles[0]
    for i in range(1, angles.size):
        change = angles[i] - angles[i - 1]
        if abs(change) >= math.pi:
            short = (change + math.pi) % (2.0 * math.pi) - math.pi
            if short == -math.pi and change > 0.0:
                short = math.pi
            turns += short - change
        out[i] = angles[i] + turns
    return out
