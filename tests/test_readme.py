"""What the documents say can be done: every command, example, link and path."""

import os
import re
import shlex
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
import typer
import typer.main

from experiments.cli.app import app
from experiments.cli.compile_notice import NOTICE
from experiments.config.scenario_file import load_scenario, scenario_names
from experiments.config.sweep_file import load_sweep
from experiments.metrics.catalogue import IN_TERMINAL
from experiments.planners.registry import PLANNERS
from sumo_nets.build import net_path

ROOT = Path(__file__).parent.parent
README = (ROOT / "README.md").read_text(encoding="utf-8")
DOCUMENTS = sorted(
    path
    for pattern in ("*.md", "planner/*.md", "sumo_nets/*.md", "experiments/*.md")
    for path in ROOT.glob(pattern)
)
PROGRESS = re.compile(r"\w+: t = [-0-9.]+ s, (s = [-0-9]+ m, )?v = [-0-9.]+ m/s")
LINK = re.compile(r"\]\(([^)#\s]+)(?:#[^)]*)?\)")


def blocks(text: str, language: str) -> list[str]:
    return re.findall(rf"^```{language}\n(.*?)^```", text, re.MULTILINE | re.DOTALL)


def commands() -> list[str]:
    """Every command of the README, without its comment."""
    first = re.findall(r"^    ((?:make|rearview) .*)$", README, re.MULTILINE)
    lines = [line for block in blocks(README, "sh") for line in block.splitlines()]
    return [shlex.join(shlex.split(line, comments=True)) for line in [*first, *lines]]


def make(*arguments: str, **variables: str) -> subprocess.CompletedProcess[str]:
    """Run make as from a shell, also where make runs the tests."""
    own = ("MAKEFLAGS", "MAKELEVEL", "MFLAGS", "NET", "RUN", "ARGS")
    clean = {key: value for key, value in os.environ.items() if key not in own}
    return subprocess.run(
        ["make", *arguments],
        cwd=ROOT,
        env={**clean, **variables},
        capture_output=True,
        text=True,
        check=False,
    )


def rearview_arguments(command: str) -> list[str]:
    """What `rearview` gets, from a command of either kind."""
    words = shlex.split(command)
    if words[0] == "rearview":
        return words[1:]
    done = make("-n", *words[1:], RUN="runs/some")
    assert done.returncode == 0, done.stderr
    last = shlex.split(done.stdout.splitlines()[-1])
    called = last[0].endswith("rearview")
    through_make = {"experiment", "figure", "report", "sweep", "thesis", "video"}
    assert called == (words[1] in through_make), last
    return last[1:] if called else []


def parse(arguments: list[str]) -> typer.Context:
    """Parse as the command line does, without running anything."""
    group = typer.main.get_command(app)
    outer = group.make_context("rearview", list(arguments))
    _, command, rest = group.resolve_command(outer, list(arguments))
    return command.make_context(command.name, rest, parent=outer)


def rearview(*arguments: str, folder: Path) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-m", "experiments", *arguments],
        cwd=folder,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        capture_output=True,
        text=True,
        check=False,
        timeout=600,
    )


def assert_only_progress(stderr: str) -> None:
    """Check stderr: the notice of compilation and lines of progress, nothing else."""
    lines = stderr.replace(NOTICE, "").splitlines()
    assert [line for line in lines if not PROGRESS.fullmatch(line)] == []


def test_readme_begins_with_the_two_commands():
    assert commands()[:2] == ["make experiment NET=intersection", "make test"]


@pytest.mark.skipif(not shutil.which("make"), reason="needs make")
@pytest.mark.parametrize("command", commands())
def test_commands_parse(command):
    arguments = rearview_arguments(command)
    if not arguments or "--help" in arguments:
        return
    given = parse(arguments).params
    if "file" in given:
        load_sweep(given["file"])
    if "scenario" not in given:
        return
    name = given["scenario"]
    assert name in scenario_names() or name == "my_road.yaml"
    if name in scenario_names():
        load_scenario(
            name,
            planner=given["planner"],
            seed=given["seed"],
            overrides=given["overrides"] or (),
        )
    assert given["planner"] in (None, "my_planner:make", *PLANNERS)


@pytest.mark.skipif(not shutil.which("make"), reason="needs make")
def test_experiment_without_a_road_says_what_to_give():
    done = make("experiment")
    assert done.returncode == 2
    assert "NET=intersection" in done.stderr
    assert done.stdout == ""


@pytest.mark.skipif(not shutil.which("make"), reason="needs make")
def test_clean_removes_what_was_compiled_before(tmp_path):
    for name in ("planner", "sumo_nets", "experiments", "tests"):
        (tmp_path / name / "__pycache__" / "compiled-0123456789ab").mkdir(parents=True)
    done = make("-f", str(ROOT / "Makefile"), "-C", str(tmp_path), "clean")
    assert done.returncode == 0, done.stderr
    assert not list(tmp_path.rglob("__pycache__"))
    assert len(list(tmp_path.iterdir())) == 4


@pytest.mark.skipif(not shutil.which("make"), reason="needs make")
def test_make_help_names_every_command_of_the_documents():
    shown = make("help").stdout
    for document in DOCUMENTS:
        text = document.read_text(encoding="utf-8")
        for target in re.findall(r"[`(]make ([a-z-]+)", text):
            assert f"make {target} " in shown, f"{document.name}: make {target}"


@pytest.mark.parametrize("document", DOCUMENTS, ids=lambda path: path.name)
def test_links_lead_to_files(document):
    for target in LINK.findall(document.read_text(encoding="utf-8")):
        if "://" not in target:
            assert (document.parent / target).exists(), f"{document.name}: {target}"


def test_paths_of_the_tree_exist():
    tree = next(block for block in blocks(README, "text") if "planner/  " in block)
    folder = ROOT
    for line in tree.splitlines():
        name = line.split()[0]
        folder = folder if line.startswith(" ") else ROOT / name
        path = folder / name if line.startswith(" ") else folder
        assert path.is_dir(), name


def test_outcome_table_is_the_one_that_is_printed():
    table = README.partition("<!-- outcome -->")[2]
    shown = re.findall(r"^│ (.*?) +│ +([-0-9.]+) │ (\S*) +│$", table, re.MULTILINE)
    assert [(label, unit) for label, _, unit in shown] == [
        (metric.label, metric.unit) for metric in IN_TERMINAL
    ]


@pytest.mark.sumo
def test_own_planner_works_as_written(tmp_path):
    (code,) = blocks(README, "python")
    assert len(code.splitlines()) <= 40
    (tmp_path / "my_planner.py").write_text(code, encoding="utf-8")
    runs = [
        shlex.split(command)[1:]
        for command in commands()
        if "my_planner:make" in command
    ]
    status = []
    for arguments in runs:
        done = rearview(*arguments, folder=tmp_path)
        assert_only_progress(done.stderr)
        status.append((done.returncode, done.stdout.splitlines()[-3].partition(":")[0]))
    assert status == [(0, "arrived"), (1, "timeout")]


@pytest.mark.sumo
def test_own_network_works_as_written(tmp_path):
    (text,) = blocks(README, "yaml")
    (tmp_path / "my_road.yaml").write_text(text, encoding="utf-8")
    shutil.copy(net_path("intersection"), tmp_path / "my.net.xml")
    done = rearview("run", "my_road.yaml", folder=tmp_path)
    assert done.returncode == 0, done.stdout + done.stderr
    assert "arrived: " in done.stdout
