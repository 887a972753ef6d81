"""Whole episodes whose ego is not perfect, in the kinematic world."""

import numpy as np
import pytest

from experiments.config.scenario_file import load_scenario
from experiments.cosim.records import EpisodeStatus
from experiments.episode.replan import replan
from experiments.episode.run import run_episode
from experiments.trace.files import read_trace

SLOW = ("ego.plant=dynamic", "ego.actuators=autoware")
CASES = {
    "perfect": (),
    "kinematic": ("ego.plant=kinematic",),
    "slow": SLOW,
    "eyes": ("ego.perception=poor",),
    "all": (
        *SLOW,
        "ego.perception=good",
        "simulation.planning_period_s=0.2",
        "simulation.planning_delay_s=0.1",
    ),
    "measured": (*SLOW, "ego.plan_start=measured"),
}


def drive(tmp_path, overrides=(), name="cut_in"):
    return run_episode(load_scenario(name, overrides=overrides), out=tmp_path)


@pytest.mark.parametrize(
    "case",
    [
        pytest.param(
            case,
            marks=[] if case in ("perfect", "all") else [pytest.mark.slow],
        )
        for case in CASES
    ],
)
def test_the_same_seed_gives_the_same_bytes_and_every_cycle_can_be_planned_again(
    case, tmp_path
):
    one = drive(tmp_path / "a", CASES[case])
    other = drive(tmp_path / "b", CASES[case])
    assert one.ending.status is EpisodeStatus.ARRIVED
    assert one.trace_hash == other.trace_hash
    files = {file.name for file in one.folder.glob("*.parquet")}
    has = {"tracking": SLOW[0] in CASES[case] or case == "kinematic"}
    has["perceived"] = case in ("eyes", "all")
    for name, expected in has.items():
        assert (f"{name}.parquet" in files) is expected
        assert (
            bool(len(read_trace(one.folder).model_tables().get(name, ()))) is expected
        )
    planned = np.flatnonzero(~np.ma.getmaskarray(one.trace.steps["plan_status"]))
    for step in (planned[7], planned[-1]):
        assert replan(one.folder, int(step)) == ()


def test_perfect_written_out_is_the_default(tmp_path):
    plain = drive(tmp_path / "a")
    written = drive(tmp_path / "b", ("ego.plant=perfect", "ego.perception=perfect"))
    assert plain.folder.name == written.folder.name
    assert plain.trace_hash == written.trace_hash


def test_a_slow_vehicle_misses_its_plan_and_the_tube_keeps_it_clear(tmp_path):
    # who keeps to the middle of its lane does not come near the other at all
    free = (*SLOW, "planner.settings.weights.lane=0")
    with_tube = drive(tmp_path / "a", free).row
    without = drive(tmp_path / "b", (*free, "ego.tube=none")).row
    for row in (with_tube, without):
        assert 0.02 < row["tracking_lateral_max_m"] < 0.25
        assert row["tracking_lateral_rms_m"] < row["tracking_lateral_max_m"]
        assert row["plans_anew"] == 0
    assert with_tube["min_clearance_m"] > without["min_clearance_m"] + 0.1


def test_what_is_believed_is_not_what_is_there(tmp_path):
    row = drive(tmp_path, ("ego.perception=poor",)).row
    assert 0.1 < row["perception_error_m"] < 1.0
    assert row["tracking_lateral_max_m"] is None


def test_with_a_controller_that_diverges_no_number_is_nan(tmp_path):
    far = "ego.plan_start={rule: stitched, lateral_m: 5, longitudinal_m: 5}"
    unaware = (*SLOW, "ego.controller.delay_aware=false", "ego.tube=none")
    wild = drive(tmp_path, (*unaware, far))
    assert wild.ending.status is not EpisodeStatus.ARRIVED  # the planner slows down
    assert wild.row["tracking_lateral_max_m"] > 0.3
    for column in ("x_m", "y_m", "heading_rad", "speed_mps"):
        assert np.isfinite(wild.trace.steps[column]).all()
