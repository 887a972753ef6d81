"""The room beside the obstacles about a path; in place of [Thesis] eq. 5.32."""

import math

import numpy as np

from planner.compiled import compiled
from planner.dense.edge_check import MIN_STRETCH
from planner.dense.field import disc_centre
from planner.states import FloatArray


@compiled
def corridor(
    s: FloatArray,
    l: FloatArray,
    slope: FloatArray,
    road: FloatArray,
    obstacles: FloatArray,
    offsets: FloatArray,
    body: tuple[float, float, float],
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Room of each disc, as rows on (l, l') about a path.

    Args:
        s: Knots, (n,) [m].
        l: Of the path, (n,) [m].
        slope: Of the path, (n,).
        road: As `road_table` makes it.
        obstacles: s, l, r_ob [m] and road curvature there [1/m], (n_obstacles, 4).
        offsets: Of the ego's discs [m].
        body: Their radius with the margin, half length, half width [m].

    Returns:
        (gain, low, high), (n, n_discs) each: low <= l + gain l' <= high.
    """
    n, n_discs = s.size, offsets.size
    gain = np.empty((n, n_discs))
    low, high = np.empty((n, n_discs)), np.empty((n, n_discs))
    side = sides_of(s, l, slope, road[0], obstacles, offsets)
    for k in range(n):
        curvature = road[0, k]
        rho = max(1.0 - curvature * l[k], MIN_STRETCH)
        norm = math.sqrt(rho * rho + slope[k] * slope[k])
        cos, sin = rho / norm, slope[k] / norm
        need = body[1] * abs(sin) + body[2] * cos
        chord = (s[min(k + 1, n - 1)] - s[max(k - 1, 0)]) / (2.0 * cos)
        for d in range(n_discs):
            at_s, at_l = disc_centre(s[k], l[k], slope[k], offsets[d], curvature)
            below, above = road[2 + n_discs + d, k] + need, road[2 + d, k] - need
            for i in range(obstacles.shape[0]):
                between = 0.5 * (curvature + obstacles[i, 3])
                # Between knots the path may cut as deep as a chord cuts a circle.
                radius = obstacles[i, 2] + body[0]
                radius += chord * chord / (8.0 * radius)
                stretch = (1.0 - between * at_l) * (1.0 - between * obstacles[i, 1])
                turned = between * (at_s - obstacles[i, 0])
                along2 = (at_s - obstacles[i, 0]) ** 2 * (1.0 - turned * turned / 12.0)
                room2 = radius * radius - max(stretch, 0.0) * along2
                if room2 <= 0.0:
                    continue
                half = math.sqrt(room2)
                if side[i] > 0.0:
                    below = max(below, obstacles[i, 1] + half)
                else:
                    above = min(above, obstacles[i, 1] - half)
            gain[k, d] = offsets[d] * cos * cos * cos / rho
            shift = at_l - l[k] - gain[k, d] * slope[k]
            low[k, d], high[k, d] = below - shift, above - shift
    return gain, low, high


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
