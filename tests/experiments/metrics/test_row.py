"""The results row of whole episodes."""

import pytest

from experiments.cosim.records import EpisodeStatus
from experiments.metrics.catalogue import ALL_COLUMNS
from experiments.metrics.row import metric_row, row_without_episode
from planner.states import CartesianState
from tests.experiments.traces import CAR, cruising, record, trace_of


def test_row_of_an_ego_behind_a_slower_leader():
    # centres 50 m apart, lengths 4.8 and 4: gap 45.6 m, closing at 10 - 4 = 6 m/s
    leader = ("a", 50.0 + CAR.centre_offset, 0.0, 0.0, 4.0, 0.0)
    ego = CartesianState(0, 0, 0, 0, 10, 0)
    row = metric_row(trace_of([record(0, ego, cars=[leader], clearance=45.6)]))
    assert tuple(row) == ALL_COLUMNS
    assert (row["scenario"], row["planner"], row["seed"]) == ("s", "p", 0)
    assert (row["status"], row["arrived"]) == ("arrived", True)
    assert row["min_clearance_m"] == 45.6
    assert row["min_ttc_s"] == pytest.approx(7.6)
    assert row["min_time_headway_s"] == pytest.approx(4.56)
    assert (row["collisions"], row["first_collision_with"]) == (0, None)


def test_row_of_a_cruise():
    row = metric_row(cruising(51))
    assert row["travel_time_s"] == pytest.approx(5.0)
    assert row["mean_speed_mps"] == pytest.approx(10.0)
    assert row["rear_max_deceleration_mps2"] is None
    assert row["planning_ms_p50"] is None
    assert row["behind_compared"] is None


def test_an_episode_without_steps_has_a_row():
    row = metric_row(trace_of([], EpisodeStatus.CRASHED))
    assert row["status"] == "crashed"
    assert row["distance_m"] == 0.0
    assert row["rms_jerk_mps3"] is None
    assert row["min_ttc_s"] is None


def test_a_lost_run_has_a_row_of_the_same_columns():
    row = row_without_episode("s", "p", 3, "crashed")
    assert tuple(row) == ALL_COLUMNS
    assert {key: value for key, value in row.items() if value is not None} == {
        "scenario": "s",
        "planner": "p",
        "seed": 3,
        "status": "crashed",
        "arrived": False,
    }
