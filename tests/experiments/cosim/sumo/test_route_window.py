"""SUMO counts the ego on the pass over a junction that it drives, not on another."""

from itertools import pairwise

import pytest
import yaml

from experiments.config.scenario_file import load_scenario
from experiments.cosim.sumo.lanes import route_strips
from experiments.cosim.sumo.route_window import RouteWindow, window_ends
from experiments.cosim.sumo.system_libraries import load_libsumo
from experiments.episode.run import run_episode
from tests.sumo_nets.generated import generate

LOOP = ("A1B1", "B1B2", "B2A2", "A2A1", "A1A0", "A0B0", "B0B1", "B1C1")


def ends(*places):
    return window_ends(list(pairwise(places)))


def test_all_of_a_route_is_known_that_passes_no_junction_twice():
    assert ends("a", "b", "c", "d") == [3, 3, 3]


def test_what_is_known_ends_before_a_junction_comes_again():
    # over b twice: on the first edge only the way up to there is known
    assert ends("a", "b", "c", "d", "b", "e") == [3, 3, 5, 5, 5]


def test_the_next_edge_is_known_where_the_road_leads_back():
    assert ends("a", "b", "a", "c") == [2, 3, 3]


class FakeSumo:
    """One vehicle on a route; notes what it is told."""

    def __init__(self, junctions):
        self.edge = self.vehicle = self.route = self
        self.junctions = junctions
        self.told, self.added = [], {}
        self.index, self.road = 0, "e0"

    def getFromJunction(self, edge):
        return self.junctions[int(edge[1:])]

    def getToJunction(self, edge):
        return self.junctions[int(edge[1:]) + 1]

    def getRouteIndex(self, _vehicle):
        return self.index

    def getRoadID(self, _vehicle):
        return self.road

    def setRouteID(self, _vehicle, name):
        self.told.append(self.added[name])
        self.index = self.added[name].index(self.road)

    def getIDList(self):
        return tuple(self.added)

    def add(self, name, edges):
        self.added[name] = edges


def test_a_new_part_is_told_on_an_edge_and_begins_one_before():
    sumo = FakeSumo("abcdbe")
    window = RouteWindow(sumo, "ego", "route", [f"e{k}" for k in range(5)])
    assert window.is_needed
    assert window.update()
    assert sumo.told == [["e0", "e1", "e2"]]
    assert window.beyond() == ("e3", "e4")
    assert not window.update()
    sumo.index, sumo.road = 2, ":c_0"
    assert not window.update()  # inside a junction
    sumo.road = "e2"
    assert window.update()
    assert sumo.told[-1] == ["e1", "e2", "e3", "e4"]
    assert window.beyond() == ()
    assert sumo.added[window.route_id] == sumo.told[-1]
    assert window.left() == ("e2", "e3", "e4")
    sumo.index, sumo.road = 2, "e3"
    assert not window.update()
    assert window.left() == ("e3", "e4")


def drive(folder, route, note):
    """Drive a route through a grid; returns the outcome."""
    file = generate(folder, "--grid", "--grid.number=3", "--grid.length=80", "-L2")
    content = {
        "name": "loop",
        "network": {"file": file.name, "route": list(route)},
        "ego": {"start_m": 40.0, "goal_m": 540.0 if route is LOOP else 440.0},
        "traffic": {"own_veh_per_h": 0},
        "planner": "route",
        "simulation": {"warmup_s": 0, "duration_s": 120},
    }
    scenario = folder / "loop.yaml"
    scenario.write_text(yaml.safe_dump(content))
    return run_episode(load_scenario(str(scenario)), out=folder, on_step=note)


@pytest.mark.sumo
def test_ego_keeps_to_its_pass_where_its_route_crosses_itself(tmp_path):
    sumo, driven = load_libsumo(), []

    def note(_record):
        lane = sumo.vehicle.getLaneID("ego")
        edge = lane.rpartition("_")[0]
        if not driven:
            strips = route_strips(sumo, LOOP)
            expected.extend(strip[0].edge for strip in strips)
        if edge and driven[-1:] != [edge]:
            driven.append(edge)

    expected: list[str] = []
    outcome = drive(tmp_path, LOOP, note)
    assert outcome.ending.status.value == "arrived"
    assert driven == expected[: len(driven)]
    assert "B0B1" in driven


@pytest.mark.sumo
def test_on_the_way_back_the_way_out_is_forgotten(tmp_path):
    """It is the lane beside: an ego that swings out would be put on it by SUMO."""
    sumo, known = load_libsumo(), {}

    def note(_record):
        edge = sumo.vehicle.getRoadID("ego")
        known.setdefault(edge, set(sumo.vehicle.getRoute("ego")))

    route = ("A1B1", "B1C1", "C1C2", "C2B2", "B2B1", "B1A1")
    assert drive(tmp_path, route, note).ending.status.value == "arrived"
    assert "B1A1" in known["B1A1"]
    assert "A1B1" not in known["B1A1"]
