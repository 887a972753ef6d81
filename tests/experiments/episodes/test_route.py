"""The planner `route` among traffic in SUMO: changes of lanes that the route asks for.

`make test-slow ARGS="tests/experiments/episodes/test_route.py --seeds 20 -s"` runs more
seeds.
"""

import json
from concurrent.futures import ProcessPoolExecutor

import pytest

from experiments.config.scenario_file import load_scenario
from experiments.episode.run import run_episode
from experiments.trace.files import read_trace

pytestmark = [pytest.mark.sumo, pytest.mark.slow]

ROADS = ["lane_drop", "on_ramp", "left_hand"]


def episode(job):
    name, seed, out = job
    outcome = run_episode(load_scenario(name, seed=seed), out=out)
    words = read_trace(outcome.folder).steps["explanation"].tolist()
    return outcome.row, json.dumps(words)


def test_lanes_that_end_are_left_among_traffic(tmp_path, pytestconfig):
    seeds = range(max(pytestconfig.getoption("--seeds") // 10, 1))
    jobs = [(name, seed, tmp_path) for name in ROADS for seed in seeds]
    with ProcessPoolExecutor(1, max_tasks_per_child=1) as pool:
        found = list(pool.map(episode, jobs))
    for row, words in found:
        assert row["status"] == "arrived", row["scenario"]
        assert row["line_violations"] == 0
        if row["scenario"] != "left_hand":
            assert "change lane 0, to 1: lane" in words  # ends, or 1 is faster
            assert "committed lane 0, to 1" in words


def travel(job):
    road, planner, out = job
    row = run_episode(load_scenario(road, planner=planner, seed=3), out=out).row
    assert row["status"] == "arrived"
    return row["travel_time_s"]


@pytest.mark.parametrize("road", ["dense", "dense_curved"])
def test_among_obstacles_it_drives_as_the_family_made_for_them(tmp_path, road):
    """Cruising along a lane slows down there, and stood before another one opened."""
    jobs = [(road, planner, tmp_path) for planner in ("dense", "route")]
    with ProcessPoolExecutor(1, max_tasks_per_child=1) as pool:
        by_dense, by_route = pool.map(travel, jobs)
    assert by_route < 1.05 * by_dense
