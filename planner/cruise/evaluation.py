"""The hot loop: every candidate through every check and cost term."""

from typing import NamedTuple

import numpy as np

from planner.compiled import compiled
from planner.geometry.clearance import swept_clearance
from planner.cruise.costs import edge_clearance
from planner.cruise.feasibility import (
    MIN_STRETCH,
    TOLERANCE,
    Check,
    Limits,
    Reference,
    lateral_over_distance,
    lateral_over_time,
    lateral_quintic,
    road_excess,
    squared_jerk,
    to_plane,
)
from planner.states import FloatArray

# Plain numbers: numba compiles these in.
PASSED = int(Check.PASSED)
DOMAIN = int(Check.DOMAIN)
ROAD = int(Check.ROAD)
CURVATURE = int(Check.CURVATURE)
ACCELERATION = int(Check.ACCELERATION)
LATERAL_ACCELERATION = int(Check.LATERAL_ACCELERATION)
COLLISION = int(Check.COLLISION)
JERK, SAFETY, OFFSET, HEADWAY, CONSISTENCY = 0, 1, 2, 3, 4
N_TERMS = 5


class Longitudinal(NamedTuple):
    """The profiles as the kernel takes them; see `sampling.Profiles`."""

    s: FloatArray
    s_dot: FloatArray
    s_ddot: FloatArray
    s_dddot: FloatArray
    duration: FloatArray
    count: FloatArray
    jerk: FloatArray
    last_l: FloatArray  # offset of the last plan at the same s, (n_profiles, n_steps)


class Lateral(NamedTuple):
    """The lateral samples."""

    over_time: bool
    start: tuple[float, float, float]  # l and its first two derivatives
    offsets: FloatArray  # terminal offsets, (n_offsets,) [m]
    min_length: float  # of a motion over distance [m]
    step: float  # between points [s]


class Surroundings(NamedTuple):
    """Bodies and the pairs of (step, body) that can matter; see `clearance`."""

    x: FloatArray
    y: FloatArray
    cos_heading: FloatArray
    sin_heading: FloatArray
    l: FloatArray
    half_length: FloatArray
    half_width: FloatArray
    radius: FloatArray
    size: FloatArray
    threshold: FloatArray  # gap below which a candidate collides, (n,) [m]
    first: FloatArray
    step: FloatArray
    body: FloatArray
    lag_first: FloatArray
    lag_step: FloatArray
    lag_body: FloatArray
    lag: FloatArray
    discs: FloatArray
    disc_radius: float
    range: float  # gap from which on a body costs nothing [m]
    corridor: float  # half the ego's width and the margin of overlap [m]


@compiled
def candidate_motion(
    p: int,
    offset: float,
    longitudinal: Longitudinal,
    lateral: Lateral,
    reference: Reference,
) -> FloatArray:
    """All points of one candidate.

    Returns:
        (8, n_steps): x, y, cos heading, sin heading, curvature, speed, acceleration, l.
        Columns from the profile's count on are undefined.
    """
    out = np.empty((8, longitudinal.s.shape[1]))
    c, length = _lateral_coefficients(p, offset, longitudinal, lateral)
    for i in range(longitudinal.count[p]):
        l, slope, bend, _ = _lateral_at(p, i, c, length, offset, longitudinal, lateral)
        point = to_plane(
            reference,
            p,
            i,
            longitudinal.s_dot[p, i],
            longitudinal.s_ddot[p, i],
            l,
            slope,
            bend,
        )
        for row in range(7):
            out[row, i] = point[row]
        out[7, i] = l
    return out


@compiled
def _lateral_coefficients(
    p: int, offset: float, longitudinal: Longitudinal, lateral: Lateral
) -> tuple[tuple[float, float, float, float, float, float], float]:
    """Lateral quintic of one candidate and its extent in its own variable."""
    if lateral.over_time:
        length = longitudinal.duration[p]
    else:
        at = min(
            int(round(longitudinal.duration[p] / lateral.step)),
            longitudinal.s.shape[1] - 1,
        )
        length = max(longitudinal.s[p, at] - longitudinal.s[p, 0], lateral.min_length)
    return lateral_quintic(lateral.start, offset, length), length


@compiled
def _lateral_at(
    p: int,
    i: int,
    c: tuple[float, float, float, float, float, float],
    length: float,
    offset: float,
    longitudinal: Longitudinal,
    lateral: Lateral,
) -> tuple[float, float, float, float]:
    """(l, l', l'', d³l/dt³) of one candidate at step i; straight on after its end."""
    done = lateral.step * i
    if not lateral.over_time:
        done = longitudinal.s[p, i] - longitudinal.s[p, 0]
    if done > length + 1e-9:
        return offset, 0.0, 0.0, 0.0
    if lateral.over_time:
        return lateral_over_time(
            c, done, longitudinal.s_dot[p, i], longitudinal.s_ddot[p, i]
        )
    return lateral_over_distance(
        c,
        done,
        longitudinal.s_dot[p, i],
        longitudinal.s_ddot[p, i],
        longitudinal.s_dddot[p, i],
    )


@compiled
def _move_and_check(
    p: int,
    offset: float,
    longitudinal: Longitudinal,
    lateral: Lateral,
    reference: Reference,
    limits: Limits,
    excess_now: float,
    points: FloatArray,
    terms: FloatArray,
) -> int:
    """Fill `points` (5, n_steps) with x, y, cos, sin, l and check the limits.

    Stops at the first violation. Also fills the jerk, offset and consistency terms.
    """
    c, length = _lateral_coefficients(p, offset, longitudinal, lateral)
    count = longitudinal.count[p]
    allowed_excess = max(excess_now, 0.0) + TOLERANCE
    jerk = offset2 = change2 = 0.0
    for i in range(count):
        s_dot = longitudinal.s_dot[p, i]
        l, slope, bend, lateral_jerk = _lateral_at(
            p, i, c, length, offset, longitudinal, lateral
        )
        k = reference.curvature[p, i]
        if 1.0 - k * l < MIN_STRETCH:
            return DOMAIN
        x, y, cos_h, sin_h, curvature, speed, acceleration, cos_e, sin_e = to_plane(
            reference, p, i, s_dot, longitudinal.s_ddot[p, i], l, slope, bend
        )
        points[0, i] = x
        points[1, i] = y
        points[2, i] = cos_h
        points[3, i] = sin_h
        points[4, i] = l
        offset2 += l * l
        change2 += (l - longitudinal.last_l[p, i]) ** 2
        jerk += lateral_jerk * lateral_jerk
        if i == 0:
            continue
        left, right = reference.left[p, i], reference.right[p, i]
        if road_excess(l, cos_e, sin_e, k, left, right, limits) > allowed_excess:
            return ROAD
        if abs(curvature) > limits.curvature:
            return CURVATURE
        if not -limits.deceleration <= acceleration <= limits.acceleration:
            return ACCELERATION
        if speed * speed * abs(curvature) > limits.lateral_acceleration:
            return LATERAL_ACCELERATION
    if lateral.over_time:
        terms[JERK] = longitudinal.jerk[p] + squared_jerk(c, longitudinal.duration[p])
    else:
        terms[JERK] = longitudinal.jerk[p] + jerk * lateral.step
    terms[OFFSET] = offset2 / count
    terms[CONSISTENCY] = change2 / count
    return PASSED


@compiled
def _clear_and_price(
    p: int,
    points: FloatArray,
    around: Surroundings,
    gaps: FloatArray,
    terms: FloatArray,
) -> tuple[int, float]:
    """Check one candidate against the bodies; fill `gaps` and the safety terms.

    Returns:
        (first body that it hits, in time, or -1; radius of the largest body it hits).
    """
    gaps[:] = np.inf
    hit = -1
    hit_size = 0.0
    reach = around.disc_radius + abs(around.discs[-1]) + around.range
    for q in range(around.first[p], around.first[p + 1]):
        i, b = around.step[q], around.body[q]
        x, y = points[0, i], points[1, i]
        dx, dy = around.x[b, i] - x, around.y[b, i] - y
        moved = abs(x - points[0, i - 1]) + abs(y - points[1, i - 1])
        moved += abs(around.x[b, i] - around.x[b, i - 1])
        moved += abs(around.y[b, i] - around.y[b, i - 1])
        far = reach + around.size[b] + moved
        if dx * dx + dy * dy > far * far:
            continue
        j = i - 1
        gap = swept_clearance(
            (points[0, j], points[1, j], points[2, j], points[3, j]),
            (x, y, points[2, i], points[3, i]),
            (
                around.x[b, j],
                around.y[b, j],
                around.cos_heading[b, j],
                around.sin_heading[b, j],
            ),
            (
                around.x[b, i],
                around.y[b, i],
                around.cos_heading[b, i],
                around.sin_heading[b, i],
            ),
            (around.half_length[b], around.half_width[b], around.radius[b]),
            around.discs,
            around.disc_radius,
            around.range,
        )
        gaps[b] = min(gaps[b], gap)
        if gap < around.threshold[b]:
            hit_size = max(hit_size, around.size[b])
            if hit < 0:
                hit = b
    safety = 0.0
    for b in range(gaps.size):
        safety += edge_clearance(gaps[b], around.size[b], around.range)
    terms[SAFETY] = safety
    headway = 0.0
    for q in range(around.lag_first[p], around.lag_first[p + 1]):
        i, b = around.lag_step[q], around.lag_body[q]
        if abs(around.l[b, i] - points[4, i]) < around.corridor + around.half_width[b]:
            headway += around.lag[q]
    terms[HEADWAY] = headway / points.shape[1]
    return hit, hit_size


@compiled
def evaluate(
    longitudinal: Longitudinal,
    lateral: Lateral,
    reference: Reference,
    limits: Limits,
    excess_now: float,
    around: Surroundings,
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Check and price all candidates; candidate = profile · n_offsets + offset.

    Args:
        longitudinal: Profiles.
        lateral: Samples of the lateral motion.
        reference: The path under the profiles.
        limits: Of the vehicle.
        excess_now: How far the ego is over the road's edge already [m].
        around: Bodies.

    Returns:
        (check that removed it, (n,) int64; first body it hits or -1, (n,) int64;
        radius of the largest body it hits, (n,) [m]; raw cost terms, (n, 5)).
    """
    n_offsets = lateral.offsets.size
    n = longitudinal.s.shape[0] * n_offsets
    verdict = np.empty(n, np.int64)
    blocker = np.full(n, -1, np.int64)
    hit_size = np.zeros(n)
    terms = np.zeros((n, N_TERMS))
    points = np.empty((5, longitudinal.s.shape[1]))
    gaps = np.empty(around.size.size)
    for p in range(longitudinal.s.shape[0]):
        for o in range(n_offsets):
            k = p * n_offsets + o
            verdict[k] = _move_and_check(
                p,
                lateral.offsets[o],
                longitudinal,
                lateral,
                reference,
                limits,
                excess_now,
                points,
                terms[k],
            )
            if verdict[k] != PASSED:
                continue
            blocker[k], hit_size[k] = _clear_and_price(
                p, points, around, gaps, terms[k]
            )
            if blocker[k] >= 0:
                verdict[k] = COLLISION
    return verdict, blocker, hit_size, terms
