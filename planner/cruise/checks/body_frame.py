"""How one profile moves past one body: bounds for all its candidates, and frames.

In a body's own frame the ego's rear axle is at a + (change of offset) b, known once per
profile and body.
"""

import math
from typing import NamedTuple

from planner.cruise.candidate_motion import (
    COS,
    KAPPA,
    SIN,
    SLOPE,
    UNIT_L,
    UNIT_SLOPE,
    L,
    S,
    X,
    Y,
)
from planner.cruise.workspace import (
    ASKEW,
    MOVED,
    ROAD_U,
    ROAD_W,
    TURNED,
    UNIT_U,
    UNIT_W,
    Bench,
    Surroundings,
    U,
    W,
)
from planner.numerics.compiled import inlined
from planner.states import FloatArray


class Span(NamedTuple):
    """Bounds over all candidates and steps of one profile."""

    widest: float  # largest distance from the reference path [m]
    stride: float  # longest way of the reference point in one step [m]
    pace: float  # longest way of a rear axle in one step [m]
    turned: float  # largest change of a heading error in one step [rad]


@inlined
def fill_heading_bounds(
    p: int,
    count: int,
    rows: FloatArray,
    basis: FloatArray,
    outermost: tuple[float, float],
    heading_bounds: FloatArray,
) -> Span:
    """Bound how the candidates of one profile move and turn against the road.

    Offsets, slopes and stretch are linear in the change of offset, and so are places:
    their extremes are at the outermost offsets. tan e = slope / stretch.

    Args:
        p: Which profile.
        count: Its valid steps.
        rows: Of profiles and the road under them.
        basis: Of its lateral motion.
        outermost: Least and greatest change of offset [m].
        heading_bounds: Filled, (2, n_steps).
    """
    widest = stride = pace = most = 0.0
    low, high = outermost
    x_low = y_low = x_high = y_high = 0.0
    stretch_low = stretch_high = slope_low = slope_high = 0.0
    for i in range(count):
        was = x_low, y_low, x_high, y_high
        bent = stretch_low, stretch_high, slope_low, slope_high
        l_low = basis[L, i] + low * basis[UNIT_L, i]
        l_high = basis[L, i] + high * basis[UNIT_L, i]
        x_low = rows[p, X, i] - l_low * rows[p, SIN, i]
        y_low = rows[p, Y, i] + l_low * rows[p, COS, i]
        x_high = rows[p, X, i] - l_high * rows[p, SIN, i]
        y_high = rows[p, Y, i] + l_high * rows[p, COS, i]
        stretch_low = 1.0 - rows[p, KAPPA, i] * l_low
        stretch_high = 1.0 - rows[p, KAPPA, i] * l_high
        slope_low = basis[SLOPE, i] + low * basis[UNIT_SLOPE, i]
        slope_high = basis[SLOPE, i] + high * basis[UNIT_SLOPE, i]
        widest = max(widest, abs(l_low), abs(l_high))
        least = min(stretch_low, stretch_high)
        steepest = max(abs(slope_low), abs(slope_high))
        turned = 0.0
        if i > 0:
            least = min(least, bent[0], bent[1])
            steeper = max(abs(slope_low - bent[2]), abs(slope_high - bent[3]))
            longer = max(abs(stretch_low - bent[0]), abs(stretch_high - bent[1]))
            turned = (steeper + steepest * longer / least) / least
            stride = max(stride, abs(rows[p, S, i] - rows[p, S, i - 1]))
            pace = max(
                pace,
                (x_low - was[0]) ** 2 + (y_low - was[1]) ** 2,
                (x_high - was[2]) ** 2 + (y_high - was[3]) ** 2,
            )
        usable = least > 0.0
        heading_bounds[ASKEW, i] = min(steepest / least, 1.0) if usable else 1.0
        heading_bounds[TURNED, i] = min(turned, math.pi) if usable else math.pi
        most = max(most, heading_bounds[TURNED, i])
    return Span(widest, stride, math.sqrt(pace), most)


@inlined
def near_steps(
    p: int,
    count: int,
    rows: FloatArray,
    poses: FloatArray,
    b: int,
    reach: tuple[float, float, float],
    stride: float,
) -> tuple[int, int]:
    """Find the steps around those at which a body may come near any candidate.

    Args:
        p: Which profile.
        count: Its valid steps.
        rows: Of profiles and the road under them.
        poses: Bodies, (n_bodies, 4, n_steps).
        b: Which body.
        reach: A body is not near whose centre is farther than that from the reference
            path's point, or farther behind or ahead of it along the path [m].
        stride: Largest change of the distance in one step [m].

    Returns:
        (first, last), one step more on each side where there is one; last < first if
        it never comes near.
    """
    around, behind, ahead = reach
    first, last = count, -1
    i = 0
    while i < count:
        dx, dy = poses[b, 0, i] - rows[p, X, i], poses[b, 1, i] - rows[p, Y, i]
        apart2 = dx * dx + dy * dy
        if apart2 > around * around:
            i += max(1, int((math.sqrt(apart2) - around) / stride))
        else:
            along = dx * rows[p, COS, i] + dy * rows[p, SIN, i]
            if -behind <= along <= ahead:
                first, last = min(first, i), i
            i += 1
    if last >= 0:
        first, last = max(first - 1, 0), min(last + 1, count - 1)
    return first, last


class CoverDiscs(NamedTuple):
    """Discs that cover the ego: their centres ahead of the rear axle [m]."""

    three: tuple[float, float, float]  # rear first; looked at together
    more: FloatArray  # of a long body, (n,)


class Body(NamedTuple):
    """One body, as plain numbers."""

    number: int
    half_length: float  # [m]
    half_width: float  # [m]
    size: float  # radius of its circumscribed circle [m]
    reach: float  # the same and the radius of the ego's discs [m]
    grown: float  # its own radius and that of the ego's discs [m]
    threshold: float  # gap below which it is hit [m]


@inlined
def body_of(b: int, around: Surroundings) -> Body:
    """Pick body `b`."""
    return Body(
        b,
        around.extents[b, 0],
        around.extents[b, 1],
        around.size[b],
        around.size[b] + around.disc_radius,
        around.extents[b, 2] + around.disc_radius,
        around.threshold[b],
    )


@inlined
def fill_frames(
    p: int,
    steps: tuple[int, int],
    rows: FloatArray,
    outermost: tuple[float, float],
    body: Body,
    poses: FloatArray,
    axle_to_corner: float,
    bench: Bench,
) -> None:
    """Fill the frames of one body from the first to the last of `steps`."""
    basis, sway, frames = bench.basis, bench.sway, bench.frames
    low, high = outermost
    b, (first, last) = body.number, steps
    for i in range(first, last + 1):
        cos_r, sin_r = rows[p, COS, i], rows[p, SIN, i]
        cos_b, sin_b = poses[b, 2, i], poses[b, 3, i]
        road_u, road_w = cos_r * cos_b + sin_r * sin_b, sin_r * cos_b - cos_r * sin_b
        dx, dy = rows[p, X, i] - poses[b, 0, i], rows[p, Y, i] - poses[b, 1, i]
        l, unit = basis[L, i], basis[UNIT_L, i]
        frames[U, i] = dx * cos_b + dy * sin_b - road_w * l
        frames[W, i] = dy * cos_b - dx * sin_b + road_u * l
        frames[UNIT_U, i] = -road_w * unit
        frames[UNIT_W, i] = road_u * unit
        frames[ROAD_U, i] = road_u
        frames[ROAD_W, i] = road_w
        frames[MOVED, i] = 0.0
        if i > first:
            du, dw = frames[U, i] - frames[U, i - 1], frames[W, i] - frames[W, i - 1]
            unit_u = frames[UNIT_U, i] - frames[UNIT_U, i - 1]
            unit_w = frames[UNIT_W, i] - frames[UNIT_W, i - 1]
            moved = max(
                (du + low * unit_u) ** 2 + (dw + low * unit_w) ** 2,
                (du + high * unit_u) ** 2 + (dw + high * unit_w) ** 2,
            )
            turned = abs(road_u - frames[ROAD_U, i - 1])
            turned += abs(road_w - frames[ROAD_W, i - 1]) + sway[TURNED, i]
            frames[MOVED, i] = math.sqrt(moved) + axle_to_corner * turned
