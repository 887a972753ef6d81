"""Distance between the ego's discs and the bodies, swept from step to step."""

import math

import numpy as np

from planner.compiled import compiled
from planner.states import FloatArray


@compiled
def point_to_rectangle(
    u: float, w: float, half_length: float, half_width: float
) -> float:
    """Distance of a point from a rectangle about the origin [m]; 0 inside."""
    du = max(abs(u) - half_length, 0.0)
    dw = max(abs(w) - half_width, 0.0)
    return math.sqrt(du * du + dw * dw)


@compiled
def _corner_to_segment(
    cu: float, cw: float, u0: float, w0: float, u1: float, w1: float
) -> float:
    """Distance of a point from a segment [m]."""
    du, dw = u1 - u0, w1 - w0
    length2 = du * du + dw * dw
    share = 0.0
    if length2 > 0.0:
        share = min(max(((cu - u0) * du + (cw - w0) * dw) / length2, 0.0), 1.0)
    return math.hypot(cu - u0 - share * du, cw - w0 - share * dw)


@compiled
def _crosses(
    u0: float, w0: float, u1: float, w1: float, half_length: float, half_width: float
) -> bool:
    """Tell whether a segment meets the rectangle (slab method)."""
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


@compiled
def segment_to_rectangle(
    u0: float, w0: float, u1: float, w1: float, half_length: float, half_width: float
) -> float:
    """Distance of a segment from a rectangle about the origin [m]; 0 on contact.

    Args:
        u0: Start, along the rectangle's length [m].
        w0: Start, across it [m].
        u1: End, along.
        w1: End, across.
        half_length: Half extents of the rectangle [m].
        half_width: As `half_length`.
    """
    nearest = min(
        point_to_rectangle(u0, w0, half_length, half_width),
        point_to_rectangle(u1, w1, half_length, half_width),
    )
    # An end bounds the whole segment from below, so that most need no more than this.
    if nearest == 0.0 or _crosses(u0, w0, u1, w1, half_length, half_width):
        return 0.0
    for cu in (-half_length, half_length):
        for cw in (-half_width, half_width):
            nearest = min(nearest, _corner_to_segment(cu, cw, u0, w0, u1, w1))
    return nearest


@compiled
def near_pairs(
    path_x: FloatArray,
    path_y: FloatArray,
    count: FloatArray,
    x: FloatArray,
    y: FloatArray,
    size: FloatArray,
    ignored: FloatArray,
    reach: float,
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """List per profile the (step, body) pairs that can come near at any offset.

    A body farther than `reach` + its circumscribed circle from the reference point of
    a step is out of reach of every candidate of that profile.

    Args:
        path_x: Reference points, (n_profiles, n_steps) [m].
        path_y: As `path_x`.
        count: Valid steps per profile, (n_profiles,).
        x: Body centres, (n_bodies, n_steps) [m].
        y: As `x`.
        size: Circumscribed circles, (n_bodies,) [m].
        ignored: Bodies to leave out, (n_bodies,) bool.
        reach: Largest offset + ego reach + range of interest [m].

    Returns:
        (first, step, body): pairs of profile p are first[p] ... first[p + 1] - 1, in
        order of time.
    """
    n_profiles, n_bodies = path_x.shape[0], x.shape[0]
    first = np.zeros(n_profiles + 1, np.int64)
    capacity = 256
    step = np.empty(capacity, np.int64)
    body = np.empty(capacity, np.int64)
    total = 0
    for p in range(n_profiles):
        for i in range(1, count[p]):
            for b in range(n_bodies):
                dx = x[b, i] - path_x[p, i]
                dy = y[b, i] - path_y[p, i]
                far = reach + size[b]
                if ignored[b] or dx * dx + dy * dy > far * far:
                    continue
                if total == capacity:
                    capacity *= 2
                    wider = np.empty(capacity, np.int64)
                    wider[:total] = step
                    step = wider
                    wider = np.empty(capacity, np.int64)
                    wider[:total] = body
                    body = wider
                step[total] = i
                body[total] = b
                total += 1
        first[p + 1] = total
    return first, step[:total], body[:total]


@compiled
def swept_clearance(
    ego_0: tuple[float, float, float, float],
    ego_1: tuple[float, float, float, float],
    body_0: tuple[float, float, float, float],
    body_1: tuple[float, float, float, float],
    extents: tuple[float, float, float],
    discs: FloatArray,
    disc_radius: float,
    enough: float,
) -> float:
    """Smallest gap between the ego's discs and one body during one step.

    Each disc centre moves on a segment in the body's frame, which may itself move and
    turn.

    Args:
        ego_0: (x, y, cos heading, sin heading) of the rear axle before the step.
        ego_1: After it.
        body_0: The same of the body's centre, before.
        body_1: After.
        extents: (half length, half width, radius) of the body [m].
        discs: Disc centres along the ego's heading from the rear axle [m].
        disc_radius: [m].
        enough: From this gap on the exact value does not matter [m].

    Returns:
        The gap [m], negative on overlap; `enough` or more when it is at least that.
    """
    half_length, half_width, radius = extents
    grown = radius + disc_radius
    nearest = np.inf
    for disc in discs:
        u0, w0 = _in_frame(ego_0, disc, body_0)
        u1, w1 = _in_frame(ego_1, disc, body_1)
        at_end = point_to_rectangle(u1, w1, half_length, half_width) - grown
        moved = math.hypot(u1 - u0, w1 - w0)
        if at_end - moved >= min(enough, nearest):  # the sweep cannot reach it either
            nearest = min(nearest, at_end)
            continue
        gap = segment_to_rectangle(u0, w0, u1, w1, half_length, half_width) - grown
        nearest = min(nearest, gap)
    return nearest


@compiled
def _in_frame(
    ego: tuple[float, float, float, float],
    disc: float,
    body: tuple[float, float, float, float],
) -> tuple[float, float]:
    """Disc centre in the body's frame."""
    dx = ego[0] + disc * ego[2] - body[0]
    dy = ego[1] + disc * ego[3] - body[1]
    return dx * body[2] + dy * body[3], dy * body[2] - dx * body[3]
