"""Manifests and metrics of strangers: one line that names file and key."""

import json

import pytest

from experiments.cli.app import app
from experiments.comparison.results import rebuild, rows
from experiments.errors import ResultsError
from experiments.report.run.page import run_page
from experiments.storage.run_files import read_manifest
from tests.experiments.report.run_folders import driven_trace, write_run, write_sweep


@pytest.mark.parametrize(
    ("key", "value", "problem"),
    [
        ("git", "x", "git: input should be"),
        (
            "git",
            {"commit": 5, "dirty": True},
            "git.commit: input should be a valid str",
        ),
        ("versions", ["3.11"], "versions: input should be a valid dictionary"),
        ("versions", {"python": 3}, "versions.python: input should be a valid string"),
        ("wall_s", "x", 'wall_s: input should be a valid number, is "x"'),
        ("seed", 1.5, "seed: input should be a valid integer, is 1.5"),
        ("seed", True, "seed: input should be a valid integer, is true"),
        ("status", None, "status: input should be a valid string, is null"),
        ("reason", {"a": 1}, "reason: input should be a valid string"),
        ("trace_kept", "no", "trace_kept: input should be a valid boolean"),
        ("sweep", [], "sweep: input should be"),
        ("sweep", {"point": [1]}, "sweep.point: input should be a valid dictionary"),
        ("command", "x" * 5000, None),
        ("scenario", ["x" * 5000], "scenario: input should be a valid string"),
    ],
)
def test_odd_manifests(tmp_path, key, value, problem):
    folder = write_run(tmp_path / "run", driven_trace(3), **{key: value})
    if problem is None:
        assert run_page(folder)
        return
    for read in (read_manifest, run_page):
        with pytest.raises(ResultsError) as refusal:
            read(folder)
        message = str(refusal.value)
        assert message.startswith(f"{folder}/manifest.json: is damaged: {problem}")
        assert len(message) < len(str(folder)) + 200


@pytest.mark.parametrize(
    ("change", "problem"),
    [
        ([], "is damaged: not a JSON object"),
        ({"collisions": "x"}, 'is damaged: collisions: is "x"; allowed: a number'),
        ({"collisions": True}, "is damaged: collisions: is true; allowed: a number"),
        ({"arrived": 1}, "is damaged: arrived: is 1; allowed: true or false"),
        ({"status": None}, "is damaged: status: is null; allowed: a text"),
        ({"seed": 0.5}, "is damaged: seed: is 0.5; allowed: a whole number"),
        ({"distance_m": [1]}, "is damaged: distance_m: is [1]; allowed: a number"),
        ({"distance_m": 1e300}, "is damaged: distance_m: is 1e+300; allowed: a number"),
        ({"run_id": "x"}, "run_id is not a metric of this version"),
    ],
)
def test_odd_metrics(tmp_path, capsys, change, problem):
    folder = write_sweep(tmp_path / "sweep", seeds=1)
    assert len(rows(folder)) == 8
    (run,) = folder.glob(f"runs/*/{rows(folder)[3]['run_id']}")
    file = run / "metrics.json"
    content = json.loads(file.read_text())
    file.write_text(json.dumps({**content, **change} if change else change))
    for arguments in (["results", "--rebuild"], ["results"], ["report"]):
        command, *options = arguments
        with pytest.raises(SystemExit) as left:
            app([command, str(folder), *options])
        assert left.value.code == 2
        error = capsys.readouterr().err
        assert error.startswith(f"rearview: {file}: {problem}")
        assert error.count("\n") == 1


def test_a_finished_sweep_notices_a_damaged_manifest(tmp_path):
    folder = write_sweep(tmp_path / "sweep", seeds=1)
    rebuild(folder)
    file = next(iter(sorted(folder.glob("runs/*/*/manifest.json"))))
    for damage in (lambda: file.write_text("{"), file.unlink):
        damage()
        with pytest.raises(
            ResultsError, match=f"{file}: cannot be read.*run the sweep"
        ):
            rows(folder)


def test_a_row_lacks_what_older_versions_did_not_measure(tmp_path):
    folder = write_sweep(tmp_path / "sweep", seeds=1)
    for file in folder.glob("runs/*/*/metrics.json"):
        content = json.loads(file.read_text())
        del content["rms_jerk_mps3"]
        file.write_text(json.dumps(content))
    assert {row["rms_jerk_mps3"] for row in rows(folder)} == {None}
