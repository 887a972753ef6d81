"""The hot loop: every candidate through every check and cost term, and the choice.

One compiled call does it all. It goes profile by profile, and within one by terminal
offset; what belongs to a profile is computed once. What it calls is compiled into it.

Unless everything is to be counted, it is an exact branch and bound. No term is
negative, so that the terms known so far bound the cost from below: profiles come in the
order of what they cost at any offset, and what costs more than the cheapest candidate
that passed so far is not looked at any further; what hits a body is, for the blocker,
until the cheapest candidate that hits is known. What costs as much is looked at, too:
of candidates that cost the same, the first one is chosen, as without the bounds.
"""

from typing import NamedTuple

import numpy as np

from planner.cruise.candidate_motion import (
    L_JERK,
    LAST_L,
    N_BASIS,
    N_ROWS,
    UNIT_JERK,
    UNIT_L,
    L,
    Lateral,
    Tracks,
    candidate_motion,
    copy_profile,
    fill_basis,
    lateral_length,
    sample_last_plan,
    sample_road,
)
from planner.cruise.checks.clearance import Passing, check_clearance, start_passing
from planner.cruise.checks.limits import check_profile
from planner.cruise.checks.safety_bound import Priced, bound_safety
from planner.cruise.costs import (
    CONSISTENCY,
    HEADWAY,
    JERK,
    LANE,
    N_TERMS,
    OFFSET,
    SAFETY,
    SPEED,
)
from planner.cruise.end_prices import onward_of, price_end
from planner.cruise.feasibility import (
    Check,
    lateral_quintic,
    squared_jerk,
)
from planner.cruise.headway import add_headway
from planner.cruise.selection import (
    UNJUDGED,
    Choice,
    PricingColumns,
    choose,
    fixed_factors,
    total_of,
)
from planner.cruise.workspace import (
    CycleTables,
    fill_padded,
    make_bench,
    padded_size,
)
from planner.numerics.compiled import compiled, inlined
from planner.states import FloatArray, IntArray

PASSED = int(Check.PASSED)
COLLISION = int(Check.COLLISION)
JERKY = int(Check.JERK)
SLACK = 1e-6  # of a profile's bound: sums of squares may round below zero [-]


class Evaluation(NamedTuple):
    """Outcome of the candidates, and the one that is chosen."""

    verdict: IntArray  # the `Check` that removed each, (n_profiles, n_offsets), or
    # UNJUDGED where that makes no difference to the choice
    blocker: IntArray  # first body in time that each hits, or -1, in the same shape
    choice: Choice
    motion: FloatArray  # of the chosen one, as `candidate_motion`; (9, 0) without one


@compiled
def evaluate(
    cycle: CycleTables,
    pricing: PricingColumns,
    exhaustive: bool,  # noqa: FBT001 - compiled
) -> Evaluation:
    """Check and price the candidates, and choose one.

    Args:
        cycle: Samples, limits, road and bodies.
        pricing: Weights and scales, columns of the `Pricing`.
        exhaustive: Judge also those that cannot be the cheapest; must hold unless the
            pricing is separable.
    """
    tracks, lateral, limits, road, around, speed_term, _ = cycle
    n, n_steps = lateral.offsets.size, tracks.rows.shape[2]
    table = _make_table(speed_term.size, n)
    work = Workplace(
        np.empty((1, N_ROWS, n_steps)),
        np.empty((N_BASIS, n_steps)),
        lateral.offsets - lateral.start[0],
        np.empty(n, np.int64),
    )
    bench = make_bench(work.basis, padded_size(n))
    factor = fixed_factors(pricing)
    bound = _profile_bounds(tracks, speed_term, factor, exhaustive)
    least = Least(np.inf, np.inf)
    for p in _in_order(bound):
        if bound[p] > least.passed:
            break
        if tracks.dropped[p] != PASSED or tracks.peak_jerk[p] > limits.jerk:
            reason = tracks.dropped[p] if tracks.dropped[p] != PASSED else JERKY
            table.verdict[p] = reason
            continue
        priced = Priced(table.terms[p], np.zeros(n, np.bool_))
        chosen = work.members[: _price(p, cycle, work, priced, factor, least)]
        if chosen.size == 0:
            continue
        if padded_size(chosen.size) != bench.number.size:
            bench = make_bench(work.basis, padded_size(chosen.size))
        fill_padded(work.delta_l, chosen, bench.change)
        passing, count = start_passing(chosen.size), tracks.n_valid[p]
        if check_profile(0, count, work.rows, limits, bench, passing.verdict) > 0:
            check_clearance(0, count, work.rows, around, bench, passing)
        _note(p, chosen, passing, table)
        if not exhaustive:
            least = _lower(least, priced.own, factor, chosen, table.verdict[p])
    choice = choose(table.verdict, table.hit_size, table.terms, pricing)
    motion = np.empty((9, 0))
    if choice.best >= 0:
        offset = lateral.offsets[choice.best % n]
        motion = candidate_motion(choice.best // n, offset, tracks, lateral, road)
    return Evaluation(table.verdict, table.hit_body, choice, motion)


class Workplace(NamedTuple):
    """Arrays for the profile at hand; its rows stand under the number 0."""

    rows: FloatArray  # profile and road, (1, 15, n_steps)
    basis: FloatArray  # lateral basis, (8, n_steps)
    delta_l: FloatArray  # terminal offsets less the present one, (n_offsets,) [m]
    members: IntArray  # numbers of the candidates to be judged, (n_offsets,)


class Least(NamedTuple):
    """Costs that a candidate must not exceed to matter; inf if all are to be judged."""

    passed: float  # of the cheapest that passed
    judged: float  # of the cheapest that passed or only collides


class CandidateTable(NamedTuple):
    """What is found about all candidates; arrays are (n_profiles, n_offsets)."""

    verdict: IntArray
    hit_body: IntArray
    hit_size: FloatArray
    terms: FloatArray  # (n_profiles, 9, n_offsets)


@inlined
def _make_table(n_profiles: int, n: int) -> CandidateTable:
    """Allocate the table before anything is known."""
    shape = n_profiles, n
    return CandidateTable(
        np.full(shape, UNJUDGED),
        np.full(shape, -1),
        np.zeros(shape),
        np.zeros((n_profiles, N_TERMS, n)),
    )


@inlined
def _note(p: int, chosen: IntArray, passing: Passing, table: CandidateTable) -> None:
    """Note what was found about some candidates of profile `p`."""
    for i in range(chosen.size):
        o = chosen[i]
        table.verdict[p, o], table.hit_body[p, o] = (
            passing.verdict[i],
            passing.hit_body[i],
        )
        table.hit_size[p, o] = passing.hit_size[i]
        table.terms[p, SAFETY, o] = passing.safety[i]


@inlined
def _lower(
    least: Least,
    own: FloatArray,
    factor: FloatArray,
    chosen: IntArray,
    verdict: IntArray,
) -> Least:
    """Return the least costs after some candidates of a profile were judged."""
    passed, judged = least
    for o in chosen:
        if verdict[o] == PASSED:
            passed = min(passed, total_of(own, factor, o))
        if verdict[o] in (PASSED, COLLISION):
            judged = min(judged, total_of(own, factor, o))
    return Least(passed, judged)


@inlined
def _profile_bounds(
    tracks: Tracks,
    speed_term: FloatArray,
    factor: FloatArray,
    exhaustive: bool,  # noqa: FBT001 - compiled
) -> FloatArray:
    """Bound what each profile costs at any offset, (n_profiles,); -inf if exhaustive.

    Its own jerk and speed; a little less, as the sideways jerk and offsets are sums
    that may round below zero.
    """
    bound = np.full(speed_term.size, -np.inf)
    if not exhaustive:
        for p in range(bound.size):
            own = factor[JERK] * tracks.jerk[p] + factor[SPEED] * speed_term[p]
            bound[p] = own - SLACK * (1.0 + own)
    return bound


@inlined
def _in_order(bound: FloatArray) -> IntArray:
    """Sort by growing bound; equal ones stay in order. numpy's takes 2 s to compile."""
    order = np.arange(bound.size)
    for i in range(1, order.size):
        p, j = order[i], i - 1
        while j >= 0 and bound[order[j]] > bound[p]:
            order[j + 1] = order[j]
            j -= 1
        order[j + 1] = p
    return order


@inlined
def _gather(priced: Priced, factor: FloatArray, least: Least, members: IntArray) -> int:
    """List the offsets of one profile that may matter by the terms so far."""
    count = 0
    for o in range(members.size):
        most = least.judged if priced.touched[o] else least.passed
        if not total_of(priced.own, factor, o) > most:
            members[count] = o
            count += 1
    return count


@inlined
def _price(
    p: int,
    cycle: CycleTables,
    work: Workplace,
    priced: Priced,
    factor: FloatArray,
    least: Least,
) -> int:
    """Price the candidates of one profile but for passing bodies, cheap terms first.

    Args:
        p: Which profile.
        cycle: Tables of the cycle.
        work: Rows, basis and members are filled.
        priced: Filled; the safety is a lower bound, 0 while nothing has passed.
        factor: Weights over scales, (9,).
        least: Costs not to be exceeded.

    Returns:
        How many candidates are to be judged.
    """
    rows, basis, delta_l, members = work
    count = cycle.tracks.n_valid[p]
    copy_profile(cycle.tracks, p, rows)
    _price_before_road(p, cycle, rows, basis, delta_l, priced.own)
    worth = members[: _gather(priced, factor, least, members)]
    if worth.size == 0:
        return 0
    sample_road(rows, 0, count, cycle.road)
    onward = onward_of(p, rows, cycle.tracks, cycle.lateral)
    price_end(count, rows, basis, delta_l, onward, cycle, priced.own)
    if least.passed < np.inf:
        bound_safety(count, rows, basis, delta_l, worth, cycle.around, priced)
    return _gather(priced, factor, least, members)


@inlined
def _price_before_road(
    p: int,
    cycle: CycleTables,
    rows: FloatArray,
    basis: FloatArray,
    delta_l: FloatArray,
    own: FloatArray,
) -> None:
    """Fill the lateral basis of a profile, and the terms that need no road under it."""
    tracks, lateral = cycle.tracks, cycle.lateral
    count = tracks.n_valid[p]
    sample_last_plan(rows, 0, count, cycle.road)
    fill_basis(basis, p, count, tracks, lateral)
    _price_motion(p, count, tracks, basis, delta_l, rows[0, LAST_L], lateral, own)
    for o in range(delta_l.size):
        own[SPEED, o] = cycle.speed_term[p]
        own[LANE, o] = cycle.lane_term[o]
    add_headway(0, count, rows, basis, delta_l, cycle.around, own[HEADWAY])


@inlined
def _price_motion(
    p: int,
    count: int,
    tracks: Tracks,
    basis: FloatArray,
    delta_l: FloatArray,
    last_l: FloatArray,
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
        off = l - last_l[i]
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
