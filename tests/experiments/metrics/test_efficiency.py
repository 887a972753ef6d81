"""Efficiency metrics on hand-made traces with answers in closed form."""

from dataclasses import replace

import numpy as np
import pytest

from experiments.cosim.records import EpisodeStatus
from experiments.metrics import efficiency
from planner.reference_path.path import ReferencePath
from planner.reference_path.segments import arc
from planner.states import CartesianState
from tests.experiments.traces import STEP, cruising, record, trace_of


def test_constant_speed():
    trace = cruising(51)
    assert efficiency.travel_time(trace) == pytest.approx(5.0)
    assert efficiency.distance(trace) == pytest.approx(50.0)
    assert efficiency.mean_speed(trace) == pytest.approx(10.0)


def test_arrival_is_the_status_of_the_loop():
    assert efficiency.ARRIVED == EpisodeStatus.ARRIVED


def test_travel_time_needs_an_arrival():
    records = [record(0, CartesianState(0, 0, 0, 0, 5, 0))]
    assert efficiency.travel_time(trace_of(records, EpisodeStatus.TIMEOUT)) is None


def test_distance_on_an_arc_is_that_of_its_chords():
    radius, speed = 50.0, 12.0
    path = ReferencePath.from_segments([arc(150.0, 1.0 / radius)])
    records = []
    for k in range(40):
        x, y, heading = path.pose(speed * STEP * k)
        ego = CartesianState(x, y, heading, 1.0 / radius, speed, 0.0)
        records.append(record(k, ego, path=path))
    # chords are shorter than the arc by (v dt / r)² / 24
    distance = efficiency.distance(trace_of(records, path=path))
    assert distance == pytest.approx(39 * 1.2, rel=1e-4)


def limited(trace, *limits):
    s, limit = np.array(limits, dtype=np.float64).T
    table = {"s_m": s, "limit_mps": limit}
    return replace(trace, speed_limits=table)


def test_speeding_is_measured_at_the_front_bumper():
    trace = cruising(51)  # 10 m/s from s = 0
    assert efficiency.speeding_time(trace) is None
    assert efficiency.max_speeding(trace) is None
    reach = float(trace.fact("length_m") - trace.fact("rear_overhang_m"))
    slow = limited(trace, (0.0, 13.0), (20.0 + reach - 1e-6, 7.0), (35.0 + reach, 10.0))
    assert efficiency.speeding_time(slow) == pytest.approx(1.5, abs=0.11)
    assert efficiency.max_speeding(slow) == pytest.approx(3.0)
    assert efficiency.speeding_time(limited(trace, (0.0, 9.7))) == 0.0
    assert efficiency.max_speeding(limited(trace, (0.0, 12.0))) == 0.0
