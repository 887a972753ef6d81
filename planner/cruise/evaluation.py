"""The hot loop: every candidate through every check and cost term.

The compiled functions take few large arrays: each array that a compiled function
holds costs two atomic reference counts, and there are hundreds of candidates.
"""

from typing import NamedTuple

import numpy as np

from planner.compiled import compiled
from planner.cruise.costs import edge_clearance
from planner.cruise.feasibility import (
    MIN_STRETCH,
    Check,
    Limits,
    lateral_at,
    lateral_quintic,
    road_excess,
    squared_jerk,
)
from planner.cruise.headway import STRIDE
from planner.cruise.motion import (
    COS,
    KAPPA,
    KAPPA_RATE,
    LAST_L,
    LEFT,
    RIGHT,
    S_DDDOT,
    S_DDOT,
    S_DOT,
    SIN,
    Lateral,
    S,
    Tracks,
    X,
    Y,
    lateral_length,
)
from planner.geometry.clearance import span_clearance
from planner.geometry.frenet import cartesian_rates
from planner.states import FloatArray, IntArray

# Plain numbers: numba compiles these in.
PASSED = int(Check.PASSED)
DOMAIN = int(Check.DOMAIN)
ROAD = int(Check.ROAD)
CURVATURE = int(Check.CURVATURE)
ACCELERATION = int(Check.ACCELERATION)
LATERAL_ACCELERATION = int(Check.LATERAL_ACCELERATION)
COLLISION = int(Check.COLLISION)
JERK, SAFETY, OFFSET, HEADWAY, CONSISTENCY, HEADING, DEAD_END = 0, 1, 2, 3, 4, 5, 6
N_TERMS = 7


class Surroundings(NamedTuple):
    """Bodies, when they can matter, and where headway would be short."""

    poses: FloatArray  # (n_bodies, 4, n_steps)
    extents: FloatArray  # (n_bodies, 3)
    s: FloatArray  # (n_bodies, n_steps)
    l: FloatArray  # (n_bodies, n_steps)
    turn_gap: FloatArray  # room to steer round what stands, else 0, (n_bodies,) [m]
    size: FloatArray  # (n_bodies,)
    moves: FloatArray  # largest change of a distance in one step, (n_bodies,) [m]
    threshold: FloatArray  # gap below which a candidate collides, (n_bodies,) [m]
    first: IntArray  # spans, see `clearance.near_spans`
    spans: IntArray
    lag_first: IntArray  # pairs, see `headway.headway_pairs`
    lag_step: IntArray
    lag_body: IntArray
    lag: FloatArray
    discs: FloatArray
    disc_radius: float
    range: float  # gap from which on a body costs nothing [m]
    front_reach: float  # rear axle to front bumper [m]
    deceleration: float  # with which the ego can stop [m/s²]
    corridor: float  # room that the ego needs on each side of its path [m]


@compiled
def _move_and_check(
    rows: FloatArray,
    p: int,
    count: int,
    c: tuple[float, float, float, float, float, float],
    length: float,
    offset: float,
    over_time: bool,  # noqa: FBT001 - a constant of the cycle
    step: float,
    limits: Limits,
    points: FloatArray,
    terms: FloatArray,
    k: int,
) -> int:
    """Fill `points` (5, n_steps) with x, y, cos, sin, l and check the limits.

    Stops at the first violation. Fills jerk (lateral part), offset, consistency and
    heading of `terms[k]`.
    """
    verdict = PASSED
    jerk = offset2 = change2 = sin_e = 0.0
    s0 = rows[p, S, 0]
    lever = max(limits.front, limits.rear)
    for i in range(count):
        s_dot, s_ddot, kappa = rows[p, S_DOT, i], rows[p, S_DDOT, i], rows[p, KAPPA, i]
        done = step * i if over_time else rows[p, S, i] - s0
        l, slope, bend, lateral_jerk = lateral_at(
            over_time, c, length, offset, done, s_dot, s_ddot, rows[p, S_DDDOT, i]
        )
        if 1.0 - kappa * l < MIN_STRETCH:
            verdict = DOMAIN
            break
        cos_e, sin_e, curvature, speed, acceleration = cartesian_rates(
            l, kappa, rows[p, KAPPA_RATE, i], s_dot, s_ddot, slope, bend
        )
        cos_r, sin_r = rows[p, COS, i], rows[p, SIN, i]
        points[0, i] = rows[p, X, i] - sin_r * l
        points[1, i] = rows[p, Y, i] + cos_r * l
        points[2, i] = cos_r * cos_e - sin_r * sin_e
        points[3, i] = sin_r * cos_e + cos_r * sin_e
        points[4, i] = l
        offset2 += l * l
        change2 += (l - rows[p, LAST_L, i]) ** 2
        jerk += lateral_jerk * lateral_jerk
        if i == 0:
            continue
        left, right = rows[p, LEFT, i], rows[p, RIGHT, i]
        # A bound that settles the road's edge for most points.
        widest = limits.half_width + lever * (abs(sin_e) + abs(kappa) * lever)
        excess = max(l + widest - left, right - l + widest)
        if excess > limits.excess:
            excess = road_excess(
                l,
                cos_e,
                sin_e,
                kappa,
                left,
                right,
                limits.front,
                limits.rear,
                limits.half_width,
            )
        verdict = _check_point(excess, curvature, speed, acceleration, limits)
        if verdict != PASSED:
            break
    terms[k, JERK] = jerk * step
    terms[k, OFFSET] = offset2 / count
    terms[k, CONSISTENCY] = change2 / count
    terms[k, HEADING] = sin_e * sin_e
    return verdict


@compiled
def _check_point(
    excess: float, curvature: float, speed: float, acceleration: float, limits: Limits
) -> int:
    """Check one point against the limits; [Thesis] eq. 4.12, 4.13 and the road."""
    if excess > limits.excess:
        return ROAD
    if abs(curvature) > limits.curvature:
        return CURVATURE
    if acceleration > limits.acceleration or acceleration < -limits.deceleration:
        return ACCELERATION
    if speed * speed * abs(curvature) > limits.lateral_acceleration:
        return LATERAL_ACCELERATION
    return PASSED


@compiled
def evaluate(
    tracks: Tracks,
    lateral: Lateral,
    limits: Limits,
    around: Surroundings,
) -> tuple[IntArray, IntArray, FloatArray, FloatArray]:
    """Check and price all candidates; candidate = profile · n_offsets + offset.

    Args:
        tracks: Profiles and the road under them.
        lateral: Samples of the lateral motion.
        limits: Of the vehicle.
        around: Bodies.

    Returns:
        (check that removed it, (n,); first body it hits or -1, (n,); radius of the
        largest body it hits, (n,) [m]; raw cost terms, (n, 7)).
    """
    n_offsets = lateral.offsets.size
    n = tracks.rows.shape[0] * n_offsets
    verdict = np.empty(n, np.int64)
    blocker = np.full(n, -1, np.int64)
    hit_size = np.zeros(n)
    terms = np.zeros((n, N_TERMS))
    points = np.empty((5, tracks.rows.shape[2]))
    for p in range(tracks.rows.shape[0]):
        duration, count = tracks.duration[p], tracks.n_valid[p]
        length = lateral_length(tracks.rows, p, duration, lateral)
        for o in range(n_offsets):
            k = p * n_offsets + o
            offset = lateral.offsets[o]
            c = lateral_quintic(lateral.start, offset, length)
            verdict[k] = _move_and_check(
                tracks.rows,
                p,
                count,
                c,
                length,
                offset,
                lateral.over_time,
                lateral.step,
                limits,
                points,
                terms,
                k,
            )
            if verdict[k] != PASSED:
                continue
            if lateral.over_time:
                terms[k, JERK] = squared_jerk(c, duration)
            terms[k, JERK] += tracks.jerk[p]
            blocker[k], hit_size[k] = _clear_and_price(p, points, around, terms, k)
            terms[k, DEAD_END] = _dead_end(
                tracks.rows[p, S, count - 1],
                points[4, count - 1],
                tracks.rows[p, S_DOT, count - 1],
                count - 1,
                around,
            )
            if blocker[k] >= 0:
                verdict[k] = COLLISION
    return verdict, blocker, hit_size, terms


@compiled
def _clear_and_price(
    p: int,
    points: FloatArray,
    around: Surroundings,
    terms: FloatArray,
    k: int,
) -> tuple[int, float]:
    """Check one candidate against the bodies; fill the safety terms.

    Returns:
        (first body that it hits, in time, or -1; radius of the largest body it hits).
    """
    hit = -1
    hit_step = points.shape[1]
    hit_size = 0.0
    safety = 0.0
    for q in range(around.first[p], around.first[p + 1]):
        b = around.spans[0, q]
        gap, step = span_clearance(
            points,
            around.poses,
            around.extents,
            b,
            around.spans[1, q],
            around.spans[2, q],
            around.discs,
            around.disc_radius,
            around.range,
            around.threshold[b],
            around.moves[b],
        )
        if step >= 0:
            gap = 0.0  # a body that is hit is priced as touched
        safety += edge_clearance(gap, around.size[b], around.range)
        if step >= 0:
            hit_size = max(hit_size, around.size[b])
            if step < hit_step:
                hit, hit_step = b, step
    terms[k, SAFETY] = safety
    headway = 0.0
    for q in range(around.lag_first[p], around.lag_first[p + 1]):
        i, b = around.lag_step[q], around.lag_body[q]
        reach = around.corridor + around.extents[b, 1] + around.extents[b, 2]
        if abs(around.l[b, i] - points[4, i]) < reach:
            headway += around.lag[q]
    terms[k, HEADWAY] = headway * STRIDE / points.shape[1]
    return hit, hit_size


@compiled
def _dead_end(
    s: float, l: float, speed: float, step: int, around: Surroundings
) -> float:
    """Share of the room that is missing where a plan ends in front of what stands.

    The room is a stopping distance and `turn_gap`: with less, the ego could later
    neither stop nor steer round, and it has no reverse gear. Linear, so that creeping
    nearer never pays.
    """
    worst = 0.0
    for b in range(around.size.size):
        if around.turn_gap[b] == 0.0:
            continue
        beyond = around.s[b, step] - s
        reach = around.corridor + around.extents[b, 1] + around.extents[b, 2]
        if beyond <= 0.0 or abs(around.l[b, step] - l) > reach:
            continue
        gap = beyond - around.extents[b, 0] - around.extents[b, 2] - around.front_reach
        needed = around.turn_gap[b] + 0.5 * speed * speed / around.deceleration
        worst = max(worst, 1.0 - max(gap, 0.0) / needed)
    return worst
