"""A recorded cycle, planned again from its run folder, gives the same plan."""

import shutil
import subprocess
import sys

import numpy as np
import pytest

from experiments.config.scenario_file import load_scenario
from experiments.episode import run as episode
from experiments.episode.replan import Recorded, replan
from experiments.episode.run import run_episode
from experiments.errors import ConfigError, ResultsError
from experiments.planners.registry import PLANNERS
from experiments.trace.files import file_name, read_trace, write_tables
from experiments.trace.schema import TABLES
from planner.scene import COLUMNS, Scene

SHORT = ("simulation.duration_s=2.5", "simulation.warmup_s=20")
# planner -> scenarios that it can drive
ROADS = {
    "cruise": ("intersection", "dense_curved", "unprotected_left"),
    "dense": ("dense_curved",),
    "lane_change": ("lane_change_curved",),
    "careful_human": ("cut_in",),
    "regulation_157": ("cut_in",),
    "rss": ("braking_leader",),
    "fuzzy_safety": ("cut_out",),
    "idm_mobil": ("lane_change_curved",),
    "route": ("unprotected_left",),
    "sumo": ("straight",),
}


def scenarios(planner: str) -> tuple[str, ...]:
    """Choose scenarios by the first word of a planner's name that has some."""
    words = planner.split("_")
    return next(
        ROADS[name]
        for n in range(len(words), 0, -1)
        if (name := "_".join(words[:n])) in ROADS
    )


# The planners that give the roads their names; the others are settings of them.
CASES = [
    pytest.param(name, road, marks=[] if name in ROADS else [pytest.mark.slow])
    for name in PLANNERS
    for road in scenarios(name)
]


@pytest.mark.sumo
def test_a_closure_is_known_from_the_same_step_on(tmp_path):
    told = "obstacles.known_from_m=470"
    scenario = load_scenario("lane_change", overrides=(*SHORT, told))
    run = run_episode(scenario, out=tmp_path)
    scenes = list(Recorded.read(run.folder).scenes(20))
    known = [bool(scene.obstacles.ids) for scene in scenes]
    assert known == sorted(known)
    assert 0 < sum(known) < len(known)
    assert replan(run.folder, 20) == ()


@pytest.fixture(scope="module")
def recorded(tmp_path_factory):
    """One short run, with traffic and a traffic light."""
    scenario = load_scenario("intersection", overrides=SHORT)
    return run_episode(scenario, out=tmp_path_factory.mktemp("runs")).folder


@pytest.mark.sumo
@pytest.mark.parametrize(("planner", "road"), CASES)
def test_the_same_plan_bit_by_bit(planner, road, tmp_path):
    scenario = load_scenario(road, planner=planner, overrides=SHORT)
    run = run_episode(scenario, out=tmp_path)
    planned = np.flatnonzero(~np.ma.getmaskarray(run.trace.steps["plan_status"]))
    assert planned.size > 10
    for step in (0, planned[-1] // 2, planned[-1]):
        assert replan(run.folder, int(step)) == ()


@pytest.mark.sumo
def test_the_scenes_are_those_of_the_run(tmp_path, monkeypatch):
    scenario = load_scenario("intersection", overrides=SHORT)
    seen: list[Scene] = []
    made = episode.make_scenario_planner(scenario)

    class Watched:
        def plan(self, scene, memory):
            seen.append(scene)
            return made.plan(scene, memory)

    monkeypatch.setattr(episode, "make_scenario_planner", lambda _: Watched())
    folder = run_episode(scenario, out=tmp_path).folder
    rebuilt = list(Recorded.read(folder).scenes(len(seen) - 1))
    assert max(len(scene.vehicles.ids) for scene in seen) >= 2
    assert any(scene.stop_lines for scene in seen)
    for was, now in zip(seen, rebuilt, strict=True):
        for name in ("time", "step", "ego", "ego_frenet", "vehicle", "stop_lines"):
            assert getattr(now, name) == getattr(was, name)
        assert now.target_speed == was.target_speed
        assert now.vehicles.ids == was.vehicles.ids
        for record, names in {
            "path": ("s", "x", "y", "heading", "curvature", "curvature_rate"),
            "road": ("s", "left", "right"),
            "lanes": ("s", "centre", "width"),
            "obstacles": ("x", "y", "heading", "length", "width", "radius"),
            "vehicles": COLUMNS,
        }.items():
            for name in names:
                np.testing.assert_array_equal(
                    getattr(getattr(now, record), name),
                    getattr(getattr(was, record), name),
                )
        for name in ("x", "y", "heading", "s", "l"):
            np.testing.assert_array_equal(
                getattr(now.vehicles.prediction, name),
                getattr(was.vehicles.prediction, name),
            )


@pytest.mark.sumo
def test_another_plan_is_named(recorded, tmp_path):
    folder = tmp_path / "run"
    shutil.copytree(recorded, folder)
    trace = read_trace(folder)
    x = trace.plans["x_m"].copy()
    x[trace.plans["index"] == 5] += 0.25
    table = {**trace.plans, "x_m": x}
    write_tables([(table, TABLES["plans"], folder / file_name("plans"))])
    assert replan(folder, 4) == ()
    assert replan(folder, 5) == ("x_m differs by up to 0.25",)
    bounds = {**trace.bounds, "left_m": trace.bounds["left_m"] - 2.0}
    write_tables([(bounds, TABLES["bounds"], folder / file_name("bounds"))])
    assert replan(folder, 4)  # a narrower road leaves fewer candidates


@pytest.mark.sumo
def test_what_cannot_be_planned_again_is_refused(recorded, tmp_path, monkeypatch):
    with pytest.raises(ConfigError, match=r"--step: is 4000; allowed: 0 to \d+"):
        replan(recorded, 4000)
    with pytest.raises(ConfigError, match="--step: is -1"):
        replan(recorded, -1)
    with pytest.raises(ResultsError, match="is not a run folder"):
        replan(tmp_path, 0)
    monkeypatch.setattr("experiments.trace.files.SCHEMA_VERSION", 7)
    with pytest.raises(ResultsError, match="schema version 6; allowed: 7"):
        replan(recorded, 0)


@pytest.mark.sumo
@pytest.mark.parametrize(
    ("step", "status", "out", "err"),
    [
        ("3", 0, "same plan\n", ""),
        ("900", 2, "", "rearview: --step: is 900; allowed: 0 to"),
    ],
)
def test_the_command(recorded, step, status, out, err):
    done = subprocess.run(
        [sys.executable, "-m", "experiments", "replan", recorded, "--step", step],
        capture_output=True,
        text=True,
        check=False,
    )
    assert (done.returncode, done.stdout) == (status, out)
    assert done.stderr.startswith(err)
    assert done.stderr.count("\n") == (status == 2)
