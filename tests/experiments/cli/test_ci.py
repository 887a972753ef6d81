"""What continuous integration calls: --fail-if, --junit, --against, --json."""

import json
import shutil
from xml.etree import ElementTree as ET

import pytest

from experiments.trace.files import read_trace
from experiments.trace.schema import trace_hash
from tests.experiments.cli.test_app import EMPTY_ROAD, HERE, OWN, rearview, row_of

SWEEP = """\
name: tiny
scenarios: [./empty_road.yaml]
planners:
  - {name: "constant_speed_planner:make", label: steady}
  - {name: "constant_speed_planner:make", label: failing, settings: {raise_at: 1.0}}
seeds: {first: 0, count: 2}
"""


@pytest.fixture
def folder(tmp_path):
    shutil.copy(HERE / "constant_speed_planner.py", tmp_path)
    (tmp_path / "empty_road.yaml").write_text(EMPTY_ROAD)
    (tmp_path / "tiny.yaml").write_text(SWEEP)
    return tmp_path


def test_json_has_folder_report_reason_and_hash(folder):
    done = rearview("run", "empty_road.yaml", *OWN, "--json", folder=folder)
    row = row_of(done)
    run = folder / str(row["run_folder"])
    assert row["trace_hash"] == trace_hash(read_trace(run))
    assert row["reason"] == json.loads((run / "manifest.json").read_text())["reason"]
    assert (folder / str(row["report"])).is_file()


@pytest.mark.slow
def test_a_sweep_fails_by_its_condition(folder):
    def sweep(*options):
        return rearview("sweep", "tiny.yaml", "--workers", "0", *options, folder=folder)

    condition = "collisions > 0 or arrived < 0.95"
    done = sweep("--fail-if", condition, "--junit", "junit.xml")
    assert done.returncode == 1, done.stderr
    assert f"failed: empty_road, failing: {condition} " in done.stdout
    assert "failed: empty_road, steady" not in done.stdout
    root = ET.parse(folder / "junit.xml").getroot()
    assert (root.get("tests"), root.get("failures")) == ("6", "1")
    done = sweep("--fail-if", f'planner == "steady" and ({condition})')
    assert done.returncode == 0, done.stdout
    assert "passed: 2 conditions" in done.stdout
    done = sweep("--fail-if", "colisions > 0")
    assert done.returncode == 2
    assert (done.stdout, done.stderr.count("\n")) == ("", 1)

    shutil.copy(folder / "sweeps/tiny/results.parquet", folder / "baseline.parquet")
    against = ("compare", "sweeps/tiny", "--against", "baseline.parquet")
    done = rearview(*against, "--fail-on", "worse", folder=folder)
    assert done.returncode == 0, done.stderr
    assert "no metric got worse" in done.stdout
    failing = SWEEP.replace("label: steady}", "label: steady, settings: {raise_at: 2}}")
    (folder / "tiny.yaml").write_text(failing)
    sweep("--out", "later")
    done = rearview(
        *("compare", "later", "--against", "baseline.parquet", "--fail-on", "worse"),
        folder=folder,
    )
    assert done.returncode == 1, done.stderr
    assert "mean_speed_mps" not in done.stdout  # equal but for rounding
    assert "empty_road: arrived 0, -1 on 2 common seeds" in done.stdout
    done = rearview(*against, "--baseline", "steady", folder=folder)
    assert done.returncode == 2
    assert done.stderr.count("\n") == 1
