"""The hot loop: every candidate through every check and cost term, and the choice.

One compiled call does it all. It goes profile by profile, and within one by terminal
offset; what belongs to a profile is computed once. What it calls is compiled into it.
"""

from typing import NamedTuple

import numpy as np

from planner.cruise.candidate_motion import (
    L_JERK,
    LAST_L,
    S_DOT,
    UNIT_JERK,
    UNIT_L,
    L,
    Lateral,
    RoadTables,
    S,
    Tracks,
    candidate_motion,
    fill_basis,
    lateral_length,
    sample_road,
)
from planner.cruise.checks.clearance import Passing, check_clearance
from planner.cruise.checks.limits import check_profile
from planner.cruise.costs import (
    CONSISTENCY,
    DEAD_END,
    HEADING,
    HEADWAY,
    JERK,
    N_TERMS,
    OFFSET,
    SAFETY,
    SPEED,
)
from planner.cruise.feasibility import (
    CandidateLimits,
    Check,
    lateral_quintic,
    squared_jerk,
)
from planner.cruise.headway import add_headway
from planner.cruise.selection import Choice, PricingColumns, choose
from planner.cruise.workspace import Surroundings, make_bench, padded
from planner.numerics.compiled import compiled, inlined
from planner.states import FloatArray, IntArray

PASSED = int(Check.PASSED)


class Evaluation(NamedTuple):
    """Outcome of all candidates, and the one that is chosen."""

    verdict: IntArray  # the `Check` that removed each, (n_profiles, n_offsets)
    blocker: IntArray  # first body in time that each hits, or -1, in the same shape
    choice: Choice
    motion: FloatArray  # of the chosen one, as `candidate_motion`; (9, 0) without one


@compiled
def evaluate(
    tracks: Tracks,
    lateral: Lateral,
    limits: CandidateLimits,
    road: RoadTables,
    around: Surroundings,
    speed_term: FloatArray,
    pricing: PricingColumns,
) -> Evaluation:
    """Check and price all candidates, and choose one.

    Args:
        tracks: Profiles; the rows of the ground under them are filled here.
        lateral: Samples of the lateral motion.
        limits: Of the vehicle.
        road: Path, road and last plan.
        around: Bodies.
        speed_term: Price of each profile's speed, (n_profiles,).
        pricing: Weights and scales, columns of the `Pricing`.
    """
    rows, n = tracks.rows, lateral.offsets.size
    n_profiles, n_steps = rows.shape[0], rows.shape[2]
    verdict = np.empty((n_profiles, n), np.int64)
    hit_body, hit_at = np.full((n_profiles, n), -1), np.full(n, -1)
    hit_size = np.zeros((n_profiles, n))
    terms = np.zeros((n_profiles, N_TERMS, n))
    delta_l = lateral.offsets - lateral.start[0]
    wide = padded(lateral.offsets, lateral.start[0])
    bench = make_bench(n_steps, wide.size)
    for p in range(n_profiles):
        count = tracks.n_valid[p]
        passed = 0
        if tracks.dropped[p] == PASSED:
            sample_road(rows, p, count, road)
            fill_basis(bench.basis, p, count, tracks, lateral)
            passed = check_profile(
                p, count, rows, bench.basis, delta_l, limits, bench.course, verdict[p]
            )
        else:
            verdict[p] = tracks.dropped[p]
        if passed > 0:
            own = terms[p]
            _price_motion(p, count, tracks, bench.basis, delta_l, lateral, own)
            _price_end(p, count, rows, bench.basis, delta_l, bench.course, around, own)
            for o in range(n):
                own[SPEED, o] = speed_term[p]
            add_headway(p, count, rows, bench.basis, delta_l, around, own[HEADWAY])
            hit_at[:] = -1
            passing = Passing(verdict[p], hit_body[p], hit_at, hit_size[p], own[SAFETY])
            check_clearance(p, count, rows, wide, around, bench, passing)
    choice = choose(verdict, hit_size, terms, pricing)
    motion = np.empty((9, 0))
    if choice.best >= 0:
        offset = lateral.offsets[choice.best % n]
        motion = candidate_motion(choice.best // n, offset, tracks, lateral)
    return Evaluation(verdict, hit_body, choice, motion)


@inlined
def _price_motion(
    p: int,
    count: int,
    tracks: Tracks,
    basis: FloatArray,
    delta_l: FloatArray,
    lateral: Lateral,
    own: FloatArray,
) -> None:
    """Fill jerk ([Thesis] eq. 4.15), offset and consistency of one profile.

    The offset and its jerk are linear in the change of offset, their squares and the
    sums of these over time quadratic: three sums do for all candidates.
    """
    rows, step, over_time = tracks.rows, lateral.step, lateral.over_time
    l00 = l01 = l11 = d00 = d01 = j00 = j01 = j11 = 0.0
    for i in range(count):
        l, unit = basis[L, i], basis[UNIT_L, i]
        off = l - rows[p, LAST_L, i]
        jerk, unit_jerk = basis[L_JERK, i], basis[UNIT_JERK, i]
        l00 += l * l
        l01 += l * unit
        l11 += unit * unit
        d00 += off * off
        d01 += off * unit
        j00 += jerk * jerk
        j01 += jerk * unit_jerk
        j11 += unit_jerk * unit_jerk
    length = lateral_length(rows, p, tracks.duration[p], lateral)
    for o in range(delta_l.size):
        c = delta_l[o]
        own[OFFSET, o] = (l00 + c * (2.0 * l01 + c * l11)) / count
        own[CONSISTENCY, o] = (d00 + c * (2.0 * d01 + c * l11)) / count
        sideways = step * (j00 + c * (2.0 * j01 + c * j11))
        if over_time:
            quintic = lateral_quintic(lateral.start, lateral.offsets[o], length)
            sideways = squared_jerk(quintic, length)
        own[JERK, o] = sideways + tracks.jerk[p]


@inlined
def _price_end(
    p: int,
    count: int,
    rows: FloatArray,
    basis: FloatArray,
    delta_l: FloatArray,
    course: FloatArray,
    around: Surroundings,
    own: FloatArray,
) -> None:
    """Fill heading and dead end: where the plans of one profile come to.

    A dead end is the share of the room that is missing where a plan ends in front of
    what stands. The room is a stopping distance and `turn_gap`: with less, the ego
    could later neither stop nor steer round, and it has no reverse gear. Linear, so
    that creeping nearer never pays.
    """
    last = count - 1
    s, speed = rows[p, S, last], rows[p, S_DOT, last]
    l, unit = basis[L, last], basis[UNIT_L, last]
    for o in range(delta_l.size):
        own[HEADING, o] = course[1, last, o] * course[1, last, o]
        own[DEAD_END, o] = 0.0
    for b in range(around.size.size):
        beyond = around.s[b, last] - s
        if around.turn_gap[b] == 0.0 or not beyond > 0.0:
            continue
        reach = around.corridor + around.extents[b, 1] + around.extents[b, 2]
        gap = beyond - around.extents[b, 0] - around.extents[b, 2] - around.front_reach
        needed = around.turn_gap[b] + 0.5 * speed * speed / around.deceleration
        lack = 1.0 - max(gap, 0.0) / needed
        apart = around.l[b, last] - l
        for o in range(delta_l.size):
            if abs(apart - delta_l[o] * unit) <= reach:
                own[DEAD_END, o] = max(own[DEAD_END, o], lack)
