"""Every command of the documents is one that make and rearview take."""

import re
import shlex
import shutil
from pathlib import Path

import pytest
import yaml

from experiments.cli.app import app
from experiments.config.scenario_file import load_scenario, scenario_names
from experiments.config.search_file import search_names
from experiments.config.sweep_file import load_sweep, sweep_names
from experiments.planners.registry import PLANNERS
from sumo_nets.build import net_path
from tests.docs.documents import (
    TEXTS,
    all_commands,
    blocks,
    commands,
    make,
    parse,
    rearview,
    rearview_arguments,
)

COMMANDS = all_commands()
OWN_SCENARIOS = {"my_road.yaml", "my.net.xml", "mine.xml", "two_egos.xml"}
OWN_SWEEPS = {
    "against_peers.yaml",
    "ci.yaml",
    "learned.yaml",
    "mine.yaml",
    "study.yaml",
    "question.yaml",
}
OWN_PLANNER = "my_planner:make"
PEER = "rearview.peers:fiss_plus"  # of others, see docs/planners/peers.md
CHEAP = [
    "rearview list",
    "rearview schema",
    "rearview schema --sweep",
    "rearview --version",
]
DRIVES = [
    command
    for command in COMMANDS
    if command.startswith("rearview run ")
    and "--gui" not in command
    and not re.search(r"(?<!\.net)\.xml", command)  # of CommonRoad: driven elsewhere
]


@pytest.mark.skipif(not shutil.which("make"), reason="needs make")
@pytest.mark.parametrize("command", COMMANDS)
def test_commands_parse(command):
    arguments = rearview_arguments(command)
    if not arguments or arguments[0] == "--version" or "--help" in arguments:
        return
    given = parse(arguments).params
    if "file" in given and given["file"] not in OWN_SWEEPS:
        names = search_names() if arguments[0] == "search" else sweep_names()
        assert given["file"] in names
    if "scenario" not in given or given["scenario"] in OWN_SCENARIOS:
        return
    assert given["planner"] in (None, OWN_PLANNER, PEER, *PLANNERS)
    assert given["scenario"] in scenario_names() or Path(given["scenario"]).is_file()
    load_scenario(
        given["scenario"],
        planner=given["planner"],
        seed=given["seed"],
        overrides=given["overrides"] or (),
    )


@pytest.mark.parametrize("command", CHEAP)
def test_cheap_commands_work(command, capsys):
    assert command in COMMANDS
    with pytest.raises(SystemExit) as left:
        app(shlex.split(command)[1:])
    out, err = capsys.readouterr()
    assert (left.value.code, err) == (0, "")
    assert out.strip()


@pytest.mark.slow
@pytest.mark.sumo
@pytest.mark.parametrize("command", DRIVES)
def test_episodes_of_the_documents_are_driven(command, tmp_path):
    (planner,) = blocks(TEXTS["docs/tutorials/own_planner.md"], "python")
    (tmp_path / "my_planner.py").write_text(planner, encoding="utf-8")
    road, *_ = blocks(TEXTS["docs/tutorials/own_network.md"], "yaml")
    (tmp_path / "my_road.yaml").write_text(road, encoding="utf-8")
    shutil.copy(net_path("intersection"), tmp_path / "my.net.xml")
    done = rearview(*shlex.split(command)[1:], folder=tmp_path)
    assert done.returncode in (0, 1), done.stderr  # an outcome, whatever it is
    assert len(list(tmp_path.glob("runs/*/report.html"))) == 1


@pytest.mark.slow
@pytest.mark.sumo
def test_pictures_of_a_run_are_drawn(tmp_path):
    done = rearview("run", "thesis_straight", folder=tmp_path)
    assert done.returncode == 0, done.stderr
    (run,) = tmp_path.glob("runs/*")
    drawn = [
        command.replace("runs/some", str(run))
        for command in commands(TEXTS["docs/reference/pages.md"])
        if re.match(r"rearview (report|figure|video) ?(?!sweeps)", command)
        and "sweeps/" not in command
    ]
    assert len(drawn) == 6
    for command in drawn:
        done = rearview(*shlex.split(command)[1:], folder=tmp_path)
        assert done.returncode == 0, command + done.stderr


@pytest.mark.slow
@pytest.mark.sumo
def test_sweep_of_the_tutorial_works_as_written(tmp_path):
    text = TEXTS["docs/tutorials/sweep.md"]
    (study,) = blocks(text, "yaml")
    (tmp_path / "study.yaml").write_text(study, encoding="utf-8")
    assert load_sweep(str(tmp_path / "study.yaml"))[0].count == 240
    few = study.replace("count: 30", "count: 2")
    (tmp_path / "study.yaml").write_text(few, encoding="utf-8")
    for command in commands(text):
        words = shlex.split(command)[1:]
        if words[0] == "rerun":
            runs = sorted(tmp_path.glob("sweeps/study/runs/*/*"))
            words[-1] = runs[0].name[:8]
        done = rearview(*words, folder=tmp_path)
        assert done.returncode == 0, command + done.stderr


@pytest.mark.slow
@pytest.mark.sumo
def test_the_tutorial_from_question_to_figure_works_as_written(tmp_path):
    """As written, with 1 seed in the place of 20 and 2 settings in that of 3."""
    text = TEXTS["docs/tutorials/question.md"]
    (planner,) = blocks(TEXTS["docs/tutorials/own_planner.md"], "python")
    (tmp_path / "my_planner.py").write_text(planner, encoding="utf-8")
    (question,) = blocks(text, "yaml")
    assert len(question.splitlines()) <= 12
    given = [command for command in commands(text) if command.startswith("rearview ")]
    assert len(given) <= 8
    few = question.replace("count: 20", "count: 1").replace(", 3.0, 4.0]", ", 4.0]")
    (tmp_path / "question.yaml").write_text(few, encoding="utf-8")
    for command in given:
        words = shlex.split(command)[1:]
        if words[0] == "events":
            words[1] = str(next(tmp_path.glob("sweeps/question/reruns/*")))
        done = rearview(*words, folder=tmp_path)
        assert done.returncode == 0, command + done.stderr
    for name in ("route.png", "table.tex", "pairs.pdf", "pairs.csv", "worst.html"):
        assert (tmp_path / name).is_file()
    assert "mine, braking 2" in (tmp_path / "table.tex").read_text()


def test_sweep_of_the_tutorial_has_as_many_runs_as_it_says(tmp_path):
    text = TEXTS["docs/tutorials/sweep.md"]
    (study,) = blocks(text, "yaml")
    (tmp_path / "study.yaml").write_text(study, encoding="utf-8")
    count = load_sweep(str(tmp_path / "study.yaml"))[0].count
    assert f"# {count} runs" in text


def test_scenario_of_the_reference_is_valid(tmp_path):
    texts = blocks(TEXTS["docs/reference/scenario_files.md"], "yaml")
    found = [text for text in texts if text.startswith("name:")]
    assert len(found) == 2
    for text, name in zip(found, ("mixed", "bend"), strict=True):
        (tmp_path / f"{name}.yaml").write_text(text, encoding="utf-8")
        assert load_scenario(str(tmp_path / f"{name}.yaml")).name == name


def test_closure_of_the_reference_is_that_of_the_shipped_scenario():
    texts = blocks(TEXTS["docs/reference/scenario_files.md"], "yaml")
    (text,) = (found for found in texts if found.startswith("obstacles:"))
    shown = yaml.safe_load(text)["obstacles"]
    shipped = load_scenario("lane_change").obstacles
    assert shown["closure"] == shipped.closure
    assert shown["known_from_m"] == shipped.known_from_m
    assert shown["listed"][0]["s_m"] == shipped.listed[0].s_m


@pytest.mark.skipif(not shutil.which("make"), reason="needs make")
def test_make_help_names_every_command_of_the_documents():
    shown = make("help").stdout
    for name, text in TEXTS.items():
        for target in re.findall(r"[`(]make ([a-z0-9-]+)", text):
            assert f"make {target} " in shown, f"{name}: make {target}"
