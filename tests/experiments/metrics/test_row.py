"""Metrics on hand-made traces whose answers are known in closed form."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from experiments.cosim import loop
from experiments.cosim.records import (
    EpisodeStatus,
)
from experiments.metrics import columns, comfort, computation, efficiency, safety
from experiments.metrics.followers import (
    followings,
    rear_max_deceleration,
    rear_speed_loss,
)
from experiments.metrics.pairs import Neighbours
from experiments.metrics.row import metric_row
from planner.interface import PlanResult, PlanStats, PlanStatus
from planner.reference_path.path import ReferencePath
from planner.reference_path.segments import arc
from planner.shapes.rectangles import Rectangle, Rectangles, distance, distances
from planner.states import CartesianState
from tests.experiments.traces import CAR, STEP, cruising, record, trace_of


def test_constant_speed():
    trace = cruising(51)
    assert efficiency.travel_time(trace) == pytest.approx(5.0)
    assert efficiency.distance(trace) == pytest.approx(50.0)
    assert efficiency.mean_speed(trace) == pytest.approx(10.0)
    assert comfort.rms_jerk(trace) == 0.0
    assert comfort.max_abs_acceleration(trace) == 0.0
    assert comfort.max_heading(trace) == 0.0


def test_travel_time_needs_an_arrival():
    records = [record(0, CartesianState(0, 0, 0, 0, 5, 0))]
    assert efficiency.travel_time(trace_of(records, EpisodeStatus.TIMEOUT)) is None


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
    assert comfort.rms_jerk(trace) == pytest.approx(0.0, abs=1e-12)
    assert comfort.max_heading(trace) == pytest.approx(0.0, abs=1e-9)
    # chords are shorter than the arc by (v dt / r)² / 24
    assert efficiency.distance(trace) == pytest.approx(39 * 1.2, rel=1e-4)


def test_lateral_jerk_counts():
    # curvature grows linearly: d(kappa v²)/dt = rate * v³
    speed, rate = 10.0, 1e-3
    records = [
        record(k, CartesianState(k, 0, 0, rate * speed * STEP * k, speed, 0))
        for k in range(20)
    ]
    assert comfort.rms_jerk(trace_of(records)) == pytest.approx(rate * speed**3)


def test_time_to_collision_with_a_slower_leader():
    # centres 50 m apart, lengths 4.8 and 4: gap 45.6 m, closing 10 - 4 = 6 m/s
    centre = CAR.centre_offset
    trace = trace_of(
        [
            record(
                0,
                CartesianState(0, 0, 0, 0, 10, 0),
                cars=[("a", 50.0 + centre, 0.0, 0.0, 4.0, 0.0)],
            )
        ]
    )
    assert safety.min_time_to_collision(trace) == pytest.approx(45.6 / 6.0)
    assert safety.min_time_headway(trace) == pytest.approx(45.6 / 10.0)


@pytest.mark.parametrize(
    "car",
    [
        ("faster", 50.0, 0.0, 0.0, 11.0, 0.0),
        ("aside", 50.0, 2.2, 0.0, 4.0, 0.0),
        ("oncoming aside", 50.0, 3.0, math.pi, 10.0, 0.0),
        ("too far ahead in time", 100.0, 0.0, 0.0, 9.9, 0.0),
        ("behind and slower", -30.0, 0.0, 0.0, 4.0, 0.0),
    ],
)
def test_no_time_to_collision(car):
    records = [record(0, CartesianState(0, 0, 0, 0, 10, 0), cars=[car])]
    assert safety.min_time_to_collision(trace_of(records)) is None


def test_oncoming_traffic_in_a_bend_is_no_conflict():
    # its tangent crosses the ego's; along the road it keeps 10 m to the left
    path = ReferencePath.from_segments([arc(300.0, 1.0 / 60.0)])
    x, y, heading = path.pose(0.0)
    x2, y2, heading2 = path.pose(40.0)
    car = (
        "oncoming",
        x2 + 10.0 * math.sin(heading2),
        y2 - 10.0 * math.cos(heading2),
        heading2 + math.pi,
        14.0,
        0.0,
    )
    ego = CartesianState(x, y, heading, 1.0 / 60.0, 14.0, 0.0)
    trace = trace_of([record(0, ego, path=path, cars=[car])], path=path)
    assert trace.vehicles["l_m"][0] == pytest.approx(-10.0)
    assert safety.min_time_to_collision(trace) is None


GRID = np.linspace(0.0, 5.0, 2001)


def _swept_by_brute_force(pairs: Neighbours) -> float:
    """First time on a fine grid at which the rectangles overlap."""
    n = np.ones(GRID.size)
    others = Rectangles(
        pairs.ds + GRID * pairs.ds_dot,
        pairs.dl + GRID * pairs.dl_dot,
        pairs.heading * n,
        pairs.length * n,
        pairs.width * n,
        0.0 * n,
    )
    ego = Rectangle(0, 0, float(pairs.ego_heading[0]), CAR.length, CAR.width)
    touching = np.flatnonzero(distances(ego, others) <= 0.0)
    return float(GRID[touching[0]]) if touching.size else math.inf


angle = st.floats(-math.pi, math.pi)


@settings(deadline=None)
@given(
    place=st.tuples(st.floats(-30, 30), st.floats(-15, 15)),
    rate=st.tuples(st.floats(-15, 15), st.floats(-8, 8)),
    headings=st.tuples(angle, angle),
)
def test_time_to_contact_agrees_with_brute_force(place, rate, headings):
    def one(value):
        return np.array([value])

    pairs = Neighbours(
        np.array([0]),
        np.array(["a"]),
        one(place[0]),
        one(place[1]),
        one(rate[0]),
        one(rate[1]),
        one(headings[0]),
        one(4.5),
        one(1.8),
        one(10.0),
        one(0.0),
        one(headings[1]),
        one(10.0),
        CAR.length,
        CAR.width,
    )
    found = float(safety.time_to_contact(pairs)[0])
    brute = _swept_by_brute_force(pairs)
    if math.isinf(brute):
        # a graze shorter than the grid may be missed by it
        assert found > 5.0 or _graze(pairs, found)
    else:
        assert found <= brute + 1e-9
        assert found >= brute - 5.0 / 2000 - 1e-9 or _graze(pairs, found)


def _graze(pairs: Neighbours, t: float) -> bool:
    """Tell whether the bodies really touch at the time that the grid missed."""
    other = Rectangle(
        float(pairs.ds[0] + t * pairs.ds_dot[0]),
        float(pairs.dl[0] + t * pairs.dl_dot[0]),
        float(pairs.heading[0]),
        4.5,
        1.8,
    )
    ego = Rectangle(0, 0, float(pairs.ego_heading[0]), CAR.length, CAR.width)
    return distance(ego, other) < 1e-6


def test_contacts_clearance_and_road():
    ego = CartesianState(0, 0, 0, 0, 10, 0)
    trace = trace_of(
        [
            record(0, ego, clearance=2.0, off_road=0.005),
            record(1, ego, clearance=0.5, off_road=0.2),
            record(2, ego, clearance=0.1, contacts=("b", "a")),
            record(3, ego, clearance=0.1, contacts=("a",)),
        ]
    )
    assert safety.contacts(trace) == ["b", "a"]
    assert safety.min_clearance(trace) == 0.0
    assert safety.off_road_steps(trace) == 1
    assert safety.min_clearance(trace_of([record(0, ego, clearance=0.7)])) == 0.7
    assert safety.min_clearance(trace_of([record(0, ego)])) is None


def test_off_road_counts_what_the_loop_counts():
    assert safety.OFF_ROAD_TOLERANCE == loop.OFF_ROAD_TOLERANCE


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


def test_planner_columns():
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
        elapsed=[0.0, 9.0, 9.5, 10.0],
    )
    assert comfort.mean_cost(trace, comfort.JERK_COST) == 3.0
    assert comfort.mean_cost(trace, comfort.OFFSET_COST) == 1.0
    assert computation.mean_count(trace, "candidates") == 200.0
    assert computation.fallback_cycles(trace) == 1
    # of the second cycle and the third: the first one also loads compiled loops
    assert computation.planning_percentiles(trace, (0, 50, 100)) == [2.0, 2.5, 3.0]
    slow = np.ma.masked_invalid([9.9e4, 150.0, 99.0, np.nan])
    late = replace(trace, timing={**trace.timing, "planning_ms": slow})
    assert computation.deadline_misses(late) == 1
    assert computation.steps_per_second(trace) == pytest.approx(2.0)


def test_row_has_the_columns_of_the_design_in_order():
    expected = [
        "scenario",
        "planner",
        "seed",
        "status",
        "arrived",
        "collisions",
        "first_collision_with",
        "min_clearance_m",
        "min_ttc_s",
        "min_time_headway_s",
        "off_road_steps",
        "travel_time_s",
        "distance_m",
        "mean_speed_mps",
        "mean_j_jerk",
        "mean_j_offset_m2",
        "rms_jerk_mps3",
        "max_abs_acceleration_mps2",
        "max_abs_lateral_acceleration_mps2",
        "max_abs_curvature_1pm",
        "max_heading_rad",
        "fallback_cycles",
        "candidates_mean",
        "survivors_mean",
        "planning_ms_p50",
        "planning_ms_p95",
        "planning_ms_p99",
        "planning_ms_max",
        "deadline_misses",
        "steps_per_s",
        "rear_max_deceleration_mps2",
        "rear_speed_loss_mps",
        "lane_change_s",
        "lane_change_done_s",
        "changed_before_blockage",
        "behind_compared",
        "behind_delay_mean_s",
        "behind_delay_max_s",
        "behind_speed_loss_mps",
        "behind_added_deceleration_mps2",
    ]
    row = metric_row(cruising(5))
    assert list(row) == expected
    assert set(columns.TIMING_COLUMNS) <= set(row)


def test_an_episode_without_steps_has_a_row():
    row = metric_row(trace_of([], EpisodeStatus.CRASHED))
    assert row["status"] == "crashed"
    assert row["distance_m"] == 0.0
    assert row["rms_jerk_mps3"] is None
    assert row["min_ttc_s"] is None
