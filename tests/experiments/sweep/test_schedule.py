"""Sweeps as users run them: whatever a run does, every run is a row."""

import fcntl
import json
import os
import shutil
import signal
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import duckdb
import psutil
import pytest
import yaml

from experiments.cli.app import app
from experiments.comparison.results import ATTEMPTS, WALL, rebuild, rows
from experiments.config.scenario_file import CONFIG_FILE, config_text
from experiments.config.sweep_file import load_sweep
from experiments.errors import ConfigError, ResultsError
from experiments.metrics.catalogue import TIMING_COLUMNS
from experiments.metrics.row import row_without_episode
from experiments.sweep.execute import execute_run
from experiments.sweep.executors.executor import WorkerSettings
from experiments.sweep.executors.local import MOST_PER_CORE, cores, require_few
from experiments.sweep.executors.sequential import SequentialExecutor
from experiments.sweep.folder import (
    finished,
    remove_unfinished,
    run_folder,
    run_folders,
)
from experiments.sweep.plan import Plan
from experiments.sweep.schedule import drive_missing, task_of
from experiments.sweep.task import Failure, facts_of

HERE = Path(__file__).parents[1]  # where faulty_planner is
ROOT = HERE.parent.parent
UNSTEADY = (*TIMING_COLUMNS, WALL, ATTEMPTS)  # wall clock and retries
TIMEOUT = 30  # of a run that takes 0.1 s: other jobs may have the machine [s]
PATIENCE = 300.0  # with whole commands [s]
ROAD = """\
name: empty_road
world: kinematic
road: {segments: [[line, 300]]}
ego: {goal_m: 60}
"""


def write_sweep(folder: Path, count: int, faults: dict[int, str] | None = None, **keys):
    """Write a sweep of light runs, of which some go wrong."""
    (folder / "empty_road.yaml").write_text(ROAD)
    for module in ("faulty_planner.py", "constant_speed_planner.py"):
        shutil.copy(HERE / module, folder)
    chosen = [(faults or {}).get(k, "none") for k in range(count)]
    speeds = [round(10 + 0.01 * k, 2) for k in range(count)]
    axes = {"planner.settings.fault": chosen, "ego.target_speed_mps": speeds}
    sweep = {
        "name": "light",
        "scenarios": ["empty_road.yaml"],
        "planners": ["faulty_planner:make"],
        "axes": {"zip": axes},
        "seeds": [1],
        "timeout_s": TIMEOUT,
        "memory_mb": 900,
        "retries": 0,
        **keys,
    }
    path = folder / "light.yaml"
    path.write_text(yaml.safe_dump(sweep))
    return str(path)


def pretend(sweep: str, out: Path) -> None:
    """Leave the folders of all runs of a sweep without driving them."""
    plan = Plan(*load_sweep(sweep))
    for run in plan:
        about = {"sweep": {"name": "light", "label": run.label, "point": run.point}}
        about |= {"trace_hash": "0", "attempts": 1, "wall_s": 0.1}
        about |= {"scenario": run.scenario.name, "planner": "p", "seed": 1}
        about |= {"status": "arrived"}
        row = row_without_episode(run.scenario.name, "p", 1, "arrived")
        folder = run_folder(out, run.run_id)
        folder.mkdir(parents=True)
        (folder / "manifest.json").write_text(json.dumps(about))
        (folder / "metrics.json").write_text(json.dumps(row))
        (folder / CONFIG_FILE).write_text(config_text(run.scenario.resolved()))


def environment() -> dict[str, str]:
    return {**os.environ, "PYTHONPATH": str(ROOT), "COLUMNS": "100"}


def start(*arguments: object) -> subprocess.Popen:
    return subprocess.Popen(
        [sys.executable, "-m", "experiments", *map(str, arguments)],
        cwd=HERE,
        env=environment(),
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        stdin=subprocess.DEVNULL,
        text=True,
        start_new_session=True,
    )


@pytest.fixture
def interruptible():
    """Let children have Ctrl-C even if these tests run in a script's background."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


def rearview(*arguments: object) -> subprocess.CompletedProcess:
    process = start(*arguments)
    out, err = process.communicate(timeout=2 * PATIENCE)
    return subprocess.CompletedProcess(arguments, process.returncode, out, err)


def last_words(stderr: str) -> str:
    """Give the one line that says why a sweep stopped, after lines of progress."""
    *before, last = stderr.splitlines()
    assert all(" runs done" in line for line in before), stderr
    assert last.startswith("rearview: ")
    return last


def steady(folder: Path) -> list[dict]:
    """Give the rows without what differs from call to call."""
    return [
        {key: value for key, value in row.items() if key not in UNSTEADY}
        for row in rows(folder)
    ]


@pytest.mark.slow
def test_a_file_of_the_users_called_experiments(tmp_path, monkeypatch):
    (tmp_path / "experiments.py").write_text("raise SystemExit('not this one')\n")
    monkeypatch.chdir(tmp_path)  # where workers look for planners
    sweep = write_sweep(tmp_path, 2)
    out = tmp_path / "out"
    command = [sys.executable, ROOT / "rearview_command.py", "sweep", sweep]
    done = subprocess.run([*command, "--out", out], check=False, capture_output=True)
    assert done.returncode == 0, done.stderr
    assert [row["status"] for row in rows(out)] == ["arrived"] * 2


def test_sweep_resume_rerun(tmp_path, refusal):
    sweep = write_sweep(tmp_path, 5, {3: "raise"})
    out = tmp_path / "out"
    done = rearview("sweep", sweep, "--out", out, "--limit", "2", "--workers", "0")
    assert done.returncode == 0, done.stderr
    assert "light: 5 runs\n" in done.stdout
    assert len(finished(out)) == 2
    done = rearview("sweep", sweep, "--out", out, "--workers", "2")
    assert "5 runs, 2 of them finished" in done.stdout
    assert "2 arrived, 1 planner_failed" in done.stdout
    found = rows(out)
    assert [row["status"] for row in found] == [
        *["arrived"] * 3,
        "planner_failed",
        "arrived",
    ]
    assert found[3]["reason"] == "RuntimeError: no idea"
    assert [row["trace_kept"] for row in found] == [False] * 3 + [True, False]
    kept = run_folder(out, found[3]["run_id"])
    assert (kept / "trace.parquet").is_file()
    assert not (run_folder(out, found[0]["run_id"]) / "trace.parquet").exists()
    progress = json.loads((out / "progress.json").read_text())
    assert (progress["state"], progress["done"], progress["there"]) == (
        "finished",
        3,
        2,
    )

    error = refusal("rerun", str(out), found[0]["run_id"][:9])
    assert "--allow-planner faulty_planner" in error
    allowed = ("--allow-planner", "faulty_planner")
    again = rearview("rerun", out, found[0]["run_id"][:9], *allowed)
    assert again.returncode == 0, again.stdout + again.stderr
    assert "identical trace" in again.stdout
    folder = out / "reruns" / found[0]["run_id"]
    assert f"run folder: {folder}" in again.stdout
    assert (folder / "trace.parquet").is_file()
    about = json.loads((folder / "manifest.json").read_text())
    assert about["trace_hash"] == found[0]["trace_hash"]


@pytest.mark.slow
def test_dry_run_leaves_nothing(tmp_path):
    done = rearview(
        "sweep", write_sweep(tmp_path, 3), "--dry-run", "--out", tmp_path / "o"
    )
    assert done.returncode == 0, done.stderr
    lines = done.stdout.splitlines()
    assert lines[0] == "light: 3 runs"
    assert lines[1].startswith("about ")
    assert not (tmp_path / "o").exists()


@pytest.fixture
def refusal(capfd, monkeypatch):
    """Run in this process; nothing here comes to a run."""
    monkeypatch.chdir(HERE)

    def run(*arguments: object) -> str:
        with pytest.raises(SystemExit) as left:
            app([str(argument) for argument in arguments])
        out, err = capfd.readouterr()
        assert left.value.code == 2
        assert out.count("\n") <= 1  # the number of runs
        assert err.count("\n") == 1
        return err

    return run


def test_million_runs_need_a_yes(tmp_path, refusal):
    sweep = write_sweep(tmp_path, 1, seeds={"count": 1_000_000})
    message = refusal("sweep", sweep, "--out", tmp_path / "out")
    assert "makes 1000000 runs; allowed without --yes: 20000" in message


def test_two_sweeps_in_one_folder(tmp_path, refusal):
    out = tmp_path / "out"
    out.mkdir()
    with (out / ".lock").open("w") as lock:
        lock.write("process 7 on there")
        lock.flush()
        fcntl.flock(lock, fcntl.LOCK_EX)
        message = refusal("sweep", write_sweep(tmp_path, 2), "--out", out)
    assert "in use by another sweep (process 7 on there)" in message
    assert list(run_folders(out)) == []


def test_a_sweep_does_not_mix_with_something_else(tmp_path, refusal):
    sweep, out = write_sweep(tmp_path, 2), tmp_path / "runs"
    single = out / "straight-cruise-0-12345678"
    single.mkdir(parents=True)
    (single / "manifest.json").write_text("{}")
    file = tmp_path / "notes.md"
    file.touch()
    before = sorted(tmp_path.rglob("*"))
    for place, words in (
        (out, "runs: holds single runs (1), no sweep; allowed: a folder that is new"),
        (single, "is the folder of a single run"),
        (tmp_path, "holds something else (constant_speed_planner.py)"),
        (file, "notes.md: is a file; allowed: a folder"),
        (file / "inner", "notes.md: is a file; allowed: a folder"),
    ):
        for more in ((), ("--dry-run",)):
            assert words in refusal("sweep", sweep, "--out", place, *more)
    assert sorted(tmp_path.rglob("*")) == before


@pytest.mark.slow
def test_other_code_and_other_sweep_are_refused(tmp_path, refusal):
    out = tmp_path / "out"
    sweep = write_sweep(tmp_path, 2)
    done = rearview("sweep", sweep, "--out", out, "--workers", "0")
    assert done.returncode == 0, done.stderr
    before = sorted(finished(out))
    code = json.loads((out / "code.json").read_text())
    now = code["code"]["the code"]
    code["code"]["the code"] = "0" * 64
    (out / "code.json").write_text(json.dumps(code))
    message = refusal("sweep", sweep, "--out", out)
    words = f"its 2 runs are of another version of the code (00000000, now {now[:8]})"
    assert words in message
    code["code"] |= {"the code": now, "numpy": "1.0"}
    (out / "code.json").write_text(json.dumps(code))
    message = refusal("sweep", sweep, "--out", out)
    assert "are of another version of numpy (1.0, now " in message
    other = write_sweep(tmp_path, 2, name="heavy")
    assert "belongs to the sweep light" in refusal("sweep", other, "--out", out)
    assert sorted(finished(out)) == before


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("sweep", "smok"), "smok: no such sweep; did you mean smoke?"),
        (("sweep", "smoke", "--workers", "2", "--cluster", "tcp://x:1"), "--workers"),
        (("results", "nowhere"), "nowhere: there is no such folder"),
        (("compare", "nowhere", "--baseline", "a"), "there is no such folder"),
        (("rerun", "nowhere", "a"), "there is no such folder"),
    ],
)
def test_bad_words_are_one_line(arguments, message, refusal):
    assert message in refusal(*arguments)


@pytest.mark.slow
def test_faults_cost_one_run_each(tmp_path):
    faults = {2: "segfault", 5: "hang", 7: "raise", 9: "memory"}
    out = tmp_path / "out"
    done = rearview("sweep", write_sweep(tmp_path, 16, faults), "--out", out)
    assert done.returncode == 0, done.stderr
    found = rows(out)
    assert len(found) == 16
    failed = {row["planner.settings.fault"]: row for row in found if not row["arrived"]}
    assert sorted(failed) == sorted(faults.values())
    assert failed["segfault"]["failure"] == "process_died"
    assert "SIGSEGV" in failed["segfault"]["reason"]
    assert failed["segfault"]["exit_code"] == -signal.SIGSEGV
    assert failed["hang"]["failure"] == "wall_clock"
    assert failed["hang"]["reason"] == f"exceeded {TIMEOUT} s of wall clock"
    assert failed["memory"]["failure"] == "memory"
    assert failed["memory"]["reason"] == "exceeded 900 MB of memory"
    assert failed["raise"]["failure"] is None
    assert failed["raise"]["status"] == "planner_failed"
    assert failed["hang"]["collisions"] is None  # unknown, not 0


@pytest.mark.slow
@pytest.mark.parametrize("fault", ["segfault", "hang", "raise", "memory", "leave"])
def test_fault_in_the_very_first_run(tmp_path, fault):
    """A fault of the run that the estimate is made of costs its row, not the sweep."""
    sweep = write_sweep(tmp_path, 3, {0: fault}, memory_mb=700)
    out = tmp_path / "out"
    done = rearview("sweep", sweep, "--out", out, "--workers", "1")
    assert done.returncode == 0, done.stderr
    assert [row["arrived"] for row in rows(out)] == [False, True, True]
    failure = {
        "segfault": "process_died",
        "hang": "wall_clock",
        "raise": None,
        "memory": "memory",
        "leave": None,
    }
    assert rows(out)[0]["failure"] == failure[fault]


@pytest.mark.slow
def test_lost_runs_are_tried_again(tmp_path):
    out = tmp_path / "out"
    sweep = write_sweep(tmp_path, 3, {1: "segfault"}, retries=2)
    assert rearview("sweep", sweep, "--out", out).returncode == 0
    assert [row["attempts"] for row in rows(out)] == [1, 3, 1]


@pytest.mark.slow
def test_killed_twice_and_resumed_is_as_undisturbed(tmp_path):
    count = 120
    sweep = write_sweep(tmp_path, count)
    whole = tmp_path / "whole"
    assert rearview("sweep", sweep, "--out", whole, "--workers", "0").returncode == 0
    out = tmp_path / "out"
    for share in (0.25, 0.5):
        process = start("sweep", sweep, "--out", out, "--workers", "2")
        wait_for(out, share * count, process)
        if share < 0.5:
            os.killpg(process.pid, signal.SIGKILL)
        else:
            process.kill()  # the workers are left to notice
        process.communicate()
        assert share * count <= len(finished(out)) < count
    done = rearview("sweep", sweep, "--out", out, "--workers", "2")
    assert done.returncode == 0, done.stderr
    assert not list((out / "runs").glob("*/.unfinished-*"))
    assert steady(out) == steady(whole)


@pytest.mark.slow
@pytest.mark.parametrize("workers", [0, 2])
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
@pytest.mark.usefixtures("interruptible")
def test_interrupt_stops_cleanly_and_says_how_to_go_on(tmp_path, number, workers):
    out = tmp_path / "out"
    sweep = write_sweep(tmp_path, 300)
    process = start("sweep", sweep, "--out", out, "--workers", workers)
    wait_for(out, 10, process)
    os.killpg(process.pid, number)  # as a terminal does
    _, err = process.communicate(timeout=PATIENCE)
    assert process.returncode == 130
    again = f"rearview sweep {tmp_path}/light.yaml --out {out} --workers {workers}"
    assert last_words(err).endswith(f"resume with: {again}")
    assert len(rows(out)) == len(finished(out)) >= 10
    assert all(row["arrived"] for row in rows(out))
    assert not list((out / "runs").glob("*/.unfinished-*"))
    assert json.loads((out / "progress.json").read_text())["state"] == "interrupted"


@pytest.mark.slow
def test_full_disk_is_a_clear_stop(tmp_path, tiny_disk):
    subprocess.run(["mount", "-o", "remount,size=400k", str(tiny_disk)], check=True)
    out = tiny_disk / "out"
    done = rearview("sweep", write_sweep(tmp_path, 200), "--out", out)
    assert done.returncode == 2
    message = last_words(done.stderr)
    assert "No space left on device" in message
    assert message.endswith("the same command resumes")
    there = list(run_folders(out))
    assert 0 < len(there) < 200
    for run in there:
        json.loads((run / "manifest.json").read_text())
        json.loads((run / "metrics.json").read_text())
    subprocess.run(["mount", "-o", "remount,size=20m", str(tiny_disk)], check=True)
    done = rearview("sweep", write_sweep(tmp_path, 200), "--out", out)
    assert done.returncode == 0, done.stderr
    assert len(rows(out)) == 200


@pytest.mark.slow
def test_invalid_run_is_a_row(tmp_path):
    """Obstacles drawn from the seed may stand on the ego: a row, not the end."""
    out = tmp_path / "out"
    obstacles = {"random": {"first_m": 0, "spacing_m": [100, 100], "max_offset_m": 6}}
    sweep = write_sweep(tmp_path, 1, set={"obstacles": obstacles}, seeds={"count": 20})
    assert rearview("sweep", sweep, "--out", out, "--workers", "1").returncode == 0
    found = rows(out)
    assert len(found) == 20
    invalid = [row for row in found if row["failure"] == "invalid_configuration"]
    assert 0 < len(invalid) < 20
    assert all("stands on the ego" in row["reason"] for row in invalid)


@pytest.mark.slow
def test_shipped_smoke_sweep(tmp_path):
    """What continuous integration has of the real planners and of SUMO in sweeps."""
    done = rearview("sweep", "smoke", "--out", tmp_path / "out")
    assert done.returncode == 0, done.stderr
    found = rows(tmp_path / "out")
    assert len(found) == 24
    assert all(row["arrived"] for row in found), found


@pytest.mark.slow
def test_interrupt_and_lost_dask_worker_cost_no_run(tmp_path):
    out = tmp_path / "out"
    sweep = write_sweep(tmp_path, 150)
    cluster = start("cluster", "--workers", "2")
    try:
        address = cluster.stdout.readline().strip()
        process = start("sweep", sweep, "--out", out, "--cluster", address)
        wait_for(out, 10, process)
        process.terminate()  # the workers must be free again afterwards
        process.communicate(timeout=PATIENCE)
        assert process.returncode == 130
        process = start("sweep", sweep, "--out", out, "--cluster", address)
        wait_for(out, 40, process)
        workers = [p for p in psutil.Process(cluster.pid).children() if is_worker(p)]
        workers[0].kill()
        _, err = process.communicate(timeout=PATIENCE)
        assert process.returncode == 0, err
    finally:
        cluster.terminate()
        cluster.communicate(timeout=PATIENCE)
    assert [row["status"] for row in rows(out)] == ["arrived"] * 150


@pytest.mark.slow
def test_lost_scheduler_is_a_clear_stop(tmp_path):
    out = tmp_path / "out"
    sweep = write_sweep(tmp_path, 300)
    cluster = start("cluster", "--workers", "2")
    try:
        address = cluster.stdout.readline().strip()
        process = start("sweep", sweep, "--out", out, "--cluster", address)
        wait_for(out, 10, process)
    finally:
        os.killpg(cluster.pid, signal.SIGKILL)
        cluster.communicate(timeout=PATIENCE)
    _, err = process.communicate(timeout=PATIENCE)
    assert process.returncode == 2
    assert err.splitlines()[-1].endswith(
        "the scheduler is lost; the same command resumes the sweep"
    )
    assert len(rows(out)) == len(finished(out)) >= 10


def is_worker(process: psutil.Process) -> bool:
    """Tell a dask worker from the helpers of multiprocessing."""
    return "spawn_main" in " ".join(process.cmdline())


@pytest.mark.slow
def test_dask_gives_the_same_rows(tmp_path):
    faults = {3: "segfault", 5: "hang", 7: "raise", 9: "memory"}
    sweep = write_sweep(tmp_path, 14, faults)
    cluster = start("cluster", "--workers", "2")
    try:
        address = cluster.stdout.readline().strip()
        done = rearview("sweep", sweep, "--out", tmp_path / "d", "--cluster", address)
        assert done.returncode == 0, done.stderr
    finally:
        cluster.terminate()
        cluster.communicate(timeout=PATIENCE)
    assert rearview("sweep", sweep, "--out", tmp_path / "p").returncode == 0
    assert steady(tmp_path / "d") == steady(tmp_path / "p")


@pytest.mark.slow
@pytest.mark.parametrize(
    ("address", "words"),
    [
        ("tcp://127.0.0.1:1", "no dask scheduler answers there"),
        ("tcp://no.such.host:8786", "no dask scheduler answers there"),
        ("nonsense", "is not an address"),
        ("tcp://", "is not an address"),
        ("tcp://127.0.0.1:99999", "is not an address"),
    ],
)
def test_wrong_cluster_address_is_one_line(tmp_path, address, words):
    sweep = write_sweep(tmp_path, 2)
    done = rearview("sweep", sweep, "--out", tmp_path / "o", "--cluster", address)
    assert done.returncode == 2
    assert done.stderr.count("\n") == 1, done.stderr
    assert words in done.stderr


@pytest.mark.slow
def test_trace_does_not_depend_on_what_ran_before(tmp_path):
    """One worker drives SUMO runs in both orders: each trace is as it was."""
    hashes = []
    for name, seeds in (("up", [1, 2, 3]), ("down", [3, 2, 1])):
        sweep = write_sweep(
            tmp_path,
            1,
            scenarios=["straight"],
            planners=["cruise"],
            axes={},
            set={"ego.goal_m": 160},
            seeds=seeds,
            timeout_s=60,
        )
        out = tmp_path / name
        assert rearview("sweep", sweep, "--out", out, "--workers", "1").returncode == 0
        hashes.append([row["trace_hash"] for row in rows(out)])
    assert hashes[0] == hashes[1]
    alone = ("straight", "--planner", "cruise", "--seed", 2, "--set", "ego.goal_m=160")
    done = rearview("run", *alone, "--json", "--out", tmp_path / "runs")
    folder = Path(json.loads(done.stdout)["run_folder"])
    about = json.loads((folder / "manifest.json").read_text())
    assert about["trace_hash"] == hashes[0][1]
    assert len(set(hashes[0])) == 3


@pytest.mark.slow
def test_nothing_to_do_is_quick(tmp_path, monkeypatch):
    """A thousand finished runs take about 2 s of processor time.

    Twice that is allowed: a machine with other jobs computes slower.
    """
    monkeypatch.chdir(HERE)
    out = tmp_path / "out"
    sweep = write_sweep(tmp_path, 1000)
    pretend(sweep, out)
    done = rearview("sweep", sweep, "--out", out)  # compiles byte code, draws the page
    assert done.returncode == 0, done.stderr
    assert "light: 1000 runs, 1000 of them finished" in done.stdout
    taken = []
    for _ in range(3):
        before = os.times()
        rearview("sweep", sweep, "--out", out)
        after = os.times()
        user = after.children_user - before.children_user
        taken.append(user + after.children_system - before.children_system)
    assert min(taken) < 4.0


def test_stale_results_are_gathered_though_nothing_is_missing(tmp_path, monkeypatch):
    """As after a kill between the last run and the gathering."""
    monkeypatch.chdir(HERE)
    out = tmp_path / "out"
    sweep = write_sweep(tmp_path, 3)
    pretend(sweep, out)
    lost = next(run_folders(out))
    lost.rename(tmp_path / "aside")
    assert rebuild(out) == 2
    (tmp_path / "aside").rename(lost)
    app(["sweep", sweep, "--out", str(out)], standalone_mode=False)
    with duckdb.connect() as database:
        found = database.execute(f"SELECT count(*) FROM '{out}/results.parquet'")
        assert found.fetchone() == (3,)


def test_runs_that_are_not_asked_for_are_said(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(HERE)
    out = tmp_path / "out"
    pretend(write_sweep(tmp_path, 3), out)
    sweep = write_sweep(tmp_path, 2)
    app(["sweep", sweep, "--out", str(out)], standalone_mode=False)
    words = "light: 2 runs, 2 of them finished; its results keep 1 other run"
    assert words in capsys.readouterr().out


def test_worker_with_other_code_ends_the_sweep(tmp_path, monkeypatch):
    monkeypatch.chdir(HERE)
    asked, document = load_sweep(write_sweep(tmp_path, 2))
    plan = Plan(asked, document)
    task = task_of(next(iter(plan)), asked, tmp_path)
    other = replace(task, facts={**task.facts, "code_hash": "0" * 64})
    report = execute_run(other)
    assert (report.failure, report.ends_sweep) == (Failure.OTHER_CODE, True)
    assert not task.folder.exists()

    class Foreign(SequentialExecutor):
        def submit(self, _):
            super().submit(other)

    settings = WorkerSettings(900, tmp_path / "log", HERE)
    with pytest.raises(ResultsError, match="another version of the code"):
        drive_missing(plan, asked, tmp_path, lambda: Foreign(settings), Silent())
    assert not list(run_folders(tmp_path))


@pytest.mark.parametrize(
    ("kept", "counted"), [("none", False), ("failures", True), ("all", True)]
)
def test_candidates_are_counted_where_a_trace_may_be_kept(
    tmp_path, monkeypatch, kept, counted
):
    monkeypatch.chdir(HERE)
    asked, document = load_sweep(write_sweep(tmp_path, 1, keep_traces=kept))
    task = task_of(next(iter(Plan(asked, document))), asked, tmp_path)
    assert task.full_statistics is counted
    assert facts_of(task)["full_statistics"] is counted


class Silent:
    def report(self, report): ...

    def tick(self): ...


def test_unfinished_folders_are_taken_out_of_other_hands(tmp_path):
    """Who still fills one can no longer put it in its place."""
    left = tmp_path / "runs" / "ab" / ".unfinished-12-x"
    left.mkdir(parents=True)
    (left / "metrics.json").write_text("{}")
    remove_unfinished(tmp_path)
    assert list((tmp_path / "runs" / "ab").iterdir()) == []


@pytest.mark.slow
def test_results_are_rebuilt_from_the_run_folders(tmp_path):
    out = tmp_path / "out"
    sweep = write_sweep(tmp_path, 3, keep_traces="none")
    assert rearview("sweep", sweep, "--out", out, "--workers", "0").returncode == 0
    before = rows(out)
    (out / "results.parquet").unlink()
    assert rebuild(out) == 3
    assert rows(out) == before
    (out / "results.parquet").write_bytes(b"no parquet")
    assert rows(out) == before


def wait_for(out: Path, count: float, process: subprocess.Popen) -> None:
    """Wait until so many runs are there."""
    deadline = time.monotonic() + PATIENCE
    while len(finished(out)) < count:
        assert process.poll() is None, process.communicate()
        assert time.monotonic() < deadline
        time.sleep(0.05)


def test_more_workers_than_the_machine_can_bear_are_refused():
    most = MOST_PER_CORE * cores()
    require_few(most)
    with pytest.raises(ConfigError, match=f"--workers: is {most + 1}; allowed: up to"):
        require_few(most + 1)
