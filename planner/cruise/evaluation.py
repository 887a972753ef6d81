"""The hot loop: every candidate through every check and cost term."""

from typing import NamedTuple

import numpy as np

from planner.compiled import compiled
from planner.cruise.costs import edge_clearance
from planner.cruise.feasibility import (
    MIN_STRETCH,
    TOLERANCE,
    Check,
    Limits,
    Reference,
    lateral_at,
    lateral_quintic,
    road_excess,
    squared_jerk,
)
from planner.geometry.clearance import span_clearance
from planner.geometry.frenet import cartesian_rates
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
    """Bodies, when they can matter, and where headway would be short."""

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
    first: FloatArray  # spans, see `clearance.near_spans`
    body: FloatArray
    begin: FloatArray
    end: FloatArray
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
    s = longitudinal.s[p]
    for i in range(longitudinal.count[p]):
        s_dot, s_ddot = longitudinal.s_dot[p, i], longitudinal.s_ddot[p, i]
        done = lateral.step * i if lateral.over_time else s[i] - s[0]
        l, slope, bend, _ = lateral_at(
            lateral.over_time, c, length, offset, done, s_dot, s_ddot, 0.0
        )
        cos_e, sin_e, curvature, speed, acceleration = cartesian_rates(
            l,
            reference.curvature[p, i],
            reference.curvature_rate[p, i],
            s_dot,
            s_ddot,
            slope,
            bend,
        )
        cos_r, sin_r = reference.cos_heading[p, i], reference.sin_heading[p, i]
        out[0, i] = reference.x[p, i] - sin_r * l
        out[1, i] = reference.y[p, i] + cos_r * l
        out[2, i] = cos_r * cos_e - sin_r * sin_e
        out[3, i] = sin_r * cos_e + cos_r * sin_e
        out[4, i] = curvature
        out[5, i] = speed
        out[6, i] = acceleration
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
    The loop works on rows and numbers: whole records would be passed by value to
    every point.
    """
    c, length = _lateral_coefficients(p, offset, longitudinal, lateral)
    over_time, step = lateral.over_time, lateral.step
    s, s_dots, s_ddots = (
        longitudinal.s[p],
        longitudinal.s_dot[p],
        longitudinal.s_ddot[p],
    )
    s_dddots, last_l = longitudinal.s_dddot[p], longitudinal.last_l[p]
    ref_x, ref_y = reference.x[p], reference.y[p]
    ref_cos, ref_sin = reference.cos_heading[p], reference.sin_heading[p]
    ref_k, ref_rate = reference.curvature[p], reference.curvature_rate[p]
    lefts, rights = reference.left[p], reference.right[p]
    max_curvature, max_lateral = limits.curvature, limits.lateral_acceleration
    lowest, highest = -limits.deceleration, limits.acceleration
    front, rear, half_width = limits.front, limits.rear, limits.half_width
    count = longitudinal.count[p]
    allowed_excess = max(excess_now, 0.0) + TOLERANCE
    jerk = offset2 = change2 = 0.0
    for i in range(count):
        s_dot, s_ddot, k = s_dots[i], s_ddots[i], ref_k[i]
        done = step * i if over_time else s[i] - s[0]
        l, slope, bend, lateral_jerk = lateral_at(
            over_time, c, length, offset, done, s_dot, s_ddot, s_dddots[i]
        )
        if 1.0 - k * l < MIN_STRETCH:
            return DOMAIN
        cos_e, sin_e, curvature, speed, acceleration = cartesian_rates(
            l, k, ref_rate[i], s_dot, s_ddot, slope, bend
        )
        points[0, i] = ref_x[i] - ref_sin[i] * l
        points[1, i] = ref_y[i] + ref_cos[i] * l
        points[2, i] = ref_cos[i] * cos_e - ref_sin[i] * sin_e
        points[3, i] = ref_sin[i] * cos_e + ref_cos[i] * sin_e
        points[4, i] = l
        offset2 += l * l
        change2 += (l - last_l[i]) ** 2
        jerk += lateral_jerk * lateral_jerk
        if i == 0:
            continue
        excess = road_excess(
            l, cos_e, sin_e, k, lefts[i], rights[i], front, rear, half_width
        )
        if excess > allowed_excess:
            return ROAD
        if abs(curvature) > max_curvature:
            return CURVATURE
        if acceleration < lowest or acceleration > highest:
            return ACCELERATION
        if speed * speed * abs(curvature) > max_lateral:
            return LATERAL_ACCELERATION
    if over_time:
        terms[JERK] = longitudinal.jerk[p] + squared_jerk(c, longitudinal.duration[p])
    else:
        terms[JERK] = longitudinal.jerk[p] + jerk * step
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
    hit_step = points.shape[1]
    hit_size = 0.0
    for q in range(around.first[p], around.first[p + 1]):
        b = around.body[q]
        gaps[b], step = span_clearance(
            points,
            around.x[b],
            around.y[b],
            around.cos_heading[b],
            around.sin_heading[b],
            around.begin[q],
            around.end[q],
            (around.half_length[b], around.half_width[b], around.radius[b]),
            around.discs,
            around.disc_radius,
            around.range,
            around.threshold[b],
        )
        if step >= 0:
            hit_size = max(hit_size, around.size[b])
            if step < hit_step:
                hit, hit_step = b, step
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
