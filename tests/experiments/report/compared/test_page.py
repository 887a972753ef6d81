"""The page that compares runs: what is in it, and runs that do not fit together."""

import json
import shutil
from time import process_time

import numpy as np
import pytest
import yaml

from experiments.cli.app import app
from experiments.cli.sweep_runs import chosen_runs
from experiments.comparison.results import rows
from experiments.errors import ConfigError
from experiments.metrics.row import metric_row
from experiments.report.compared.page import save_comparison
from experiments.report.compared.runs import (
    differing_settings,
    distance_to_first,
    read_compared,
    remarks,
)
from planner.states import CartesianState
from tests.experiments.report.run.test_page import Tags, data_of
from tests.experiments.report.run_folders import (
    HOSTILE,
    driven_trace,
    write_run,
    write_sweep,
)
from tests.experiments.traces import STEP, record, trace_of

MEGABYTE = 1e6


def standing_aside(n, y):
    """10 m/s, at an offset that grows to y in the second second."""
    offsets = y * np.clip((np.arange(n) * STEP - 1.0), 0.0, 1.0)
    return trace_of(
        [
            record(k, CartesianState(k, offset, 0.0, 0.0, 10.0, 0.0))
            for k, offset in enumerate(offsets)
        ]
    )


@pytest.fixture(scope="module")
def runs(tmp_path_factory):
    parent = tmp_path_factory.mktemp("runs")
    for name, y in (("one", 0.0), ("two", 2.0), ("three", -1.0)):
        trace = standing_aside(40, y)
        write_run(parent / name, trace, planner=name)
        config = f"name: s\nplanner: {{name: {name}, settings: {{y: {y}}}}}\n"
        (parent / name / "config.yaml").write_text(config)
    return [parent / name for name in ("one", "two", "three")]


def called(capsys, *arguments):
    with pytest.raises(SystemExit) as left:
        app(("compare-runs", *map(str, arguments)))
    out, err = capsys.readouterr()
    return left.value.code or 0, out, err


def test_page_goes_beside_the_runs_or_where_asked(runs, tmp_path, capsys):
    code, out, err = called(capsys, *runs)
    assert (code, out, err) == (0, f"{runs[0].parent / 'comparison.html'}\n", "")
    other = tmp_path / "page.html"
    assert called(capsys, *runs, "-o", other)[:2] == (0, f"{other}\n")


def test_runs_of_one_planner_are_told_apart_by_a_setting(tmp_path):
    folders = []
    for name, plant in (("a", "perfect"), ("b", "dynamic"), ("c", None)):
        folders.append(write_run(tmp_path / name, standing_aside(3, 0.0)))
        section = "" if plant is None else f"ego: {{plant: {{model: {plant}}}}}\n"
        (folders[-1] / "config.yaml").write_text(f"name: s\n{section}")
    found, _ = read_compared(folders)
    labels = [run.label for run in found]
    assert labels == ["cruise, plant perfect", "cruise, plant dynamic", "cruise"]
    found, _ = read_compared([folders[0], folders[0]])
    assert [run.label for run in found] == ["cruise (1)", "cruise (2)"]


def test_what_differs_is_found(runs):
    found, left_out = read_compared(runs)
    assert [run.label for run in found] == ["one", "two", "three"]
    assert left_out == remarks(found, []) == []
    assert differing_settings(found) == [
        ("planner.name", ["one", "two", "three"]),
        ("planner.settings.y", ["0.0", "2.0", "-1.0"]),
    ]
    first, second, third = distance_to_first(found)
    assert np.isnan(first).all()
    assert second[[0, 10, 15, 30]] == pytest.approx([0.0, 0.0, 1.0, 2.0])
    assert third[-1] == pytest.approx(1.0)


def test_the_parting_is_an_event(runs, tmp_path):
    page, _ = save_comparison(runs, tmp_path / "page.html")
    data = data_of(page.read_text())
    parted = [event for event in data["events"] if "parts from" in event["text"]]
    assert [(event["run"], event["time"]) for event in parted] == [(1, 1.3), (2, 1.6)]
    assert [run["label"] for run in data["runs"]] == ["one", "two", "three"]


def test_other_seeds_and_scenarios_are_said(runs, tmp_path):
    other = write_run(
        tmp_path / "other", driven_trace(20), scenario="bend", seed=8, planner="one"
    )
    found, _ = read_compared([runs[0], other])
    assert [run.label for run in found] == ["one, made_up", "one, bend"]
    words = " ".join(remarks(found, []))
    assert "The scenarios differ: made_up, bend." in words
    assert "The seeds differ, and with them the traffic: 3, 8." in words
    page, _ = save_comparison([runs[0], other], tmp_path / "page.html")
    assert "The scenarios differ" in page.read_text()


def test_a_damaged_run_is_left_out_and_named(runs, tmp_path, capsys):
    bad = shutil.copytree(runs[1], tmp_path / "bad")
    (bad / "trace.parquet").write_bytes(b"nothing")
    code, out, err = called(capsys, runs[0], bad, runs[2], "-o", tmp_path / "p.html")
    assert code == 0
    assert out
    assert err.count("\n") == 1
    assert "left out" in err
    assert "bad/trace.parquet" in (tmp_path / "p.html").read_text()
    code, out, err = called(capsys, runs[0], bad)
    assert (code, out, err.count("\n")) == (2, "", 1)
    assert "fewer than two of 2 runs" in err


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ((0,), "1 runs to compare; allowed: 2 to 8"),
        ((0,) * 30, "30 runs to compare; allowed: 2 to 8"),
        ((0, 1, "--seed", "3"), "is not a sweep's folder"),
        ((0, 1, "-o", "page.pdf"), "allowed: .html, .htm"),
    ],
)
def test_too_few_or_too_many_are_one_line(runs, capsys, arguments, words):
    given = [runs[a] if isinstance(a, int) else a for a in arguments]
    code, out, err = called(capsys, *given)
    assert (code, out, err.count("\n")) == (2, "", 1)
    assert words in err


@pytest.mark.slow
def test_size_and_time_of_three_runs_of_a_minute(tmp_path):
    folders = [
        write_run(tmp_path / name, driven_trace(601, n_cars=30), planner=name)
        for name in ("a", "b", "c")
    ]
    save_comparison(folders, tmp_path / "warm.html")
    before = process_time()
    page, _ = save_comparison(folders, tmp_path / "page.html")
    assert process_time() - before < 2.0
    assert page.stat().st_size < 8 * MEGABYTE


def test_runs_of_a_sweep_are_chosen(tmp_path, capsys):
    sweep = write_sweep(tmp_path / "made", seeds=5)
    where = "scenario = 'curved' AND \"ego.target_speed_mps\" = 8"
    ids = chosen_runs(sweep, [], 3, where, None)
    labels = {row["run_id"]: row["label"] for row in rows(sweep)}
    assert [labels[run_id] for run_id in ids] == ["cruise", "old"]
    assert chosen_runs(sweep, [run_id[:12] for run_id in ids], None, None, None) == ids
    for arguments, words in (
        (([], 99, None, None), "--seed 99: no run has it"),
        (([], None, None, "rms_jrk_mps3"), "did you mean rms_jerk_mps3"),
        (([], None, None, None), "allowed with it: ids of runs, --seed, or --worst"),
    ):
        with pytest.raises(ConfigError, match=words):
            chosen_runs(sweep, *arguments)
    worst = chosen_runs(sweep, [], None, None, "travel_time_s")
    assert "did not arrive" in capsys.readouterr().err
    row = {row["run_id"]: row for row in rows(sweep)}
    assert [row[run_id]["arrived"] for run_id in worst] == [True, False]


def test_runs_with_many_egos_are_refused_before_any_is_repeated(tmp_path):
    sweep = write_sweep(tmp_path / "made", seeds=2)
    for file in sweep.rglob("metrics.json"):
        row = json.loads(file.read_text())
        file.write_text(json.dumps({**row, "egos_driven": 3}))
    where = "scenario = 'curved' AND \"ego.target_speed_mps\" = 8"
    chosen = [row["run_id"] for row in rows(sweep, f"SELECT * FROM runs WHERE {where}")]
    for ids, seed, worst in (
        (chosen[:2], None, None),
        ([], 1, None),
        ([], None, "travel_time_s"),
    ):
        with pytest.raises(
            ConfigError, match=r"have many egos; allowed: runs with one"
        ):
            chosen_runs(sweep, ids, seed, where if not ids else None, worst)


def test_the_worst_of_one_planner_is_refused(tmp_path):
    sweep = write_sweep(tmp_path / "made", seeds=2)
    file = sweep / "sweep.yaml"
    content = yaml.safe_load(file.read_text())
    file.write_text(yaml.safe_dump({**content, "planners": content["planners"][:1]}))
    with pytest.raises(ConfigError, match="cruise is the only planner; allowed: a sw"):
        chosen_runs(sweep, [], None, None, "travel_time_s")


def test_metrics_are_marked_and_lead_to_their_moment(runs, tmp_path):
    page, _ = save_comparison(runs, tmp_path / "page.html")
    text = page.read_text()
    row = json.loads((runs[0] / "metrics.json").read_text())
    assert row == metric_row(standing_aside(40, 0.0))
    assert 'href="#t=3.9"' in text  # arrival
    assert '<strong class="good">' in text


def test_a_metric_that_does_not_apply_leads_nowhere(runs, tmp_path):
    self_driven = tmp_path / "self"
    shutil.copytree(runs[1], self_driven)
    file = self_driven / "metrics.json"
    row = json.loads(file.read_text())
    file.write_text(json.dumps({**row, "rms_jerk_mps3": None}))
    page, _ = save_comparison([runs[0], self_driven], tmp_path / "page.html")
    text = page.read_text()
    line = text[text.index('title="rms_jerk_mps3"') :].partition("</tr>")[0]
    assert line.count("</a>") == 1
    assert "<td>-</td>" in line


def test_hostile_names_stay_text(tmp_path):
    folders = [
        write_run(
            tmp_path / f"{k}",
            driven_trace(9, name=HOSTILE),
            planner=f"{HOSTILE}{k}",
            scenario=HOSTILE,
            reason=HOSTILE,
        )
        for k in (0, 1)
    ]
    page = save_comparison(folders, tmp_path / "page.html")[0].read_text()
    assert "<img" not in page
    scripts = [tag for tag, _ in Tags(page).found if tag == "script"]
    assert len(scripts) == 2, "the data and the page's own"
