import json
import math
from pathlib import Path

import numpy as np
import pytest
import rearview

from experiments.config.scenario_file import load_scenario
from experiments.cosim.fleet.loop import FleetLoop
from experiments.cosim.sumo.fleet_world import SumoFleetWorld
from experiments.cosim.sumo.ghost_vehicle import Ghost
from experiments.cosim.sumo.lanes import route_strips
from experiments.cosim.sumo.system_libraries import load_libsumo
from experiments.episode.drive import run_scenario
from experiments.episode.fleet_preview import preview_fleet
from experiments.episode.run_folder import Outcome
from experiments.errors import ConfigError, ResultsError
from experiments.metrics.catalogue import ALL_COLUMNS
from experiments.metrics.row import read_row
from experiments.report.run_reader import read_run
from experiments.trace.files import read_table, read_trace
from experiments.trace.fleet import FLEET_TABLES
from tests.sumo_nets.generated import generate

pytestmark = pytest.mark.sumo
SHORT = ("simulation.warmup_s=12", "simulation.duration_s=4")


def run(folder: Path, *overrides: str, name: str = "motorway") -> Outcome:
    return run_scenario(load_scenario(name, overrides=[*SHORT, *overrides]), out=folder)


@pytest.fixture(scope="module")
def motorway(tmp_path_factory) -> Outcome:
    """Return one short run; tests read it and leave it as it is."""
    return run(tmp_path_factory.mktemp("motorway"))


def test_the_order_of_the_egos_does_not_matter(motorway, tmp_path, monkeypatch):
    in_order = FleetLoop._in_order
    monkeypatch.setattr(FleetLoop, "_in_order", lambda loop: in_order(loop)[::-1])
    reverse = run(tmp_path)
    assert motorway.row["egos_driven"] >= 4
    assert motorway.trace_hash == reverse.trace_hash


def test_run_folder_holds_tables_row_and_configuration(motorway, tmp_path):
    outcome = motorway
    row = read_row(outcome.folder)
    assert list(row) == list(ALL_COLUMNS)
    assert row["status"] == "arrived"
    assert 0.0 < row["egos_share"] < 1.0
    assert row["all_fuel_g_per_km"] > 0.0
    assert row["travel_time_s"] is None
    tables = {
        name: read_table(kinds, outcome.folder / f"{name}.parquet")
        for name, kinds in FLEET_TABLES.items()
    }
    assert len(tables["fleet_steps"]["index"]) == 41
    egos, fleet = tables["egos"], tables["fleet"]
    assert set(egos["id"]) == set(fleet["id"][np.ma.filled(fleet["group"], -1) == 0])
    again = load_scenario(str(outcome.folder / "config.yaml"))
    assert run_scenario(again, out=tmp_path).trace_hash == outcome.trace_hash
    manifest = json.loads((outcome.folder / "manifest.json").read_text())
    assert manifest["trace_hash"] == outcome.trace_hash
    assert manifest["planner"] == row["planner"] == "cruise"
    assert outcome.folder.name.startswith("motorway-cruise-1-")


def test_nobody_is_driven_at_0_and_labels_alone_change_nothing(tmp_path):
    none = run(tmp_path, "egos.penetration=0")
    assert none.row["egos_driven"] == 0
    assert none.row["planner"] == "sumo"
    labelled = run(tmp_path, "planner=sumo")
    assert labelled.row["egos_driven"] > 0
    assert labelled.row["all_mean_speed_mps"] == none.row["all_mean_speed_mps"]


def test_several_planners_share_a_simulation(tmp_path):
    scenario = load_scenario(str(_with_two_groups(tmp_path)))
    outcome = run_scenario(scenario, out=tmp_path)
    fleet = read_table(FLEET_TABLES["fleet"], outcome.folder / "fleet.parquet")
    assert set(fleet["group"].tolist()) == {None, 0, 1}
    assert outcome.row["planner"] == "cruise+idm_mobil"
    assert outcome.folder.name.startswith("two-cruise_idm_mobil-0-")


def test_a_planner_of_ones_own_plans_for_all_its_egos_at_once(tmp_path, monkeypatch):
    (tmp_path / "at_once.py").write_text(
        "from planner.cruise import proposed\n"
        "class AtOnce:\n"
        "    def plan(self, scene, memory):\n"
        "        raise AssertionError('a batch was offered')\n"
        "    def plan_many(self, scenes, memories):\n"
        "        return [proposed().plan(*x) for x in zip(scenes, memories)]\n"
        "def make():\n"
        "    return AtOnce()\n"
    )
    monkeypatch.syspath_prepend(str(tmp_path))
    short = ("simulation.duration_s=3", "egos.planner=at_once:make")
    at_once = run(tmp_path / "runs", *short)
    assert at_once.row["status"] == "arrived"
    assert at_once.row["egos_driven"] > 1


def test_a_check_says_who_drives_what(tmp_path):
    found = preview_fleet(load_scenario(str(_with_two_groups(tmp_path))))
    facts = dict(found.facts)
    assert facts["scenario"] == "two, driven by cruise+idm_mobil"
    assert facts["egos 1"].startswith("30 % of own, driven by idm_mobil: ")
    own = [int(facts[f"egos {k}"].split()[-4]) for k in range(2)]
    total, humans = (int(facts["traffic"].split()[k]) for k in (0, -4))
    assert sum(own) + humans == total
    assert min(own) > 0
    none = load_scenario("motorway", overrides=[*SHORT, "egos.penetration=0"])
    assert preview_fleet(none).unusual == ()
    with pytest.raises(ConfigError, match=r"egos\.of: is nobody; allowed: own, "):
        preview_fleet(load_scenario("motorway", overrides=["egos.of=nobody"]))


def _with_two_groups(folder: Path) -> Path:
    file = folder / "two.yaml"
    file.write_text(
        "name: two\nworld: sumo\nnetwork: motorway\negos:\n"
        "  - {penetration: 0.3, planner: cruise}\n"
        "  - {penetration: 0.3, planner: idm_mobil, of: own}\n"
        "traffic: {own_veh_per_h: 4500}\n"
        "simulation: {warmup_s: 12, duration_s: 2, predictor: held_braking}\n"
    )
    return file


@pytest.mark.slow
def test_an_ego_drives_round_and_round_a_ring(tmp_path):
    outcome = run(
        tmp_path,
        "simulation.warmup_s=5",
        "simulation.duration_s=90",
        "measurement.from_s=0",
        "egos.count=2",
        name="ring",
    )
    assert outcome.ending.status == "arrived"
    egos = read_table(FLEET_TABLES["egos"], outcome.folder / "egos.parquet")
    driven = egos["speed_mps"][egos["id"] == "car.0"].sum() * 0.1
    assert driven > 250.0  # more than a lap
    assert egos["off_road_m"].max() == 0.0
    assert outcome.row["egos_failed"] == 0


def test_egos_of_a_type_with_a_bounded_speed_factor_have_ghosts(tmp_path):
    # SUMO draws such a factor again until it is between its bounds: for ever, once
    short = ["simulation.duration_s=16", "measurement.from_s=0"]
    scenario = load_scenario("platoon", overrides=short)
    row = run_scenario(scenario, out=tmp_path).row
    assert row["egos_driven"] == 8


def test_egos_are_where_they_drive_not_where_sumo_has_them(tmp_path, monkeypatch):
    # before a line, and where a body swings out, SUMO has it elsewhere
    update = Ghost.update

    def beside(ghost, ego, body, front, **options):
        x, y = update(ghost, ego, body, front, **options)
        return x - 0.8 * math.sin(ego.heading), y + 0.8 * math.cos(ego.heading)

    monkeypatch.setattr(Ghost, "update", beside)
    folder = run(tmp_path).folder
    tables = [
        read_table(FLEET_TABLES[name], folder / f"{name}.parquet")
        for name in ("egos", "fleet")
    ]
    egos, fleet = (
        {key: row for row, key in enumerate(zip(t["index"], t["id"], strict=True))}
        for t in tables
    )
    rows = [(row, fleet[key]) for key, row in egos.items() if key in fleet]
    assert len(rows) > 100
    ego, seen = (
        np.array([[t[c][row] for c in ("x_m", "y_m")] for row in picked], float)
        for t, picked in zip(tables, zip(*rows, strict=True), strict=True)
    )
    heading = np.array([tables[0]["heading_rad"][row] for row, _ in rows], float)
    away = seen - ego
    sideways = away[:, 1] * np.cos(heading) - away[:, 0] * np.sin(heading)
    assert np.abs(sideways).max() < 1e-6


def test_pictures_and_trace_are_of_a_single_ego(motorway):
    folder = motorway.folder
    for read in (read_trace, read_run):
        with pytest.raises(ResultsError, match="is a run with many egos"):
            read(folder)
    frames = rearview.Run.open(folder).frames()
    assert set(frames) == set(FLEET_TABLES)
    assert len(frames["fleet_steps"]) == 41


@pytest.mark.parametrize(
    ("override", "words"),
    [
        ("egos.penetration=1.5", "egos.penetration: is 1.5; allowed: a number >= 0"),
        ("egos.planner=sumo_tuned", "is sumo_tuned; allowed: a planner, or sumo"),
        ("egos.on_failure=stop", "on_failure: is the text 'stop'; allowed: hand_back"),
        ("egos.of=truk", "egos.of: is truk; allowed: own, "),
        ("egos.shares=1", "egos.shares: unknown key"),
        ("ego.goal_m=100", "egos: is beside ego; allowed: one of them"),
        ("simulation.without_ego=true", "is of a single ego; allowed: false"),
        ("traffic.own_veh_per_h=0", "egos: needs vehicles"),
        ("planner=cruse", "planner: cruse: no such planner"),
        ("simulation.planning_delay_s=0.1", "planning_delay_s: is of a single ego"),
        ("simulation.planning_period_s=0.5", "planning_period_s: is of a single ego"),
        ("traffic.relaxation_s=8", "relaxation_s: is of a single ego; allowed: 0"),
        ("traffic.drivers=distracted", "traffic.drivers: err, which is of a single"),
    ],
)
def test_mistakes_are_one_line(tmp_path, override, words):
    with pytest.raises(ConfigError) as caught:
        run(tmp_path, override)
    assert words in str(caught.value)
    assert "\n" not in str(caught.value)
    assert not list(tmp_path.iterdir())


def test_detectors_have_to_be_on_the_network(tmp_path):
    for detector, words in (
        ("{edge: on, at_m: 1}", "edge: is on; allowed: own"),
        ("{edge: own, at_m: 9999}", "at_m: is 9999; allowed: 0 to 5000.0"),
    ):
        file = _with_two_groups(tmp_path)
        text = f"measurement: {{detectors: [{detector}]}}\n"
        file.write_text(file.read_text() + text)
        with pytest.raises(ConfigError, match=r"measurement\.detectors") as caught:
            run_scenario(load_scenario(str(file)), out=tmp_path / "runs")
        assert words in str(caught.value)


LOOP = "A1B1 B1B2 B2A2 A2A1 A1A0 A0B0 B0B1 B1C1"  # over B1 twice
LOOP_LIST = ", ".join(LOOP.split())


def _loop(folder: Path) -> Path:
    """Write a scenario in which the ego's route crosses itself."""
    net = generate(folder, "--grid", "--grid.number=3", "--grid.length=80", "-L2")
    (folder / "one.rou.xml").write_text(
        f'<routes><vType id="car"/><route id="loop" edges="{LOOP}"/>'
        '<vehicle id="one" type="car" route="loop" depart="1"/></routes>'
    )
    file = folder / "loop.yaml"
    file.write_text(
        f"name: loop\nnetwork: {{file: {net.name}, route: [{LOOP_LIST}]}}\n"
        "traffic: {route_files: [one.rou.xml]}\n"
        "egos: {of: one, count: 1, planner: route}\n"
        "simulation: {warmup_s: 0, duration_s: 120}\n"
    )
    return file


@pytest.mark.slow
def test_an_ego_keeps_to_its_pass_where_its_route_crosses_itself(tmp_path, monkeypatch):
    expected, driven = [], []
    advance = SumoFleetWorld.advance

    def note(world, egos, waiting):
        sumo = load_libsumo()
        if not expected:
            expected.extend(x[0].edge for x in route_strips(sumo, LOOP.split()))
        edge = sumo.vehicle.getLaneID("one").rpartition("_")[0] if egos else ""
        if edge and driven[-1:] != [edge]:
            driven.append(edge)
        advance(world, egos, waiting)

    monkeypatch.setattr(SumoFleetWorld, "advance", note)
    outcome = run_scenario(load_scenario(str(_loop(tmp_path))), out=tmp_path / "runs")
    assert outcome.ending.status == "arrived"
    assert outcome.row["egos_failed"] == 0
    assert driven == expected[: len(driven)]
    assert "B1C1" in driven
