"""Comfort metrics on hand-made traces with answers in closed form."""

import math

import pytest

from experiments.metrics import comfort
from planner.interface import PlanResult, PlanStats, PlanStatus
from planner.reference_path.path import ReferencePath
from planner.reference_path.segments import arc
from planner.states import CartesianState
from tests.experiments.traces import CAR, STEP, cruising, record, trace_of


def test_constant_speed():
    trace = cruising(51)
    assert comfort.rms_jerk(trace) == 0.0
    assert comfort.max_abs_acceleration(trace) == 0.0
    assert comfort.max_heading(trace) == 0.0


def test_rms_of_a_sinusoidal_jerk():
    # a = A sin(w t): jerk A w cos(w t), RMS over whole periods A w / sqrt(2)
    amplitude, omega, n = 2.0, 2.0 * math.pi / 5.0, 501
    records = [
        record(
            k, CartesianState(k, 0, 0, 0, 10, amplitude * math.sin(omega * STEP * k))
        )
        for k in range(n)
    ]
    expected = amplitude * omega / math.sqrt(2.0)
    assert comfort.rms_jerk(trace_of(records)) == pytest.approx(expected, rel=2e-3)
    assert comfort.max_abs_acceleration(trace_of(records)) == pytest.approx(
        amplitude, rel=5e-3
    )


def test_circle_has_lateral_acceleration_but_no_jerk():
    radius, speed = 50.0, 12.0
    path = ReferencePath.from_segments([arc(150.0, 1.0 / radius)])
    records = []
    for k in range(40):
        x, y, heading = path.pose(speed * STEP * k)
        ego = CartesianState(x, y, heading, 1.0 / radius, speed, 0.0)
        records.append(record(k, ego, path=path))
    trace = trace_of(records, path=path)
    assert comfort.max_abs_lateral_acceleration(trace) == pytest.approx(2.88)
    assert comfort.max_abs_curvature(trace) == pytest.approx(0.02)
    assert comfort.max_front_wheel_angle(trace) == pytest.approx(
        math.atan(CAR.wheelbase * 0.02)
    )
    assert comfort.max_front_wheel_rate(trace) == pytest.approx(0.0, abs=1e-12)
    assert comfort.rms_jerk(trace) == pytest.approx(0.0, abs=1e-12)
    assert comfort.max_heading(trace) == pytest.approx(0.0, abs=1e-9)


def test_lateral_jerk_counts():
    # curvature grows linearly: d(kappa v²)/dt = rate * v³
    speed, rate = 10.0, 1e-3
    records = [
        record(k, CartesianState(k, 0, 0, rate * speed * STEP * k, speed, 0))
        for k in range(20)
    ]
    assert comfort.rms_jerk(trace_of(records)) == pytest.approx(rate * speed**3)


def test_cost_terms_are_averaged_over_the_plans_that_report_them():
    def plan(status, candidates, **costs):
        return PlanResult(status, None, None, PlanStats("", candidates, 1, {}, costs))

    plans = [
        plan(PlanStatus.OK, 100, jerk_integral=2.0, mean_offset_squared=0.5),
        plan(PlanStatus.OK, 300, jerk_integral=4.0, mean_offset_squared=1.5),
        plan(PlanStatus.FULL_STOP, 200),
        None,
    ]
    ego = CartesianState(0, 0, 0, 0, 10, 0)
    trace = trace_of(
        [record(k, ego, plan=p) for k, p in enumerate(plans)],
    )
    assert comfort.mean_cost(trace, comfort.JERK_COST) == 3.0
    assert comfort.mean_cost(trace, comfort.OFFSET_COST) == 1.0
    assert comfort.mean_cost(trace, "another") is None


def driven(sideways, along=None, speed=10.0):
    """A trace with these accelerations, step by step."""
    along = [0.0] * len(sideways) if along is None else along
    return trace_of(
        [
            record(k, CartesianState(k, 0, 0, a / speed**2, speed, b))
            for k, (a, b) in enumerate(zip(sideways, along, strict=True))
        ]
    )


def test_shares_of_what_is_uncomfortable():
    trace = driven([2.2, 2.3, -2.4, 0.0], [-3.5, -3.6, 4.0, 0.0])
    assert comfort.lateral_discomfort(trace) == 0.5
    assert comfort.braking_discomfort(trace) == 0.25


def test_a_jerk_is_the_mean_of_half_a_second():
    ramp = [min(4.0 * STEP * k, 2.0) for k in range(21)]  # 4 m/s³ for half a second
    spike = [0.0] * 10 + [1.0] + [0.0] * 10
    trace = driven(ramp, spike)
    assert comfort.max_lateral_jerk(trace) == pytest.approx(4.0)
    assert comfort.max_tangential_jerk(trace) == pytest.approx(1.0 / 0.5)
    assert comfort.max_lateral_jerk(driven([0.0, 9.0])) is None


def test_reversals_count_what_is_felt():
    sideways = [1.0, 0.1, -0.1, 0.5, -1.0, -0.2, -0.5, 1.0]
    minutes = (len(sideways) - 1) * STEP / 60.0
    trace = driven(sideways)
    assert comfort.lateral_reversals(trace) == pytest.approx(2 / minutes)


def test_the_front_wheel_turns_as_fast_as_the_curvature_asks():
    rate = 0.2  # [rad/s]
    bends = [math.tan(rate * STEP * k) / CAR.wheelbase for k in range(10)]
    records = [
        record(k, CartesianState(k, 0, 0, bend, 5, 0)) for k, bend in enumerate(bends)
    ]
    trace = trace_of(records)
    assert comfort.max_front_wheel_rate(trace) == pytest.approx(rate)
    assert comfort.max_front_wheel_angle(trace) == pytest.approx(9 * rate * STEP)
    assert CAR.front_wheel_angle(bends[9]) == pytest.approx(9 * rate * STEP)
    assert comfort.max_front_wheel_rate(trace_of(records[:1])) is None
