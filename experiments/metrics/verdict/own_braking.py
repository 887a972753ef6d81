"""Why the ego brakes hard where no body is in its way: a line, a bend, or nothing."""

import json
from typing import Final

import numpy as np

from experiments.metrics.verdict.records import Fault
from experiments.trace.schema import Trace

GENTLE: Final = 2.5  # braking that a line or bend asks for in time [m/s²]
SIDEWAYS: Final = 3.0  # lateral acceleration that a bend may ask for [m/s²]
ROUNDING: Final = 0.05  # [m/s²]


def own_braking(trace: Trace, first: int, last: int) -> tuple[Fault, str]:
    """Judge a hard braking for which there is no body in the way.

    A line that closed too near to be stopped at gently is nobody's fault; for one that
    was closed in time, for a bend and for nothing it is the ego's own.

    Args:
        trace: Of the episode.
        first: Row in which the braking begins.
        last: Row in which it ends.

    Returns:
        Whose fault it is, and why.
    """
    line = _line_that_closed(trace, first, last)
    if line is not None:
        needed, why = line
        if needed > GENTLE + ROUNDING:
            return Fault.UNAVOIDABLE, f"brakes for a line that closed before it{why}"
        return Fault.EGO, f"brakes late for a closed line{why}"
    blocker = trace.steps["blocker"][first]
    if blocker is not np.ma.masked and blocker:
        return Fault.EGO, f"brakes for {blocker}, which is not in its way"
    if _bend(trace, first):
        return Fault.EGO, "brakes late for a bend"
    return Fault.EGO, "brakes for nothing that is in its way"


def _line_that_closed(trace: Trace, first: int, last: int) -> tuple[float, str] | None:
    """Find the closed line for which the ego brakes.

    Returns:
        What it asked for when it closed [m/s²], and for whom the ego waits there; None
        without a line ahead.
    """
    steps = trace.steps
    reach = trace.fact("length_m") - trace.fact("rear_overhang_m")
    for row in range(first, last + 1):
        front = float(np.ma.filled(steps["s_m"][row], np.nan)) + reach
        speed = float(steps["speed_mps"][row])
        ahead = [x for x in json.loads(steps["stop_lines"][row]) if x > front]
        near = [x for x in ahead if x - front < speed**2 / (2.0 * GENTLE) + speed]
        if near:
            line = min(near)
            break
    else:
        return None
    since = row
    while since > 0 and _is_closed(trace, since - 1, line):
        since -= 1
    front = float(np.ma.filled(steps["s_m"][since], np.nan)) + reach
    needed = float(steps["speed_mps"][since]) ** 2 / (2.0 * max(line - front, 0.1))
    who = steps["gives_way_to"][row]
    return needed, "" if who is np.ma.masked or not who else f", for {who}"


def _is_closed(trace: Trace, row: int, line: float) -> bool:
    """Check whether a line was closed in a row."""
    lines = json.loads(trace.steps["stop_lines"][row])
    return any(abs(x - line) < 1.0 for x in lines)


def _bend(trace: Trace, row: int) -> bool:
    """Check whether a bend ahead asks for less than the ego's speed."""
    road, steps = trace.road, trace.steps
    s, speed = np.ma.filled(steps["s_m"][row], np.nan), float(steps["speed_mps"][row])
    ahead = np.asarray(road["s_m"]) - float(s)
    near = (ahead > 0.0) & (ahead < speed**2 / (2.0 * GENTLE) + speed)
    curvature = np.abs(np.ma.filled(road["curvature_1pm"], 0.0))[near]
    return bool((speed**2 * curvature > SIDEWAYS).any())
