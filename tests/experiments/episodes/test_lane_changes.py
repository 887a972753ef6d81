"""Lane changes among traffic that reacts, paired with SUMO's own driver by seed.

`make test-slow ARGS="tests/experiments/episodes/test_lane_changes.py --seeds 100 -s"`
runs the full set and prints a line for each density and driver.
"""

from concurrent.futures import ProcessPoolExecutor
from typing import get_args

import numpy as np
import pytest

from experiments.config.scenario_file import load_scenario
from experiments.config.simulation import Simulation
from experiments.episode.run import run_episode
from experiments.trace.files import read_trace
from experiments.world_setup.layout import make_layout
from planner.prediction import PREDICTORS

LIMIT = 16.67  # of the one-way roads, 60 km/h [m/s]

DONE = {"light": 0.98, "medium": 0.95, "dense": 0.85}  # least share of arrivals
HARD = 3.0  # braking that nobody likes to be made to do [m/s²]


def episode(job):
    scenario, planner, seed, overrides, out = job
    checked = load_scenario(scenario, planner=planner, seed=seed, overrides=overrides)
    return run_episode(checked, out=out).row


def episodes(scenario, planner, density, n_seeds, out):
    overrides = [f"traffic.density={density}"]
    jobs = [(scenario, planner, s, overrides, out) for s in range(1, n_seeds + 1)]
    with ProcessPoolExecutor(2) as pool:
        rows = list(pool.map(episode, jobs))
    brakes = [row["rear_max_deceleration_mps2"] for row in rows]
    brakes = np.array([b for b in brakes if b is not None] or [0.0])
    times = [row["travel_time_s"] for row in rows if row["arrived"]]
    print(  # noqa: T201 - the table that this test is run for
        f"\n{scenario} {planner} {density}: arrived {sum(r['arrived'] for r in rows)} "
        f"of {len(rows)}, collisions {sum(r['collisions'] for r in rows)}, off road "
        f"{sum(r['off_road_steps'] for r in rows)} steps, travel time "
        f"{np.mean(times):.1f} s, braking behind above {HARD:g} m/s² in "
        f"{np.mean(brakes > HARD):.0%} of {brakes.size}, mean {brakes.mean():.2f} m/s²"
    )
    return rows


@pytest.mark.slow
@pytest.mark.sumo
@pytest.mark.parametrize("density", DONE)
def test_lane_changes_harm_nobody(density, tmp_path, request):
    n_seeds = request.config.getoption("--seeds")
    rows = episodes("lane_change", "lane_change", density, n_seeds, tmp_path)
    assert sum(row["collisions"] + row["off_road_steps"] for row in rows) == 0
    arrived = sum(row["arrived"] for row in rows)
    assert arrived >= DONE[density] * n_seeds
    waiting = [row["status"] for row in rows if not row["arrived"]]
    assert set(waiting) <= {"blocked", "timeout"}
    episodes("lane_change", "sumo", density, n_seeds, tmp_path)


@pytest.mark.slow
@pytest.mark.sumo
@pytest.mark.parametrize(
    "scenario", ["lane_change_curved", "lane_change_three", "lane_change_leader"]
)
def test_other_roads_too(scenario, tmp_path, request):
    n_seeds = request.config.getoption("--seeds")
    rows = episodes(scenario, "lane_change", "medium", n_seeds, tmp_path)
    assert sum(row["collisions"] + row["off_road_steps"] for row in rows) == 0
    assert sum(row["arrived"] for row in rows) >= 0.95 * n_seeds


@pytest.mark.sumo
def test_the_trace_says_why_each_plan_was_made(tmp_path):
    scenario = load_scenario(
        "lane_change", seed=2, overrides=("simulation.duration_s=30",)
    )
    steps = run_episode(scenario, out=tmp_path).trace.steps
    reasons = [text for text in steps["explanation"].tolist() if text is not None]
    phases = {text.split(":")[0] for text in reasons}
    assert {"change", "committed", "keep"} <= phases
    assert any("ahead of" in text for text in reasons)


@pytest.mark.sumo
def test_sumo_drives_the_same_vehicle_to_the_same_goal(tmp_path):
    scenario = load_scenario("lane_change", planner="sumo", seed=2)
    outcome = run_episode(scenario, out=tmp_path)
    row = outcome.row
    assert row["status"] == "arrived"
    assert row["collisions"] == 0
    assert row["min_clearance_m"] > 0.0
    # it has changed lanes: the blockage cannot be driven through
    assert outcome.trace.steps["l_m"].max() > 3.0
    again = run_episode(scenario, out=tmp_path / "again")
    assert again.trace_hash == outcome.trace_hash


@pytest.mark.sumo
def test_sumo_drives_at_the_speed_that_is_asked_for(tmp_path):
    asked = 12.0  # the limit is 16.67 m/s
    scenario = load_scenario(
        "lane_change",
        planner="sumo",
        overrides=("traffic=none", "obstacles=none", f"ego.target_speed_mps={asked}"),
    )
    speed = run_episode(scenario, out=tmp_path).trace.steps["speed_mps"]
    assert speed[-1] == pytest.approx(asked, abs=0.05)
    faster = load_scenario(
        "lane_change",
        planner="sumo",
        overrides=("traffic=none", "obstacles=none", "ego.target_speed_mps=19"),
    )
    speed = run_episode(faster, out=tmp_path).trace.steps["speed_mps"]
    assert speed[-1] == pytest.approx(LIMIT, abs=0.05)  # of the road, which is kept


@pytest.mark.sumo
def test_the_scenario_chooses_the_predictor(tmp_path):
    names = get_args(Simulation.model_fields["predictor"].annotation)
    names = [name for name in names if name != "recorded"]  # of world commonroad
    assert set(names) == set(PREDICTORS)
    hashes = set()
    for name in names:
        overrides = (
            f"simulation.predictor={name}",
            "simulation.duration_s=25",
            "traffic.density=dense",
            "traffic.ego_lane_veh_per_h=600",
        )
        scenario = load_scenario("lane_change", seed=3, overrides=overrides)
        hashes.add(run_episode(scenario, out=tmp_path / name).trace_hash)
    assert len(hashes) == len(names)  # someone ahead brakes


@pytest.mark.sumo
def test_nobody_is_met_where_someone_moves_into_the_lane(tmp_path):
    # in this traffic a car in mid lane change reaches over the line at the start
    scenario = load_scenario(
        "intersection", seed=111, overrides=["simulation.duration_s=3"]
    )
    row = run_episode(scenario, out=tmp_path).row
    assert row["collisions"] == 0
    assert row["min_clearance_m"] > 0.2


def test_a_kinematic_road_has_the_lanes_that_it_says(tmp_path):
    file = tmp_path / "road.yaml"
    file.write_text(
        "name: road\nworld: kinematic\nego: {goal_m: 90, target_speed_mps: 9}\n"
        "road:\n  segments: [[line, 100]]\n  half_width_m: 6\n"
        "  lanes: {count: 3, width_m: 3.5}\n"
    )
    lanes = make_layout(load_scenario(str(file))).road.lanes
    for s in (0.0, 60.0):
        centres, widths = lanes.at(s)
        assert centres.tolist() == [-3.5, 0.0, 3.5]
        assert widths.tolist() == [3.5, 3.5, 3.5]
    bare = load_scenario(str(file), overrides=("road.lanes=null",))
    assert make_layout(bare).road.lanes.at(0.0)[0].size == 0


def test_a_lane_change_in_the_kinematic_world(tmp_path):
    file = tmp_path / "road.yaml"
    file.write_text(
        "name: road\nworld: kinematic\n"
        "ego: {start_offset_m: -1.75, goal_m: 300, target_speed_mps: 12}\n"
        "road: {segments: [[line, 400]], half_width_m: 3.5, lanes: {count: 2}}\n"
        "obstacles: [{s_m: 200, l_m: -1.75, length_m: 10, width_m: 2.6}]\n"
        "vehicles: [{s_m: 20, l_m: 1.75, speed_mps: 12}]\n"
        "planner: lane_change\nsimulation: {horizon_s: 10.0}\n"
    )
    row = run_episode(load_scenario(str(file)), out=tmp_path).row
    assert row["status"] == "arrived"
    assert row["changed_before_blockage"] is True
    assert row["min_clearance_m"] > 0.3


@pytest.mark.parametrize(
    ("name", "centres"),
    [
        ("lane_change", [0.0, 3.5]),
        ("lane_change_curved", [0.0, 3.5]),
        ("lane_change_three", [-3.5, 0.0, 3.5]),
        ("straight", [-10.0 / 3.0, 0.0, 10.0 / 3.0]),
        ("intersection", [-10.0 / 3.0, 0.0, 10.0 / 3.0]),
    ],
)
def test_the_scene_knows_the_lanes(name, centres):
    lanes = make_layout(load_scenario(name)).road.lanes
    for s in (10.0, 150.0, 290.0):
        found, widths = lanes.at(s)
        assert found == pytest.approx(centres, abs=0.15)
        expected = [abs(centres[1] - centres[0])] * len(centres)
        if name == "intersection" and s == 150.0:
            expected[0] = 0.0  # inside the junction: the right lane does not turn left
        assert widths == pytest.approx(expected, abs=0.05)


@pytest.mark.slow
@pytest.mark.sumo
def test_a_change_is_not_braked_to_a_stand_behind_the_whole_platoon(tmp_path):
    """Begun ahead of a car that could not be passed, it braked with 4.5 m/s²."""
    overrides = ["traffic.density=dense", "traffic.reaction_s=1.0"]
    scenario = load_scenario("lane_change", seed=4, overrides=overrides)
    result = run_episode(scenario, out=tmp_path)
    assert result.row["status"] == "arrived"
    steps = read_trace(result.folder).steps
    before = steps["time_s"] < 30.0
    assert steps["acceleration_mps2"][before].min() > -2.5
    assert result.row["max_abs_lateral_acceleration_mps2"] < 2.5
