"""Distance between the ego's discs and the bodies, swept from step to step."""

import math

import numpy as np

from planner.numerics.compiled import inlined
from planner.states import FloatArray

TURN_REACH = 5.0  # at most from the rear axle to a disc: turning moves it [m]


@inlined
def _corner_to_segment(
    cu: float, cw: float, u0: float, w0: float, u1: float, w1: float
) -> float:
    """Compute the distance of a point from a segment [m]."""
    du, dw = u1 - u0, w1 - w0
    length2 = du * du + dw * dw
    share = 0.0
    if length2 > 0.0:
        share = min(max(((cu - u0) * du + (cw - w0) * dw) / length2, 0.0), 1.0)
    du, dw = cu - u0 - share * du, cw - w0 - share * dw
    return math.sqrt(du * du + dw * dw)


@inlined
def _crosses(
    u0: float, w0: float, u1: float, w1: float, half_length: float, half_width: float
) -> bool:
    """Check whether a segment meets the rectangle (slab method)."""
    enter, leave = 0.0, 1.0
    for start, delta, half in ((u0, u1 - u0, half_length), (w0, w1 - w0, half_width)):
        if abs(delta) < 1e-12:
            if abs(start) > half:
                return False
        else:
            first = (-half - start) / delta
            second = (half - start) / delta
            enter = max(enter, min(first, second))
            leave = min(leave, max(first, second))
    return enter <= leave


@inlined
def segment_to_rectangle(
    u0: float, w0: float, u1: float, w1: float, half_length: float, half_width: float
) -> float:
    """Compute the distance of a segment from a rectangle about the origin [m].

    It is 0 on contact.

    Args:
        u0: Start, along the rectangle's length [m].
        w0: Start, across it [m].
        u1: End, along.
        w1: End, across.
        half_length: Half extents of the rectangle [m].
        half_width: As `half_length`.
    """
    # The distance is convex along the segment: where it grows from the start on, or
    # falls up to the end, the nearest point is that end.
    du, dw = u1 - u0, w1 - w0
    out_u = u0 - min(max(u0, -half_length), half_length)
    out_w = w0 - min(max(w0, -half_width), half_width)
    if out_u * du + out_w * dw >= 0.0:
        return math.sqrt(out_u * out_u + out_w * out_w)
    nearest = math.sqrt(out_u * out_u + out_w * out_w)
    out_u = u1 - min(max(u1, -half_length), half_length)
    out_w = w1 - min(max(w1, -half_width), half_width)
    if out_u * du + out_w * dw <= 0.0:
        return math.sqrt(out_u * out_u + out_w * out_w)
    if half_length == 0.0 and half_width == 0.0:  # a disc: its centre decides
        return abs(u0 * dw - w0 * du) / math.sqrt(du * du + dw * dw)
    nearest = min(nearest, math.sqrt(out_u * out_u + out_w * out_w))
    if _crosses(u0, w0, u1, w1, half_length, half_width):
        return 0.0
    for cu in (-half_length, half_length):
        for cw in (-half_width, half_width):
            nearest = min(nearest, _corner_to_segment(cu, cw, u0, w0, u1, w1))
    return nearest


@inlined
def gap_to(
    points: FloatArray,
    poses: FloatArray,
    extents: FloatArray,
    b: int,
    discs: FloatArray,
    disc_radius: float,
    cutoff_gap: float,
) -> float:
    """Compute the smallest gap of one motion to body `b`; arguments as in `gaps_to`.

    Between steps each disc centre moves on a segment in the body's frame, which may
    itself move and turn.
    """
    half_length, half_width = extents[b, 0], extents[b, 1]
    grown = extents[b, 2] + disc_radius
    # The ego's middle, a circle about all discs, and one about the whole body.
    middle = 0.5 * (discs[0] + discs[-1])
    around_both = 0.5 * abs(discs[-1] - discs[0]) + math.hypot(half_length, half_width)
    nearest = np.inf
    for i in range(points.shape[1]):
        j = max(i - 1, 0)
        dx = points[0, i] + middle * points[2, i] - poses[b, 0, i]
        dy = points[1, i] + middle * points[3, i] - poses[b, 1, i]
        # No less than what a point of the ego moves against the body's frame.
        ahead_x = points[0, i] - points[0, j] - poses[b, 0, i] + poses[b, 0, j]
        ahead_y = points[1, i] - points[1, j] - poses[b, 1, i] + poses[b, 1, j]
        turned = (
            abs(points[2, i] - points[2, j])
            + abs(points[3, i] - points[3, j])
            + abs(poses[b, 2, i] - poses[b, 2, j])
            + abs(poses[b, 3, i] - poses[b, 3, j])
        )
        moved = abs(ahead_x) + abs(ahead_y) + TURN_REACH * turned
        far = min(cutoff_gap, nearest) + grown + around_both + moved
        if dx * dx + dy * dy > far * far:
            continue
        for k in range(discs.size):
            u0, w0 = _in_frame(points, poses, b, j, discs[k])
            u1, w1 = _in_frame(points, poses, b, i, discs[k])
            du = max(abs(u1) - half_length, 0.0)
            dw = max(abs(w1) - half_width, 0.0)
            far = min(cutoff_gap, nearest) + grown + abs(u1 - u0) + abs(w1 - w0)
            if du * du + dw * dw < far * far:
                gap = (
                    segment_to_rectangle(u0, w0, u1, w1, half_length, half_width)
                    - grown
                )
                nearest = min(nearest, gap)
    return nearest


@inlined
def _in_frame(
    points: FloatArray, poses: FloatArray, b: int, i: int, disc: float
) -> tuple[float, float]:
    """Return the disc centre at step i in the frame of body b [m]."""
    dx = points[0, i] + disc * points[2, i] - poses[b, 0, i]
    dy = points[1, i] + disc * points[3, i] - poses[b, 1, i]
    cos, sin = poses[b, 2, i], poses[b, 3, i]
    return dx * cos + dy * sin, dy * cos - dx * sin


@inlined
def gaps_to(
    points: FloatArray,
    poses: FloatArray,
    extents: FloatArray,
    discs: FloatArray,
    disc_radius: float,
    cutoff_gap: float = np.inf,
) -> FloatArray:
    """Compute the smallest gap of one motion to each body, swept from step to step.

    Args:
        points: (4, n_steps): x, y, cos and sin of the heading of the rear axle; with
            one column the gaps at that moment.
        poses: Bodies, (n_bodies, 4, >= n_steps).
        extents: (n_bodies, 3): half length, half width, radius [m].
        discs: Disc centres along the ego's heading from the rear axle [m].
        disc_radius: [m].
        cutoff_gap: From this gap on the exact value does not matter [m].

    Returns:
        (n_bodies,) [m], negative on overlap; inf or at least `cutoff_gap` when it is at
        least that.
    """
    gaps = np.empty(poses.shape[0])
    for b in range(poses.shape[0]):
        gaps[b] = gap_to(points, poses, extents, b, discs, disc_radius, cutoff_gap)
    return gaps
