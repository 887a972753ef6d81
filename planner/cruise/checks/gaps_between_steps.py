"""Gaps between the candidates of one profile and one body, between the steps.

Between two steps each disc moves on a segment in the body's frame. A gap changes no
faster than the disc moves: on the segment it is at least (g₀ + g₁ - way) / 2. And the
distance from a rectangle is convex: it is smaller inside the segment than at both ends
only if it falls at the start and grows at the end. Few candidates are left to which
both allow a gap that matters.
"""

import math

import numpy as np

from planner.cruise.checks.body_frame import Body, CoverDiscs
from planner.cruise.checks.gaps_at_steps import first_touch, square_apart
from planner.cruise.feasibility import Check
from planner.cruise.workspace import (
    LANES,
    MOVED,
    ROAD_U,
    ROAD_W,
    UNIT_U,
    UNIT_W,
    Bench,
    U,
    W,
)
from planner.numerics.compiled import inlined
from planner.shapes.disc_clearance import segment_to_rectangle
from planner.states import FloatArray, IntArray

PASSED = int(Check.PASSED)
FAR_BEYOND = 1 << 30  # no candidate has such a number
ROUNDING = 1.0 + 1e-9  # of a square that only decides whether to look more closely


@inlined
def sweep(
    steps: tuple[int, int],
    active: tuple[int, int],
    delta_l: FloatArray,
    body: Body,
    discs: CoverDiscs,
    cutoff_gap: float,
    verdict: IntArray,
    bench: Bench,
) -> None:
    """Find the least gaps between the steps, and the first hit of each candidate.

    Args:
        steps: First and last step.
        active: Candidates looked at: first and last + 1.
        delta_l: Terminal offsets less the present one, (n,) [m].
        body: Which body.
        discs: Of the ego.
        cutoff_gap: From this gap on the exact value does not matter [m].
        verdict: Only candidates that passed are looked at, (n,).
        bench: The gaps at the steps and nearest are given. Nearest is lowered, until a
            candidate hits; hit_step is filled: the first step with a hit, or -1.
    """
    _start(steps, active, body, cutoff_gap, verdict, bench)
    if not _flag(steps, delta_l, body, discs, bench):
        return
    limit, nearest, until = bench.limit, bench.nearest, bench.until
    gaps, flag, frames = bench.gaps, bench.flag, bench.frames
    for i in range(steps[0] + 1, steps[1] + 1):
        for o in range(active[0], active[1] if bench.flagged[i] > 0 else 0):
            lowest = gaps[i - 1, o] + gaps[i, o] - frames[MOVED, i]
            if flag[i, o] > 0 and lowest < 2.0 * limit[o] and i < until[o]:
                gap = _gap_on_the_way(
                    i, o, limit[o], delta_l[o], body, discs, bench.course, frames
                )
                nearest[o] = min(nearest[o], gap)
                limit[o] = max(min(nearest[o], cutoff_gap), body.threshold)
                if gap < body.threshold:
                    bench.hit_step[o] = i
                    until[o] = i


@inlined
def _start(
    steps: tuple[int, int],
    active: tuple[int, int],
    body: Body,
    cutoff_gap: float,
    verdict: IntArray,
    bench: Bench,
) -> None:
    """Set up to which gap, and until which step, each candidate is looked at."""
    bench.limit[:] = -math.inf
    bench.until[:] = math.inf
    for o in range(active[0], active[1]):
        bench.hit_step[o] = -1
        if verdict[o] == PASSED:
            bench.limit[o] = max(min(bench.nearest[o], cutoff_gap), body.threshold)
            if bench.nearest[o] < body.threshold:
                hit = first_touch(steps, o, bench.gaps, body.threshold)
                bench.hit_step[o] = hit
                bench.until[o] = hit


@inlined
def _flag(
    steps: tuple[int, int],
    delta_l: FloatArray,
    body: Body,
    discs: CoverDiscs,
    bench: Bench,
) -> bool:
    """Flag the candidates whose gap before a step may be smaller than at both ends.

    Args:
        steps: First and last step.
        delta_l: Terminal offsets less the present one, (n,) [m].
        body: Which body.
        discs: Of the ego.
        bench: Flag is filled: 1 for those, 0 for others in the window; and flagged, how
            many they are at each step.

    Returns:
        Whether there are any.
    """
    window, gaps, course, frames = bench.window, bench.gaps, bench.course, bench.frames
    limit, until, flag = bench.limit, bench.until, bench.flag
    number = bench.number
    half_length, half_width = body.half_length, body.half_width
    rear, middle, front = discs.three
    found = False
    for i in range(steps[0] + 1, steps[1] + 1):
        begin = np.uint64(min(window[0, i - 1], window[0, i]))
        end = np.uint64(max(window[1, i - 1], window[1, i]))
        moved, step = frames[MOVED, i], float(i)
        least, greatest = FAR_BEYOND, -1  # of the candidates in doubt
        for o in range(begin, end):
            lowest = gaps[i - 1, o] + gaps[i, o] - moved
            doubtful = (lowest < 2.0 * limit[o]) & (step < until[o])
            least = min(least, number[o] if doubtful else FAR_BEYOND)
            greatest = max(greatest, number[o] if doubtful else -1)
        bench.flagged[i] = 0
        if greatest < 0:
            continue
        begin = np.uint64(least - least % LANES)
        end = np.uint64(greatest + 1 + -(greatest + 1) % LANES)
        was, now = _frame(i - 1, frames), _frame(i, frames)
        count = 0
        for o in range(begin, end):
            a = _placed(delta_l[o], course[0, i - 1, o], course[1, i - 1, o], was)
            b = _placed(delta_l[o], course[0, i, o], course[1, i, o], now)
            far = limit[o] + body.reach
            far2 = far * far * ROUNDING
            dips = (
                _dips(a, b, rear, half_length, half_width, far2)
                | _dips(a, b, middle, half_length, half_width, far2)
                | _dips(a, b, front, half_length, half_width, far2)
            )
            flag[i, o] = 1 if dips else 0
            count += 1 if dips else 0
        for disc in discs.more:
            for o in range(begin, end):
                a = _placed(delta_l[o], course[0, i - 1, o], course[1, i - 1, o], was)
                b = _placed(delta_l[o], course[0, i, o], course[1, i, o], now)
                far = limit[o] + body.reach
                far2 = far * far * ROUNDING
                dips = _dips(a, b, disc, half_length, half_width, far2)
                count += 1 if dips and flag[i, o] == 0 else 0
                flag[i, o] = 1 if dips else flag[i, o]
        bench.flagged[i] = count
        found = found or count > 0
    return found


@inlined
def _dips(
    a: tuple[float, float, float, float],
    b: tuple[float, float, float, float],
    disc: float,
    half_length: float,
    half_width: float,
    far2: float,
) -> bool:
    """Check whether a disc comes nearer between `a` and `b` than it is there.

    Ways that pass the body's centre at more than the root of `far2` [m²] do not count.
    """
    u0, w0 = a[0] + disc * a[2], a[1] + disc * a[3]
    u1, w1 = b[0] + disc * b[2], b[1] + disc * b[3]
    du, dw = u1 - u0, w1 - w0
    out_u0 = u0 - min(max(u0, -half_length), half_length)
    out_w0 = w0 - min(max(w0, -half_width), half_width)
    out_u1 = u1 - min(max(u1, -half_length), half_length)
    out_w1 = w1 - min(max(w1, -half_width), half_width)
    falls = out_u0 * du + out_w0 * dw < 0.0
    grows = out_u1 * du + out_w1 * dw > 0.0
    cross = u0 * dw - w0 * du
    return falls & grows & (cross * cross < far2 * (du * du + dw * dw))


@inlined
def _frame(
    i: int, frames: FloatArray
) -> tuple[float, float, float, float, float, float]:
    """Frame of the body at step `i`."""
    return (
        frames[U, i],
        frames[UNIT_U, i],
        frames[W, i],
        frames[UNIT_W, i],
        frames[ROAD_U, i],
        frames[ROAD_W, i],
    )


@inlined
def _placed(
    delta_l: float,
    cos_e: float,
    sin_e: float,
    frame: tuple[float, float, float, float, float, float],
) -> tuple[float, float, float, float]:
    """Rear axle [m] and direction of one candidate in the body's frame."""
    u0, u1, w0, w1, road_u, road_w = frame
    return (
        u0 + delta_l * u1,
        w0 + delta_l * w1,
        cos_e * road_u - sin_e * road_w,
        cos_e * road_w + sin_e * road_u,
    )


@inlined
def _gap_on_the_way(
    i: int,
    o: int,
    limit: float,
    delta_l: float,
    body: Body,
    discs: CoverDiscs,
    course: FloatArray,
    frames: FloatArray,
) -> float:
    """Smallest gap between step i - 1 and step i; inf if it is `limit` or more."""
    was = course[0, i - 1, o], course[1, i - 1, o]
    now = course[0, i, o], course[1, i, o]
    u0, w0, ahead_u0, ahead_w0 = _placed(delta_l, was[0], was[1], _frame(i - 1, frames))
    u1, w1, ahead_u1, ahead_w1 = _placed(delta_l, now[0], now[1], _frame(i, frames))
    nearest = math.inf
    for k in range(3 + discs.more.size):
        disc = discs.three[k] if k < 3 else discs.more[k - 3]
        from_u, from_w = u0 + disc * ahead_u0, w0 + disc * ahead_w0
        to_u, to_w = u1 + disc * ahead_u1, w1 + disc * ahead_w1
        far = min(limit, nearest) + body.grown + abs(to_u - from_u) + abs(to_w - from_w)
        if square_apart(to_u, to_w, body.half_length, body.half_width) < far * far:
            gap = segment_to_rectangle(
                from_u, from_w, to_u, to_w, body.half_length, body.half_width
            )
            nearest = min(nearest, gap - body.grown)
    return nearest
