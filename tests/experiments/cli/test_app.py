"""The command line as users run it: in a process of its own."""

import errno
import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from datetime import datetime
from pathlib import Path

import pytest

from experiments.cli import crash_guard
from experiments.cli.app import app, main
from experiments.cli.compile_notice import NOTICE
from experiments.episode import run_folder
from experiments.metrics.catalogue import TIMING_COLUMNS
from experiments.trace.files import read_trace
from experiments.trace.schema import TABLES, trace_hash
from sumo_nets.build import net_path

HERE = Path(__file__).parents[1]  # where the planners of these tests are
ROOT = HERE.parent.parent
PATIENCE = 300.0  # with processes; other jobs may have the machine [s]
OWN = ("--planner", "constant_speed_planner:make")

EMPTY_ROAD = """\
name: empty_road
world: kinematic
road: {segments: [[line, 300]]}
ego: {goal_m: 60}
"""


def rearview(
    *arguments: str, folder: Path = HERE, **environment: str
) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-m", "rearview_command", *arguments],
        cwd=folder,
        env={**os.environ, "PYTHONPATH": str(ROOT), "COLUMNS": "100", **environment},
        capture_output=True,
        text=True,
        check=False,
        timeout=PATIENCE,
        stdin=subprocess.DEVNULL,
    )


@pytest.fixture
def refusal(monkeypatch, capfd) -> Callable[..., str]:
    """Run in this process, which is quicker; nothing here comes to a simulator."""
    monkeypatch.setattr(crash_guard, "guarded", lambda episode, crashed: episode())

    def run(*arguments: str) -> str:
        with pytest.raises(SystemExit) as left:
            app(arguments)
        out, err = capfd.readouterr()
        assert left.value.code == 2
        assert out == ""
        assert err.count("\n") == 1
        return err

    return run


@pytest.fixture
def run_here(monkeypatch, capfd) -> Callable[..., tuple[int, dict[str, object], str]]:
    """Run in this process, for runs that leave it alive: exit status, row, stderr."""
    monkeypatch.setattr(crash_guard, "guarded", lambda episode, crashed: episode())
    monkeypatch.chdir(HERE)
    monkeypatch.syspath_prepend(str(HERE))

    def run(*arguments: str) -> tuple[int, dict[str, object], str]:
        with pytest.raises(SystemExit) as left:
            app(("run", *arguments, "--json"))
        out, err = capfd.readouterr()
        assert out.count("\n") == 1
        return left.value.code, json.loads(out), err

    return run


@pytest.fixture
def output_of(capfd) -> Callable[..., str]:
    """Run a command that succeeds in this process: stdout."""

    def run(*arguments: str) -> str:
        with pytest.raises(SystemExit) as left:
            app(arguments)
        out, err = capfd.readouterr()
        assert left.value.code == 0, err
        return out

    return run


@pytest.fixture
def road(tmp_path: Path) -> str:
    path = tmp_path / "empty_road.yaml"
    path.write_text(EMPTY_ROAD)
    return str(path)


def row_of(done: subprocess.CompletedProcess[str]) -> dict[str, object]:
    assert done.stdout.count("\n") == 1, done
    return json.loads(done.stdout)


def test_run_arrives_and_leaves_a_run_folder(road, tmp_path, output_of, monkeypatch):
    done = rearview("run", road, *OWN, "--out", str(tmp_path / "runs"))
    assert done.returncode == 0, done.stderr
    assert done.stderr.replace(NOTICE, "") == ""
    assert "arrived: " in done.stdout
    assert "m/s²" in done.stdout
    (folder,) = (tmp_path / "runs").iterdir()
    assert str(folder) in done.stdout
    assert folder.name.startswith("empty_road-constant_speed_planner_make-0-")
    names = {path.name for path in folder.iterdir()}
    assert {"config.yaml", "manifest.json", "metrics.json", "trace.parquet"} <= names
    manifest = json.loads((folder / "manifest.json").read_text())
    trace = read_trace(folder)
    assert manifest["trace_hash"] == trace_hash(trace)
    assert len(trace.steps["index"]) == 45  # 60 m at 13.89 m/s: 44 steps
    assert manifest["versions"]["python"].startswith("3.")
    assert manifest["planner_hash"]
    assert time.time() - 120 < datetime.fromisoformat(manifest["ended_at"]).timestamp()
    monkeypatch.chdir(tmp_path)  # where the newest run is looked for
    assert output_of("report") == f"runs/{folder.name}/report.html\n"


def test_recorded_configuration_makes_the_same_run(road, tmp_path, run_here):
    first = row_of(rearview("run", road, *OWN, "--json", "--out", str(tmp_path / "a")))
    config = str(Path(str(first["run_folder"])) / "config.yaml")
    _, second, _ = run_here(config, *OWN, "--out", str(tmp_path / "b"))
    for row in (first, second):
        del row["run_folder"]
        assert Path(str(row.pop("report"))).is_file()
        for name in TIMING_COLUMNS:
            row.pop(name)
    assert first == second
    (one,), (other,) = (tmp_path / "a").iterdir(), (tmp_path / "b").iterdir()
    assert one.name == other.name
    files = [file for file in one.glob("*.parquet") if file.name != "timing.parquet"]
    assert len(files) == len(TABLES)
    for file in files:
        assert file.read_bytes() == (other / file.name).read_bytes(), file.name


def test_other_outcomes_are_exit_status_1(road, tmp_path, run_here):
    obstacle = "obstacles=[{s_m: 40, radius_m: 1}]"
    out = ("--out", str(tmp_path), "--json")
    done = rearview("run", road, *OWN, *out, "--set", obstacle)
    row = row_of(done)
    assert done.returncode == 1
    assert row["status"] == "collision"
    assert row["first_collision_with"] == "obstacle.0"
    assert row["travel_time_s"] is None
    short = ("--set", "simulation.duration_s=1", "--out", str(tmp_path))
    code, row, _ = run_here(road, *OWN, *short)
    assert code == 1
    assert row["status"] == "timeout"


@pytest.mark.parametrize("how", ["nan_at", "raise_at"])
def test_a_failing_planner_leaves_the_trace_up_to_there(road, tmp_path, run_here, how):
    setting = f"planner.settings.{how}=2"
    code, row, err = run_here(road, *OWN, "--set", setting, "--out", str(tmp_path))
    assert code == 1
    assert row["status"] == "planner_failed"
    assert "Traceback" not in err
    trace = read_trace(Path(str(row["run_folder"])))
    assert trace.steps["time_s"][-1] == pytest.approx(2.0)
    assert trace.fact("reason")


def test_a_dying_process_is_an_outcome(road, tmp_path):
    setting = "planner.settings.crash_at=1"
    out = ("--out", str(tmp_path / "runs"))
    done = rearview("run", road, *OWN, "--set", setting, "--json", *out)
    row = row_of(done)
    assert done.returncode == 1
    assert row["status"] == "crashed"
    assert "SIGSEGV" in read_trace(Path(str(row["run_folder"]))).fact("reason")
    assert len(list((tmp_path / "runs").iterdir())) == 1, "nothing half-written is left"


@pytest.mark.parametrize("how", ["exit_at", "stats_at"])
def test_a_planner_that_breaks_its_contract(road, tmp_path, run_here, how):
    setting = f"planner.settings.{how}=1"
    code, row, err = run_here(road, *OWN, "--set", setting, "--out", str(tmp_path))
    assert code == 1
    assert row["status"] == "planner_failed"
    assert "Traceback" not in err


@pytest.mark.slow
def test_a_process_that_just_leaves_is_a_crash(road, tmp_path):
    setting = "planner.settings.leave_at=1"
    out = ("--out", str(tmp_path / "runs"))
    done = rearview("run", road, *OWN, "--set", setting, "--json", *out)
    row = row_of(done)
    assert done.returncode == 1
    assert row["status"] == "crashed"
    assert "exit status 0 before the end" in read_trace(
        Path(str(row["run_folder"]))
    ).fact("reason")
    assert len(list((tmp_path / "runs").iterdir())) == 1


def test_a_planner_may_change_the_working_folder(road, tmp_path, run_here, monkeypatch):
    monkeypatch.chdir(tmp_path)
    setting = "planner.settings.move_at=1"
    code, _, err = run_here(road, *OWN, "--set", setting, "--out", "runs")
    assert code == 0, err
    assert Path.cwd() == tmp_path
    (folder,) = Path("runs").iterdir()
    assert (folder / "report.html").is_file()


@pytest.mark.skipif(not hasattr(os, "fork"), reason="no guard without fork")
def test_a_mistake_of_ours_has_its_own_exit_status(capfd):
    def episode() -> int:
        raise LookupError("never foreseen")

    assert crash_guard.guarded(episode, lambda *_: 1) == crash_guard.INTERNAL_ERROR
    assert "LookupError: never foreseen" in capfd.readouterr().err


def sleepy(road: str, seconds: float, mark: Path) -> list[str]:
    """Give the command of a run that sleeps in every cycle, from a file's touch on."""
    settings = (f"planner.settings.sleep={seconds}", f"planner.settings.mark={mark}")
    sets = [word for setting in settings for word in ("--set", setting)]
    return [sys.executable, "-m", "experiments", "run", road, *OWN, *sets]


def wait_for_file(file: Path) -> None:
    deadline = time.monotonic() + PATIENCE
    while not file.exists():
        assert time.monotonic() < deadline
        time.sleep(0.02)


@pytest.mark.slow
@pytest.mark.parametrize(("asleep", "whole"), [(0.05, 0), (300.0, 1)])
def test_sigterm_to_the_parent_ends_both(road, tmp_path, asleep, whole):
    """A step that takes too long is killed, and the episode counts as crashed."""
    runs = tmp_path / "runs"
    mark = tmp_path / "planning"
    process = subprocess.Popen(
        [*sleepy(road, asleep, mark), "--out", str(runs)],
        cwd=HERE,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        start_new_session=True,
    )
    wait_for_file(mark)
    process.terminate()
    assert process.wait(timeout=PATIENCE) == crash_guard.TERMINATED
    with pytest.raises(ProcessLookupError):
        os.killpg(process.pid, 0)
    assert [path.name[0] for path in runs.iterdir()] == ["e"] * whole


@pytest.mark.parametrize("to_all", [True, False])
def test_ctrl_c_to_all_or_to_the_command_alone_ends_after_the_step(
    road, tmp_path, to_all
):
    runs, mark = tmp_path / "runs", tmp_path / "planning"
    process = subprocess.Popen(
        [*sleepy(road, 0.2, mark), "--out", str(runs)],
        cwd=HERE,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        start_new_session=True,
        stderr=subprocess.PIPE,
        text=True,
    )
    wait_for_file(mark)
    if to_all:
        os.killpg(process.pid, signal.SIGINT)
    else:
        process.send_signal(signal.SIGINT)
    _, words = process.communicate(timeout=PATIENCE)
    assert process.returncode == crash_guard.INTERRUPTED
    assert "Traceback" not in words
    with pytest.raises(ProcessLookupError):
        os.killpg(process.pid, 0)
    assert list(runs.iterdir()) == []


def test_ctrl_c_in_a_step_that_hangs_says_so_and_the_second_one_stops(road, tmp_path):
    runs = tmp_path / "runs"
    mark = tmp_path / "planning"
    process = subprocess.Popen(
        [*sleepy(road, 300.0, mark), "--out", str(runs)],
        cwd=HERE,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        start_new_session=True,
        stderr=subprocess.PIPE,
        text=True,
    )
    wait_for_file(mark)
    os.killpg(process.pid, signal.SIGINT)
    for line in process.stderr:
        if line.startswith("waiting for the step to end"):
            break
    assert process.poll() is None
    process.send_signal(signal.SIGINT)  # to the parent alone
    assert process.wait(timeout=PATIENCE) == crash_guard.INTERRUPTED
    process.stderr.close()
    with pytest.raises(ProcessLookupError):
        os.killpg(process.pid, 0)
    assert list(runs.iterdir()) == []


def test_ctrl_c_leaves_nothing(road, tmp_path):
    setting = "planner.settings.interrupt_at=1"
    runs = tmp_path / "runs"
    done = rearview("run", road, *OWN, "--set", setting, "--out", str(runs))
    assert done.returncode == 130
    assert done.stdout == ""
    assert list(runs.iterdir()) == []


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["run", "intersecton"], "did you mean intersection"),
        (["run", "nowhere.yaml"], "nowhere.yaml: cannot be read"),
        (["run", "straight", "--planner", "cruse"], "did you mean cruise"),
        (["run", "straight", "--seed", "-1"], "simulation.seed: is -1; allowed"),
        (["run", "straight", "--set", "ego.gol_m=1"], "did you mean goal_m"),
        (["run", "straight", "--set", "network=strait"], 'no network "strait"; there'),
        (["run", "straight", "--set", "ego.goal_m=9999"], "allowed: 0 to 500.0"),
        (
            ["run", "straight", "--set", "obstacles=[{s_m: 102, radius_m: 1}]"],
            "obstacles[0]: an obstacle stands on the ego",
        ),
        (
            ["run", "straight", "--set", "obstacles={random: {first_m: 104}}"],
            "obstacles.random.first_m: an obstacle stands on the ego",
        ),
        (
            ["run", "straight", "--set", "traffic={models: {Crauss: 1}}"],
            "traffic.models.Crauss: unknown key; did you mean Krauss",
        ),
        (["run", "straight", "--set", "ego.goal_m"], "allowed: key.path=value"),
        (["run", "straight", "--out", "/dev/null/runs"], "/dev/null"),
        (["run", ""], "'': no such scenario"),
        (["run", str(HERE)], "is a folder; allowed: a .yaml file"),
        (["run", "straight", "--set", "ego.goal_m=[60"], "=[60: is not YAML"),
        (
            ["run", "straight", "--set", "ego.start_offset_m=4.9"],
            "ego.start_offset_m: is 4.9 at start_m = 100; allowed: -4.05 to 4.05",
        ),
        (
            [
                "run",
                "straight",
                "--set",
                "ego.start_m=499",
                "--set",
                "ego.goal_m=499.5",
            ],
            "ego.start_m: is 499; allowed: 0 to 496.2",
        ),
        (
            ["run", "straight", "--set", "traffic.models={}"],
            "traffic.models: is a section without keys; allowed: a section with Krauss",
        ),
        (
            ["run", "straight", "--set", "traffic.models={Krauss: 0}"],
            "traffic.models.Krauss: is 0; allowed: a number > 0",
        ),
        (
            ["run", "thesis_straight", "--set", "vehicles=[{s_m: 3, speed_mps: 0}]"],
            "vehicles[0]: a vehicle stands on the ego",
        ),
        (
            ["run", "thesis_straight", "--set", "road.segments=[[arc, 400, 0.2]]"],
            "road.half_width_m: is 5; allowed: less than the smallest radius of the "
            "segments, 5 m",
        ),
        (
            ["run", "straight", "--set", "obstacles.random.spacing_m=[1e-9, 1]"],
            "obstacles.random.spacing_m[0]: is 1e-09; allowed: a number >= 1",
        ),
    ],
)
def test_bad_input_is_one_line_and_exit_status_2(arguments, message, tmp_path, refusal):
    out = () if "--out" in arguments else ("--out", str(tmp_path / "runs"))
    assert message in refusal(*arguments, *out)
    assert not (tmp_path / "runs").exists() or not list((tmp_path / "runs").iterdir())


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["run"], "Missing argument 'NAME|FILE'; see rearview run --help"),
        (["rum"], "No such command 'rum'"),
        (["run", "straight", "--sed", "3"], "No such option: --sed"),
        (["run", "straight", "--seed", "abc"], "Invalid value for '--seed'"),
    ],
)
def test_mistakes_in_the_words_are_one_line_too(
    arguments, message, capsys, monkeypatch
):
    monkeypatch.setattr(sys, "argv", ["rearview", *arguments])
    with pytest.raises(SystemExit) as left:
        main()
    out, err = capsys.readouterr()
    assert left.value.code == 2
    assert out == ""
    assert err.count("\n") == 1
    assert message in err


def test_a_run_folder_or_a_file_nearby_is_meant(road, tmp_path, monkeypatch, refusal):
    monkeypatch.chdir(tmp_path)
    assert "did you mean empty_road.yaml?" in refusal("run", "empty_road")
    (tmp_path / "config.yaml").touch()
    assert f"did you mean {tmp_path}/config.yaml?" in refusal("run", str(tmp_path))


def test_a_terminal_of_ascii_gets_question_marks(road, tmp_path):
    done = rearview("run", road, *OWN, "--out", str(tmp_path), PYTHONIOENCODING="ascii")
    assert done.returncode == 0, done.stderr
    assert "m/s?" in done.stdout


def test_bad_input_in_a_process_of_its_own(tmp_path):
    obstacle = "obstacles=[{s_m: 102, radius_m: 1}]"
    done = rearview("run", "straight", "--set", obstacle, "--out", str(tmp_path))
    assert done.returncode == 2
    assert done.stdout == ""
    assert done.stderr.count("\n") == 1
    assert "obstacles[0]: an obstacle stands on the ego" in done.stderr


@pytest.mark.parametrize(
    ("file", "route", "lane", "message"),
    [
        ("whole.net.xml", "[own]", 9, "has no lane 9"),
        ("whole.net.xml", "[own, oncoming]", 0, "no car can go from"),
        ("whole.net.xml", "[won]", 0, 'no edge "won"'),
        ("half.net.xml", "[own]", 0, "truncated or damaged"),
        ("none.net.xml", "[own]", 0, "no such network file"),
    ],
)
def test_bad_networks(tmp_path, refusal, file, route, lane, message):
    text = net_path("straight").read_text()
    (tmp_path / "whole.net.xml").write_text(text)
    (tmp_path / "half.net.xml").write_text(text[: len(text) // 2])
    scenario = tmp_path / "mine.yaml"
    scenario.write_text(
        f"name: mine\nnetwork: {{file: {file}, route: {route}, lane: {lane}}}\n"
        "ego: {goal_m: 90}\n"
    )
    line = refusal("run", str(scenario), "--out", str(tmp_path / "runs"))
    assert message in line
    assert f"{scenario}:2: network: " in line
    assert not (tmp_path / "runs").exists()


def test_full_disk_is_one_line(road, tmp_path, refusal, monkeypatch):
    def full(trace: object, folder: Path) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(run_folder, "write_trace", full)
    monkeypatch.syspath_prepend(str(HERE))
    line = refusal("run", road, *OWN, "--out", str(tmp_path / "runs"))
    assert "No space left on device" in line
    assert list((tmp_path / "runs").iterdir()) == []


def test_a_disk_that_really_is_full(road, tiny_disk):
    done = rearview("run", road, *OWN, "--out", str(tiny_disk))
    assert done.returncode == 2
    assert "cannot be written: No space left on device" in done.stderr
    assert done.stderr.count("\n") == 1
    assert done.stdout == ""
    assert list(tiny_disk.iterdir()) == []


def test_no_display_for_the_window():
    done = rearview("run", "straight", "--gui", DISPLAY="")
    if sys.platform.startswith("linux"):
        assert done.returncode == 2
        assert done.stderr.count("\n") == 1
        assert "DISPLAY is not set" in done.stderr


def test_list_names_everything(output_of):
    listed = output_of("list")
    for name in (
        "scenarios",
        "networks",
        "planners",
        "u_shaped",
        "cruise_conventional",
    ):
        assert name in listed


def test_schema_is_the_committed_one(output_of):
    assert output_of("schema") == (
        ROOT / "experiments" / "scenarios" / "scenario.schema.json"
    ).read_text(encoding="utf-8")


@pytest.mark.sumo
@pytest.mark.parametrize(
    "name",
    [
        "straight",
        *(
            pytest.param(name, marks=pytest.mark.slow)
            for name in ("curved", "intersection", "u_shaped")
        ),
    ],
)
def test_sumo_roads_are_driven_to_the_goal(name, tmp_path):
    nothing = ("--set", "traffic=none", "--set", "obstacles=none")
    done = rearview("run", name, *OWN, *nothing, "--json", "--out", str(tmp_path))
    row = row_of(done)
    assert row["status"] == "arrived", done
    assert row["off_road_steps"] == 0
    trace = read_trace(Path(str(row["run_folder"])))
    assert trace.steps["s_m"][0] == pytest.approx(100.0, abs=1e-6)
    assert abs(trace.steps["l_m"]).max() < 1e-3


@pytest.mark.slow
@pytest.mark.sumo
def test_same_seed_same_trace_in_two_processes_other_seed_another(tmp_path):
    hashes = []
    for seed, out in (("3", "a"), ("3", "b"), ("4", "c")):
        done = rearview(
            "run",
            "straight",
            *OWN,
            "--seed",
            seed,
            "--json",
            "--out",
            str(tmp_path / out),
        )
        folder = Path(str(row_of(done)["run_folder"]))
        hashes.append(json.loads((folder / "manifest.json").read_text())["trace_hash"])
    assert hashes[0] == hashes[1] != hashes[2]


@pytest.mark.parametrize("name", ["planner", "sumo_nets", "experiments"])
def test_a_file_of_the_users_that_hides_a_package_of_ours(tmp_path, name):
    file = tmp_path / f"{name}.py"
    file.write_text("def make(): ...\n")
    path = f"{tmp_path}{os.pathsep}{ROOT}"
    for command in (("run", "straight", "--planner", f"{name}:make"), ("list",)):
        done = rearview(*command, folder=tmp_path, PYTHONPATH=path)
        assert done.returncode == 2
        words = f"the name {name} is taken by rearview; allowed: another name"
        assert done.stderr.startswith(f"rearview: {file}: {words}"), done.stderr
        assert done.stderr.count("\n") == 1


def test_messages_are_not_longer_than_a_few_lines(tmp_path, refusal):
    file = tmp_path / "long.yaml"
    file.write_text(EMPTY_ROAD.replace("60", "x" * 20_000))
    message = refusal("run", str(file))
    assert "xxx...'; allowed: a number" in message  # long values are cut first
    message = refusal("run", f"{tmp_path}/{'x' * 20_000}.yaml")
    assert message.endswith("...\n")
    assert len(message) < 520


def test_a_scenario_that_names_a_strangers_module_is_refused(tmp_path, refusal):
    file = tmp_path / "theirs.yaml"
    mark = tmp_path / "gotcha"
    settings = f"{{name: 'os:system', settings: {{command: touch {mark}}}}}"
    file.write_text(f"{EMPTY_ROAD}planner: {settings}\n")
    message = refusal("run", str(file), "--out", str(tmp_path / "runs"))
    assert "theirs.yaml:5: planner: os:system: a file may not name" in message
    assert not mark.exists()
