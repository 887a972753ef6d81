"""`rearview net`, `check` and `new`: networks, scenarios and skeletons before a run."""

import os
import re
import shlex
import subprocess
import sys

import pytest
import typer.main

from experiments.cli.app import app
from experiments.config.scenario_file import load_scenario
from experiments.config.sweep_file import load_sweep
from experiments.episode.preview import preview
from experiments.sweep.plan import Plan
from sumo_nets.build import net_path
from tests.docs.documents import parse


def called(capsys, *arguments):
    with pytest.raises(SystemExit) as left:
        app([str(argument) for argument in arguments])
    out, err = capsys.readouterr()
    return left.value.code or 0, out, err


def test_edges_of_a_network(tmp_path, capsys):
    code, out, err = called(capsys, "net", "intersection", "-o", tmp_path / "net.svg")
    assert (code, err) == (0, "")
    assert "8 edges for cars, 1 junction, 1 signal, traffic on the right" in out
    row = next(line for line in out.splitlines() if line.startswith("west_in "))
    assert row.split() == [
        *("west_in", "3", "130.0", "13.89", "signal"),
        *("south_out", "east_out", "north_out"),
    ]
    drawn = (tmp_path / "net.svg").read_text()
    assert all(f">{name}<" in drawn for name in ("west_in", "north_out"))


def test_a_file_that_is_no_network_is_one_line(tmp_path, capsys):
    bad = tmp_path / "my.net.xml"
    bad.write_text("<osm/>")
    for name in (bad, tmp_path / "none.net.xml"):
        code, out, err = called(capsys, "net", name)
        assert (code, out, err.count("\n")) == (2, "", 1)
        assert str(name) in err
    code, _, err = called(capsys, "net", "intersection", "-o", "net.bmp")
    assert (code, "allowed: .png, .svg, .pdf" in err) == (2, True)


def test_check_places_signals_bend_and_goal(tmp_path, capsys):
    code, out, err = called(
        capsys, "check", "intersection", "-o", tmp_path / "route.svg"
    )
    assert (code, err) == (0, "")
    facts = dict(re.split(r"  +", line, maxsplit=1) for line in out.splitlines()[:-1])
    assert facts["route"] == "west_in north_out, lane 1"
    assert facts["signals"] == "signal at 130 m"
    assert facts["junctions"] == "1 of 1 before the goal"
    assert "unusual" not in out
    drawn = (tmp_path / "route.svg").read_text()
    assert all(f">{word}<" in drawn for word in ("start", "goal", "sharpest bend"))


@pytest.mark.parametrize(
    ("overrides", "words"),
    [
        (["ego.goal_m=120"], "The goal at 120 m lies before the junction at 13"),
        (["ego.goal_m=145"], "The goal lies inside a junction"),
        (["ego.target_speed_mps=18"], "is above a limit of 13.89 m/s"),
        (["simulation.duration_s=15"], "leaves little time to wait"),
        (["traffic=none", "obstacles=none"], "neither traffic nor an obstacle"),
        (["traffic.own_veh_per_h=9000"], "vehicles an hour and lane"),
        (
            ["ego.vehicle.limits.max_curvature_1pm=0.03"],
            "of the ego's curvature: beside the path",
        ),
    ],
)
def test_what_is_unusual_is_said(overrides, words):
    found = preview(load_scenario("intersection", overrides=overrides))
    assert any(words in sentence for sentence in found.unusual), found.unusual


def test_a_scenario_that_cannot_be_run_is_one_line(capsys):
    for change in ("ego.goal_m=9000", "ego.goal=1", "planner=nobody"):
        code, out, err = called(capsys, "check", "intersection", "--set", change)
        assert (code, out, err.count("\n")) == (2, "", 1)


def test_skeletons_are_files_that_work(tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for kind in ("scenario", "sweep", "planner"):
        code, out, _ = called(capsys, "new", kind, f"own_{kind}")
        suffix = "py" if kind == "planner" else "yaml"
        assert (code, out) == (0, f"own_{kind}.{suffix}\n")
    assert preview(load_scenario("own_scenario.yaml")).unusual == ()
    sweep, document = load_sweep("own_sweep.yaml")
    assert len(list(Plan(sweep, document))) == sweep.count == 60
    code, out, err = called(capsys, "new", "sweep", "own_sweep")
    assert (code, out, err.count("\n")) == (2, "", 1)
    assert called(capsys, "new", "sweep", "a/b")[0] == 2


@pytest.mark.sumo
def test_the_planner_of_the_skeleton_drives(tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(str(tmp_path))
    called(capsys, "new", "planner", "own_skeleton")
    try:
        code, _, _ = called(
            *(capsys, "run", "straight", "--planner", "own_skeleton:make"),
            *("--set", "obstacles=none", "--set", "traffic=none"),
        )
    finally:
        sys.modules.pop("own_skeleton", None)
    assert code == 0, "arrived"
    assert len(list(tmp_path.glob("runs/*/report.html"))) == 1


@pytest.mark.parametrize("name", sorted(typer.main.get_command(app).commands))
def test_every_command_shows_an_example_that_parses_and_its_statuses(name, capsys):
    code, out, _ = called(capsys, name, "--help")
    words = " ".join(out.split())
    assert code == 0
    assert "Exit status: " in words
    (found,) = re.findall(r"Examples?: (.*?)(?: Exit status:)", words)
    for example in found.split("; "):
        arguments = shlex.split(example)
        assert arguments[:2] == ["rearview", name]
        parse(arguments[1:])


def test_the_shell_is_told_the_commands():
    environment = {
        **os.environ,
        "_REARVIEW_COMPLETE": "complete_bash",
        "COMP_WORDS": "rearview comp",
        "COMP_CWORD": "1",
    }
    done = subprocess.run(
        [sys.executable, "-m", "experiments"],
        env=environment,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.stdout.split() == ["compare", "compare-runs", "compile"]


def test_an_unknown_network_is_told_from_a_missing_file(capsys):
    code, out, err = called(capsys, "net", "intersectoin")
    assert (code, out, err.count("\n")) == (2, "", 1)
    assert "neither a network file nor a shipped network; did you mean inter" in err


def test_check_names_the_lane_that_is_driven(capsys):
    file = net_path("intersection")
    network = f"network={{file: {file}, route: [west_in, north_out], lane: 0}}"
    code, out, err = called(capsys, "check", "intersection", "--set", network)
    assert code == 0
    assert err.startswith("rearview: ")
    assert "lane 0" in err
    assert re.search(r"^route +west_in north_out, lane [12]$", out, re.MULTILINE)
