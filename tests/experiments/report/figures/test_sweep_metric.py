"""Figures of one metric of a sweep: what is drawn, and the numbers beside it."""

import csv

import numpy as np
import pytest

from experiments.cli.app import app
from experiments.comparison.results import rows
from experiments.report.figures.save import save_metric_figure
from experiments.report.figures.sweep_metric import FigureKind, draw_metric
from experiments.report.figures.swept_metric import swept_metric
from tests.experiments.report.run_folders import write_sweep

PLANNERS = ["cruise", "old"]


@pytest.fixture(scope="module")
def sweep(tmp_path_factory):
    return write_sweep(tmp_path_factory.mktemp("sweeps") / "made", seeds=5)


def drawn(sweep, metric, kind):
    return draw_metric(swept_metric(rows(sweep), metric, PLANNERS), kind)


def values(sweep, scenario, label, metric="travel_time_s"):
    return [
        row[metric]
        for row in rows(sweep)
        if (row["scenario"], row["label"]) == (scenario, label)
        and row[metric] is not None
    ]


def test_means_have_intervals_by_scenario_and_planner(sweep):
    found = drawn(sweep, "travel_time_s", FigureKind.MEANS)
    assert len(found.data) == 4
    for scenario, planner, runs, mean, low, high in found.data:
        own = values(sweep, scenario, planner)
        assert runs == len(own)
        assert mean == pytest.approx(np.mean(own))
        assert low < mean < high
    (axes,) = found.figure.axes
    assert axes.get_xlabel() == "travel time [s], 95 % interval"
    assert found.figure.get_figwidth() == 3.5


def test_rates_are_in_percent(sweep):
    found = drawn(sweep, "collided", FigureKind.MEANS)
    shares = {(row[0], row[1]): row[3] for row in found.data}
    failed = [row for row in rows(sweep) if not row["arrived"]]
    assert sum(shares.values()) == pytest.approx(100.0 * len(failed) / 10)


def test_pairs_are_the_differences_on_common_seeds(sweep):
    found = drawn(sweep, "travel_time_s", FigureKind.PAIRS)
    time = {
        (r["scenario"], r["label"], r["seed"], r["ego.target_speed_mps"]): r[
            "travel_time_s"
        ]
        for r in rows(sweep)
    }
    assert 10 < len(found.data) <= 20
    for scenario, planner, baseline, seed, point, difference in found.data:
        speed = float(point.rpartition(" = ")[2])
        own, base = (time[scenario, name, seed, speed] for name in (planner, baseline))
        assert difference == pytest.approx(own - base)


def test_distributions_end_below_one_where_runs_have_no_value(sweep):
    found = drawn(sweep, "travel_time_s", FigureKind.ECDF)
    ends = {planner: share for planner, _, share in found.data}
    lost = {
        p: sum(not r["arrived"] for r in rows(sweep) if r["label"] == p) for p in ends
    }
    for planner, share in ends.items():
        assert share == pytest.approx(1.0 - lost[planner] / 20)
    legend = found.figure.axes[0].get_legend().get_texts()
    assert any("without a value" in text.get_text() for text in legend)


def test_a_heat_map_has_the_means_of_its_cells(sweep):
    found = drawn(sweep, "min_clearance_m", FigureKind.HEAT)
    assert found.names == ("scenario", "ego.target_speed_mps", "runs", "mean")
    for scenario, speed, runs, mean in found.data:
        own = [
            row["min_clearance_m"]
            for row in rows(sweep)
            if (row["scenario"], row["ego.target_speed_mps"]) == (scenario, speed)
        ]
        assert (runs, mean) == (len(own), pytest.approx(np.mean(own)))


@pytest.mark.parametrize(
    "kind",
    [
        pytest.param(kind, marks=[] if kind is FigureKind.MEANS else [pytest.mark.slow])
        for kind in FigureKind
    ],
)
def test_files_are_the_same_again_with_data_beside_them(sweep, tmp_path, kind):
    written = []
    for name in ("a.pdf", "b.pdf"):
        files = save_metric_figure(sweep, "travel_time_s", kind, None, tmp_path / name)
        written.append([file.read_bytes() for file in files])
    assert written[0] == written[1]
    assert len(list(csv.reader(written[0][1].decode().splitlines()))) > 2


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("--metric", "travel_tim_s"), "did you mean travel_time_s"),
        (("--metric", "scenario"), "no such metric"),
        (("--metric", "behind_delay_mean_s"), "applies to no run"),
        (("--metric", "travel_time_s", "-o", "a.doc"), "allowed: .png, .svg, .pdf"),
        (("--metric", "travel_time_s", "--where", "seed = 99"), "no runs that meet"),
        (("--where", "seed = 1"), "allowed with --metric"),
        (
            (
                "--metric",
                "travel_time_s",
                "--where",
                "label = 'old'",
                "--kind",
                "pairs",
            ),
            "--kind pairs: no run of another planner",
        ),
    ],
)
def test_bad_input_is_one_line(sweep, capsys, arguments, words):
    with pytest.raises(SystemExit) as left:
        app(("figure", str(sweep), *arguments))
    out, err = capsys.readouterr()
    assert (left.value.code, out, err.count("\n")) == (2, "", 1)
    assert words in err
