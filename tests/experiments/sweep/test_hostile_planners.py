"""Planners that misbehave in every way, in one sweep; and sweeps that are killed."""

import os
import random
import signal
import time
import uuid
from pathlib import Path

import psutil
import pytest

from experiments.comparison.results import rows
from experiments.sweep.folder import LOG
from tests.experiments.hostile_planner_outcomes import OUTCOMES
from tests.experiments.sweep.test_schedule import (
    HERE,
    ROAD,
    rearview,
    start,
    steady,
    write_sweep,
)

FORKS = 5  # of a hostile planner, of each kind
MARK = "REARVIEW_TEST"  # variable of the environment that marks what a test starts
SWEEP = """\
name: hostile
scenarios: [empty_road.yaml]
planners: ["hostile_planner:make"]
axes: {{grid: {{planner.settings.action: [{actions}]}}}}
seeds: [1]
timeout_s: 20
memory_mb: 900
retries: 0
"""


@pytest.fixture
def mark(monkeypatch) -> str:
    """Mark all processes started from here on, also those that leave their parents."""
    value = uuid.uuid4().hex
    monkeypatch.setenv(MARK, value)
    return value


def left_over(mark: str) -> list[psutil.Process]:
    found = []
    for process in psutil.process_iter():
        try:
            marked = process.environ().get(MARK) == mark
        except psutil.Error:
            continue
        if marked and process.pid != os.getpid():
            found.append(process)
    return found


def end_all(processes: list[psutil.Process]) -> None:
    for process in processes:
        process.kill()


def write_hostile_sweep(folder: Path) -> Path:
    (folder / "empty_road.yaml").write_text(ROAD)
    for module in ("hostile_planner.py", "constant_speed_planner.py"):
        (folder / module).write_bytes((HERE / module).read_bytes())
    sweep = folder / "hostile.yaml"
    sweep.write_text(SWEEP.format(actions=", ".join(OUTCOMES)))
    return sweep


@pytest.mark.slow
def test_every_hostile_planner_is_one_row_with_its_reason(tmp_path, mark):
    out = tmp_path / "out"
    done = rearview("sweep", write_hostile_sweep(tmp_path), "--out", out)
    left = left_over(mark)
    end_all(left)
    assert done.returncode == 0, done.stderr
    assert left == []
    found = {row["planner.settings.action"]: row for row in rows(out)}
    assert sorted(found) == sorted(OUTCOMES)
    wrong = {}
    for action, (status, failure, reason) in OUTCOMES.items():
        row = found[action]
        is_right = (row["status"], row["failure"]) == (status, failure)
        if not is_right or reason not in row["reason"] or len(row["reason"]) > 700:
            wrong[action] = (row["status"], row["failure"], row["reason"])
    assert wrong == {}
    assert (out / LOG).stat().st_size < 10e6, "output of a planner is limited"


@pytest.mark.slow
@pytest.mark.parametrize("action", ["cancelled", "daemons", "forked_copy", "exit_7"])
def test_a_hostile_planner_in_a_single_run(tmp_path, mark, action):
    write_hostile_sweep(tmp_path)
    done = rearview(
        *("run", tmp_path / "empty_road.yaml", "--planner", "hostile_planner:make"),
        *("--set", f"planner.settings.action={action}", "--out", tmp_path / "runs"),
    )
    left = left_over(mark)
    end_all(left)
    assert left == []
    status = OUTCOMES[action][0]
    assert done.returncode == (0 if status == "arrived" else 1), done.stderr
    assert f"{status}" in done.stdout
    assert len(list((tmp_path / "runs").iterdir())) == 1


@pytest.mark.slow
def test_kill_of_a_run_ends_all_that_its_planner_has_started(tmp_path, mark):
    write_hostile_sweep(tmp_path)
    out = tmp_path / "runs"
    process = start(
        *("run", tmp_path / "empty_road.yaml", "--planner", "hostile_planner:make"),
        *("--set", "planner.settings.action=daemons_then_hang", "--out", out),
    )
    until(lambda: len(left_over(mark)) == 3 + 2 * FORKS)  # command, child, episode
    process.kill()
    process.communicate()
    try:
        until(lambda: not left_over(mark), 10.0)
    finally:
        end_all(left_over(mark))


@pytest.mark.slow
def test_kill_of_a_sweep_at_any_moment_costs_no_run(tmp_path, mark, pytestconfig):
    kills = pytestconfig.getoption("--kills")
    count = 20 * kills
    sweep = write_sweep(tmp_path, count)
    whole, out = tmp_path / "whole", tmp_path / "out"
    assert rearview("sweep", sweep, "--out", whole, "--workers", "2").returncode == 0
    chosen = random.Random(4)
    for _ in range(kills):
        process = start("sweep", sweep, "--out", out, "--workers", "2")
        time.sleep(chosen.uniform(0.5, 20.0))
        os.kill(process.pid, signal.SIGKILL)  # the workers are left to notice
        process.communicate()
        until(lambda: not left_over(mark), 20.0)
    done = rearview("sweep", sweep, "--out", out, "--workers", "2")
    assert done.returncode == 0, done.stderr
    assert not list((out / "runs").glob("*/.unfinished-*"))
    assert steady(out) == steady(whole)


def until(condition, patience: float = 120.0) -> None:
    deadline = time.monotonic() + patience
    while not condition():
        assert time.monotonic() < deadline
        time.sleep(0.05)
