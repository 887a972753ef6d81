"""What continuous integration calls: --fail-if, --junit, --against, --json."""

import json
import shutil
import signal
from xml.etree import ElementTree as ET

import pytest

from experiments.cli.app import app
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


@pytest.fixture
def here(folder, monkeypatch, capfd):
    """Call the command line in this process, which is quicker than one of its own."""
    monkeypatch.chdir(folder)
    monkeypatch.syspath_prepend(str(folder))
    handler = signal.getsignal(signal.SIGTERM)

    def call(*arguments: str) -> tuple[int, str, str]:
        with pytest.raises(SystemExit) as left:
            app(arguments)
        out, err = capfd.readouterr()
        return left.value.code, out, err

    yield call
    signal.signal(signal.SIGTERM, handler)


@pytest.mark.slow
def test_a_sweep_fails_by_its_condition(here, folder):
    sweep = ("sweep", "tiny.yaml", "--workers", "0")
    condition = "collisions > 0 or arrived < 0.95"
    code, out, err = here(*sweep, "--fail-if", "colisions > 0")
    assert (code, out, err.count("\n")) == (2, "", 1)
    code, out, _ = here(*sweep, "--fail-if", condition, "--junit", "junit.xml")
    assert code == 1
    assert f"failed: empty_road, failing: {condition} " in out
    assert "failed: empty_road, steady" not in out
    root = ET.parse(folder / "junit.xml").getroot()
    assert (root.get("tests"), root.get("failures")) == ("6", "1")
    code, out, _ = here(*sweep, "--fail-if", f'planner == "steady" and ({condition})')
    assert code == 0
    assert "passed: 1 condition for each of 2 scenarios and planners" in out

    shutil.copy(folder / "sweeps/tiny/results.parquet", folder / "baseline.parquet")
    against = ("--against", "baseline.parquet")
    code, out, _ = here("compare", "sweeps/tiny", *against, "--fail-on", "worse")
    assert code == 0
    assert "no metric got worse" in out
    code, out, err = here("compare", "sweeps/tiny", *against)
    assert (code, out, err.count("\n")) == (2, "", 1)
    assert "2 common seeds, of which nothing can be tested; allowed: at least 6" in err
    code, _, err = here("compare", "sweeps/tiny", "--against", "sweeps/tiny")
    assert code == 2
    assert "is a folder; allowed: a copy of the results.parquet" in err
    failing = SWEEP.replace("label: steady}", "label: steady, settings: {raise_at: 2}}")
    (folder / "tiny.yaml").write_text(failing)
    here(*sweep, "--out", "later")
    code, out, _ = here("compare", "later", *against, "--fail-on", "worse")
    assert code == 1
    assert "empty_road: arrived 0, -1 on 2 common seeds" in out
    assert "mean_speed_mps" not in out  # equal but for rounding
    code, out, err = here("compare", "later", *against, "--baseline", "steady")
    assert (code, out, err.count("\n")) == (2, "", 1)
