"""Computation: what planning cost, and how it went."""

from collections.abc import Sequence

import numpy as np

from experiments.trace.schema import Trace
from planner.interface import PlanStatus
from planner.states import FloatArray

TO_MS = 1e3  # from seconds


def fallback_cycles(trace: Trace) -> int:
    """Number of planning cycles that ended in anything but a fresh plan."""
    statuses = np.ma.compressed(trace.steps["plan_status"])
    return sum(1 for status in statuses if status != PlanStatus.OK)


def mean_count(trace: Trace, name: str) -> float | None:
    """Mean over the planning cycles of `candidates` or `survivors` [-].

    None if nothing was planned.
    """
    counts = np.ma.compressed(trace.steps[name])
    return float(counts.mean()) if counts.size else None


def planning_percentiles(
    trace: Trace, percentiles: Sequence[float]
) -> list[float | None]:
    """Percentiles of the wall-clock time of one planning cycle [ms].

    None each if fewer than two cycles were planned.
    """
    times = _planning_times(trace)
    if not times.size:
        return [None] * len(percentiles)
    return [float(value) for value in np.percentile(times, percentiles)]


def deadline_misses(trace: Trace) -> int:
    """Planning cycles that took longer, by the wall clock, than a step lasts."""
    deadline = TO_MS * float(trace.fact("step_s"))
    return int(np.count_nonzero(_planning_times(trace) > deadline))


def _planning_times(trace: Trace) -> FloatArray:
    """Wall clock of the cycles from the second one on, (n,) [ms].

    The first one loads the planner's compiled loops, or compiles them, which is the
    start of a process and not planning.
    """
    return np.asarray(np.ma.compressed(trace.timing["planning_ms"])[1:])


def steps_per_second(trace: Trace) -> float | None:
    """Steps of the closed loop in a second of wall clock, planner included [1/s].

    Counted from the second step on, because the first one compiles. None if there
    are fewer than three.
    """
    elapsed = trace.timing["elapsed_s"][1:]
    lasted = float(elapsed[-1] - elapsed[0]) if len(elapsed) > 1 else 0.0
    return (len(elapsed) - 1) / lasted if lasted > 0.0 else None
