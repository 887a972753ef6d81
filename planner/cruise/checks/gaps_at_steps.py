"""Gaps between the candidates of one profile and one body, at the steps.

They are taken for several candidates at once: windows of offsets begin and end at
multiples of `LANES`, and arrays over offsets are padded to one. Indices of the inner
loops are unsigned: a negative index counts from the end, and where the compiler cannot
rule it out, it fetches the candidates one by one.
"""

import math

import numpy as np

from planner.cruise.candidate_motion import UNIT_L
from planner.cruise.checks.body_frame import Body, CoverDiscs
from planner.cruise.workspace import (
    ASKEW,
    FAR,
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
from planner.states import FloatArray


@inlined
def find_windows(
    steps: tuple[int, int],
    active: tuple[int, int],
    delta_l: FloatArray,
    body: Body,
    discs: tuple[float, float, float],
    cutoff_gap: float,
    bench: Bench,
) -> None:
    """Find the candidates that are near enough at each step for the gap to matter.

    Args:
        steps: First and last step.
        active: Candidates looked at: first and last + 1.
        delta_l: Terminal offsets less the present one, growing, (n,) [m].
        body: Which body.
        discs: Their centres ahead of the rear axle, rear first [m].
        cutoff_gap: From this gap on the exact value does not matter [m].
        bench: Frames are given, window is filled and in frames FAR: the gap that all
            others have at least, from which none can come below `cutoff_gap` on the way
            to the next step or from the one before.
    """
    basis, sway, frames, window = bench.basis, bench.sway, bench.frames, bench.window
    axle_to_corner = max(abs(discs[0]), abs(discs[2]))
    rear, front = min(discs[0], 0.0), max(discs[2], 0.0)
    first, last = steps
    begin, end = active
    for i in range(first, last + 1):
        far = cutoff_gap + 0.5 * max(frames[MOVED, i], frames[MOVED, min(i + 1, last)])
        frames[FAR, i] = far
        window[0, i], window[1, i] = bench.gaps.shape[1], 0
        # The body seen from the road's point, along and across the road.
        road_u, road_w = frames[ROAD_U, i], frames[ROAD_W, i]
        along = -(frames[U, i] * road_u + frames[W, i] * road_w)
        across = frames[U, i] * road_w - frames[W, i] * road_u
        apart = max(along - front, rear - along, 0.0)
        room = (far + body.reach) ** 2 - apart * apart
        if room > 0.0:
            reach = math.sqrt(room) + axle_to_corner * sway[ASKEW, i]
            begin, end = _offsets_within(
                delta_l,
                basis[UNIT_L, i],
                (across - reach, across + reach),
                (begin, end),
                active,
            )
            if begin < end:
                window[0, i] = begin - begin % LANES
                window[1, i] = end + -end % LANES


@inlined
def _offsets_within(
    delta_l: FloatArray,
    unit: float,
    bounds: tuple[float, float],
    before: tuple[int, int],
    active: tuple[int, int],
) -> tuple[int, int]:
    """Find the candidates whose offset differs by so much from the basis' one.

    Begins with those of the step before; all ranges are (first, last + 1).
    """
    low, high = bounds
    begin, end = before
    while begin > active[0] and delta_l[begin - 1] * unit >= low:
        begin -= 1
    while begin < active[1] and delta_l[begin] * unit < low:
        begin += 1
    while end < active[1] and delta_l[end] * unit <= high:
        end += 1
    while end > begin and delta_l[end - 1] * unit > high:
        end -= 1
    return begin, max(begin, end)


@inlined
def take_gaps(
    steps: tuple[int, int],
    delta_l: FloatArray,
    body: Body,
    discs: CoverDiscs,
    bench: Bench,
) -> None:
    """Compute the gaps at the steps and their least over time.

    Args:
        steps: First and last step.
        delta_l: Terminal offsets less the present one, growing, (n,) [m].
        body: Which body.
        discs: Of the ego.
        bench: Window is given; gaps and nearest are filled, gaps beyond the window with
            the lower bound of `find_windows`.
    """
    frames, course, gaps, nearest = (
        bench.frames,
        bench.course,
        bench.gaps,
        bench.nearest,
    )
    half_length, half_width, grown = body.half_length, body.half_width, body.grown
    rear, middle, front = discs.three
    nearest[:] = math.inf
    for i in range(steps[0], steps[1] + 1):
        u0, u1 = frames[U, i], frames[UNIT_U, i]
        w0, w1 = frames[W, i], frames[UNIT_W, i]
        road_u, road_w = frames[ROAD_U, i], frames[ROAD_W, i]
        begin, end = np.uint64(bench.window[0, i]), np.uint64(bench.window[1, i])
        far = frames[FAR, i]
        for o in range(gaps.shape[1]):
            gaps[i, o] = far
        for o in range(begin, end):
            u, w = u0 + delta_l[o] * u1, w0 + delta_l[o] * w1
            cos_e, sin_e = course[0, i, o], course[1, i, o]
            ahead_u = cos_e * road_u - sin_e * road_w
            ahead_w = cos_e * road_w + sin_e * road_u
            square = min(
                square_apart(
                    u + rear * ahead_u, w + rear * ahead_w, half_length, half_width
                ),
                square_apart(
                    u + middle * ahead_u, w + middle * ahead_w, half_length, half_width
                ),
                square_apart(
                    u + front * ahead_u, w + front * ahead_w, half_length, half_width
                ),
            )
            gaps[i, o] = math.sqrt(square) - grown
        for disc in discs.more:
            for o in range(begin, end):
                u, w = u0 + delta_l[o] * u1, w0 + delta_l[o] * w1
                cos_e, sin_e = course[0, i, o], course[1, i, o]
                u += disc * (cos_e * road_u - sin_e * road_w)
                w += disc * (cos_e * road_w + sin_e * road_u)
                square = square_apart(u, w, half_length, half_width)
                gaps[i, o] = min(gaps[i, o], math.sqrt(square) - grown)
        for o in range(begin, end):
            nearest[o] = min(nearest[o], gaps[i, o])


@inlined
def square_apart(u: float, w: float, half_length: float, half_width: float) -> float:
    """Squared distance of a point from a rectangle about the origin [m²]."""
    du = max(abs(u) - half_length, 0.0)
    dw = max(abs(w) - half_width, 0.0)
    return du * du + dw * dw


@inlined
def first_touch(
    steps: tuple[int, int], o: int, gaps: FloatArray, threshold: float
) -> int:
    """Find the first step that ends a way with a gap below `threshold`, or -1.

    The ways looked at end at the second step and later; a gap at the first step belongs
    to the first way.
    """
    i, last = steps
    while i <= last and gaps[i, o] >= threshold:
        i += 1
    touch = max(i, steps[0] + 1)
    return touch if touch <= last else -1
