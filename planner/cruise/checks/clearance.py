"""Bodies beside the candidates of one profile: hits, and what passing costs.

The gaps at the steps are taken for many candidates at once; between two steps only
where they leave it open whether the gap is smaller there.
"""

from typing import NamedTuple

import numpy as np

from planner.cruise.checks.body_frame import (
    Body,
    CoverDiscs,
    body_of,
    fill_frames,
    fill_heading_bounds,
    near_steps,
)
from planner.cruise.checks.gaps_at_steps import find_windows, take_gaps
from planner.cruise.checks.gaps_between_steps import sweep
from planner.cruise.costs import edge_clearance
from planner.cruise.feasibility import Check
from planner.cruise.workspace import Bench, Surroundings
from planner.numerics.compiled import inlined
from planner.states import FloatArray, IntArray

# Plain numbers: numba compiles these in.
PASSED = int(Check.PASSED)
COLLISION = int(Check.COLLISION)


class Passing(NamedTuple):
    """Outcome of candidates of one profile beside bodies; arrays are (n,)."""

    verdict: IntArray  # a `Check`; those that had passed and hit get COLLISION
    hit_body: IntArray  # that is hit first; -1 is given
    hit_at: IntArray  # step of that; -1 is given
    hit_size: FloatArray  # radius of the largest body hit; 0 is given [m]
    safety: FloatArray  # price of the gaps, summed over bodies; 0 is given


@inlined
def start_passing(n: int) -> Passing:
    """Allocate the outcome of n candidates before any body is looked at."""
    return Passing(
        np.full(n, PASSED), np.full(n, -1), np.full(n, -1), np.zeros(n), np.zeros(n)
    )


@inlined
def check_clearance(
    p: int,
    count: int,
    rows: FloatArray,
    around: Surroundings,
    bench: Bench,
    passing: Passing,
) -> None:
    """Check candidates of one profile against the bodies, and price the passing.

    Args:
        p: Which profile.
        count: Its valid steps.
        rows: Of profiles and the road under them.
        around: Bodies.
        bench: Basis, changes of offset and course are given.
        passing: Changed in place; candidates that had not passed are not looked at.
    """
    verdict, delta_l = passing.verdict, bench.change
    active = _passed_range(verdict)
    outermost = delta_l[active[0]], delta_l[active[1] - 1]
    span = fill_heading_bounds(p, count, rows, bench.basis, outermost, bench.sway)
    axle_to_corner = max(abs(around.discs[0]), abs(around.discs[2]))
    rear, front = min(around.discs[0], 0.0), max(around.discs[2], 0.0)
    for b in range(around.size.size):
        if around.follower[b]:
            continue
        cutoff_gap = max(around.range, around.threshold[b])
        reach = around.size[b] + around.disc_radius + cutoff_gap
        widest = span.widest + axle_to_corner + reach
        # In the frame of a body that turns, what is far away moves.
        moved = span.pace + around.stride[b] + widest * around.spin[b]
        reach += 0.5 * (moved + axle_to_corner * (span.turned + around.spin[b]))
        steps = near_steps(
            p,
            count,
            rows,
            around.poses,
            b,
            (span.widest + axle_to_corner + reach, reach - rear, reach + front),
            span.stride + around.stride[b] + 1e-3,
        )
        if steps[0] > steps[1]:
            continue
        body = body_of(b, around)
        fill_frames(
            p, steps, rows, outermost, body, around.poses, axle_to_corner, bench
        )
        find_windows(steps, active, delta_l, body, around.discs, cutoff_gap, bench)
        discs = CoverDiscs(around.discs, around.more_discs)
        take_gaps(steps, delta_l, body, discs, bench)
        sweep(steps, active, delta_l, body, discs, cutoff_gap, verdict, bench)
        _note(active, body, around.range, bench, passing)
    for o in range(active[0], active[1]):
        if passing.hit_body[o] >= 0:
            verdict[o] = COLLISION


@inlined
def _passed_range(verdict: IntArray) -> tuple[int, int]:
    """Find the first and the last candidate that passed, (first, last + 1)."""
    begin, end = 0, verdict.size
    while begin < end and verdict[begin] != PASSED:
        begin += 1
    while end > begin and verdict[end - 1] != PASSED:
        end -= 1
    return begin, end


@inlined
def _note(
    active: tuple[int, int],
    body: Body,
    scale: float,
    bench: Bench,
    passing: Passing,
) -> None:
    """Note which candidates hit a body, and add what passing it costs."""
    nearest, hit_step = bench.nearest, bench.hit_step
    for o in range(active[0], active[1]):
        gap, step = nearest[o], hit_step[o]
        if step >= 0:
            gap = 0.0  # a body that is hit is priced as touched
            passing.hit_size[o] = max(passing.hit_size[o], body.size)
            if passing.hit_body[o] < 0 or step < passing.hit_at[o]:
                passing.hit_body[o] = body.number
                passing.hit_at[o] = step
        passing.safety[o] += edge_clearance(gap, body.size, scale)
