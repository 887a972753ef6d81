"""Computation: planning time, deadlines, fallbacks, numbers of candidates."""

from enum import StrEnum

import numpy as np

from experiments.trace.schema import Trace
from planner.interface import PlanStatus
from planner.states import FloatArray

TO_MS = 1e3  # from seconds


class PlanningClock(StrEnum):
    """Column of the timing table: what the time of a planning cycle is measured by.

    Wall clock decides whether a deadline is met, but grows with the load of the
    machine; the CPU time of the planning thread can be compared between runs.
    """

    WALL = "planning_ms"
    CPU = "planning_cpu_ms"


def fallback_cycles(trace: Trace) -> int:
    """Count the planning cycles without a fresh plan."""
    statuses = np.ma.compressed(trace.steps["plan_status"])
    return sum(1 for status in statuses if status != PlanStatus.OK)


def emergency_cycles(trace: Trace) -> int:
    """Count the planning cycles that brake in an emergency."""
    statuses = np.ma.compressed(trace.steps["plan_status"])
    return sum(1 for status in statuses if status == PlanStatus.EMERGENCY_BRAKING)


def mean_count(trace: Trace, name: str) -> float | None:
    """Average `candidates` or `survivors` over the planning cycles [-].

    None if nothing was planned.
    """
    counts = np.ma.compressed(trace.steps[name])
    return float(counts.mean()) if counts.size else None


def planning_percentile(
    trace: Trace, percentile: float, clock: PlanningClock
) -> float | None:
    """Return a percentile of the time of a planning cycle [ms].

    The first cycle is excluded. None with fewer than two cycles.
    """
    times = _planning_times(trace, clock)
    return float(np.percentile(times, percentile)) if times.size else None


def deadline_misses(trace: Trace) -> int:
    """Count the planning cycles whose wall-clock time exceeded the step."""
    deadline = TO_MS * float(trace.fact("step_s"))
    return int(np.count_nonzero(_planning_times(trace, PlanningClock.WALL) > deadline))


def _planning_times(trace: Trace, clock: PlanningClock) -> FloatArray:
    """Return the times of the cycles from the second on, (n,) [ms].

    The first cycle loads or compiles the planner's loops: process start-up, not
    planning.
    """
    return np.asarray(np.ma.compressed(trace.timing[clock])[1:])


def steps_per_second(trace: Trace) -> float | None:
    """Return the closed-loop steps per second of wall clock, planner included [1/s].

    Counted from the second step on, because the first one compiles. None with fewer
    than three steps.
    """
    elapsed = trace.timing["elapsed_s"][1:]
    lasted = float(elapsed[-1] - elapsed[0]) if len(elapsed) > 1 else 0.0
    return (len(elapsed) - 1) / lasted if lasted > 0.0 else None
