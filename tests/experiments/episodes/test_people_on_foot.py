"""People on foot at crossings: who has the right of way is waited for, in real SUMO."""

import os
import subprocess

import pytest
import yaml

from experiments.config.scenario_file import load_scenario
from experiments.episode.run import run_episode
from sumo_nets.lane_choice import choose_lanes
from sumo_nets.net_reader import read_net
from sumo_nets.right_of_way import passages
from tests.sumo_nets.generated import netgenerate

NODES = """<nodes><node id="a" x="0" y="0"/><node id="b" x="150" y="0"/>
<node id="c" x="320" y="0"/></nodes>"""
EDGES = """<edges><edge id="in" from="a" to="b" speed="13.8"/>
<edge id="-in" from="b" to="a" speed="13.8"/>
<edge id="out" from="b" to="c" speed="13.8"/>
<edge id="-out" from="c" to="b" speed="13.8"/></edges>"""
CROSSING = """<connections><crossing node="b" edges="in -in" priority="{}"/>
</connections>"""
FREE = 17.4  # without people on the road [s]
PEOPLE = """<routes><personFlow id="p" begin="0" end="60" period="{}" departPos="100">
<walk from="-out" to="in"/></personFlow></routes>"""


def road_with_a_crossing(folder, priority):
    """Build a straight road that people cross in the middle."""
    program = netgenerate().with_name("netconvert")
    parts = {"nod": NODES, "edg": EDGES, "con": CROSSING.format(priority)}
    for kind, text in parts.items():
        (folder / f"n.{kind}.xml").write_text(text)
    file = folder / "n.net.xml"
    options = ["--sidewalks.guess", "--sidewalks.guess.from-permissions=false"]
    sources = [f"-{kind[0]}={folder}/n.{kind}.xml" for kind in ("nod", "edg")]
    command = [program, *sources, f"-x={folder}/n.con.xml", *options, "-o", file]
    home = str(program.parent.parent)
    subprocess.run(
        command, env={**os.environ, "SUMO_HOME": home}, capture_output=True, check=True
    )
    return file


def crossed_in(file):
    net = read_net(file)
    (passage,) = (x for x in passages(net, choose_lanes(net, ("in", "out"), 1)) if x)
    (crossing,) = passage.crossings
    return crossing


@pytest.mark.parametrize("priority", [True, False])
def test_who_goes_first_at_a_crossing_is_read_from_the_network(tmp_path, priority):
    crossing = crossed_in(road_with_a_crossing(tmp_path, str(priority).lower()))
    assert crossing.goes_first is priority
    assert crossing.gives_way is not priority
    assert crossing.lane.edge.id == ":b_c0"
    assert set(crossing.corners) == {":b_w0", ":b_w1"}


def drive(folder, seed, period=3):
    content = {
        "name": "zebra",
        "network": {"file": str(folder / "n.net.xml"), "route": ["in", "out"]},
        "ego": {"start_m": 10.0, "goal_m": 250.0},
        "traffic": {"route_files": [str(folder / "p.rou.xml")]},
        "planner": "route",
        "simulation": {"seed": seed, "warmup_s": 55, "duration_s": 120},
    }
    (folder / "p.rou.xml").write_text(PEOPLE.format(period))
    file = folder / "zebra.yaml"
    file.write_text(yaml.safe_dump(content))
    return run_episode(load_scenario(str(file)), out=folder / "runs")


@pytest.mark.sumo
@pytest.mark.parametrize(
    "seed", [2, *(pytest.param(k, marks=pytest.mark.slow) for k in (0, 1))]
)
def test_people_with_the_right_of_way_are_waited_for(tmp_path, seed):
    road_with_a_crossing(tmp_path, "true")
    outcome = drive(tmp_path, seed)
    assert outcome.ending.status.value == "arrived"
    assert outcome.row["collisions"] == 0
    assert outcome.row["line_violations"] == 0
    # they come one after the other: it stands, or slows down until there is a gap
    assert outcome.row["travel_time_s"] > FREE + 0.5
    assert outcome.row["min_clearance_m"] > 0.5


@pytest.mark.sumo
def test_people_who_give_way_are_not_waited_for(tmp_path):
    road_with_a_crossing(tmp_path, "false")
    outcome = drive(tmp_path, 0)
    assert outcome.ending.status.value == "arrived"
    assert outcome.row["travel_time_s"] < FREE + 2.0
    assert outcome.row["collisions"] == 0
