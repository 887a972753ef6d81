import shutil

import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st

from experiments.config.route_goal import (
    LONGEST_DURATION,
    SLOW,
    USUAL_DURATION,
    usual_duration,
)
from experiments.config.scenario_file import changed, load_scenario, scenario_document
from experiments.errors import ConfigError
from experiments.world_setup.layout import make_layout
from sumo_nets.catalogue import networks

NET = networks()["town"].net_file
PLACES = {"from": "00_10", "to": "30_31"}


@pytest.fixture
def folder(tmp_path):
    shutil.copy(NET, tmp_path / "own.net.xml")
    return tmp_path


def write(folder, **sections):
    file = folder / "own.yaml"
    network = {"file": "own.net.xml", **PLACES}
    file.write_text(yaml.safe_dump({"name": "own", "network": network, **sections}))
    return str(file)


@pytest.mark.parametrize("body", [{}, {"length_m": 9.0, "rear_overhang_m": 2.0}])
def test_goal_is_where_the_front_is_at_the_end_of_the_road(folder, body):
    scenario = load_scenario(write(folder, ego={"vehicle": body}))
    layout = make_layout(scenario)
    front = scenario.ego.goal + layout.task.vehicle.front_reach
    length = layout.road.path.length
    assert length - 1.0 - 0.01 * length <= front <= length
    expected = usual_duration(scenario.ego.goal)
    assert scenario.simulation.duration_s == expected > USUAL_DURATION


def test_what_is_given_stays(folder):
    given = {"ego": {"goal_m": 60.0}, "simulation": {"duration_s": 33.0}}
    scenario = load_scenario(write(folder, **given))
    assert scenario.ego.goal == 60.0
    assert scenario.simulation.duration_s == 33.0
    only_goal = load_scenario(write(folder, ego={"goal_m": 60.0}))
    assert only_goal.simulation.duration_s == USUAL_DURATION
    only_time = load_scenario(write(folder, simulation={"duration_s": 33.0}))
    assert only_time.ego.goal > 60.0
    assert only_time.simulation.duration_s == 33.0


def test_route_of_another_way_is_as_long_as_its_edges(folder):
    by_places = load_scenario(write(folder))
    network = make_layout(by_places).network
    named = write(folder, network={"file": "own.net.xml", "route": [*network.route]})
    assert load_scenario(named).ego.goal == by_places.ego.goal


def test_goal_follows_the_route_of_a_vehicle(folder):
    trip = '<trip id="t" depart="100" from="00_10" to="30_31"/>'
    (folder / "t.rou.xml").write_text(f"<routes>{trip}</routes>")
    of_vehicle = write(
        folder,
        network={"file": "own.net.xml", "vehicle": "t"},
        traffic={"route_files": ["t.rou.xml"]},
    )
    expected = load_scenario(write(folder)).ego.goal
    assert load_scenario(of_vehicle).ego.goal == expected


def test_goal_of_a_network_file_follows_the_options(folder):
    file = str(folder / "own.net.xml")
    there = [f"network.{key}={value}" for key, value in PLACES.items()]
    assert load_scenario(file).ego.goal == 300.0
    assert load_scenario(file, overrides=there).ego.goal > 330.0
    back = ["network.from=01_00", "network.to=00_10"]
    short = load_scenario(file, overrides=back)  # less than 300 m, and no word of it
    make_layout(short)
    assert short.ego.goal < 300.0


def test_goal_is_computed_anew_for_another_route(folder):
    document = changed(scenario_document(str(folder / "own.net.xml")), ())
    assert document.data["ego"]["goal_m"] == 300.0
    far = changed(
        document, [(("network", key), value, "a") for key, value in PLACES.items()]
    )
    assert far.data["ego"]["goal_m"] > 330.0
    assert document.data["ego"]["goal_m"] == 300.0
    given = changed(far, [(("ego", "goal_m"), 200.0, "b")])
    back = changed(given, [(("network", "to"), "A1B1", "c")])
    assert back.data["ego"]["goal_m"] == 200.0


def test_route_that_is_not_there_or_too_short_is_one_line(folder):
    file = write(folder)
    with pytest.raises(ConfigError, match=r'gone\]: network: .*no edge "gone"'):
        load_scenario(file, overrides=["network.via=[gone]"])
    with pytest.raises(ConfigError, match="too short for an ego that starts at 900 m"):
        load_scenario(file, overrides=["ego.start_m=900"])


@given(st.floats(0.0, 1e5))
def test_time_grows_with_the_distance_between_its_bounds(distance):
    time = usual_duration(distance)
    assert USUAL_DURATION <= time <= LONGEST_DURATION
    assert time >= distance / SLOW or time == LONGEST_DURATION
    assert usual_duration(distance + 10.0) >= time


def test_goal_of_a_random_route_is_some_way_ahead_of_the_start(folder):
    network = {"file": "own.net.xml"}
    near = load_scenario(write(folder, network=network))
    far = load_scenario(write(folder, network=network, ego={"start_m": 25.0}))
    assert near.ego.goal >= 100.0
    assert far.ego.goal == near.ego.goal + 25.0
    assert make_layout(far).road.path.length > far.ego.goal


DEMAND = """<routes>
    <trip id="mine" from="00_10" to="30_31" depart="3"/>
</routes>"""


def test_the_usual_flows_of_a_bare_network_give_way_to_a_demand(folder):
    net = str(folder / "own.net.xml")
    (folder / "own.rou.xml").write_text(DEMAND)
    files = "traffic.route_files=[own.rou.xml]"
    assert load_scenario(net).resolved()["traffic"]["cross_veh_per_h"] > 0.0
    for options in ([files], [files, "network.vehicle=mine"]):
        traffic = load_scenario(net, overrides=options).resolved()["traffic"]
        assert traffic["route_files"] == [str(folder / "own.rou.xml")]
        assert not any("veh_per_h" in key for key in traffic)
    swept = changed(
        scenario_document(net), [(("traffic", "route_files"), ["own.rou.xml"], "axes")]
    )
    assert "own_veh_per_h" not in swept.data["traffic"]
    with pytest.raises(ConfigError, match="own_veh_per_h: does not go with route_file"):
        load_scenario(net, overrides=[files, "traffic.own_veh_per_h=9"])


@pytest.mark.parametrize(
    ("option", "message"),
    [
        ("network.vehicle=mine", "network.vehicle: is of a route file; allowed with"),
        ("network.from=00_10", "network.to: is missing; allowed: from and to, with"),
        ("network.via=[00_10]", "network.from: is missing; allowed: from and to"),
    ],
)
def test_half_of_a_route_names_its_own_key(option, message, folder):
    with pytest.raises(ConfigError) as raised:
        load_scenario(str(folder / "own.net.xml"), overrides=[option])
    assert message in str(raised.value)
