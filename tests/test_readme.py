"""What the README says can be done, done as written.

`tests/docs` does the same for all documents.
"""

import re
import shlex
import shutil

import numpy as np
import pytest

from experiments.cli.compile_notice import NOTICE
from experiments.metrics.catalogue import IN_TERMINAL
from experiments.trace.files import read_trace
from sumo_nets.build import net_path
from tests.docs.documents import ROOT, TEXTS, blocks, commands, make, rearview

README = TEXTS["README.md"]


def complaints(stderr: str) -> list[str]:
    """Return what is neither the notice of compilation nor progress.

    Progress is a line every ten seconds of wall clock, so a slow machine prints it.
    """
    lines = stderr.replace(NOTICE, "").splitlines()
    return [line for line in lines if not re.match(r"\w+: t = [\d.]+ s, ", line)]


def test_readme_begins_with_the_two_commands():
    first = list(commands(README))[:2]
    assert first == ["make experiment NET=intersection", "make test"]


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
def test_an_episode_needs_no_development_tools():
    done = make("-n", "experiment", "NET=straight", "VENV=nowhere")
    assert "[figures]" in done.stdout
    assert "[dev]" not in done.stdout
    assert "[dev]" in make("-n", "test", "VENV=nowhere").stdout


def test_outcome_table_is_the_one_that_is_printed():
    table = TEXTS["docs/quick_start.md"].partition("<!-- outcome -->")[2]
    shown = re.findall(r"^│ (.*?) +│ +([-0-9.]+) │ (\S*) +│$", table, re.MULTILINE)
    assert [(label, unit) for label, _, unit in shown] == [
        (metric.label, metric.unit) for metric in IN_TERMINAL
    ]


@pytest.mark.sumo
def test_own_planner_works_as_written(tmp_path):
    (code,) = blocks(README, "python")
    (tmp_path / "my_planner.py").write_text(code, encoding="utf-8")
    status = []
    for command in commands(README):
        if "my_planner:make" not in command:
            continue
        done = rearview(*shlex.split(command)[1:], folder=tmp_path)
        assert complaints(done.stderr) == []
        status.append((done.returncode, done.stdout.splitlines()[-3].partition(":")[0]))
    assert status == [(0, "arrived"), (1, "blocked")]


@pytest.mark.sumo
def test_own_network_works_as_written(tmp_path):
    (text,) = blocks(README, "yaml")
    (tmp_path / "my_road.yaml").write_text(text, encoding="utf-8")
    shutil.copy(net_path("intersection"), tmp_path / "my.net.xml")
    done = rearview("run", "my_road.yaml", folder=tmp_path)
    assert done.returncode == 0, done.stdout + done.stderr
    assert "arrived: " in done.stdout
    (run,) = (tmp_path / "runs").iterdir()
    heading = np.unwrap(read_trace(run).steps["heading_rad"])
    assert heading[-1] - heading[0] == pytest.approx(np.pi / 2.0, abs=0.1)  # it turns
