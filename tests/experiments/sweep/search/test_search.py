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


@pytest.fixture
def search(tmp_path, monkeypatch):
    """Return a search that finds something within 8 trials."""
    monkeypatch.chdir(tmp_path)  # where a repeated run looks for the planner
    monkeypatch.setattr(sys, "path", [str(tmp_path), *sys.path])
    monkeypatch.delitem(sys.modules, "broken_planner", raising=False)
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
