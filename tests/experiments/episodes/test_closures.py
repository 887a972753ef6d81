"""SUMO's driver and ours before a closed lane: told from the same place."""

import libsumo
import numpy as np
import pytest

from experiments.config.scenario_file import load_scenario
from experiments.cosim.sumo.obstacle_vehicles import ID_PREFIX
from experiments.episode.run import run_episode
from experiments.world_setup.layout import make_layout
from experiments.world_setup.world import make_world

pytestmark = pytest.mark.sumo
BEGUN = 0.3  # from the lane's centre a change has begun [m]


def changed_at(name, planner, tmp_path, *overrides):
    """Return where the ego began to leave its lane [m], and its row."""
    scenario = load_scenario(
        name, planner=planner, seed=1, overrides=["traffic=none", *overrides]
    )
    outcome = run_episode(scenario, out=tmp_path)
    steps = outcome.trace.steps
    l = np.ma.getdata(steps["l_m"])
    first = int(np.flatnonzero(np.abs(l - l[0]) > BEGUN)[0])
    return float(steps["s_m"][first]), outcome.row


def test_twins_are_stopped_vehicles(tmp_path):
    scenario = load_scenario("lane_change", overrides=["traffic=none"])
    world = make_world(scenario, make_layout(scenario), tmp_path)
    try:
        world.enter()
        twins = [n for n in libsumo.vehicle.getIDList() if n.startswith(ID_PREFIX)]
        assert len(twins) == 1
        assert libsumo.vehicle.isStopped(twins[0])
        assert libsumo.vehicle.getLaneID(twins[0]) == "own2_0"
        assert libsumo.vehicle.getPosition(twins[0]) == pytest.approx((506.0, -1.75))
        assert libsumo.vehicle.getLength(twins[0]) == pytest.approx(12.0, abs=0.11)
    finally:
        world.close()


@pytest.mark.parametrize("closure", ["stopped_vehicle", "disallowed"])
@pytest.mark.parametrize(
    "planner",
    [
        "sumo",
        *(
            pytest.param(p, marks=pytest.mark.slow)
            for p in ("sumo_sublane", "idm_mobil")
        ),
    ],
)
def test_nobody_changes_before_being_told(closure, planner, tmp_path):
    kind = f"obstacles.closure={closure}"
    late, row = changed_at(
        "lane_change", planner, tmp_path, kind, "obstacles.known_from_m=150"
    )
    assert row["arrived"]
    assert late + 3.8 > 794.0 - 150.0
    early, row = changed_at("lane_change", planner, tmp_path, kind)
    assert row["arrived"]
    assert early < late - 40.0


def test_a_driver_who_is_not_told_sees_the_stopped_vehicle(tmp_path):
    at, row = changed_at("lane_change", "sumo_as_shipped", tmp_path)
    assert row["arrived"]
    assert 794.0 - 110.0 < at + 3.8 < 794.0


@pytest.mark.parametrize("planner", ["sumo", "lane_change", "idm_mobil"])
def test_a_lane_that_ends_is_left(planner, tmp_path):
    at, row = changed_at("lane_change_end", planner, tmp_path)
    assert row["arrived"]
    assert row["off_road_steps"] == 0
    assert at < 780.0


def test_what_sumo_only_draws_or_nobody_plans_is_null(tmp_path):
    _, row = changed_at("lane_change", "sumo", tmp_path)
    for column in (
        "rms_jerk_mps3",
        "max_abs_lateral_acceleration_mps2",
        "lane_change_s",
        "planning_ms_p50",
        "planning_cpu_ms_p99",
        "deadline_misses",
        "fallback_cycles",
    ):
        assert row[column] is None, column
    assert row["travel_time_s"] > 50.0
    assert row["changed_before_blockage"]


@pytest.mark.parametrize("planner", ["sumo", "sumo_sublane"])
def test_sumos_driver_passes_joints_of_edges(planner, tmp_path):
    """On the winding road, cut into short edges, its obstacle begins at a joint.

    There the sublane model stood before what blocks the other lane, and LC2013's
    vehicle was turned by half a circle for a step.
    """
    scenario = load_scenario(
        "lane_change_curved",
        planner=planner,
        seed=200,
        overrides=["traffic.density=dense", "traffic.reaction_s=0.1"],
    )
    outcome = run_episode(scenario, out=tmp_path)
    assert outcome.row["arrived"]
    heading = np.ma.getdata(outcome.trace.steps["heading_rad"])
    assert np.all(np.abs(np.diff(np.unwrap(heading))) < 0.3)
