"""The picture of a sweep: what it shows, with units."""

import numpy as np
import pytest

from experiments.cli.app import app
from experiments.comparison.results import rows
from experiments.errors import ResultsError
from experiments.report.figures.save import save_figure
from experiments.report.figures.sweep import draw_sweep
from tests.experiments.report.run_folders import write_sweep


@pytest.fixture(scope="module")
def sweep(tmp_path_factory):
    return write_sweep(tmp_path_factory.mktemp("sweeps") / "made", seeds=5)


def test_every_axis_has_a_unit_and_every_group_a_name(sweep):
    figure = draw_sweep(sweep)
    shown = [axes for axes in figure.axes if axes.get_visible()]
    titles = [axes.get_xlabel() for axes in shown]
    assert titles[0] == "arrived [%], 95 % interval"
    assert "travel time [s]" in titles
    assert all("[" in title for title in titles)
    assert [label.get_text() for label in shown[0].get_yticklabels()] == [
        "curved · cruise",
        "curved · old",
        "straight · cruise",
        "straight · old",
    ]


def test_shares_and_medians_are_those_of_the_results(sweep):
    own = [
        row
        for row in rows(sweep)
        if (row["scenario"], row["label"]) == ("straight", "old")
    ]
    figure = draw_sweep(sweep)
    rates, times = figure.axes[:2]
    points = [line for line in rates.get_lines() if len(line.get_xdata()) == 1]
    share = 100 * np.mean([row["arrived"] for row in own])
    assert points[3].get_xdata()[0] == pytest.approx(share)
    median = np.median([row["travel_time_s"] for row in own if row["arrived"]])
    drawn = np.concatenate([line.get_xdata() for line in times.get_lines()])
    assert any(value == pytest.approx(median) for value in drawn)


@pytest.mark.parametrize(
    "name", [pytest.param("a.pdf", marks=pytest.mark.slow), "a.svg"]
)
def test_the_same_bytes_again(sweep, tmp_path, name):
    contents = [save_figure(sweep, tmp_path / name).read_bytes() for _ in range(2)]
    assert contents[0] == contents[1]


def test_a_sweep_without_runs_is_one_line(tmp_path, capsys):
    folder = write_sweep(tmp_path / "made", seeds=0)
    with pytest.raises(ResultsError, match="holds no runs yet"):
        draw_sweep(folder)
    with pytest.raises(SystemExit) as left:
        app(("figure", str(folder)))
    assert left.value.code == 2
    assert capsys.readouterr().err.count("\n") == 1
