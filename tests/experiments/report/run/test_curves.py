"""The curves of a run page are those of the metrics."""

import math

import numpy as np
import pytest

from experiments.metrics.comfort import rms_jerk
from experiments.metrics.safety import min_time_to_collision
from experiments.report.run.curves import (
    TimeCurve,
    TimeSeries,
    curves,
    jerk,
    time_to_collision,
)
from planner.states import CartesianState
from tests.experiments.report.run_folders import driven_trace
from tests.experiments.traces import record, trace_of


def test_every_curve_has_a_unit_and_a_value_a_step():
    trace = driven_trace(30)
    found = curves(trace)
    assert [curve.title for curve in found] == [
        "speed",
        "acceleration",
        "jerk",
        "lateral offset",
        "curvature",
        "front wheel",
        "clearance",
        "time to collision",
        "planning time",
    ]
    for curve in found:
        assert curve.unit
        for series in curve.series:
            assert series.values.shape == (30,)


def test_least_time_to_collision_is_that_of_the_metrics():
    def car(k):
        return [("slow", 40.0 + 0.2 * k, 0, 0, 2, 0), ("beside", 40.0, 3.5, 0, 0, 0)]

    records = [
        record(k, CartesianState(k, 0, 0, 0, 10, 0), cars=car(k)) for k in range(20)
    ]
    trace = trace_of(records)
    series = time_to_collision(trace)
    assert np.nanmin(series) == pytest.approx(min_time_to_collision(trace))
    gap = 40.0 - (4.8 / 2 - 1.0) - 4.8 / 2 - 2.0  # rear axle, half a body, half a car
    assert series[0] == pytest.approx(gap / 8.0)


def test_jerk_is_that_of_the_metrics():
    accelerations = [0.0, 1.0, -1.0, 0.5]
    records = [
        record(k, CartesianState(k, 0, 0, 0.01 * k, 10, a))
        for k, a in enumerate(accelerations)
    ]
    trace = trace_of(records)
    along, lateral = jerk(trace)
    np.testing.assert_allclose(along[:3], [10.0, -20.0, 15.0])
    np.testing.assert_allclose(lateral[:3], 10.0)
    assert np.isnan(along[3])
    assert rms_jerk(trace) == pytest.approx(
        np.sqrt(np.nanmean(along**2) + np.nanmean(lateral**2))
    )


def test_a_run_of_one_step_has_curves():
    for curve in curves(driven_trace(1)):
        assert curve.words(np.array([0.0]))


def test_words_say_what_the_chart_shows():
    values = np.array([1.0, np.nan, 3.0, 2.0])
    time = np.array([0.0, 0.1, 0.2, 0.3])
    words = TimeCurve("speed", "m/s", 1, (TimeSeries("v", values),)).words(time)
    assert words == "least 1.0 m/s at 0.0 s, largest 3.0 m/s at 0.2 s, mean 2.0 m/s"
    nothing = TimeCurve("speed", "m/s", 1, (TimeSeries("v", values * np.nan),))
    assert nothing.words(time) == "no value in this run"


def test_one_cycle_that_compiles_does_not_flatten_the_others():
    trace = driven_trace(200)
    planning = np.full(200, 2.0)
    planning[0], planning[7] = 46_000.0, 150.0
    slow = {**trace.timing, "planning_ms": planning}
    object.__setattr__(trace, "timing", slow)
    curve = curves(trace)[-1]
    assert curve.high < 10.0
    assert curve.note == "deadline misses: 1"


def test_one_hard_stop_does_not_flatten_the_jerk():
    def ego(k):
        a = 0.02 * math.sin(k) if k < 150 else (-4.5 if k == 150 else 0.0)
        return CartesianState(k, 0, 0, 0, 10, a)

    curve = curves(trace_of([record(k, ego(k)) for k in range(300)]))[2]
    assert curve.title == "jerk"
    assert np.nanmin(curve.series[0].values) == pytest.approx(-45.0, abs=0.3)
    assert curve.high is not None
    assert curve.low == -curve.high
    assert 0.2 < curve.high < 1.0  # 0.2 m/s³ is the largest of all others
    calm = curves(trace_of([record(k, ego(k)) for k in range(100)]))[2]
    assert (calm.low, calm.high) == (None, None)
