"""Scenarios: what is accepted, what is refused, and in which words."""

import json
import re
from functools import cache
from pathlib import Path
from typing import get_args

import jsonschema
import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st

from experiments.config import Scenario, Traffic
from experiments.config.base import NAME
from experiments.config.scenario_file import (
    SCENARIO_FOLDER,
    SCHEMA_FILE,
    config_hash,
    load_scenario,
    scenario_names,
    schema_text,
)
from experiments.config.sections import scenario_name
from experiments.config.traffic import CarModel
from experiments.episode.run import make_scenario_planner
from experiments.episode.run_folder import folder_name
from experiments.errors import ConfigError
from experiments.world_setup.layout import make_layout
from experiments.world_setup.scenario_network import scenario_network
from experiments.world_setup.traffic import make_demand
from sumo_nets.catalogue import network
from sumo_nets.net_reader import read_net
from sumo_nets.vehicle_types import MODELS

SCENARIO = """\
name: test
world: kinematic
road:
  segments: [[line, 100], [clothoid, 20, 0, 0.05], [arc, 30, 0.05]]
ego:
  goal_m: 120
obstacles:
  - {s_m: 40, l_m: 1, radius_m: 1}
"""


@pytest.fixture
def file(tmp_path: Path) -> Path:
    path = tmp_path / "test.yaml"
    path.write_text(SCENARIO)
    return path


def refusal(file: Path, *overrides: str) -> str:
    with pytest.raises(ConfigError) as caught:
        load_scenario(str(file), overrides=overrides)
    message = str(caught.value)
    assert "\n" not in message
    return message


@pytest.mark.parametrize(
    "name", [x for x in scenario_names() if load_scenario(x).egos is None]
)
def test_shipped_scenarios_start_no_faster_than_they_want(name):
    scenario = load_scenario(name)
    start = scenario.ego.depart_speed_mps
    if start == "max":
        if scenario.world != "sumo":  # a kinematic world: the target speed
            assert scenario.world == "kinematic"
            return
        network = scenario_network(scenario)
        edge = read_net(network.net_file).edges[network.route[0]]
        start = edge.lanes[network.lane].speed
    assert start <= scenario.ego.target_speed_mps + 0.02


@pytest.mark.parametrize("name", scenario_names())
def test_shipped_scenarios_load_and_read_back(name, tmp_path):
    scenario = load_scenario(name)
    assert scenario.name == name
    assert scenario.purpose
    resolved = tmp_path / "config.yaml"
    resolved.write_text(yaml.safe_dump(scenario.resolved()))
    assert load_scenario(str(resolved)).resolved() == scenario.resolved()


@cache
def editors() -> jsonschema.protocols.Validator:
    schema = json.loads(SCHEMA_FILE.read_text())
    kind = jsonschema.validators.validator_for(schema)
    kind.check_schema(schema)
    return kind(schema)


def accepted_by_editors(data: object) -> None:
    error = jsonschema.exceptions.best_match(editors().iter_errors(data))
    if error is not None:
        raise error


@pytest.mark.parametrize("name", scenario_names())
def test_editors_accept_shipped_scenarios(name):
    text = (SCENARIO_FOLDER / f"{name}.yaml").read_text()
    assert text.startswith("# yaml-language-server: $schema=scenario.schema.json\n")
    accepted_by_editors(yaml.safe_load(text))


@pytest.mark.parametrize(
    "change",
    [
        {"ego": {"gol_m": 3}},
        {"ego": {"goal_m": "far"}},
        {"obstacles": "some"},
        {"planner": 3},
        {"world": "moon"},
    ],
)
def test_editors_refuse_mistakes(change):
    data = yaml.safe_load((SCENARIO_FOLDER / "straight.yaml").read_text())
    with pytest.raises(jsonschema.ValidationError):
        accepted_by_editors({**data, **change})


def test_committed_schema_is_current():
    assert SCHEMA_FILE.read_text(encoding="utf-8") == schema_text(), "run make schema"


@pytest.mark.parametrize(
    ("override", "message"),
    [
        (
            "ego.gol_m=3",
            "ego.gol_m: unknown key; did you mean goal_m? allowed: start_m,",
        ),
        ("ego.goal_m=true", "ego.goal_m: is true; allowed: a number >= 0 and <="),
        ("ego.goal_m='3'", "ego.goal_m: is the text '3'; allowed: a number"),
        ("ego.goal_m=12:30", "ego.goal_m: is the text '12:30'; allowed: a number"),
        ("ego.goal_m=.nan", "ego.goal_m: is nan; allowed: a number"),
        ("ego.goal_m=.inf", "ego.goal_m: is inf; allowed: a number"),
        ("ego.goal_m=-2", "ego.goal_m: is -2; allowed: a number >= 0"),
        ("ego.goal_m=160", "ego.goal_m: is 160; allowed: 0 to 150.0, the road's end"),
        ("ego.start_m=130", "ego.goal_m: is 120; allowed: more than start_m = 130"),
        ("ego.depart_speed_mps=fast", "allowed: a number >= 0 and <= 70 or max"),
        ("ego.depart_speed_mps=30", "at most vehicle.limits.max_speed_mps = 20"),
        ("simulation.seed=1.5", "simulation.seed: is 1.5; allowed: a whole number"),
        ("simulation.seed=true", "simulation.seed: is true; allowed: a whole number"),
        ("world=moon", "world: is the text 'moon'; allowed: sumo, kinematic"),
        ("world=sumo", "network: is missing; world sumo needs it"),
        ("network=straight", "network: is not for world kinematic; allowed: road"),
        ("traffic={}", "traffic: is not for world kinematic; allowed: vehicles"),
        ("obstacles=some", "allowed: none or a list or a section with random"),
        ("obstacles=[{s_m: 4}]", "obstacles[0]: allowed: radius_m, or length_m and"),
        ("obstacles[0].s_m=151", "obstacles[0].s_m: is 151; allowed: 0 to 150.0"),
        ("obstacles={listed: []}", "obstacles.listed: unknown key; allowed: random"),
        (
            "obstacles={random: {first_m: 9, spacing_m: [9, 5]}}",
            "obstacles.random.spacing_m: is [9, 5]; allowed: [least, most], rising",
        ),
        (
            "road.segments=[[line, 0]]",
            "road.segments[0][1]: is 0; allowed: a number > 0",
        ),
        (
            "road.segments=[[bow, 3]]",
            "road.segments[0]: is a list of 2; allowed: [line,",
        ),
        (
            "road.segments=[[arc, 3]]",
            "road.segments[0]: is a list of 2; allowed: [line,",
        ),
        ("road.segments=[]", "road.segments: is a list of 0; allowed:"),
        ("planner=[]", "planner: is a list of 0; allowed: text or a section with name"),
        ("name=no way", "name: is the text 'no way'; allowed: text of the form"),
        ("ego=3", "ego: is 3; allowed: a section with start_m"),
        ("road.lanes={count: 3, width_m: 3.5}", "lanes.width_m: is 3.5; allowed: at m"),
        ("simulation.without_ego=true", "is for world sumo, where vehicles react"),
        ("simulation.predictor=x", "allowed: constant_speed, held_braking"),
        ("simulation=null", "simulation: is empty; allowed: a section with step_s"),
        ("vehicles=[{s_m: 3}]", "vehicles[0].speed_mps: is missing; allowed: a number"),
        (
            "ego.vehicle.wheelbase_m=4",
            "wheelbase_m: is 4; allowed: at most length_m - rear_overhang_m = 3.8",
        ),
        (
            "ego.vehicle.limits.max_deceleration_mps2=9",
            "emergency_deceleration_mps2: is 8; allowed: at least",
        ),
    ],
)
def test_mistakes_name_key_and_allowed_values(file, override, message):
    assert message in refusal(file, override)


def test_mistakes_in_the_file_name_file_and_line(file):
    file.write_text(SCENARIO.replace("goal_m: 120", "goal_m: far"))
    assert refusal(file).startswith(f"{file}:6: ego.goal_m: is the text 'far'; allowed")
    file.write_text(SCENARIO + "name: again\n")
    assert refusal(file) == f"{file}:9: name: is given twice, first at {file}:1"
    file.write_text(SCENARIO.replace("name: test\n", ""))
    assert refusal(file).startswith(f"{file}:1: name: is missing; allowed: text")


def test_several_mistakes_are_counted(file):
    file.write_text(SCENARIO.replace("goal_m: 120", "goal_m: far\n  x: 1\n  y: 2"))
    assert refusal(file).endswith("(2 more mistakes in the file)")


@pytest.mark.parametrize("text", ["", "- a\n", "3\n"])
def test_a_file_without_keys(file, text):
    file.write_text(text)
    assert "holds no keys" in refusal(file)


@pytest.mark.parametrize(
    "override", ["ego.goal_m", "=3", "ego..goal_m=3", "a b=3", ".ego=3", "ego.goal_m=["]
)
def test_overrides_that_are_none(file, override):
    assert refusal(file, override).startswith(f"--set {override}: ")


def test_overrides_have_yaml_types_and_the_last_wins(file):
    scenario = load_scenario(
        str(file),
        overrides=(
            "ego.goal_m=1e2",
            "ego.goal_m=110",
            "obstacles[0].l_m=-2",
            "planner.settings.depth=3",
            "simulation.blocked_after_s=5",
        ),
    )
    assert scenario.ego.goal_m == 110.0
    assert scenario.obstacles.listed[0].l_m == -2.0
    assert scenario.planner.name == "cruise"
    assert scenario.planner.settings == {"depth": 3}
    assert scenario.simulation.blocked_after_s == 5.0


def test_none_means_nothing():
    scenario = load_scenario("straight", overrides=("traffic=none", "obstacles=none"))
    assert scenario.traffic is None
    assert scenario.obstacles.random is None
    assert scenario.resolved()["traffic"] == "none"
    assert load_scenario("straight").traffic == Traffic(
        own_veh_per_h=600.0, oncoming_veh_per_h=600.0
    )


def lane_change(*overrides: str) -> Traffic:
    traffic = load_scenario("lane_change", overrides=overrides).traffic
    assert traffic is not None
    return traffic


def test_tempers_are_shares_of_drivers():
    shares = {
        temper: (found.cautious_share, found.aggressive_share)
        for temper in ("cautious", "normal", "aggressive", "mixed", "null")
        for found in [lane_change(f"traffic.temper={temper}")]
    }
    assert shares == {
        "cautious": (1.0, 0.0),
        "normal": (0.0, 0.0),
        "aggressive": (0.0, 1.0),
        "mixed": (0.25, 0.2),
        "null": (0.25, 0.2),
    }
    assert lane_change("traffic.cautious_share=0.5").aggressive_share == 0.2


def test_a_density_stands_for_the_flow_of_each_lane_that_is_fed():
    def flow(name: str, *overrides: str) -> float:
        scenario = load_scenario(name, overrides=overrides)
        return make_demand(scenario, make_layout(scenario)).own_veh_per_h

    named = [
        flow("lane_change", f"traffic.density={d}")
        for d in ("light", "medium", "dense")
    ]
    assert named == [350.0, 700.0, 1200.0]
    assert flow("lane_change", "traffic.own_lane=null") == 2 * 700.0
    assert flow("lane_change_three") == 3 * 700.0
    assert flow("lane_change", "traffic.own_veh_per_h=80") == 80.0
    assert flow("curved", "traffic.density=light") == 3 * 350.0
    plain = ("traffic.density=null", "traffic.own_veh_per_h=80")
    assert flow("lane_change", *plain) == 80.0
    assert Traffic().own_veh_per_h == 900.0


@pytest.mark.parametrize(
    ("overrides", "message"),
    [
        (
            ["density=light", "own_veh_per_h=9"],
            "own_veh_per_h: is 9 beside density = light; allowed: one",
        ),
        (
            ["density=null", "own_veh_per_h=null"],
            "own_veh_per_h: is null; allowed: a ",
        ),
        (["density=thick"], "density: is the text 'thick'; allowed: light, medium, "),
        (["temper=calm"], "temper: is the text 'calm'; allowed: cautious, normal, ag"),
        (
            ["temper=normal", "aggressive_share=0.5"],
            "aggressive_share: is 0.5 beside temper = normal, which makes it 0;",
        ),
        (
            ["slow_leader={}"],
            "slow_leader.speed_mps: is missing; allowed: a number",
        ),
        (["slow_leader={speed_mps: 0}"], "slow_leader.speed_mps: is 0; allowed: a num"),
        (
            ["slow_leader={speed_mps: 9, kind: cart}"],
            "slow_leader.kind: is the text 'cart'; allowed: car, van, truck",
        ),
    ],
)
def test_mistakes_about_traffic(overrides, message):
    with pytest.raises(ConfigError) as error:
        lane_change(*(f"traffic.{one}" for one in overrides))
    assert message in str(error.value)
    assert " more " not in str(error.value)  # one mistake is one mistake


def test_options_come_before_overrides(file):
    scenario = load_scenario(
        str(file), planner="mine:make", seed=7, overrides=("planner.settings.a=1",)
    )
    assert scenario.planner.name == "mine:make"
    assert scenario.planner.settings == {"a": 1}
    assert scenario.simulation.seed == 7


@pytest.mark.parametrize(
    ("override", "message"),
    [
        ("planner.settings.drive.time_step=7", "planner.settings.drive.time_step: is"),
        ("planner.settings.drive={time_step: 7}", "planner.settings.drive.time_step: "),
        ("planner.settings.margins=[0, 1]", "planner.settings.margins: is [0, 1]; "),
        ("planner.name=dens", "planner: dens: no such planner; did you mean dense?"),
        ("planner=dens", "planner: dens: no such planner; did you mean dense?"),
    ],
)
def test_what_a_planner_refuses_names_the_option(override, message):
    scenario = load_scenario("dense", overrides=(override,))
    with pytest.raises(ConfigError) as caught:
        make_scenario_planner(scenario)
    assert str(caught.value).startswith(f"--set {override}: {message}")


def test_what_a_planner_refuses_of_the_file_names_its_line(file):
    file.write_text(SCENARIO + "planner:\n  name: cruse\n  settings: {margin: 1}\n")
    scenario = load_scenario(str(file), overrides=("planner.settings.times=[1]",))
    with pytest.raises(
        ConfigError, match=r"test\.yaml:10 with --set .*: planner: cruse: no"
    ):
        make_scenario_planner(scenario)


def test_a_clash_between_file_and_option_names_both(file):
    option = "ego.start_m=130"
    message = refusal(file, option, "planner=dense")
    where = f"{file}:6 with --set {option}, --set planner=dense"
    assert message.startswith(f"{where}: ego.goal_m: is 120; allowed: more than")
    assert " with --set" not in refusal(file, "ego.goal_m=-1")


@pytest.mark.parametrize(
    ("override", "problem"),
    [
        ("obstacles[1].s_m=3", "obstacles[1]: obstacles is a list of 1; allowed: obs"),
        ("obstacles.s_m=3", "obstacles.s_m: obstacles is a list of 1; allowed: obsta"),
        ("ego[0].goal_m=3", "ego[0]: ego is no list; allowed: ego.KEY"),
        ("world.goal_m=3", "world: is a section with keys; allowed: sumo, kinematic"),
        ("road.segments[0][0].x=3", "road.segments[0][0].x: road.segments[0][0] is no"),
    ],
)
def test_an_option_that_leads_nowhere_says_where_it_could_go(file, override, problem):
    assert refusal(file, override).startswith(f"--set {override}: {problem}")


@pytest.mark.parametrize(
    ("models", "problem"),
    [
        ("{IDMM: 1}", ".IDMM: unknown key; did you mean IDM? allowed: Krauss, IDM, "),
        ("{IDM: 0}", ".IDM: is 0; allowed: a number > 0 and <= 1000"),
        (
            "IDM",
            ": is the text 'IDM'; allowed: a section with Krauss, IDM, EIDM, ACC, ",
        ),
        ("[IDM]", ": is a list of 1; allowed: a section with Krauss, IDM, EIDM, ACC, "),
    ],
)
def test_car_following_models_are_named(models, problem):
    override = f"traffic.models={models}"
    with pytest.raises(ConfigError) as caught:
        load_scenario("straight", overrides=(override,))
    assert f"--set {override}: traffic.models{problem}" in str(caught.value)


def test_every_model_of_the_networks_can_be_asked_for():
    assert get_args(CarModel) == MODELS


def test_a_share_of_egos_replaces_the_number_of_the_file_and_back(tmp_path):
    for override, expected in (
        ("egos.penetration=0.5", (0.5, None)),
        ("egos.count=2", (None, 2)),
    ):
        group = load_scenario("ring", overrides=(override,)).egos[0]
        assert (group.penetration, group.count) == expected
    both = ("egos.penetration=0.5", "egos.count=2")
    with pytest.raises(ConfigError, match=r"egos\.count: is beside penetration"):
        load_scenario("ring", overrides=both)
    with pytest.raises(
        ConfigError, match=r"egos\.penetration: is missing; allowed: pe"
    ):
        load_scenario("ring", overrides=("egos={speed_factor: 1.0}",))


def test_another_planner_drops_the_settings_of_the_first(file):
    file.write_text(SCENARIO + "planner: {name: cruise, settings: {margin: 1.0}}\n")
    assert load_scenario(str(file)).planner.settings == {"margin": 1.0}
    assert load_scenario(str(file), planner="cruise").planner.settings
    assert not load_scenario(str(file), planner="cruise_conventional").planner.settings


def test_unknown_scenarios_suggest_a_close_one():
    with pytest.raises(ConfigError, match="did you mean intersection"):
        load_scenario("intersecton")
    with pytest.raises(ConfigError, match=r"none\.yaml: cannot be read"):
        load_scenario("none.yaml")


def test_the_default_planner_of_a_network_file_drives_routes(tmp_path):
    file = tmp_path / "mine.yaml"
    text = "name: mine\nego: {goal_m: 9}\nnetwork: {file: a.net.xml}\n"
    file.write_text(text)
    (tmp_path / "a.net.xml").write_text("<net/>")
    assert load_scenario(str(file)).planner.name == "route"
    set_so = load_scenario(str(file), overrides=["planner.settings.gain=2.0"])
    assert (set_so.planner.name, set_so.planner.settings) == ("route", {"gain": 2.0})
    file.write_text(text + "planner: cruise\n")
    assert load_scenario(str(file)).planner.name == "cruise"
    file.write_text(text.replace("{file: a.net.xml}", "straight"))
    assert load_scenario(str(file)).planner.name == "cruise"


def test_a_key_of_another_kind_of_section_is_told_from_a_misspelt_one(tmp_path):
    file = tmp_path / "mine.yaml"
    text = "name: mine\nego: {goal_m: 9}\nnetwork: {file: a.net.xml}\ntraffic: "
    file.write_text(text + "{sumocfg: a.sumocfg, own_veh_per_h: 100}\n")
    with pytest.raises(ConfigError) as caught:
        load_scenario(str(file))
    said = "traffic.own_veh_per_h: does not go with sumocfg; allowed: sumocfg, route_"
    assert said in str(caught.value)
    file.write_text(text + "{sumocfg: a.sumocfg, begin: 3}\n")
    with pytest.raises(ConfigError, match=r"begin: unknown key; did you mean begin_s"):
        load_scenario(str(file))


@given(st.text())
def test_any_text_makes_the_name_of_a_scenario(text):
    assert re.fullmatch(NAME, scenario_name(text))
    assert scenario_name(scenario_name(text)) == scenario_name(text)


@pytest.mark.sumo
def test_a_network_file_may_have_any_name(tmp_path):
    file = tmp_path / "Würzburg Süd.net.xml"
    file.write_bytes(network("straight").net_file.read_bytes())
    loaded = load_scenario(str(file))
    assert loaded.name == "W_rzburg_S_d"
    assert loaded.network.file == str(file)


def test_network_files_are_relative_to_the_scenario(tmp_path):
    path = tmp_path / "mine.yaml"
    path.write_text(
        "name: mine\nego: {goal_m: 9}\n"
        "network: {file: a.net.xml, route: [a], lane: 0}\n"
    )
    network = load_scenario(str(path)).network
    assert network is not None
    assert network.file == str(tmp_path / "a.net.xml")
    resolved = load_scenario(str(path)).resolved()["network"]
    assert resolved == {"file": network.file, "route": ["a"], "lane": 0}


@pytest.mark.parametrize(
    ("network", "message"),
    [
        (
            "{file: a.net.xml, lane: 0}",
            "lane: needs a route, from and to, or a vehicle",
        ),
        ("{file: a.net.xml, from: a}", "to: is missing"),
        ("{file: a.net.xml, to: a}", "from: is missing"),
        ("{file: a.net.xml, via: [b]}", "from: is missing"),
        ("{file: a.net.xml, route: [a], to: b}", "allowed: route, or from, via and to"),
        ("{name: curved, from: a}", "has its own route and lane"),
    ],
)
def test_half_a_way_through_a_network_is_refused(tmp_path, network, message):
    path = tmp_path / "mine.yaml"
    path.write_text(f"name: mine\nego: {{goal_m: 9}}\nnetwork: {network}\n")
    assert message in refusal(path)


def test_ways_through_a_network_read_back(tmp_path):
    path = tmp_path / "mine.yaml"
    for way in ("from: a\n  to: 17\n  via: [-4713, b]", "route: [283921463, -4713#1]"):
        path.write_text(
            f"name: mine\nego: {{goal_m: 9}}\nnetwork:\n  file: a.net.xml\n  {way}\n"
        )
        scenario = load_scenario(str(path))
        again = tmp_path / "again.yaml"
        again.write_text(yaml.safe_dump(scenario.resolved()))
        assert load_scenario(str(again)).resolved() == scenario.resolved()
    assert scenario.network is not None
    assert scenario.network.route == ("283921463", "-4713#1")


def test_hash_depends_on_content_only(file, tmp_path):
    one = load_scenario(str(file))
    moved = tmp_path / "other.yaml"
    moved.write_text(SCENARIO.replace("goal_m: 120", "goal_m: 1.2e2  # same"))
    other = load_scenario(str(moved))
    assert config_hash(one.resolved()) == config_hash(other.resolved())
    third = load_scenario(str(file), seed=1)
    assert config_hash(one.resolved()) != config_hash(third.resolved())


def test_sections_cannot_be_changed(file):
    scenario = load_scenario(str(file))
    with pytest.raises(ValueError, match="frozen"):
        scenario.ego.goal_m = 3.0
    assert isinstance(scenario, Scenario)


@pytest.mark.parametrize(
    ("overrides", "message"),
    [
        (["measurement.from_s=60"], "measurement.from_s: is 60; allowed: below simul"),
        (["measurement.from_s=61"], "allowed: below simulation.duration_s = 60"),
        (
            ["egos=[{penetration: 0.7}, {penetration: 0.4}]"],
            "egos: have penetrations of any vehicle that are 1.1 in sum; allowed: at ",
        ),
        (
            ["egos=[{penetration: 0.7}, {penetration: 0.4, of: [car, van]}]"],
            "egos: have penetrations of car that are 1.1 in sum; allowed: at most 1",
        ),
    ],
)
def test_mistakes_about_many_egos(overrides, message):
    with pytest.raises(ConfigError) as caught:
        load_scenario("motorway", overrides=["simulation.duration_s=60", *overrides])
    assert message in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    "egos",
    [
        "[{penetration: 0.1}, {penetration: 0.2}, {penetration: 0.7}]",
        "[{penetration: 0.7, of: car}, {penetration: 0.4, of: truck}]",
        "[{penetration: 1}, {count: 3}]",
    ],
)
def test_shares_of_all_vehicles_and_of_different_ones_are_allowed(egos):
    assert load_scenario("motorway", overrides=[f"egos={egos}"]).egos is not None


def test_a_name_that_no_folder_can_have_is_shown_in_part():
    with pytest.raises(ConfigError) as caught:
        load_scenario("straight", overrides=[f"name={'n' * 210}"])
    assert str(caught.value).endswith(
        f"name: is the text '{'n' * 60}...'; allowed: text of the form "
        "^[A-Za-z0-9_]+$ of at most 100 characters"
    )


def test_the_longest_names_make_a_folder(tmp_path):
    scenario = load_scenario("straight", overrides=[f"name={'n' * 100}"])
    planner = scenario.planner.model_copy(update={"name": f"{'m' * 200}:make"})
    longest = scenario.model_copy(update={"planner": planner})
    (tmp_path / folder_name(longest, "0" * 64)).mkdir()
