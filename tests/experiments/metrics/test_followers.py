"""Follower metrics on hand-made traces."""

import math

import pytest

from experiments.metrics.followers import (
    followings,
    rear_max_deceleration,
    rear_speed_loss,
)
from planner.states import CartesianState
from tests.experiments.traces import STEP, cruising, record, trace_of


def test_follower_brakes():
    records = []
    for k in range(10):
        ego = CartesianState(10 * STEP * k, 0, 0, 0, 10, 0)
        cars = [
            ("near", ego.x - 20.0, 0.5, 0.0, 12.0 - 0.3 * k, -3.0),
            ("far", ego.x - 40.0, 0.0, 0.0, 5.0, -9.0),
            ("aside", ego.x - 10.0, 3.3, 0.0, 5.0, -9.0),
            ("ahead", ego.x + 10.0, 0.0, 0.0, 5.0, -9.0),
            ("oncoming", ego.x - 8.0, 0.0, math.pi, 5.0, -9.0),
        ]
        records.append(record(k, ego, cars=cars))
    trace = trace_of(records)
    assert [run.id for run in followings(trace)] == ["near"]
    assert rear_max_deceleration(trace) == pytest.approx(3.0)
    assert rear_speed_loss(trace) == pytest.approx(2.7)


def test_speed_loss_counts_within_one_following():
    # the second follower is slower, but itself loses nothing
    records = []
    for k in range(10):
        ego = CartesianState(10 * STEP * k, 0, 0, 0, 10, 0)
        cars = [("fast", -20.0, 0, 0, 12.0, 0.0), ("slow", -20.0, 0, 0, 4.0, 0.5)]
        records.append(record(k, ego, cars=[cars[k >= 5]]))
    trace = trace_of(records)
    assert [run.id for run in followings(trace)] == ["fast", "slow"]
    assert rear_speed_loss(trace) == 0.0
    assert rear_max_deceleration(trace) == 0.0


def test_nobody_follows():
    trace = cruising(5)
    assert rear_max_deceleration(trace) is None
    assert rear_speed_loss(trace) is None
