"""What planning costs, and how it went."""

from functools import partial
from typing import Final

from experiments.metrics import columns, computation
from experiments.metrics.computation import PlanningClock
from experiments.metrics.metric import Better, MeasuredEpisode, Metric

_PERCENTILES = {
    50: ("median", columns.PLANNING_CPU_P50, columns.PLANNING_P50),
    95: ("p95", columns.PLANNING_CPU_P95, columns.PLANNING_P95),
    99: ("p99", columns.PLANNING_CPU_P99, columns.PLANNING_P99),
    100: ("max", columns.PLANNING_CPU_MAX, columns.PLANNING_MAX),
}
_SHOWN_PERCENTILES = (50, 99)  # on the terminal and in comparisons


def _planning_times() -> tuple[Metric, ...]:
    """List the percentiles of the planning time, by CPU time and by wall clock.

    Comparisons take CPU time: wall clock depends on what else the machine does.
    """
    return tuple(
        Metric(
            column=cpu if clock is PlanningClock.CPU else wall,
            label=f"{name}, {which}",
            compute=partial(_planning_percentile, percentile=percentile, clock=clock),
            formula=f"{words}, {which}; the first cycle, which loads compiled loops, "
            "is excluded",
            unit="ms",
            digits=2,
            better=Better.LOWER,
            in_terminal=percentile in _SHOWN_PERCENTILES,
            compared=percentile in _SHOWN_PERCENTILES and clock is PlanningClock.CPU,
            timing=True,
            of_planner=True,
        )
        for clock, name, words in (
            (
                PlanningClock.CPU,
                "planning CPU time",
                "CPU time that the planning thread spends on a cycle",
            ),
            (
                PlanningClock.WALL,
                "planning time",
                "wall-clock time of a planning cycle",
            ),
        )
        for percentile, (which, cpu, wall) in _PERCENTILES.items()
    )


def _planning_percentile(
    episode: MeasuredEpisode, percentile: float, clock: PlanningClock
) -> float | None:
    """Return a percentile of the planning time [ms]."""
    return computation.planning_percentile(episode.trace, percentile, clock)


COMPUTATION: Final = (
    Metric(
        column=columns.EMERGENCY_CYCLES,
        label="emergency cycles",
        compute=lambda e: computation.emergency_cycles(e.trace),
        formula="planning cycles with the status `emergency_braking`",
        better=Better.LOWER,
        of_planner=True,
    ),
    Metric(
        column=columns.FALLBACK_CYCLES,
        label="fallback cycles",
        compute=lambda e: computation.fallback_cycles(e.trace),
        formula="planning cycles without a fresh plan",
        better=Better.LOWER,
        in_terminal=True,
        of_planner=True,
    ),
    Metric(
        column=columns.CANDIDATES_MEAN,
        label="candidates per cycle",
        compute=lambda e: computation.mean_count(e.trace, "candidates"),
        formula="mean number of candidates over planning cycles; null without cycles",
        in_terminal=True,
        of_planner=True,
    ),
    Metric(
        column=columns.FEASIBLE_MEAN,
        label="feasible candidates",
        compute=lambda e: computation.mean_count(e.trace, "survivors"),
        formula="mean number of feasible candidates over planning cycles; null without "
        "cycles, or if the planner was not asked to count them",
        in_terminal=True,
        of_planner=True,
    ),
    *_planning_times(),
    Metric(
        column=columns.DEADLINE_MISSES,
        label="deadline misses",
        compute=lambda e: computation.deadline_misses(e.trace),
        formula="planning cycles, from the second on, whose wall-clock time exceeded "
        "the step",
        better=Better.LOWER,
        timing=True,
        of_planner=True,
    ),
    Metric(
        column=columns.STEPS_PER_SECOND,
        label="loop rate",
        compute=lambda e: computation.steps_per_second(e.trace),
        formula="steps of the closed loop per second of wall clock, planner included, "
        "from the second step on",
        unit="steps/s",
        better=Better.HIGHER,
        in_terminal=True,
        timing=True,
    ),
)
