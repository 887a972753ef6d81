"""The estimate of a sweep's duration, with the work of its processes made up."""

import time
from pathlib import Path

import pytest

from experiments.config.scenario_file import load_scenario
from experiments.interrupts import interrupts_between_steps
from experiments.sweep import estimate
from experiments.sweep.estimate import estimate_duration, time_run
from experiments.sweep.executors.executor import WorkerSettings
from experiments.sweep.plan import PlannedRun
from experiments.sweep.schedule import Missing, Survey

HERE = Path(__file__).parents[1]  # where faulty_planner is
ROAD = """\
name: empty_road
world: kinematic
road: {segments: [[line, 300]]}
ego: {goal_m: 30}
"""


@pytest.fixture
def scenario(tmp_path):
    file = tmp_path / "empty_road.yaml"
    file.write_text(ROAD)

    def load(planner: str, *overrides: str):
        return load_scenario(str(file), planner=planner, overrides=overrides)

    return load


@pytest.fixture
def calls(monkeypatch):
    """Calls of worker processes, as (function, planners, timeout); with made-up times.

    A planner that ends with `lost` dies.
    """
    made = []
    seconds = {"cruise": 2.0, "dense": 4.0, "mine:make": 9.0}

    def call_each(function, configs, settings, timeout, workers):
        names = [config["planner"]["name"] for config in configs]
        made.append((function, names, timeout))
        if function is estimate.time_run:
            return [seconds.get(name) for name in names]
        return [not name.startswith("lane_change") for name in names]

    monkeypatch.setattr(estimate, "_call_each", call_each)
    return made


def survey(scenario, counts: dict[str, int]) -> Survey:
    kinds = {
        (name, "empty_road"): Missing(
            PlannedRun("id", scenario(name), name, {}, {}), count
        )
        for name, count in counts.items()
    }
    return Survey(sum(counts.values()), 0, kinds=kinds)


def test_each_kind_is_compiled_then_timed(scenario, calls, tmp_path):
    settings = WorkerSettings(900, tmp_path / "log", tmp_path)
    found = survey(scenario, {"cruise": 10, "dense": 5, "lane_change": 3})
    made = estimate_duration(found, settings, 60.0, 2)
    # the lost kind counts with the mean of the others
    assert made.seconds == pytest.approx(10 * 2.0 + 5 * 4.0 + 3 * 3.0)
    assert [config["planner"]["name"] for config in made.warm_up] == ["cruise", "dense"]
    assert [(names, timeout) for _, names, timeout in calls] == [
        (["cruise", "dense", "lane_change"], estimate.COMPILE_TIMEOUT),
        (["cruise", "dense", "lane_change"], 60.0),
    ]


def test_a_users_planner_is_not_waited_for_while_loops_compile(
    scenario, calls, tmp_path
):
    settings = WorkerSettings(900, tmp_path / "log", tmp_path)
    made = estimate_duration(survey(scenario, {"mine:make": 2}), settings, 60.0, 2)
    assert calls[0][1] == [estimate.STAND_IN]
    assert calls[1][1] == ["mine:make"]
    assert made.seconds == 18.0


def test_no_estimate_if_every_timed_run_is_lost(scenario, calls, tmp_path):
    settings = WorkerSettings(900, tmp_path / "log", tmp_path)
    made = estimate_duration(survey(scenario, {"yours:make": 2}), settings, 60.0, 2)
    assert made.seconds is None


def sleeps(config):
    """Be a run that takes as long as its settings say; loaded by worker processes."""
    time.sleep(config["sleep"])
    return config["sleep"]


def test_a_run_that_takes_too_long_is_left_out_of_the_estimate(tmp_path, caplog):
    """The others are timed, in the same pool: the loss comes from another process."""
    settings = WorkerSettings(900, tmp_path / "log", tmp_path)
    planner = {"planner": {"name": "cruise"}}
    configs = [{**planner, "sleep": seconds} for seconds in (0.0, 60.0, 0.1)]
    found = estimate._call_each(sleeps, configs, settings, 1.0, 1)
    assert found == [0.0, None, 0.1]
    assert "1 s" in caplog.text
    assert "BrokenProcessPool" not in caplog.text


@pytest.mark.sumo
def test_of_a_slow_run_with_many_egos_the_beginning_stands_for_all(monkeypatch):
    short = ("simulation.warmup_s=5", "measurement=null")
    ten, thousand = (
        load_scenario("motorway", overrides=(*short, f"simulation.duration_s={time}"))
        for time in (10, 1000)
    )
    monkeypatch.setattr(estimate, "TIMED", 0.0)
    found = [time_run(one.resolved()) for one in (ten, thousand)]
    assert found[1] > 10.0 * found[0]


def test_time_of_a_run(scenario, monkeypatch):
    monkeypatch.chdir(HERE)
    drives = scenario("faulty_planner:make").resolved()
    seconds = time_run(drives)
    assert seconds is not None
    assert seconds > 0.0
    leaves = scenario("faulty_planner:make", "planner.settings.fault=leave").resolved()
    with interrupts_between_steps():  # as in a sweep: it is no Ctrl-C
        assert time_run(leaves) is not None, "its planner fails, the run ends"
