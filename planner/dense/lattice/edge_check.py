"""Check of one edge against obstacles, road and curvature; [Thesis] 5.5.2."""

import math
from enum import IntEnum
from typing import NamedTuple

import numpy as np

from planner.dense.field import (
    Discs,
    ObstacleColumns,
    RoadColumns,
    squared_distance,
)
from planner.numerics.compiled import inlined
from planner.numerics.interpolation import interpolate
from planner.reference_path.road_turn import circles_to, road_turn
from planner.states import FloatArray, IntArray

MIN_STRETCH = 0.05  # 1 - kappa_r l, below which the frame is too close to its pole
TOUCH = 1e-9  # outermost waypoints lie on the bound itself [m]
RATE_STEP = 0.5  # over which the road's curvature is differentiated [m]


class EdgeVerdict(IntEnum):
    """Outcome of the check of an edge."""

    FREE = 0
    COLLISION = 1
    OFF_ROAD = 2  # free of collisions, but not on the road
    TOO_SHARP = 3  # neither of the two, but beyond the curvature bound


# Plain numbers: numba compiles these in.
FREE = int(EdgeVerdict.FREE)
COLLISION = int(EdgeVerdict.COLLISION)
OFF_ROAD = int(EdgeVerdict.OFF_ROAD)
TOO_SHARP = int(EdgeVerdict.TOO_SHARP)


class RoadAlong(NamedTuple):
    """The road at n points."""

    curvature: FloatArray  # (n,) [1/m]
    rate: FloatArray  # of the curvature, (n,) [1/m²]
    left: FloatArray  # beside each disc, (n_discs, n) [m]
    right: FloatArray  # as `left`
    reach: FloatArray  # curvature that bends it away under each disc, as `left` [1/m]
    turned: FloatArray  # by how much it has turned under each disc, as `left` [rad]


class EdgePoints(NamedTuple):
    """Points that all edges of one gap between layers share."""

    s: FloatArray  # of the points, growing, (n,) [m]
    road: RoadAlong
    window: IntArray  # points near each obstacle, as `obstacle_windows` makes them


class EdgeLimits(NamedTuple):
    """Bounds of an edge, and the reach of the clearance cost."""

    clearance: float  # gap from which on an obstacle costs nothing [m]
    max_curvature: float  # [1/m]


class LateralSpan(NamedTuple):
    """Bounds of the l of all discs along an edge [m]."""

    low: float
    high: float


class EdgeScratch(NamedTuple):
    """One edge, and where its discs are."""

    shape: FloatArray  # l, l', l'', (3, n)
    disc_s: FloatArray  # (n_discs, n) [m]
    disc_l: FloatArray  # (n_discs, n) [m]
    inverse: FloatArray  # 1 / length of (1 - kappa l, l'), (n,)


@inlined
def road_along(s: FloatArray, road: RoadColumns, offset: FloatArray) -> RoadAlong:
    """Look up the road at points that many edges share.

    Args:
        s: (n,) [m].
        road: Its samples.
        offset: Of the ego's discs, (n_discs,) [m].
    """
    n_discs = offset.size
    left, right = np.empty((n_discs, s.size)), np.empty((n_discs, s.size))
    curvature, behind, ahead = np.empty(s.size), np.empty(s.size), np.empty(s.size)
    interpolate(s, 0.0, road.s, road.curvature, curvature)
    interpolate(s, -RATE_STEP, road.s, road.curvature, behind)
    interpolate(s, RATE_STEP, road.s, road.curvature, ahead)
    rate = (ahead - behind) / (2.0 * RATE_STEP)
    for d in range(n_discs):
        interpolate(s, offset[d], road.s, road.left, left[d])
        interpolate(s, offset[d], road.s, road.right, right[d])
    reach, turned = np.empty((n_discs, s.size)), np.zeros((n_discs, s.size))
    reach[:] = curvature
    if np.ptp(road.curvature) > 0.0:
        reach, turned = circles_to(s, offset, road_turn(road.s, road.curvature))
    elif road.curvature[0] != 0.0:
        for d in range(n_discs):
            turned[d] = offset[d] * curvature
    return RoadAlong(curvature, rate, left, right, reach, turned)


@inlined
def edge_scratch(n: int, n_discs: int) -> EdgeScratch:
    """Allocate an edge of n points."""
    return EdgeScratch(
        np.empty((3, n)), np.empty((n_discs, n)), np.empty((n_discs, n)), np.empty(n)
    )


@inlined
def obstacle_windows(
    s: FloatArray,
    curvature: FloatArray,
    obstacles: ObstacleColumns,
    offset: FloatArray,
    reach: float,
) -> IntArray:
    """Find the points from which each obstacle can be within reach.

    Args:
        s: Growing, (n,) [m].
        curvature: Of the road there, (n,) [1/m].
        obstacles: Of the field.
        offset: Of the ego's discs [m].
        reach: Beyond its radius an obstacle matters this far from a disc [m].

    Returns:
        First point and the one after the last, (n_obstacles, 2).
    """
    windows = np.empty((obstacles.s.size, 2), dtype=np.int64)
    bent = np.any(curvature != 0.0)
    for i in range(obstacles.s.size):
        # A curved frame stretches s: 1 - kappa l stays above 1/2 on real roads.
        stretch = 2.0 if bent or obstacles.curvature[i] != 0.0 else 1.0
        span = obstacles.radius[i] + reach
        first = obstacles.s[i] - stretch * (span + max(offset[-1], 0.0))
        last = obstacles.s[i] + stretch * (span - min(offset[0], 0.0))
        windows[i, 0] = np.searchsorted(s, first)
        windows[i, 1] = np.searchsorted(s, last, side="right")
    return windows


@inlined
def edge_verdict(
    edge: EdgeScratch,
    points: EdgePoints,
    span: LateralSpan,
    obstacles: ObstacleColumns,
    discs: Discs,
    limits: EdgeLimits,
) -> tuple[int, float]:
    """Check one edge point by point; [Thesis] eq. 5.17, 5.18, and the road.

    Args:
        edge: Its shape is given, the rest is overwritten.
        points: Of the gap that it crosses.
        span: No disc gets beyond it.
        obstacles: Of the field.
        discs: Of the ego, with the margin.
        limits: See there.

    Returns:
        (value of `EdgeVerdict`; integral over s of the clearance cost, the sum over
        obstacles of r_ob (1 - gap / clearance)², in the mean over the discs).
    """
    s, road = points.s, points.road
    n, n_discs = s.size, discs.offset.size
    sharp, outside = place_discs(edge, s, road, discs, limits.max_curvature)
    price = 0.0
    for i in range(obstacles.s.size):
        other_s, other_l = obstacles.s[i], obstacles.l[i]
        touching = obstacles.radius[i] + discs.radius
        reach = touching + limits.clearance
        if other_l - reach > span.high or other_l + reach < span.low:
            continue
        touching2, priced2 = touching**2, reach**2
        for d in range(n_discs):
            for j in range(points.window[i, 0], points.window[i, 1]):
                between = 0.5 * (road.curvature[j] + obstacles.curvature[i])
                away2 = squared_distance(
                    edge.disc_s[d, j], edge.disc_l[d, j], other_s, other_l, between
                )
                if away2 < priced2:
                    if away2 < touching2:
                        return COLLISION, 0.0
                    lack = 1.0 - (math.sqrt(away2) - touching) / limits.clearance
                    part = 1.0 if 0 < j < n - 1 else 0.5
                    price += part * obstacles.radius[i] * lack * lack
    if outside:
        return OFF_ROAD, 0.0
    if sharp:
        return TOO_SHARP, 0.0
    return FREE, price * (s[n - 1] - s[0]) / ((n - 1) * n_discs)


@inlined
def place_discs(
    edge: EdgeScratch,
    s: FloatArray,
    road: RoadAlong,
    discs: Discs,
    max_curvature: float,
) -> tuple[bool, bool]:
    """Fill s and l of the discs along an edge.

    The formulas of `path_curvature`, `disc_centre` and `half_span` with their common
    root, in loops without branches: these compile to vector instructions, ten times as
    fast.

    Returns:
        (whether the edge is too sharp anywhere, whether it leaves the road).
    """
    n, n_discs, sharp, outside = s.size, discs.offset.size, 0, 0
    shape, inverse = edge.shape, edge.inverse
    for j in range(n):
        rho = 1.0 - road.curvature[j] * shape[0, j]
        inverse[j] = 1.0 / math.sqrt(rho * rho + shape[1, j] * shape[1, j])
    for j in range(n):
        slope, curvature = shape[1, j], road.curvature[j]
        rho = 1.0 - curvature * shape[0, j]
        bend = (
            shape[2, j] * rho + (road.rate[j] * shape[0, j] + curvature * slope) * slope
        )
        bent = (bend * inverse[j] * inverse[j] + curvature) * inverse[j]
        sharp += int(abs(bent) > max_curvature)
        outside += int(rho < MIN_STRETCH)
    half_length, half_width = discs.half_length, discs.half_width
    for d in range(n_discs):
        offset = discs.offset[d]
        for j in range(n):
            curvature, turned = road.reach[d, j], road.turned[d, j]
            cos = (1.0 - road.curvature[j] * shape[0, j]) * inverse[j]
            sin = shape[1, j] * inverse[j]
            rho = 1.0 - curvature * shape[0, j]
            along, across = offset * cos, offset * sin
            at_l = shape[0, j] + across - 0.5 * curvature * along * along / rho
            ahead = along / (rho - curvature * across)
            edge.disc_s[d, j] = s[j] + ahead * (1.0 - (curvature * ahead) ** 2 / 3.0)
            edge.disc_l[d, j] = at_l
            need = half_length * abs(sin - turned * cos) - TOUCH
            need += half_width * min(cos + turned * sin, 1.0)
            need += 0.5 * abs(curvature) * half_length**2  # only the road bends
            outside += int(at_l + need > road.left[d, j])
            outside += int(at_l - need < road.right[d, j])
    return sharp > 0, outside > 0
