"""Computation metrics on hand-made traces."""

from dataclasses import replace

import numpy as np
import pytest

from experiments.metrics import computation
from planner.interface import PlanResult, PlanStats, PlanStatus
from planner.states import CartesianState
from tests.experiments.traces import cruising, record, trace_of

WALL, CPU = computation.PlanningClock.WALL, computation.PlanningClock.CPU


def test_computation_of_planned_cycles():
    def plan(status, candidates):
        return PlanResult(status, None, None, PlanStats("", candidates, 1, {}, {}))

    plans = [
        plan(PlanStatus.OK, 100),
        plan(PlanStatus.OK, 300),
        plan(PlanStatus.FULL_STOP, 200),
        None,
    ]
    ego = CartesianState(0, 0, 0, 0, 10, 0)
    trace = trace_of(
        [record(k, ego, plan=p) for k, p in enumerate(plans)],
        elapsed=[0.0, 9.0, 9.5, 10.0],
    )
    assert computation.mean_count(trace, "candidates") == 200.0
    assert computation.fallback_cycles(trace) == 1
    # of the second cycle and the third: the first one also loads compiled loops
    for clock, expected in ((WALL, [2.0, 2.5, 3.0]), (CPU, [1.5, 2.0, 2.5])):
        percentiles = [
            computation.planning_percentile(trace, p, clock) for p in (0, 50, 100)
        ]
        assert percentiles == expected
    slow = np.ma.masked_invalid([9.9e4, 150.0, 99.0, np.nan])
    late = replace(trace, timing={**trace.timing, "planning_ms": slow})
    assert computation.deadline_misses(late) == 1
    assert computation.steps_per_second(trace) == pytest.approx(2.0)


def test_nothing_was_planned():
    trace = cruising(5)
    assert computation.mean_count(trace, "candidates") is None
    assert computation.planning_percentile(trace, 50, WALL) is None
    assert computation.deadline_misses(trace) == 0
