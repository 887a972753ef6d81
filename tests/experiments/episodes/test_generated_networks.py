"""Random routes through generated networks, with traffic, from end to end."""

import pytest
import yaml

from experiments.config.scenario_file import load_scenario
from experiments.episode.run import run_episode
from experiments.errors import ExperimentError
from experiments.evidence.generated_networks.prepare import (
    NETGENERATE,
    STREET_MAPS,
    prepare,
)
from sumo_nets.errors import NetworkError
from tests.sumo_nets.generated import generate

pytestmark = [pytest.mark.sumo, pytest.mark.slow]

ROUTES = 3  # of each network


@pytest.mark.parametrize(
    ("source", "number"),
    [(NETGENERATE, n) for n in range(8)] + [(STREET_MAPS, n) for n in range(4)],
)
def test_random_routes_arrive_on_the_road_or_are_refused_with_the_place(
    source, number, tmp_path
):
    planner = "cruise" if source == NETGENERATE else "route"
    prepare(tmp_path, range(number, number + 1), range(ROUTES), source=source)
    (file,) = set(tmp_path.glob("*.yaml")) - {tmp_path / "sweep.yaml"}
    content = yaml.safe_load(file.read_text())
    arrived = refused = 0
    for seed in range(ROUTES):
        content["planner"] = planner
        content["simulation"]["seed"] = seed
        file.write_text(yaml.safe_dump(content))
        try:
            outcome = run_episode(load_scenario(str(file)), out=tmp_path)
        except (ExperimentError, NetworkError) as error:
            refused += "a bend that this body cannot take" in str(error)
            continue
        assert outcome.row["off_road_steps"] == 0
        assert outcome.ending.status.value != "simulator_failed"
        arrived += outcome.ending.status.value == "arrived"
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
