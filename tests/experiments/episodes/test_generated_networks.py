"""Random routes through generated networks, with traffic, from end to end."""

import pytest
import yaml

from experiments.config.scenario_file import load_scenario
from experiments.episode.run import run_episode
from tests.experiments.episodes.network_campaign import (
    ROUTES,
    Route,
    drive,
    summary,
)
from tests.sumo_nets.generated import generate

pytestmark = [pytest.mark.sumo, pytest.mark.slow]

# Shapes, lanes, signals and sides of traffic all differ between these.
SEEDS = range(12)


@pytest.mark.parametrize("seed", SEEDS)
def test_random_routes_arrive_on_the_road_or_are_refused_with_the_place(seed, tmp_path):
    arrived = refused = 0
    for number in range(ROUTES):
        result = drive(Route(seed, number, "car"), "cruise", tmp_path)
        if result["status"] == "refused":
            refused += "a bend that this body cannot take" in result["reason"]
            continue
        assert result["off_road_steps"] == 0
        assert result["status"] != "simulator_failed"
        arrived += result["status"] == "arrived"
    assert arrived + refused >= ROUTES - 1


def test_an_ego_that_has_stopped_at_the_outer_side_of_a_bend_goes_on(tmp_path):
    """Its lane alone leaves no motion back to its middle; the road does."""
    file = generate(
        tmp_path,
        "--spider",
        "--spider.arm-number=5",
        "--spider.circle-number=3",
        "--spider.space-radius=55",
        "--seed=40",
        "-L3",
        "--default-junction-type=right_before_left",
        turnarounds=True,
    )
    content = {
        "name": "spider",
        "network": {"file": file.name},
        "ego": {"goal_m": 300.0},
        "traffic": {
            "own_veh_per_h": 300,
            "oncoming_veh_per_h": 300,
            "cross_veh_per_h": 100,
        },
        "planner": "route",
        "simulation": {"seed": 0, "duration_s": 240},
    }
    scenario = tmp_path / "spider.yaml"
    scenario.write_text(yaml.safe_dump(content))
    outcome = run_episode(load_scenario(str(scenario)), out=tmp_path)
    assert outcome.ending.status.value == "arrived", outcome.ending.reason
    assert outcome.row["off_road_steps"] == 0


def test_summary_counts_only_what_the_simulators_driver_drives():
    def result(route, planner, status, off_road_steps=0):
        return {
            "body": "car",
            "seed": 0,
            "route": route,
            "planner": planner,
            "status": status,
            "off_road_steps": off_road_steps,
        }

    results = [
        result(0, "sumo", "arrived"),
        result(0, "cruise", "off_road", 3),
        result(0, "lane_change", "arrived"),
        result(1, "sumo", "collision"),
        result(1, "cruise", "arrived"),
        result(1, "lane_change", "arrived"),
    ]
    assert summary(results, ["cruise", "lane_change"]) == [
        "sumo drives 1 of 2 routes",
        "cruise: {'off_road': 1}, off the road in 1",
        "lane_change: {'arrived': 1}, off the road in 0",
        "either: 1 of 1",
    ]
