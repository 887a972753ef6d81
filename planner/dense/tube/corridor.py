"""The room beside the obstacles about a path; in place of [Thesis] eq. 5.32."""

import math
from typing import NamedTuple

import numpy as np

from planner.dense.field import (
    Discs,
    ObstacleColumns,
    disc_centre,
    half_span,
    squared_chord,
)
from planner.dense.lattice.edge_check import MIN_STRETCH, RoadAlong
from planner.numerics.compiled import compiled
from planner.states import FloatArray, IntArray, read_only


class PathGuess(NamedTuple):
    """The path about which discs and curvature are taken to first order."""

    s: FloatArray  # knots, (n,) [m]
    l: FloatArray  # (n,) [m]
    slope: FloatArray  # (n,)

    @classmethod
    def of(cls, s: FloatArray, l: FloatArray, slope: FloatArray) -> "PathGuess":
        """Guess a path, read-only: a kernel is compiled once more for what is not."""
        return cls(*map(read_only, (s, l, slope)))


class Passages(NamedTuple):
    """Bounds that passing each obstacle puts on the rows; infinite out of its reach."""

    left: FloatArray  # lower bounds to its left, (n_obstacles, n, n_discs) [m]
    right: FloatArray  # upper bounds to its right, as `left`
    window: IntArray  # knots reached: first, one after the last, (n_obstacles, 2)


@compiled
def road_rows(
    path: PathGuess, road: RoadAlong, discs: Discs
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Compute the room of each disc on the road, as rows on (l, l') about a path.

    Returns:
        (gain, low, high), (n, n_discs) each: low <= l + gain l' <= high.
    """
    s, l, slope = path
    n, n_discs = s.size, discs.offset.size
    gain = np.empty((n, n_discs))
    low, high = np.empty((n, n_discs)), np.empty((n, n_discs))
    for k in range(n):
        curvature = road.curvature[k]
        rho = max(1.0 - curvature * l[k], MIN_STRETCH)
        norm = math.sqrt(rho * rho + slope[k] * slope[k])
        cos = rho / norm
        for d in range(n_discs):
            offset = discs.offset[d]
            bend = road.reach[d, k]
            _, at_l = disc_centre(s[k], l[k], slope[k], offset, bend)
            gain[k, d] = offset * cos * cos * cos / rho
            shift = at_l - l[k] - gain[k, d] * slope[k]
            need = half_span(discs, slope[k], rho, road.turned[d, k], bend)
            low[k, d] = road.right[d, k] + need - shift
            high[k, d] = road.left[d, k] - need - shift
    return gain, low, high


@compiled
def obstacle_rows(
    path: PathGuess,
    gain: FloatArray,
    road: RoadAlong,
    obstacles: ObstacleColumns,
    discs: Discs,
) -> Passages:
    """Compute what passing an obstacle on either side asks of the rows.

    Args:
        path: About which discs are placed.
        gain: Of the rows, (n, n_discs) [m]; see `road_rows`.
        road: At the knots.
        obstacles: Of the field.
        discs: Of the ego, with the margin.
    """
    s, l, slope = path
    curvature = road.curvature
    n, n_discs, n_obstacles = s.size, discs.offset.size, obstacles.s.size
    left = np.full((n_obstacles, n, n_discs), -np.inf)
    right = np.full((n_obstacles, n, n_discs), np.inf)
    window = np.zeros((n_obstacles, 2), dtype=np.int64)
    window[:, 0] = n
    for k in range(n):
        rho = max(1.0 - curvature[k] * l[k], MIN_STRETCH)
        cos = rho / math.sqrt(rho * rho + slope[k] * slope[k])
        chord = (s[min(k + 1, n - 1)] - s[max(k - 1, 0)]) / (2.0 * cos)
        for d in range(n_discs):
            at_s, at_l = disc_centre(
                s[k], l[k], slope[k], discs.offset[d], road.reach[d, k]
            )
            shift = at_l - l[k] - gain[k, d] * slope[k]
            for i in range(n_obstacles):
                other_s, other_l = obstacles.s[i], obstacles.l[i]
                between = 0.5 * (curvature[k] + obstacles.curvature[i])
                # Between knots the path may cut as deep as a chord cuts a circle.
                around = obstacles.radius[i] + discs.radius
                around += chord * chord / (8.0 * around)
                stretch = (1.0 - between * at_l) * (1.0 - between * other_l)
                along2 = squared_chord(at_s - other_s, between)
                room2 = around * around - max(stretch, 0.0) * along2
                if room2 <= 0.0:
                    continue
                half = math.sqrt(room2)
                left[i, k, d] = other_l + half - shift
                right[i, k, d] = other_l - half - shift
                window[i, 0] = min(window[i, 0], k)
                window[i, 1] = max(window[i, 1], k + 1)
    return Passages(left, right, window)


@compiled
def narrow(
    low: FloatArray, high: FloatArray, sides: FloatArray, passages: Passages
) -> None:
    """Narrow the rows' bounds in place for the sides chosen.

    Args:
        low: From `road_rows`, (n, n_discs) [m].
        high: From `road_rows`.
        sides: 1 to the left of an obstacle, -1 to its right, 0 open, (n_obstacles,).
        passages: Of the obstacles.
    """
    left, right, window = passages
    for i in range(sides.size):
        for k in range(window[i, 0], window[i, 1]):
            for d in range(low.shape[1]):
                if sides[i] > 0.0:
                    low[k, d] = max(low[k, d], left[i, k, d])
                elif sides[i] < 0.0:
                    high[k, d] = min(high[k, d], right[i, k, d])


@compiled
def sides_of(
    path: PathGuess,
    road: RoadAlong,
    obstacles: ObstacleColumns,
    offsets: FloatArray,
) -> FloatArray:
    """Return on which side a path passes each obstacle: 1 to its left, -1 right.

    Args:
        path: (n,).
        road: At its knots.
        obstacles: Of the field.
        offsets: Of the ego's discs [m].
    """
    s, l, slope = path
    side = np.ones(obstacles.s.size)
    for i in range(side.size):
        nearest = np.inf
        for k in range(s.size):
            for d in range(offsets.size):
                at_s, at_l = disc_centre(
                    s[k], l[k], slope[k], offsets[d], road.reach[d, k]
                )
                away = abs(at_s - obstacles.s[i])
                if away < nearest:
                    nearest = away
                    side[i] = 1.0 if at_l >= obstacles.l[i] else -1.0
    return side


@compiled
def second_bounds(
    path: PathGuess, road: RoadAlong, max_curvature: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Compute bounds of l'' that keep the curvature in its own; eq. 3.45 about a path.

    With the heading error taken as zero in the cosines, which is on the safe side.

    Args:
        path: (n,).
        road: At its knots.
        max_curvature: At the knots, (n,) [1/m].

    Returns:
        (lowest, highest) l'', (n,) each [1/m].
    """
    l, slope = path.l, path.slope
    low, high = np.empty(l.size), np.empty(l.size)
    for k in range(l.size):
        curvature, rate = road.curvature[k], road.rate[k]
        rho = max(1.0 - curvature * l[k], MIN_STRETCH)
        bend = (rate * l[k] + curvature * slope[k]) * slope[k] / rho
        low[k] = (-max_curvature[k] * rho - curvature) * rho - bend
        high[k] = (max_curvature[k] * rho - curvature) * rho - bend
    return low, high
