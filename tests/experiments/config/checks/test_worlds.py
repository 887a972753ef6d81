"""What each world has of its own, and what has to be on its road."""

import re

import pytest

from experiments.config.checks.worlds import beyond_road
from experiments.config.scenario_file import load_scenario
from experiments.errors import ConfigError

KINEMATIC = "thesis_straight"
SLOW = "{s_m: %g, speed_mps: 1}"


@pytest.mark.parametrize(
    ("name", "overrides", "problem"),
    [
        ("straight", ["network=null"], "network: is missing; world sumo needs it"),
        (KINEMATIC, ["road=null"], "road: is missing; world kinematic needs it"),
        (
            "straight",
            ["road={segments: [[line, 100]]}"],
            "road: is not for world sumo; allowed: network",
        ),
        (
            KINEMATIC,
            ["network=straight"],
            "network: is not for world kinematic; allowed: road",
        ),
        (
            "straight",
            ["vehicles=[{s_m: 10, speed_mps: 1}]"],
            "vehicles: is not for world sumo; allowed: traffic",
        ),
        (
            KINEMATIC,
            ["traffic={own_veh_per_h: 100}"],
            "traffic: is not for world kinematic; allowed: vehicles",
        ),
        (
            KINEMATIC,
            ["simulation.without_ego=true"],
            "simulation.without_ego: is for world sumo, where vehicles react",
        ),
        (
            "straight",
            ["simulation.placebo=true"],
            "simulation.placebo: needs without_ego",
        ),
        (
            "straight",
            ["ego.goal_m=null"],
            "ego.goal_m: is missing; world sumo",
        ),
        (
            "straight",
            ["simulation.predictor=recorded"],
            "simulation.predictor: is recorded, which is for world commonroad",
        ),
        (
            "straight",
            ["network={file: a.net.xml, route: [a], planning_problem: 3}"],
            "network.planning_problem: is for world commonroad; allowed: name, or",
        ),
        (
            "straight",
            ["network={file: a.net.xml, vehicle: v}"],
            "network.vehicle: is of a route file; allowed with traffic.sumocfg",
        ),
        (KINEMATIC, ["ego.goal_m=5000"], "ego.goal_m: is 5000; allowed: 0 to "),
    ],
)
def test_keys_of_another_world_are_one_line(name, overrides, problem):
    with pytest.raises(ConfigError, match=re.escape(problem)) as caught:
        load_scenario(name, overrides=overrides)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("overrides", "length", "key"),
    [
        ([], 90.0, ("ego", "goal_m")),
        (["obstacles=[{s_m: 150, radius_m: 1}]"], 120.0, ("obstacles", 0, "s_m")),
        (
            [
                "obstacles=none",
                "vehicles=[{s_m: 1, speed_mps: 1}, {s_m: 170, speed_mps: 1}]",
            ],
            150.0,
            ("vehicles", 1, "s_m"),
        ),
        (
            ["obstacles={random: {first_m: 140}}"],
            130.0,
            ("obstacles", "random", "first_m"),
        ),
    ],
)
def test_what_lies_beyond_the_road_is_named(overrides, length, key):
    more = ["road.segments=[[line, 500]]", "ego.goal_m=100", *overrides]
    scenario = load_scenario(KINEMATIC, overrides=more)
    found, problem = beyond_road(scenario, length)
    assert found == key
    assert problem.endswith(f"allowed: 0 to {length:.1f}, the road's end")
    assert beyond_road(scenario, 500.0) is None
