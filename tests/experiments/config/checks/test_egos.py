"""What a scenario with many egos may not say, and one with a single one."""

import re

import pytest

from experiments.config.scenario_file import load_scenario
from experiments.errors import ConfigError

DRAWN = "obstacles={random: {first_m: 140}}"


@pytest.mark.parametrize(
    ("name", "overrides", "problem"),
    [
        ("straight", ["ego=null"], "ego: is missing; allowed: a section with start_m"),
        ("straight", ["measurement={from_s: 1}"], "measurement: is of many egos"),
        ("platoon", ["ego={goal_m: 100}"], "egos: is beside ego; allowed: one of them"),
        (
            "platoon",
            ["world=kinematic", "network=null", "traffic=null"],
            "egos: is for world sumo; allowed there: ego",
        ),
        ("platoon", ["traffic=none"], "egos: needs vehicles; allowed: with a traffic"),
        (
            "platoon",
            ["traffic={own_veh_per_h: 0, oncoming_veh_per_h: 0, cross_veh_per_h: 0}"],
            "egos: needs vehicles; allowed: with a flow",
        ),
        (
            "platoon",
            ["planner=sumo_tuned"],
            "planner: is sumo_tuned; allowed",
        ),
        (
            "platoon",
            ["measurement.from_s=160"],
            "measurement.from_s: is 160; allowed: below simulation.duration_s = 160",
        ),
        (
            "platoon",
            ["egos=[{penetration: 0.7}, {penetration: 0.7}]"],
            "egos: have penetrations of ",
        ),
        (
            "platoon",
            [DRAWN],
            "obstacles: are of a single ego",
        ),
        (
            "platoon",
            ["traffic={own_veh_per_h: 100, slow_leader: {speed_mps: 5}}"],
            "traffic.slow_leader: is of a single ego; allowed with ego",
        ),
        (
            "platoon",
            ["traffic={own_veh_per_h: 100, ego_lane_veh_per_h: 100}"],
            "traffic.ego_lane_veh_per_h: is of a single ego; allowed with ego",
        ),
        (
            "platoon",
            ["network={file: a.net.xml, vehicle: v}"],
            "network.vehicle: is of a single ego; allowed with ego",
        ),
        (
            "platoon",
            ["network={file: a.net.xml}"],
            "network.route: is missing; allowed with egos: network.route, or from and "
            "to",
        ),
        (
            "platoon",
            ["simulation.without_ego=true"],
            "simulation.without_ego: is of a single ego; allowed: false",
        ),
        (
            "platoon",
            ["simulation.planning_delay_s=0.1"],
            "simulation.planning_delay_s: is of a single ego; allowed: without it",
        ),
        (
            "platoon",
            ["traffic={own_veh_per_h: 100, relaxation_s: 3}"],
            "traffic.relaxation_s: is of a single ego; allowed: 0",
        ),
        (
            "platoon",
            ["traffic={own_veh_per_h: 100, drivers: distracted}"],
            "traffic.drivers: err, which is of a single ego; allowed: distraction: 0",
        ),
    ],
)
def test_what_is_of_the_other_kind_is_one_line(name, overrides, problem):
    with pytest.raises(ConfigError, match=re.escape(problem)) as caught:
        load_scenario(name, overrides=overrides)
    assert "\n" not in str(caught.value)


def test_shares_that_are_a_whole_are_allowed():
    groups = "egos=[{penetration: 0.4}, {penetration: 0.6}]"
    assert len(load_scenario("platoon", overrides=[groups]).egos) == 2
