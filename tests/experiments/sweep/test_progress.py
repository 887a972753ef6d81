"""What a sweep says while it runs."""

import io
import json
from pathlib import Path

import pytest
from rich.console import Console

from experiments.config.sweep import KeepTraces
from experiments.sweep.progress import (
    Counts,
    duration,
    in_words,
    sweep_progress,
    table,
)
from experiments.sweep.task import Failure, RunReport, RunTask


def report(run_id: str, wall: float | None, failure: Failure | None = None):
    task = RunTask(run_id, {}, Path(), KeepTraces.ALL, 9.0, {})
    return RunReport(task, "crashed" if failure else "arrived", wall, failure)


@pytest.fixture
def counts() -> Counts:
    counts = Counts(missing=12, there=3)
    for k, wall in enumerate((1.0, 5.0, 2.0, 4.0, 3.0)):
        counts.add(report(f"run{k}", wall))
    counts.add(report("lost", None, Failure.PROCESS_DIED))
    counts.elapsed = 12.0
    return counts


def test_counts(counts):
    assert (counts.done, counts.lost, counts.rate, counts.left) == (6, 1, 0.5, 12.0)
    assert sorted(counts.slowest) == [(3.0, "run4"), (4.0, "run3"), (5.0, "run1")]
    assert counts.by_status == {"arrived": 5, "crashed": 1}


def test_line(counts):
    expected = "6 of 12 runs done, 1 of them lost, 0.50 runs/s, 12 s left"
    assert in_words(counts) == expected


def test_table(counts):
    screen = io.StringIO()
    Console(width=60, file=screen).print(table("study", counts))
    text = screen.getvalue()
    for words in ("6 of 12", "lost: process_died", "0.50 runs/s", "slowest: run1"):
        assert words in text


def test_file_is_always_there(counts, tmp_path, capsys):
    with sweep_progress("study", tmp_path, counts) as progress:
        progress.report(report("last", 1.0))
        progress.tick()
        running = json.loads((tmp_path / "progress.json").read_text())
        progress.write("finished")
    assert (running["state"], running["done"], running["missing"]) == ("running", 7, 12)
    finished = json.loads((tmp_path / "progress.json").read_text())
    assert finished["state"] == "finished"
    assert finished["slowest"][0] == [5.0, "run1"]
    assert capsys.readouterr().err == ""  # a line only every ten seconds


@pytest.mark.parametrize(
    ("seconds", "words"),
    [(None, "-"), (0.4, "0 s"), (59.0, "59 s"), (90.0, "2 min"), (5400.0, "1.5 h")],
)
def test_duration(seconds, words):
    assert duration(seconds) == words
