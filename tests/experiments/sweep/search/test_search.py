"""Searches as users run them: found, resumed, refused, repeated."""

import json
import subprocess
import sys
import time
from pathlib import Path

import pytest
import yaml

from experiments.cli.app import app
from tests.experiments.sweep.search.planted import write_search

ROOT = Path(__file__).parents[4]
PATIENCE = 120.0  # with a process on a busy machine [s]


def rearview(capsys, *words: str) -> tuple[int, str, str]:
    """Run a command in this process."""
    capsys.readouterr()
    with pytest.raises(SystemExit) as stop:
        app([*map(str, words)])
    out, err = capsys.readouterr()
    return int(stop.value.code or 0), out, err


def found(folder: Path) -> dict:
    return json.loads((folder / "search.json").read_text(encoding="utf-8"))


def without_folder(content: dict, folder: Path) -> str:
    return json.dumps(content).replace(str(folder), "FOLDER")


@pytest.fixture(autouse=True)
def _planner_is_found(tmp_path, monkeypatch):
    """Let the planner beside a search be imported, anew in each test."""
    monkeypatch.chdir(tmp_path)  # where a repeated run looks for the planner
    monkeypatch.setattr(sys, "path", [str(tmp_path), *sys.path])
    monkeypatch.delitem(sys.modules, "broken_planner", raising=False)


@pytest.fixture
def search(tmp_path):
    """Return a search that finds something within 8 trials."""
    return write_search(
        tmp_path,
        "window",
        method="tpe",
        seed=1,
        budget=8,
        reduce=1,
        reduction_runs=4,
        keep_traces="none",
    )


def test_a_search_that_was_stopped_goes_on_with_the_same_trials(
    search, tmp_path, capsys
):
    whole, parts = tmp_path / "whole", tmp_path / "parts"
    words = ("search", search, "--workers", "0")
    code, out, _ = rearview(capsys, *words, "--out", whole)
    assert code == 0
    assert "trials failed, first trial" in out
    assert "coverage: " in out
    code, out, _ = rearview(capsys, *words, "--out", parts, "--limit", "5")
    assert code == 0
    assert "limit reached; the same command goes on" in out
    assert not (parts / "search.json").exists()
    assert len(list(parts.glob("runs/*/*"))) == 5
    rearview(capsys, *words, "--out", parts)
    one, other = found(whole), found(parts)
    assert without_folder(one, whole) == without_folder(other, parts)
    assert one["failures"] > 0
    mildest = one["clusters"][0]["mildest"]
    assert mildest["runs"] <= 4
    check_replay(one["clusters"][0]["worst"]["command"], tmp_path, capsys)


def check_replay(command: str, folder: Path, capsys) -> None:
    """The command of a failure repeats it to the last bit."""
    words = command.split()
    assert words[:2] == ["rearview", "rerun"]
    code, out, _ = rearview(capsys, *words[1:])
    assert code == 0
    assert "identical trace" in out


def test_a_search_with_other_ranges_is_refused(search, tmp_path, capsys):
    out = tmp_path / "out"
    words = ("search", search, "--workers", "0", "--out", out)
    rearview(capsys, *words, "--limit", "1")
    content = yaml.safe_load(Path(search).read_text())
    changes = {
        "was searched with space.conflict.gap_m": {
            "space": {**content["space"], "conflict.gap_m": [110.0, 200.0]}
        },
        "was searched with seed 1, now 2": {"seed": 2},
        "was searched with scenario_hash": {"set": {"simulation.duration_s": 15}},
        "was searched with objective.metric": {"objective": "clearance"},
    }
    for message, change in changes.items():
        Path(search).write_text(yaml.safe_dump({**content, **change}))
        code, _, err = rearview(capsys, *words)
        assert code == 2
        assert err.count("\n") == 1
        assert message in err or "was searched with set" in err
        assert "allowed: the same, or another --out" in err
    Path(search).write_text(yaml.safe_dump({**content, "budget": 2}))
    code, _, _ = rearview(capsys, *words)  # fewer trials are no other search
    assert code == 0


def test_against_random_says_what_chance_finds(search, tmp_path, capsys):
    out = tmp_path / "out"
    content = yaml.safe_load(Path(search).read_text())
    small = {**content, "budget": 3, "batch": 3, "reduce": 0}
    Path(search).write_text(yaml.safe_dump(small))
    words = ("search", search, "--workers", "0", "--out", out)
    code, text, _ = rearview(capsys, *words, "--against", "random")
    assert code == 0
    assert "against random: first failure after " in text
    assert found(out)["against"]["trials"] == 3
    code, _, err = rearview(capsys, *words, "--against", "sobol")
    assert (code, err.count("\n")) == (2, 1)


@pytest.mark.slow
def test_a_search_that_was_killed_goes_on_with_the_same_trials(
    search, tmp_path, capsys
):
    whole, killed = tmp_path / "whole", tmp_path / "killed"
    command = [sys.executable, str(ROOT / "rearview_command.py"), "search", search]
    command += ["--workers", "1", "--out", str(killed)]
    process = subprocess.Popen(command, stdout=-3, stderr=-3)
    until = time.monotonic() + PATIENCE
    while len(list(killed.glob("runs/*/*"))) < 3 and time.monotonic() < until:
        time.sleep(0.05)
    process.kill()
    process.wait()
    time.sleep(1.0)  # its worker notices
    assert not (killed / "search.json").exists()
    for folder in (killed, whole):
        rearview(capsys, "search", search, "--workers", "0", "--out", folder)
    assert without_folder(found(whole), whole) == without_folder(found(killed), killed)


def disc_search(tmp_path, **keys) -> str:
    """Write a search of a lane keeper that is blind to the left."""
    return write_search(tmp_path, "left", reduce=0, keep_traces="none", **keys)


@pytest.mark.slow
def test_a_subset_simulation_estimates_a_probability_for_rate(tmp_path, capsys):
    path = disc_search(tmp_path, method="subset", level_trials=20, budget=20)
    out = tmp_path / "out"
    allow = ("--allow-planner", "broken_planner")
    words = ("search", path, "--workers", "0", "--out", out, *allow)
    code, text, _ = rearview(capsys, *words)
    assert code == 0
    assert "a failure has a probability" in text
    value = found(out)["probability"]
    assert value["low"] <= value["probability"] <= value["high"]
    code, text, _ = rearview(capsys, "rate", out)
    assert code == 0
    assert text.startswith("failures\n  per run")
    code, _, err = rearview(capsys, "rate", out, "--event", "collisions > 0")
    assert (code, err.count("\n")) == (2, 1)
    page = (out / "report.html").read_text(encoding="utf-8")
    assert "· search" in page
    assert "Probability of a failure" in page


@pytest.mark.parametrize(("method", "code"), [("random", 0), ("directed", 2)])
def test_rates_are_of_random_trials_alone(method, code, tmp_path, capsys):
    path = disc_search(tmp_path, method=method, budget=4)
    out = tmp_path / "out"
    allow = ("--allow-planner", "broken_planner")
    rearview(capsys, "search", path, "--workers", "0", "--out", out, *allow)
    found_code, text, err = rearview(capsys, "rate", out)
    assert found_code == code
    if code == 0:
        assert "of 4 runs" in text  # the mild point is the fifth
    else:
        assert "its trials are no sample; allowed: a sweep, or a search" in err
        assert err.count("\n") == 1


@pytest.mark.parametrize("stop", [1, pytest.param(1000, marks=pytest.mark.slow)])
def test_trials_that_a_number_of_failures_ended_are_no_sample(stop, tmp_path, capsys):
    keys = {"batch": 1, "stop_after_failures": stop}
    path = disc_search(tmp_path, method="random", budget=12, **keys)
    out = tmp_path / "out"
    allow = ("--allow-planner", "broken_planner")
    rearview(capsys, "search", path, "--workers", "0", "--out", out, *allow)
    result = found(out)
    assert result["failures"] > 0
    assert (len(result["trials"]) < 12) is (stop == 1)
    code, _, err = rearview(capsys, "rate", out)
    assert code == (2 if stop == 1 else 0)
    if stop == 1:
        assert "stop_after_failures: ended the search after" in err
        assert err.count("\n") == 1
