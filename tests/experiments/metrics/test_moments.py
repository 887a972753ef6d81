"""A metric has at its moment the value that it reports."""

from dataclasses import replace

import numpy as np
import pytest

from experiments.cosim.records import PlanStart, PlanStartKind
from experiments.metrics import columns
from experiments.metrics.comfort import JERK_COST, OFFSET_COST
from experiments.metrics.metric import MeasuredEpisode
from experiments.metrics.moments import moments, moments_beside_the_trace
from experiments.metrics.row import metric_row
from experiments.trace.recording import vehicle_table
from planner.interface import PlanStats, PlanStatus
from planner.reference_path.frenet import cartesian_to_frenet_one
from planner.states import CartesianState
from planner.vehicle import VehicleLimits
from tests.experiments.metrics.test_exposure import FRONT, drive, ego_at
from tests.experiments.metrics.test_right_of_way import LINE, SPEED, braking_foe
from tests.experiments.metrics.test_right_of_way import drive as drive_junction
from tests.experiments.metrics.test_tracking import report
from tests.experiments.report.run_folders import plan_from
from tests.experiments.traces import CAR, STEP, STRAIGHT, record, trace_of, traffic


def test_conflicts_along_the_road():
    # 5 m/s closing from 40 m on, until step 60; then the car leads as fast as the ego
    def slower(k):
        return (40.0 + FRONT + 2.0 + 0.5 * min(k, 60) + max(k - 60, 0), 0, 0, 5.0)

    trace = drive(80, slower)
    row, found = metric_row(trace), moments(trace)
    gap = 40.0 - 0.5 * np.arange(80)
    gap[60:] = 10.0
    drac = 5.0**2 / (2.0 * gap)
    assert row[columns.MAX_DRAC] == pytest.approx(drac.max())
    assert found[columns.MAX_DRAC] == int(drac.argmax())
    assert found[columns.TIME_EXPOSED_TTC] == int(np.argmax(gap / 5.0 < 3.0))
    later = found[columns.MIN_PET]  # the follower's visit: where it is then, it was
    assert later >= row[columns.MIN_PET] / STEP


def test_rules_at_a_junction():
    crossing = int(np.ceil((LINE + 0.35 - CAR.front_reach) / (SPEED * STEP)))
    found = moments(drive_junction(lines=lambda _: [LINE]))
    assert found[columns.LINE_VIOLATIONS] == crossing
    trace = braking_foe(-2.5)
    over = np.flatnonzero(
        SPEED * STEP * np.arange(41) + CAR.front_reach > LINE  # the front is over
    )
    assert moments(trace)[columns.ENCROACHMENTS] == over[0]
    assert columns.ENCROACHMENTS not in moments(braking_foe(-1.5))


def test_tracking():
    ego = CartesianState(5, 0, 0, 0, 10, 0)
    anew = PlanStart(
        PlanStartKind.ANEW, ego, cartesian_to_frenet_one(STRAIGHT, ego, None), 0.0
    )
    records = [
        replace(
            record(k, ego, plan=plan_from(ego, PlanStats())),
            tracking=report(k) if k else None,
            start=anew if k == 7 else None,
        )
        for k in range(30)
    ]
    trace = trace_of(records)
    found, row = moments(trace), metric_row(trace)
    errors = np.abs(trace.tracking["lateral_error_m"])
    assert found[columns.TRACKING_LATERAL_MAX] == int(errors.argmax()) + 1
    assert row[columns.TRACKING_LATERAL_MAX] == pytest.approx(errors.max())
    assert found[columns.PLANS_ANEW] == 7
    assert found[columns.LIMITED_SHARE] == 1


def test_means_shares_and_percentiles():
    # 10 m/s, but slow in steps 30 to 34; a bend to one side, then to the other;
    # braking hard in step 50; planning takes 1 + k ms
    def ego(k):
        speed = 2.0 if 30 <= k < 35 else 10.0
        bend = {10: 0.01, 11: 0.03, 12: -0.01}.get(k, 0.0)
        return CartesianState(5 + k, 0, 0, bend, speed, -4.0 if k == 50 else 0.0)

    def planned(k):
        costs = {JERK_COST: 5.0 if k == 20 else 1.0, OFFSET_COST: float("nan")}
        status = PlanStatus.EMERGENCY_BRAKING if k in (40, 41) else PlanStatus.OK
        stats = PlanStats(candidates=9 - (k == 25), costs=costs)
        return replace(plan_from(ego(k), stats), status=status)

    records = [record(k, ego(k), plan=planned(k)) for k in range(60)]
    trace = trace_of(records)
    found, row = moments(trace), metric_row(trace)
    assert found[columns.MEAN_SPEED] == 30
    assert found[columns.LATERAL_DISCOMFORT] == 11
    assert found[columns.LATERAL_REVERSALS] == 12
    assert found[columns.BRAKING_DISCOMFORT] == 50
    assert found[columns.RMS_JERK] in (49, 50)
    assert found[columns.MEAN_J_JERK] == 20
    assert columns.MEAN_J_OFFSET not in found, "never a number"
    assert found[columns.EMERGENCY_CYCLES] == 40
    assert found[columns.CANDIDATES_MEAN] == 25
    assert found[columns.PLANNING_P50] == 30, "of cycles 1 to 59"
    assert 57 <= found[columns.PLANNING_P99] <= 59
    change = np.abs(row[columns.MAX_TANGENTIAL_JERK] * 0.5)
    assert change == pytest.approx(4.0)
    assert found[columns.MAX_TANGENTIAL_JERK] in (45, 50)
    for column in found:
        assert row[column] is not None


def test_losses_against_the_run_without_the_ego():
    # behind the ego; with it, half a second of braking with 4 m/s² from step 20 on
    def car(k, slowed):
        lost = 2.0 * min(max(k - 20, 0) * STEP / 0.5, 1.0) if slowed else 0.0
        s = -20.0 + 10.0 * STEP * k - (lost * max(k - 22.5, 0) * STEP)
        return ("a", s, 0.0, 0.0, 10.0 - lost, -4.0 if slowed and 20 <= k < 25 else 0.0)

    records = [record(k, ego_at(k), cars=[car(k, slowed=True)]) for k in range(60)]
    free = vehicle_table(
        STRAIGHT, [(k, traffic(k * STEP, [car(k, slowed=False)])) for k in range(60)]
    )
    slow = VehicleLimits(max_speed=5.0)
    episode = MeasuredEpisode(trace_of(records), free, slow)
    found = moments_beside_the_trace(episode)
    assert found[columns.BEHIND_DECELERATION] == 20
    assert 25 <= found[columns.BEHIND_SPEED_LOSS] <= 59
    assert found[columns.BEHIND_DELAY_MAX] >= 55, "it adds up to the end"
    assert found[columns.OVER_LIMITS_STEPS] == 0
    assert columns.AHEAD_SPEED_LOSS not in found
