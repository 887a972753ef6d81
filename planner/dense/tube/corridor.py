"""The room beside the obstacles about a path; in place of [Thesis] eq. 5.32."""

import math

import numpy as np

from planner.dense.field import disc_centre
from planner.dense.lattice.edge_check import MIN_STRETCH
from planner.numerics.compiled import compiled
from planner.states import FloatArray, IntArray


@compiled
def road_rows(
    s: FloatArray,
    l: FloatArray,
    slope: FloatArray,
    road: FloatArray,
    offsets: FloatArray,
    piece: tuple[float, float],
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Room of each disc on the road, as rows on (l, l') about a path.

    Args:
        s: Knots, (n,) [m].
        l: Of the path, (n,) [m].
        slope: Of the path, (n,).
        road: As `road_table` makes it.
        offsets: Of the ego's discs [m].
        piece: Half length and half width of the body's piece in a disc [m].

    Returns:
        (gain, low, high), (n, n_discs) each: low <= l + gain l' <= high.
    """
    n, n_discs = s.size, offsets.size
    gain = np.empty((n, n_discs))
    low, high = np.empty((n, n_discs)), np.empty((n, n_discs))
    for k in range(n):
        curvature = road[0, k]
        rho = max(1.0 - curvature * l[k], MIN_STRETCH)
        norm = math.sqrt(rho * rho + slope[k] * slope[k])
        cos, sin = rho / norm, slope[k] / norm
        need = piece[0] * abs(sin) + piece[1] * cos
        need += 0.5 * abs(curvature) * piece[0] ** 2  # the road bends, the body not
        for d in range(n_discs):
            _, at_l = disc_centre(s[k], l[k], slope[k], offsets[d], curvature)
            gain[k, d] = offsets[d] * cos * cos * cos / rho
            shift = at_l - l[k] - gain[k, d] * slope[k]
            low[k, d] = road[2 + n_discs + d, k] + need - shift
            high[k, d] = road[2 + d, k] - need - shift
    return gain, low, high


@compiled
def obstacle_rows(
    s: FloatArray,
    l: FloatArray,
    slope: FloatArray,
    gain: FloatArray,
    curvature: FloatArray,
    obstacles: FloatArray,
    offsets: FloatArray,
    radius: float,
) -> tuple[FloatArray, FloatArray, IntArray]:
    """What passing an obstacle on either side asks of the rows of `road_rows`.

    Args:
        s: Knots, (n,) [m].
        l: Of the path, (n,) [m].
        slope: Of the path, (n,).
        gain: Of the rows, (n, n_discs) [m].
        curvature: Of the road at the knots, (n,) [1/m].
        obstacles: s, l, r_ob [m] and road curvature there [1/m], (n_obstacles, 4).
        offsets: Of the ego's discs [m].
        radius: Of the ego's discs with the margin [m].

    Returns:
        (left, right, window): passing to the left keeps the rows above `left`, to the
        right below `right`, (n_obstacles, n, n_discs) each [m]; infinite where the
        obstacle does not reach. The window is the first knot that it reaches and the
        one after the last, (n_obstacles, 2).
    """
    n, n_discs, n_obstacles = s.size, offsets.size, obstacles.shape[0]
    left = np.full((n_obstacles, n, n_discs), -np.inf)
    right = np.full((n_obstacles, n, n_discs), np.inf)
    window = np.zeros((n_obstacles, 2), dtype=np.int64)
    window[:, 0] = n
    for k in range(n):
        rho = max(1.0 - curvature[k] * l[k], MIN_STRETCH)
        cos = rho / math.sqrt(rho * rho + slope[k] * slope[k])
        chord = (s[min(k + 1, n - 1)] - s[max(k - 1, 0)]) / (2.0 * cos)
        for d in range(n_discs):
            at_s, at_l = disc_centre(s[k], l[k], slope[k], offsets[d], curvature[k])
            shift = at_l - l[k] - gain[k, d] * slope[k]
            for i in range(n_obstacles):
                between = 0.5 * (curvature[k] + obstacles[i, 3])
                # Between knots the path may cut as deep as a chord cuts a circle.
                around = obstacles[i, 2] + radius
                around += chord * chord / (8.0 * around)
                stretch = (1.0 - between * at_l) * (1.0 - between * obstacles[i, 1])
                turned = between * (at_s - obstacles[i, 0])
                along2 = (at_s - obstacles[i, 0]) ** 2 * (1.0 - turned * turned / 12.0)
                room2 = around * around - max(stretch, 0.0) * along2
                if room2 <= 0.0:
                    continue
                half = math.sqrt(room2)
                left[i, k, d] = obstacles[i, 1] + half - shift
                right[i, k, d] = obstacles[i, 1] - half - shift
                window[i, 0] = min(window[i, 0], k)
                window[i, 1] = max(window[i, 1], k + 1)
    return left, right, window


@compiled
def narrow(
    low: FloatArray,
    high: FloatArray,
    sides: FloatArray,
    left: FloatArray,
    right: FloatArray,
    window: IntArray,
) -> None:
    """Narrow the rows' bounds in place, (n, n_discs) each, for the sides chosen.

    Args:
        low: From `road_rows`.
        high: From `road_rows`.
        sides: 1 to the left of an obstacle, -1 to its right, 0 open, (n_obstacles,).
        left: As `obstacle_rows` makes it.
        right: As `left`.
        window: As `left`.
    """
    for i in range(sides.size):
        for k in range(window[i, 0], window[i, 1]):
            for d in range(low.shape[1]):
                if sides[i] > 0.0:
                    low[k, d] = max(low[k, d], left[i, k, d])
                elif sides[i] < 0.0:
                    high[k, d] = min(high[k, d], right[i, k, d])


@compiled
def sides_of(
    s: FloatArray,
    l: FloatArray,
    slope: FloatArray,
    curvature: FloatArray,
    obstacles: FloatArray,
    offsets: FloatArray,
) -> FloatArray:
    """On which side a path passes each obstacle: 1 to its left, -1 to its right."""
    side = np.ones(obstacles.shape[0])
    for i in range(side.size):
        nearest = np.inf
        for k in range(s.size):
            for d in range(offsets.size):
                at_s, at_l = disc_centre(s[k], l[k], slope[k], offsets[d], curvature[k])
                away = abs(at_s - obstacles[i, 0])
                if away < nearest:
                    nearest = away
                    side[i] = 1.0 if at_l >= obstacles[i, 1] else -1.0
    return side


@compiled
def second_bounds(
    l: FloatArray, slope: FloatArray, road: FloatArray, max_curvature: float
) -> tuple[FloatArray, FloatArray]:
    """Bounds of l'' that keep the curvature in its own; eq. 3.45 about a path.

    With the heading error taken as zero in the cosines, which is on the safe side.

    Args:
        l: (n,) [m].
        slope: (n,).
        road: As `road_table` makes it.
        max_curvature: [1/m].

    Returns:
        (lowest, highest) l'', (n,) each [1/m].
    """
    low, high = np.empty(l.size), np.empty(l.size)
    for k in range(l.size):
        curvature, rate = road[0, k], road[1, k]
        rho = max(1.0 - curvature * l[k], MIN_STRETCH)
        bend = (rate * l[k] + curvature * slope[k]) * slope[k] / rho
        low[k] = (-max_curvature * rho - curvature) * rho - bend
        high[k] = (max_curvature * rho - curvature) * rho - bend
    return low, high
