"""The page of a sweep: failures first, and what happens without any run."""

import sys
from time import process_time

import pytest
import yaml

from experiments.cli.app import app
from experiments.comparison.results import rows
from experiments.report.sweep.failures import failure_kinds
from experiments.report.sweep.page import save_run_pages, save_sweep_page, sweep_page
from experiments.sweep.folder import run_folder
from tests.experiments.report.run.test_page import Tags, data_of, refusal
from tests.experiments.report.run_folders import (
    HOSTILE,
    driven_trace,
    write_run,
    write_sweep,
)
from tests.experiments.report.unpacking import unpack


@pytest.fixture(scope="module")
def sweep(tmp_path_factory):
    return write_sweep(tmp_path_factory.mktemp("sweeps") / "made", seeds=5)


def test_failures_come_first_by_reason(sweep):
    page = sweep_page(sweep, sweep)
    assert "<strong>40</strong> runs" in page
    assert page.index("<h2>Failures") < page.index("<h2>Comparison")
    assert "touched own.3 at t = 1.5 to 5.5 s" in page
    assert page.count('/">') >= 4  # each of the four is a link to its folder
    kinds = failure_kinds(rows(sweep), ["ego.target_speed_mps"], ["x"] * 40)
    assert [(kind.status, kind.count) for kind in kinds] == [("collision", 4)]
    assert "ego.target_speed_mps = " in kinds[0].runs[0].where


def test_comparison_has_intervals_and_differences(sweep):
    page = sweep_page(sweep, sweep)
    for text in ("Comparison with cruise", "travel time [s]", "95 % interval"):
        assert text in page
    assert page.count('<th scope="row">arrived</th>') == 1


def with_settings(folder):
    """Let the planners of a made sweep be one, with other settings."""
    file = folder / "sweep.yaml"
    content = yaml.safe_load(file.read_text(encoding="utf-8"))
    content["planners"] = [
        {"name": "cruise", "label": "cruise", "settings": {"gap": 2, "same": 1}},
        {"name": "cruise", "label": "old", "settings": {"gap": 3.5, "same": 1}},
    ]
    file.write_text(yaml.safe_dump(content), encoding="utf-8")


def test_settings_in_which_planners_differ_are_columns(tmp_path):
    folder = write_sweep(tmp_path / "made", seeds=2)
    with_settings(folder)
    axes = {axis["name"]: axis for axis in data_of(sweep_page(folder, folder))["axes"]}
    assert list(axes)[3:] == ["gap", "seed"]
    assert axes["gap"]["own"]
    label = {"cruise": 2.0, "old": 3.5}
    expected = [label[row["label"]] for row in rows(folder)]
    assert unpack(axes["gap"]["values"]).tolist() == expected


def test_columns_are_those_of_the_results(sweep):
    found = data_of(sweep_page(sweep, sweep))
    table = rows(sweep)
    assert found["ids"] == [row["run_id"] for row in table]
    assert [axis["name"] for axis in found["axes"]] == [
        "scenario",
        "planner",
        "ego.target_speed_mps",
        "seed",
    ]
    assert found["label"]["texts"] == ["cruise", "old"]
    names = [metric["name"] for metric in found["metrics"]]
    assert "travel_time_s" in names
    assert "seed" not in names


ROW_FILES = ("manifest.json", "metrics.json")


def test_links_lead_to_the_page_of_a_run_where_there_is_one(tmp_path):
    folder = write_sweep(tmp_path / "made", seeds=1)
    table = rows(folder)
    first, second = (run_folder(folder, row["run_id"]) for row in table[:2])
    kept = {name: (first / name).read_text() for name in ROW_FILES}
    write_run(first, driven_trace(5))
    for name, text in kept.items():
        (first / name).write_text(text)
    assert save_run_pages(folder) == 1
    write_run(folder / "reruns" / second.name, driven_trace(5))
    (folder / "reruns" / second.name / "report.html").write_text("")
    places = data_of(sweep_page(folder, folder))["places"]
    assert places[0] == f"{first.relative_to(folder)}/report.html"
    assert places[1] == f"reruns/{second.name}/report.html"
    assert places[2].endswith(f"{table[2]['run_id']}/")
    away = data_of(sweep_page(folder, tmp_path))["places"]
    assert away == [f"made/{place}" for place in places]


@pytest.mark.slow
def test_a_thousand_runs_take_less_than_five_seconds(tmp_path):
    folder = write_sweep(tmp_path / "made", seeds=125)
    rows(folder)  # results.parquet is there at the end of a sweep
    started = process_time()  # other processes may keep the cores busy
    file = save_sweep_page(folder)
    took = process_time() - started
    size = file.stat().st_size / 1e6
    sys.stdout.write(f"\n1000 runs: {size:.2f} MB in {took:.2f} s\n")
    assert took < 5.0


def test_a_sweep_without_runs_says_so(tmp_path):
    folder = write_sweep(tmp_path / "made", seeds=0)
    page = sweep_page(folder, folder)
    assert "There are no runs in this sweep yet." in page
    assert data_of(page) is None


def test_a_sweep_that_is_not_finished_says_so(tmp_path):
    folder = write_sweep(tmp_path / "made", seeds=2)
    text = (folder / "sweep.yaml").read_text().replace("count: 2", "count: 3")
    (folder / "sweep.yaml").write_text(text)
    assert "of 24 planned: the sweep is not finished" in sweep_page(folder, folder)


def test_hostile_reasons_stay_text(tmp_path, sweep):
    folder = write_sweep(tmp_path / "made", seeds=5, reason=HOSTILE)
    plain = [tag for tag, _ in Tags(sweep_page(sweep, sweep)).found]
    assert [tag for tag, _ in Tags(sweep_page(folder, folder)).found] == plain


def test_command_writes_pages_of_runs_too(tmp_path, capsys):
    folder = write_sweep(tmp_path / "made", seeds=1)
    with pytest.raises(SystemExit) as left:
        app(("report", str(folder), "--runs"))
    assert not left.value.code
    out = capsys.readouterr().out
    assert out == f"0 pages of runs\n{folder / 'report.html'}\n"


def test_damaged_sweeps_are_one_line(tmp_path, capsys):
    folder = write_sweep(tmp_path / "made", seeds=1)
    run = run_folder(folder, rows(folder)[0]["run_id"])
    (run / "config.yaml").write_text("{")
    assert "config.yaml: cannot be read" in refusal(capsys, folder)
    (folder / "sweep.yaml").write_text("name: [")
    assert "sweep.yaml:1: is not YAML" in refusal(capsys, folder)
