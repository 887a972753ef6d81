"""Gaps between all candidates of one profile and the bodies, swept from step to step.

In a body's own frame the ego's rear axle is at a + (change of offset) b, known once per
profile and body. The gaps at the steps are taken for all offsets at once; between two
steps only where they leave it open whether the gap is smaller there.
"""

import math
from typing import NamedTuple

from planner.compiled import compiled
from planner.cruise.costs import edge_clearance
from planner.cruise.feasibility import Check
from planner.cruise.motion import (
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
from planner.cruise.surroundings import (
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
from planner.geometry.clearance import segment_to_rectangle
from planner.states import FloatArray, IntArray

# Plain numbers: numba compiles these in.
PASSED = int(Check.PASSED)
COLLISION = int(Check.COLLISION)


class Span(NamedTuple):
    """Bounds over all candidates and steps of one profile."""

    widest: float  # largest distance from the reference path [m]
    stride: float  # longest way of the reference point in one step [m]
    pace: float  # longest way of a rear axle in one step [m]
    turned: float  # largest change of a heading error in one step [rad]


@compiled
def fill_sway(
    p: int,
    count: int,
    rows: FloatArray,
    basis: FloatArray,
    change: FloatArray,
    sway: FloatArray,
) -> Span:
    """Bound how the candidates of one profile move and turn against the road.

    Offsets, slopes and stretch are linear in the change of offset, and so are places:
    their extremes are at the outermost offsets. tan e = slope / stretch.

    Args:
        p: Which profile.
        count: Its valid steps.
        rows: Of the `Tracks`.
        basis: Of its lateral motion.
        change: Growing, (n,) [m].
        sway: Filled, (2, n_steps).
    """
    widest = stride = pace = most = 0.0
    low, high = change[0], change[change.size - 1]
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
        sway[ASKEW, i] = min(steepest / least, 1.0) if usable else 1.0
        sway[TURNED, i] = min(turned, math.pi) if usable else math.pi
        most = max(most, sway[TURNED, i])
    return Span(widest, stride, math.sqrt(pace), most)


@compiled
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
        rows: Of the `Tracks`.
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


class Body(NamedTuple):
    """One body, as plain numbers."""

    number: int
    half_length: float  # [m]
    half_width: float  # [m]
    size: float  # radius of its circumscribed circle [m]
    reach: float  # the same and the radius of the ego's discs [m]
    grown: float  # its own radius and that of the ego's discs [m]
    threshold: float  # gap below which it is hit [m]


@compiled
def _body(b: int, around: Surroundings) -> Body:
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


@compiled
def clear_bodies(
    p: int,
    count: int,
    rows: FloatArray,
    change: FloatArray,
    around: Surroundings,
    bench: Bench,
    verdict: IntArray,
    hits: IntArray,
    hit_size: FloatArray,
    safety: FloatArray,
) -> None:
    """Check the candidates of one profile against the bodies, and price the passing.

    Args:
        p: Which profile.
        count: Its valid steps.
        rows: Of the `Tracks`.
        change: Terminal offsets less the present one, growing, (n,) [m].
        around: Bodies.
        bench: Basis and course are given.
        verdict: COLLISION is put where a candidate that had passed hits a body, (n,).
        hits: Body that is hit first, and the step; -1 and -1 are given, (2, n).
        hit_size: Radius of the largest body hit; 0 is given, (n,) [m].
        safety: Price of the gaps, summed over bodies; 0 is given, (n,).
    """
    span = fill_sway(p, count, rows, bench.basis, change, bench.sway)
    lever = max(abs(around.discs[0]), abs(around.discs[2]))
    rear, front = min(around.discs[0], 0.0), max(around.discs[2], 0.0)
    for b in range(around.size.size):
        reach = around.size[b] + around.disc_radius + around.range
        widest = span.widest + lever + reach
        # In the frame of a body that turns, what is far away moves.
        moved = span.pace + around.stride[b] + widest * around.spin[b]
        reach += 0.5 * (moved + lever * (span.turned + around.spin[b]))
        first, last = near_steps(
            p,
            count,
            rows,
            around.poses,
            b,
            (span.widest + lever + reach, reach - rear, reach + front),
            span.stride + around.stride[b] + 1e-3,
        )
        if first > last or around.follower[b]:
            continue
        body = _body(b, around)
        fill_frames(p, first, last, rows, change, body, around.poses, lever, bench)
        take_gaps(first, last, change, body, around.discs, around.range, bench)
        _start(change.size, body, around.range, verdict, bench)
        sweep(first, last, change, body, around.discs, around.range, bench)
        for o in range(change.size):
            gap, step = bench.nearest[o], bench.hit_step[o]
            if step >= 0:
                gap = 0.0  # a body that is hit is priced as touched
                hit_size[o] = max(hit_size[o], body.size)
                if hits[0, o] < 0 or step < hits[1, o]:
                    hits[0, o] = b
                    hits[1, o] = step
            safety[o] += edge_clearance(gap, body.size, around.range)
    for o in range(change.size):
        if hits[0, o] >= 0:
            verdict[o] = COLLISION


@compiled
def fill_frames(
    p: int,
    first: int,
    last: int,
    rows: FloatArray,
    change: FloatArray,
    body: Body,
    poses: FloatArray,
    lever: float,
    bench: Bench,
) -> None:
    """Fill the frames of one body for the steps `first` ... `last`."""
    basis, sway, frames = bench.basis, bench.sway, bench.frames
    low, high = change[0], change[change.size - 1]
    b = body.number
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
            frames[MOVED, i] = math.sqrt(moved) + lever * turned


@compiled
def take_gaps(
    first: int,
    last: int,
    change: FloatArray,
    body: Body,
    discs: tuple[float, float, float],
    enough: float,
    bench: Bench,
) -> None:
    """Take the gaps at the steps, and find their least over time.

    Where a candidate is known to be too far for the gap to matter, even between steps,
    a lower bound stands for it: `enough` and half of what can be moved in a step.

    Args:
        first: First step.
        last: Last step.
        change: Terminal offsets less the present one, growing, (n,) [m].
        body: Which body.
        discs: Their centres ahead of the rear axle, rear first [m].
        enough: From this gap on the exact value does not matter [m].
        bench: Gaps, window and nearest are filled.
    """
    basis, sway, frames = bench.basis, bench.sway, bench.frames
    gaps, window, nearest = bench.gaps, bench.window, bench.nearest
    lever = max(abs(discs[0]), abs(discs[2]))
    n = change.size
    for o in range(n):
        nearest[o] = math.inf
    begin, end = 0, n
    for i in range(first, last + 1):
        far = enough + 0.5 * max(frames[MOVED, i], frames[MOVED, min(i + 1, last)])
        for o in range(n):
            gaps[i, o] = far
        # The body seen from the road's point, along and across the road.
        road_u, road_w = frames[ROAD_U, i], frames[ROAD_W, i]
        along = -(frames[U, i] * road_u + frames[W, i] * road_w)
        across = frames[U, i] * road_w - frames[W, i] * road_u
        apart = max(along - max(discs[2], 0.0), min(discs[0], 0.0) - along, 0.0)
        room = (far + body.reach) ** 2 - apart * apart
        window[0, i], window[1, i] = n, 0
        if room > 0.0:
            reach = math.sqrt(room) + lever * sway[ASKEW, i]
            begin, end = _offsets_within(
                change, basis[UNIT_L, i], across - reach, across + reach, begin, end
            )
            window[0, i], window[1, i] = begin, end
            _take_step(i, begin, end, change, body, discs, frames, bench.course, gaps)
            for o in range(begin, end):
                nearest[o] = min(nearest[o], gaps[i, o])


@compiled
def _offsets_within(
    change: FloatArray, unit: float, low: float, high: float, begin: int, end: int
) -> tuple[int, int]:
    """Find the candidates whose offset differs by low ... high from the basis' one.

    Begins with those of the step before, `begin` ... `end` - 1.
    """
    n = change.size
    while begin > 0 and change[begin - 1] * unit >= low:
        begin -= 1
    while begin < n and change[begin] * unit < low:
        begin += 1
    while end < n and change[end] * unit <= high:
        end += 1
    while end > begin and change[end - 1] * unit > high:
        end -= 1
    return begin, max(begin, end)


@compiled
def _take_step(
    i: int,
    begin: int,
    end: int,
    change: FloatArray,
    body: Body,
    discs: tuple[float, float, float],
    frames: FloatArray,
    course: FloatArray,
    gaps: FloatArray,
) -> None:
    """Take the gaps at step `i` of the candidates `begin` ... `end` - 1."""
    u0, u1, w0, w1 = frames[U, i], frames[UNIT_U, i], frames[W, i], frames[UNIT_W, i]
    road_u, road_w = frames[ROAD_U, i], frames[ROAD_W, i]
    half_length, half_width, grown = body.half_length, body.half_width, body.grown
    rear, middle, front = discs
    for o in range(begin, end):
        u, w = u0 + change[o] * u1, w0 + change[o] * w1
        cos_e, sin_e = course[0, i, o], course[1, i, o]
        ahead_u = cos_e * road_u - sin_e * road_w
        ahead_w = cos_e * road_w + sin_e * road_u
        square = min(
            _square(u + rear * ahead_u, w + rear * ahead_w, half_length, half_width),
            _square(
                u + middle * ahead_u, w + middle * ahead_w, half_length, half_width
            ),
            _square(u + front * ahead_u, w + front * ahead_w, half_length, half_width),
        )
        gaps[i, o] = math.sqrt(square) - grown


@compiled
def _square(u: float, w: float, half_length: float, half_width: float) -> float:
    """Squared distance of a point from a rectangle about the origin [m²]."""
    du = max(abs(u) - half_length, 0.0)
    dw = max(abs(w) - half_width, 0.0)
    return du * du + dw * dw


@compiled
def _start(n: int, body: Body, enough: float, verdict: IntArray, bench: Bench) -> None:
    """Say up to which gap each candidate is to be looked at between the steps."""
    for o in range(n):
        limit = max(min(bench.nearest[o], enough), body.threshold)
        bench.limit[o] = limit if verdict[o] == PASSED else -math.inf
        bench.hit_step[o] = -1


@compiled
def sweep(
    first: int,
    last: int,
    change: FloatArray,
    body: Body,
    discs: tuple[float, float, float],
    enough: float,
    bench: Bench,
) -> None:
    """Find the least gaps between the steps, and the first hit of each candidate.

    Between two steps each disc moves on a segment in the body's frame. The gap on it is
    at least (g₀ + g₁ - way) / 2: a gap changes no faster than the disc moves.

    Args:
        first: First step.
        last: Last step.
        change: Terminal offsets less the present one, (n,) [m].
        body: Which body.
        discs: Their centres ahead of the rear axle [m].
        enough: From this gap on the exact value does not matter [m].
        bench: Nearest is lowered, hit_step is filled: the first step with a hit, where
            the search ends.
    """
    gaps, window, frames, course = bench.gaps, bench.window, bench.frames, bench.course
    limit, nearest = bench.limit, bench.nearest
    for i in range(first + 1, last + 1):
        begin = min(window[0, i - 1], window[0, i])
        end = max(window[1, i - 1], window[1, i])
        moved = frames[MOVED, i]
        doubtful = 0
        for o in range(begin, end):
            lowest = gaps[i - 1, o] + gaps[i, o] - moved
            doubtful += 1 if lowest < 2.0 * limit[o] else 0
        if doubtful == 0:
            continue
        for o in range(begin, end):
            if gaps[i - 1, o] + gaps[i, o] - moved < 2.0 * limit[o]:
                gap = _gap_on_the_way(
                    i, o, limit[o], change[o], body, discs, course, frames
                )
                nearest[o] = min(nearest[o], gap)
                limit[o] = max(min(nearest[o], enough), body.threshold)
                if gap < body.threshold:
                    bench.hit_step[o] = i
                    limit[o] = -math.inf


@compiled
def _gap_on_the_way(
    i: int,
    o: int,
    limit: float,
    change: float,
    body: Body,
    discs: tuple[float, float, float],
    course: FloatArray,
    frames: FloatArray,
) -> float:
    """Smallest gap between step i - 1 and step i; inf if it is `limit` or more."""
    u0, w0, ahead_u0, ahead_w0 = _in_frame(i - 1, o, change, course, frames)
    u1, w1, ahead_u1, ahead_w1 = _in_frame(i, o, change, course, frames)
    nearest = math.inf
    for disc in discs:
        from_u, from_w = u0 + disc * ahead_u0, w0 + disc * ahead_w0
        to_u, to_w = u1 + disc * ahead_u1, w1 + disc * ahead_w1
        far = min(limit, nearest) + body.grown + abs(to_u - from_u) + abs(to_w - from_w)
        if _square(to_u, to_w, body.half_length, body.half_width) < far * far:
            gap = segment_to_rectangle(
                from_u, from_w, to_u, to_w, body.half_length, body.half_width
            )
            nearest = min(nearest, gap - body.grown)
    return nearest


@compiled
def _in_frame(
    i: int, o: int, change: float, course: FloatArray, frames: FloatArray
) -> tuple[float, float, float, float]:
    """Rear axle [m] and direction of one candidate in the body's frame."""
    cos_e, sin_e = course[0, i, o], course[1, i, o]
    road_u, road_w = frames[ROAD_U, i], frames[ROAD_W, i]
    return (
        frames[U, i] + change * frames[UNIT_U, i],
        frames[W, i] + change * frames[UNIT_W, i],
        cos_e * road_u - sin_e * road_w,
        cos_e * road_w + sin_e * road_u,
    )
