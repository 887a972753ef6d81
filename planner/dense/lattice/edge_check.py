"""Check of one edge against obstacles, road and curvature; [Thesis] 5.5.2."""

import math

import numpy as np

from planner.dense.field import squared_distance
from planner.numerics.compiled import inlined
from planner.states import FloatArray, IntArray

FREE, COLLISION, OFF_ROAD, TOO_SHARP = 0, 1, 2, 3
MIN_STRETCH = 0.05  # 1 - kappa_r l, below which the frame is too close to its pole
TOUCH = 1e-9  # outermost waypoints lie on the bound itself [m]
RATE_STEP = 0.5  # over which the road's curvature is differentiated [m]


@inlined
def road_table(s: FloatArray, roads: FloatArray, offsets: FloatArray) -> FloatArray:
    """Look up the road at points that many edges share.

    Args:
        s: (n,) [m].
        roads: s, left, right, curvature, (m, 4).
        offsets: Of the ego's discs, (n_discs,) [m].

    Returns:
        Curvature [1/m] and its rate [1/m²] at the points, then left and right bounds
        beside each disc [m], (2 + 2 n_discs, n).
    """
    n_discs = offsets.size
    road = np.empty((2 + 2 * n_discs, s.size))
    road[0] = np.interp(s, roads[:, 0], roads[:, 3])
    behind = np.interp(s - RATE_STEP, roads[:, 0], roads[:, 3])
    ahead = np.interp(s + RATE_STEP, roads[:, 0], roads[:, 3])
    road[1] = (ahead - behind) / (2.0 * RATE_STEP)
    for d in range(n_discs):
        road[2 + d] = np.interp(s + offsets[d], roads[:, 0], roads[:, 1])
        road[2 + n_discs + d] = np.interp(s + offsets[d], roads[:, 0], roads[:, 2])
    return road


@inlined
def obstacle_windows(
    s: FloatArray,
    curvature: FloatArray,
    obstacles: FloatArray,
    offsets: FloatArray,
    reach: float,
) -> IntArray:
    """Find the points from which each obstacle can be within reach.

    Args:
        s: Growing, (n,) [m].
        curvature: Of the road there, (n,) [1/m].
        obstacles: s, l, r_ob [m] and road curvature there [1/m], (n_obstacles, 4).
        offsets: Of the ego's discs [m].
        reach: Beyond its radius an obstacle matters this far from a disc [m].

    Returns:
        First point and the one after the last, (n_obstacles, 2).
    """
    windows = np.empty((obstacles.shape[0], 2), dtype=np.int64)
    bent = np.any(curvature != 0.0)
    for i in range(obstacles.shape[0]):
        # A curved frame stretches s: 1 - kappa l stays above 1/2 on real roads.
        stretch = 2.0 if bent or obstacles[i, 3] != 0.0 else 1.0
        span = obstacles[i, 2] + reach
        first = obstacles[i, 0] - stretch * (span + max(offsets[-1], 0.0))
        last = obstacles[i, 0] + stretch * (span - min(offsets[0], 0.0))
        windows[i, 0] = np.searchsorted(s, first)
        windows[i, 1] = np.searchsorted(s, last, side="right")
    return windows


@inlined
def edge_verdict(
    shape: FloatArray,
    s: FloatArray,
    road: FloatArray,
    obstacles: FloatArray,
    windows: IntArray,
    offsets: FloatArray,
    body: tuple[float, float, float],
    clearance: float,
    max_curvature: float,
    span: tuple[float, float],
    discs: FloatArray,
) -> tuple[int, float]:
    """Check one edge point by point; [Thesis] eq. 5.17, 5.18, and the road.

    Args:
        shape: l, l', l'', (3, n).
        s: Of the points, (n,) [m].
        road: As `road_table` makes it.
        obstacles: s, l, r_ob [m] and road curvature there [1/m], (n_obstacles, 4).
        windows: As `obstacle_windows` makes them.
        offsets: Of the ego's discs, (n_discs,) [m].
        body: Their radius with the margin, half length, half width [m].
        clearance: Gap from which on an obstacle costs nothing [m].
        max_curvature: [1/m].
        span: No disc gets beyond these l [m].
        discs: Room to work in, (2 n_discs + 1, n).

    Returns:
        (verdict; integral over s of the clearance cost, the sum over obstacles of
        r_ob (1 - gap / clearance)², in the mean over the discs).
    """
    n, n_discs = s.size, offsets.size
    sharp, outside = place_discs(shape, s, road, offsets, body, max_curvature, discs)
    price = 0.0
    for i in range(obstacles.shape[0]):
        other_s, other_l = obstacles[i, 0], obstacles[i, 1]
        touching = obstacles[i, 2] + body[0]
        reach = touching + clearance
        if other_l - reach > span[1] or other_l + reach < span[0]:
            continue
        touching2, priced2 = touching**2, reach**2
        for d in range(n_discs):
            for j in range(windows[i, 0], windows[i, 1]):
                between = 0.5 * (road[0, j] + obstacles[i, 3])
                away2 = squared_distance(
                    discs[d, j], discs[n_discs + d, j], other_s, other_l, between
                )
                if away2 < priced2:
                    if away2 < touching2:
                        return COLLISION, 0.0
                    lack = 1.0 - (math.sqrt(away2) - touching) / clearance
                    part = 1.0 if 0 < j < n - 1 else 0.5
                    price += part * obstacles[i, 2] * lack * lack
    if outside:
        return OFF_ROAD, 0.0
    if sharp:
        return TOO_SHARP, 0.0
    return FREE, price * (s[n - 1] - s[0]) / ((n - 1) * n_discs)


@inlined
def place_discs(
    shape: FloatArray,
    s: FloatArray,
    road: FloatArray,
    offsets: FloatArray,
    body: tuple[float, float, float],
    max_curvature: float,
    discs: FloatArray,
) -> tuple[bool, bool]:
    """Write s and l of the discs along an edge into `discs`, (2 n_discs + 1, n).

    The formulas of `path_curvature` and `disc_centre` with their common root, in loops
    without branches: these compile to vector instructions, ten times as fast.

    Returns:
        (whether the edge is too sharp anywhere, whether it leaves the road).
    """
    n, n_discs, sharp, outside = s.size, offsets.size, 0, 0
    inverse = discs[2 * n_discs]
    for j in range(n):
        rho = 1.0 - road[0, j] * shape[0, j]
        inverse[j] = 1.0 / math.sqrt(rho * rho + shape[1, j] * shape[1, j])
    for j in range(n):
        slope, curvature = shape[1, j], road[0, j]
        rho = 1.0 - curvature * shape[0, j]
        bend = (
            shape[2, j] * rho + (road[1, j] * shape[0, j] + curvature * slope) * slope
        )
        bent = (bend * inverse[j] * inverse[j] + curvature) * inverse[j]
        sharp += int(abs(bent) > max_curvature)
        outside += int(rho < MIN_STRETCH)
    for d in range(n_discs):
        for j in range(n):
            rho = 1.0 - road[0, j] * shape[0, j]
            cos, sin = rho * inverse[j], shape[1, j] * inverse[j]
            along, across = offsets[d] * cos, offsets[d] * sin
            at_l = shape[0, j] + across - 0.5 * road[0, j] * along * along / rho
            ahead = along / (rho - road[0, j] * across)
            discs[d, j] = s[j] + ahead * (1.0 - (road[0, j] * ahead) ** 2 / 3.0)
            discs[n_discs + d, j] = at_l
            need = body[1] * abs(sin) + body[2] * cos - TOUCH
            need += 0.5 * abs(road[0, j]) * body[1] ** 2  # the road bends, the body not
            outside += int(at_l + need > road[2 + d, j])
            outside += int(at_l - need < road[2 + n_discs + d, j])
    return sharp > 0, outside > 0
