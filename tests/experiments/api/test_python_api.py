"""The package `rearview`: scenarios, runs, sweeps and comparisons from Python."""

import json
import sys

import numpy as np
import pytest
import rearview

from experiments.config.scenario_file import load_scenario
from experiments.episode.run import run_episode
from experiments.metrics.catalogue import TIMING_COLUMNS
from experiments.trace.files import read_trace
from tests.experiments.cli.test_app import EMPTY_ROAD, HERE

OWN = "constant_speed_planner:make"


@pytest.fixture
def road(tmp_path, monkeypatch):
    monkeypatch.syspath_prepend(str(HERE))
    path = tmp_path / "empty_road.yaml"
    path.write_text(EMPTY_ROAD)
    return rearview.Scenario.load(path).with_(planner=OWN)


@pytest.fixture
def run(road, tmp_path):
    return road.run(tmp_path / "runs")


def test_every_public_name_is_there_and_documented():
    assert sorted(rearview.__all__) == rearview.__all__
    for name in rearview.__all__:
        assert getattr(rearview, name).__doc__, name


def test_a_run_is_that_of_the_command_line(tmp_path):
    changes = {"ego.goal_m": 60, "simulation.duration_s": np.float64(20.0)}
    scenario = rearview.Scenario.load("thesis_straight")
    run = scenario.with_(changes, seed=4).run(tmp_path / "runs")
    overrides = ("ego.goal_m=60", "simulation.duration_s=20")
    loaded = load_scenario("thesis_straight", seed=4, overrides=overrides)
    outcome = run_episode(loaded, out=tmp_path / "other")
    assert run.trace_hash == outcome.trace_hash
    assert run.folder.name == outcome.folder.name
    assert {k: v for k, v in run.row.items() if k not in TIMING_COLUMNS} == {
        k: v for k, v in outcome.row.items() if k not in TIMING_COLUMNS
    }


def test_scenarios_do_not_change(road):
    before = road.config
    other = road.with_({"ego.goal_m": 50.0}, seed=7, settings={"sleep": 0.0})
    assert road.config == before
    assert (other.seed, other.config["ego"]["goal_m"]) == (7, 50.0)
    assert other != road
    assert other.with_(before["ego"] and {"ego.goal_m": 60}, seed=road.seed).seed == 0


@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        (lambda s: s.with_({"ego.gaol_m": 1}), "did you mean goal_m?"),
        (lambda s: s.with_({"ego goal": 1}), "is not a key"),
        (lambda s: s.with_(seed=-1), "seed: is -1; allowed"),
        (lambda s: s.with_(planner="cruse"), "did you mean cruise?"),
        (lambda _: rearview.Scenario.load("curvd"), "no such scenario"),
        (lambda _: rearview.sweep({"name": "x"}), "scenarios: is missing"),
        (lambda _: rearview.sweep("smoke", workers=-1), "allowed: 0 or more"),
    ],
)
def test_mistakes_are_one_line(road, wrong, words, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(rearview.ConfigError) as caught:
        wrong(road)
    assert words in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_file_may_not_name_any_planner(tmp_path):
    path = tmp_path / "road.yaml"
    path.write_text(EMPTY_ROAD + "planner: os:system\n")
    with pytest.raises(rearview.ConfigError, match="may not name the module os"):
        rearview.Scenario.load(path)


def test_outcomes_are_no_exceptions(road, tmp_path):
    run = road.with_(settings={"raise_at": 1.0}).run(tmp_path / "runs")
    assert run.status == "planner_failed"
    assert "no idea" in run.reason


@pytest.mark.parametrize("library", ["pandas", "polars"])
def test_frames_hold_the_trace(run, library):
    pytest.importorskip(library)
    trace = read_trace(run.folder)
    frames = run.frames(library)
    for name in ("steps", "plans", "path", "timing"):
        table = getattr(trace, name)
        assert list(frames[name].columns) == list(table)
        for column, values in table.items():
            found = frames[name][column]
            missing = np.ma.getmaskarray(values)
            gone = found.isna() if library == "pandas" else found.is_null()
            assert gone.to_numpy().astype(bool).tolist() == missing.tolist(), column
            kept = [
                v for v, out in zip(found.to_list(), missing, strict=True) if not out
            ]
            assert kept == np.ma.getdata(values)[~missing].tolist(), column


def test_frames_without_the_library_say_how_to_get_it(run, monkeypatch):
    monkeypatch.setitem(sys.modules, "polars", None)
    with pytest.raises(rearview.ConfigError, match="pip install polars"):
        run.frames("polars")
    with pytest.raises(rearview.ConfigError, match="allowed: pandas, polars"):
        run.frames("spark")


def test_figure_and_report(run, tmp_path):
    pytest.importorskip("matplotlib")
    figure = run.figure(tmp_path / "run.svg")
    assert (tmp_path / "run.svg").read_text().startswith("<?xml")
    assert len(figure.axes) > 3
    assert run.report() == run.folder / "report.html"
    assert "empty_road" in run.report(tmp_path / "page.html").read_text()


def test_open_names_what_it_needs(run, tmp_path):
    again = rearview.Run.open(str(run.folder))
    assert (again.row, again.manifest) == (run.row, run.manifest)
    with pytest.raises(rearview.ExperimentError, match="is not a run folder"):
        rearview.Run.open(tmp_path)
    with pytest.raises(rearview.ExperimentError, match="no such folder"):
        rearview.Run.open(tmp_path / "nowhere")


def test_sweep_resumes_and_is_compared(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(str(HERE))
    (tmp_path / "empty_road.yaml").write_text(EMPTY_ROAD)
    content = {
        "name": "tiny",
        "scenarios": ["./empty_road.yaml"],
        "planners": [
            {"name": OWN, "label": "steady"},
            {"name": OWN, "label": "failing", "settings": {"raise_at": 1.0}},
        ],
        "seeds": {"first": 0, "count": 2},
    }
    lines = []
    results = rearview.sweep(content, workers=0, show=lines.append)
    assert "4 runs" in lines[0]
    assert len(results) == 4
    assert results.report().is_file()
    frame = results.frame("SELECT label, arrived FROM runs ORDER BY ALL")
    assert frame["arrived"].tolist() == [False, False, True, True]
    assert {run.status for run in results.runs()} == {"arrived", "planner_failed"}
    first = results.rows()[0]
    assert results.run(first["run_id"]).row["seed"] == first["seed"]
    resumed = []
    again = rearview.sweep(content, workers=0, show=resumed.append)
    assert "4 of them finished" in resumed[0]
    table = rearview.compare(again, "steady", metrics=["arrived", "collided"])
    assert len(table) == 4
    assert "| arrived |" in str(table)
    records = table.frame().to_dict("records")
    lost = next(
        x for x in records if (x["metric"], x["planner"]) == ("arrived", "failing")
    )
    assert (lost["value"], lost["difference"]) == (0.0, -1.0)
    assert json.loads(table.frame().to_json())  # plain numbers
    assert table.save(tmp_path / "t.csv").read_text().startswith("metric,where,planner")
