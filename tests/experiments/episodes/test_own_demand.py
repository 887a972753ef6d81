"""Episodes in a town whose traffic comes from SUMO's own files."""

import re

import pytest
import yaml

from experiments.config.scenario_file import load_scenario
from experiments.cosim.sumo.vehicle_reader import PERSON
from experiments.episode.preview import preview
from experiments.episode.run import run_episode
from experiments.errors import ConfigError
from tests.sumo_nets.city_demand import make_town

pytestmark = pytest.mark.sumo
DRIVEN = 60  # a car in the middle of the demand


@pytest.fixture(scope="module")
def town(tmp_path_factory):
    folder = tmp_path_factory.mktemp("town")
    net_file, config, routes = make_town(folder, 120, 5, 30, size=5, seconds=60)
    return folder, net_file, config, routes


def load(town, network, traffic, planner=None):
    folder, net_file, _, _ = town
    file = folder / "town.yaml"
    content = {
        "name": "town",
        "network": {"file": net_file.name, **network},
        "ego": {"goal_m": 60.0}
        if "vehicle" in network
        else {"start_m": 10.0, "goal_m": 60.0},
        "traffic": traffic,
        "simulation": {"warmup_s": 40, "duration_s": 60},
    }
    file.write_text(yaml.safe_dump(content))
    return load_scenario(str(file), planner=planner)


def watch(scenario, out):
    """Drive; returns the outcome and the ids of everybody that was seen."""
    seen = set()

    def note(record):
        seen.update(record.traffic.vehicles.ids)

    return run_episode(scenario, out=out, on_step=note), seen


def test_ego_joins_the_traffic_of_a_sumocfg(town, tmp_path):
    route = town[3][DRIVEN]
    places = {"from": route[0], "to": route[-1]}
    outcome, seen = watch(load(town, places, {"sumocfg": "town.sumocfg"}), tmp_path)
    assert outcome.ending.status == "arrived"
    assert any(name.startswith(PERSON) for name in seen)
    assert f"v{DRIVEN}" in seen


def test_demand_need_not_be_in_the_order_of_departure(town, tmp_path):
    """SUMO reads a file in parts, and forgets who is written after a late one."""
    route = town[3][DRIVEN]
    late, early = (
        f'<vehicle id="{name}" depart="{depart}"><route edges="{" ".join(route)}"/>'
        "</vehicle>"
        for name, depart in (("late", 5000), ("early", 20))
    )
    (town[0] / "odd.rou.xml").write_text(f"<routes>{late}{early}</routes>")
    scenario = load(
        town, {"from": route[0], "to": route[-1]}, {"route_files": ["odd.rou.xml"]}
    )
    _, seen = watch(scenario, tmp_path)
    assert "early" in seen


def test_ego_takes_the_place_of_a_vehicle(town, tmp_path):
    traffic = {"route_files": ["town.rou.xml"], "additional_files": ["stops.add.xml"]}
    scenario = load(town, {"vehicle": f"v{DRIVEN}"}, traffic)
    outcome, seen = watch(scenario, tmp_path)
    assert outcome.ending.status == "arrived"
    assert f"v{DRIVEN}" not in seen
    assert seen


def test_who_waits_to_enter_where_the_ego_takes_over_waits_on(town, tmp_path):
    """Two trips begin on one edge at one time: SUMO lets them in one by one."""
    route = " ".join(town[3][DRIVEN])
    trips = [
        f'<vehicle id="{name}" depart="30"><route edges="{route}"/></vehicle>'
        for name in ("me", "other")
    ]
    (town[0] / "two.rou.xml").write_text(f"<routes>{''.join(trips)}</routes>")
    scenario = load(town, {"vehicle": "me"}, {"route_files": ["two.rou.xml"]})
    outcome, seen = watch(scenario, tmp_path)
    assert outcome.ending.status == "arrived"
    assert "other" in seen


def test_a_vehicle_that_speeds_can_be_taken_over(town, tmp_path):
    """SUMO refuses departures above what the ego may drive on the lane."""
    folder = town[0]
    text = (folder / "town.rou.xml").read_text()
    speeding = f'id="v{DRIVEN}" departSpeed="16" type="car"'
    fast = re.sub(f'id="v{DRIVEN}" type="[a-z]+"', speeding, text)
    fast = fast.replace('<vType id="car"', '<vType id="car" speedFactor="1.5"')
    (folder / "fast.rou.xml").write_text(fast)
    assert fast.count('departSpeed="16"') == fast.count("speedFactor") == 1
    traffic = {"route_files": ["fast.rou.xml"], "additional_files": ["stops.add.xml"]}
    scenario = load(town, {"vehicle": f"v{DRIVEN}"}, traffic)
    speeds = []
    outcome = run_episode(
        scenario, out=tmp_path, on_step=lambda record: speeds.append(record.ego.speed)
    )
    assert outcome.ending.status != "simulator_failed"
    assert speeds[0] > 15.0


def test_sumos_driver_is_free_to_drive_in_a_vehicles_place(town, tmp_path):
    traffic = {"route_files": ["town.rou.xml"], "additional_files": ["stops.add.xml"]}
    scenario = load(town, {"vehicle": f"v{DRIVEN}"}, traffic, planner="sumo")
    speeds = []
    run_episode(
        scenario, out=tmp_path, on_step=lambda record: speeds.append(record.ego.speed)
    )
    assert max(speeds) > speeds[0] + 1.0


@pytest.mark.parametrize(
    ("network", "traffic", "expected"),
    [
        ({"vehicle": "v999"}, {"sumocfg": "town.sumocfg"}, 'no vehicle "v999"'),
        ({}, {"sumocfg": "gone.sumocfg"}, "no such configuration"),
        ({}, {"route_files": ["gone.rou.xml"]}, "no such demand file"),
        ({}, {"route_files": ["town.net.xml"]}, "no such demand file"),
        (
            {"vehicle": "v1"},
            {"own_veh_per_h": 100},
            "network.vehicle: is of a route file; allowed with traffic.sumocfg or",
        ),
        (
            {},
            {"sumocfg": "town.sumocfg", "own_veh_per_h": 100},
            "traffic.own_veh_per_h: does not go with sumocfg; allowed: sumocfg, ",
        ),
        ({}, {"additional_files": ["a"]}, "traffic.route_files: is missing"),
        (
            {},
            {"sumocfg": "a", "route_files": ["b"]},
            "traffic.route_files: is beside sumocfg; allowed: one of them",
        ),
    ],
)
def test_wrong_demand_is_one_line(town, tmp_path, network, traffic, expected):
    with pytest.raises(ConfigError) as caught:
        run_episode(load(town, network, traffic), out=tmp_path)
    assert expected in str(caught.value)
    assert "\n" not in str(caught.value)


def test_demand_of_another_network_is_refused(town, tmp_path):
    other = tmp_path / "other.net.xml"
    other.write_text(town[1].read_text() + "<!-- -->")
    scenario = load(town, {"file": str(other)}, {"sumocfg": "town.sumocfg"})
    with pytest.raises(ConfigError, match=r"is for the network .*generated.net.xml"):
        run_episode(scenario, out=tmp_path)


@pytest.mark.parametrize(
    ("vehicle", "expected"),
    [
        ('<trip id="a" type="ghost" depart="0" from="{0}" to="{1}"/>', "ghost"),
        ('<trip id="a" depart="abc" from="{0}" to="{1}"/>', "departure time"),
        ('<vType id="t" length="-4"/>', "length"),
    ],
)
def test_a_check_finds_what_sumo_refuses(town, tmp_path, vehicle, expected):
    folder, _, _, routes = town
    edges = routes[DRIVEN]
    content = vehicle.format(edges[0], edges[-1])
    (folder / "wrong.rou.xml").write_text(f"<routes>{content}</routes>")
    scenario = load(town, {}, {"route_files": ["wrong.rou.xml"]})
    with pytest.raises(ConfigError) as caught:
        preview(scenario)
    assert expected in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_demand_of_another_time_is_told_once(town, tmp_path, caplog):
    folder, _, _, routes = town
    edges = routes[DRIVEN]
    late = f'<trip id="a" depart="3600" from="{edges[0]}" to="{edges[-1]}"/>'
    (folder / "late.rou.xml").write_text(f"<routes>{late}</routes>")
    scenario = load(town, {}, {"route_files": ["late.rou.xml"]})
    assert len([x for x in preview(scenario).unusual if "No vehicle of late" in x]) == 1
    assert not caplog.records
    run_episode(scenario, out=tmp_path)
    (record,) = caplog.records
    assert "they depart from 3600 s to 3600 s" in record.getMessage()
