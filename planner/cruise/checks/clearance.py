"""Bodies beside the candidates of one profile: who is hit, and what passing costs.

The gaps at the steps are taken for many candidates at once; between two steps only
where they leave it open whether the gap is smaller there.
"""

from planner.cruise.checks.body_frame import (
    Body,
    body_of,
    fill_frames,
    fill_sway,
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


@inlined
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
        verdict: COLLISION is put where a candidate that had passed hits a body, (n,);
            those that had not are not looked at.
        hits: Body that is hit first, and the step; -1 and -1 are given, (2, n).
        hit_size: Radius of the largest body hit; 0 is given, (n,) [m].
        safety: Price of the gaps, summed over bodies; 0 is given, (n,).
    """
    among = _passed_range(verdict)
    outermost = change[among[0]], change[among[1] - 1]
    span = fill_sway(p, count, rows, bench.basis, outermost, bench.sway)
    lever = max(abs(around.discs[0]), abs(around.discs[2]))
    rear, front = min(around.discs[0], 0.0), max(around.discs[2], 0.0)
    for b in range(around.size.size):
        if around.follower[b]:
            continue
        enough = max(around.range, around.threshold[b])
        reach = around.size[b] + around.disc_radius + enough
        widest = span.widest + lever + reach
        # In the frame of a body that turns, what is far away moves.
        moved = span.pace + around.stride[b] + widest * around.spin[b]
        reach += 0.5 * (moved + lever * (span.turned + around.spin[b]))
        steps = near_steps(
            p,
            count,
            rows,
            around.poses,
            b,
            (span.widest + lever + reach, reach - rear, reach + front),
            span.stride + around.stride[b] + 1e-3,
        )
        if steps[0] > steps[1]:
            continue
        body = body_of(b, around)
        fill_frames(
            p, steps[0], steps[1], rows, outermost, body, around.poses, lever, bench
        )
        find_windows(steps, among, change, body, around.discs, enough, bench)
        take_gaps(steps, change, body, around.discs, bench)
        sweep(steps, among, change, body, around.discs, enough, verdict, bench)
        _note(among, body, around.range, bench, hits, hit_size, safety)
    for o in range(among[0], among[1]):
        if hits[0, o] >= 0:
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
    among: tuple[int, int],
    body: Body,
    scale: float,
    bench: Bench,
    hits: IntArray,
    hit_size: FloatArray,
    safety: FloatArray,
) -> None:
    """Note who hits a body, and add what passing it costs; see `clear_bodies`."""
    nearest, hit_step = bench.nearest, bench.hit_step
    for o in range(among[0], among[1]):
        gap, step = nearest[o], hit_step[o]
        if step >= 0:
            gap = 0.0  # a body that is hit is priced as touched
            hit_size[o] = max(hit_size[o], body.size)
            if hits[0, o] < 0 or step < hits[1, o]:
                hits[0, o] = body.number
                hits[1, o] = step
        safety[o] += edge_clearance(gap, body.size, scale)
