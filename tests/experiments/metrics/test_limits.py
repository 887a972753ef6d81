"""Driven motion against the limits of the vehicle."""

import pytest

from experiments.metrics.limits import steps_over_limits
from experiments.metrics.row import metric_row
from planner.states import CartesianState
from planner.vehicle import VehicleLimits
from tests.experiments.traces import cruising, record, trace_of

LIMITS = VehicleLimits(20.0, 3.0, 4.5, 8.0, 4.0, 0.2)


@pytest.mark.parametrize(
    ("curvature", "speed", "acceleration", "over"),
    [
        (0.0, 20.1, 0.0, 0),  # within 1 %
        (0.0, 20.3, 0.0, 1),
        (0.0, 10.0, 3.02, 0),
        (0.0, 10.0, 3.04, 1),
        (0.0, 10.0, -8.0, 0),  # emergency braking is allowed
        (0.0, 10.0, -8.1, 1),
        (0.04, 10.0, 0.0, 0),  # 4 m/s² to the left
        (-0.05, 10.0, 0.0, 1),
        (-0.21, 1.0, 0.0, 1),
        (0.21, 5.0, 4.0, 1),  # three limits at once: one step
    ],
)
def test_each_limit(curvature, speed, acceleration, over):
    states = [
        CartesianState(k, 0.0, 0.0, bend, speed, wished)
        for k, (bend, wished) in enumerate([(curvature, acceleration), (0.0, 0.0)])
    ]
    trace = trace_of([record(k, state) for k, state in enumerate(states)])
    always = 0 if speed <= 20.2 else 1  # the second step is as fast
    assert steps_over_limits(trace, LIMITS) == over + always


def test_nothing_to_say_without_limits_or_steps():
    assert steps_over_limits(cruising(5), None) is None
    assert steps_over_limits(trace_of([]), LIMITS) is None
    assert metric_row(cruising(5))["over_limits_steps"] is None
    assert metric_row(cruising(5, 25.0), limits=LIMITS)["over_limits_steps"] == 5
