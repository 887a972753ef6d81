"""Metrics of tracking and perception on hand-made traces."""

import math
from dataclasses import replace

import pytest

from experiments.cosim.records import (
    PlanStart,
    PlanStartKind,
    TrackingReport,
)
from experiments.metrics import tracking
from planner.reference_path.frenet import cartesian_to_frenet_one
from planner.states import CartesianState
from tests.experiments.road_users import road_users
from tests.experiments.traces import STEP, STRAIGHT, cruising, record, trace_of


def report(k: int) -> TrackingReport:
    wave = math.sin(2.0 * math.pi * k / 40.0)
    return TrackingReport(
        0.2 * wave, 1.0, 0.0, 0.0, 0.0, 0.3 * k * STEP, 0.0, 0.25, 0.5
    )


def test_errors_of_a_wave():
    records = [
        replace(
            record(k, CartesianState(k, 0, 0, 0, 10, 0)),
            tracking=report(k) if k else None,
        )
        for k in range(81)
    ]
    trace = trace_of(records)
    assert tracking.max_error(trace, "lateral_error_m") == pytest.approx(0.2)
    assert tracking.rms_error(trace, "lateral_error_m") == pytest.approx(
        0.2 / math.sqrt(2.0)
    )
    assert tracking.max_error(trace, "behind_m") == 1.0
    assert tracking.limited_share(trace) == 0.25
    assert tracking.rms_command_jerk(trace) == pytest.approx(0.3)
    assert tracking.plans_anew(trace) == 0


def test_plans_begun_anew_are_counted():
    ego = CartesianState(5, 0, 0, 0, 10, 0)
    frenet = cartesian_to_frenet_one(STRAIGHT, ego, None)
    kinds = [PlanStartKind.STITCHED, PlanStartKind.ANEW, PlanStartKind.ANEW]
    records = [
        replace(
            record(k, ego),
            tracking=report(k),
            start=PlanStart(kind, ego, frenet, 0.0),
        )
        for k, kind in enumerate(kinds)
    ]
    assert tracking.plans_anew(trace_of(records)) == 2


def test_the_nearest_one_that_is_believed_in_counts():
    cars = [("far", 60.0, 0, 0, 8, 0), ("near", 20.0, 0, 0, 8, 0)]
    size = {"length": 4.0, "width": 2.0}
    beliefs = [
        road_users(("near", 20.3, 0.4, 0, 8, 0), ("far", 70.0, 0, 0, 8, 0), **size),
        road_users(("far", 61.0, 0, 0, 8, 0), **size),
    ]
    records = [
        replace(record(k, CartesianState(0, 0, 0, 0, 10, 0), cars=cars), seen=seen)
        for k, seen in enumerate(beliefs)
    ]
    trace = trace_of(records)
    assert tracking.nearest_error(trace) == pytest.approx((0.5 + 1.0) / 2)
    assert tracking.unseen_near(trace) == 0.5


def test_a_perfect_ego_has_no_errors():
    trace = cruising(5)
    assert tracking.max_error(trace, "lateral_error_m") is None
    assert tracking.limited_share(trace) is None
    assert tracking.plans_anew(trace) is None
    assert tracking.nearest_error(trace) is None
    assert tracking.unseen_near(trace) is None
