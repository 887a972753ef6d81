"""s-T graphs of the cycles: kept beside the trace, thinned, packed into the page."""

import numpy as np
import pytest

from experiments.report.run.page import run_page
from experiments.report.run.speed_graphs import packed_graphs
from experiments.trace.speed_graphs import read_graphs, write_graphs
from planner.interface import SpeedGraph
from tests.experiments.report.run.test_page import Tags, data_of
from tests.experiments.report.run_folders import HOSTILE, driven_trace, write_run
from tests.experiments.report.unpacking import unpack

T = 0.1 * np.arange(41)


def graph(speed: float) -> SpeedGraph:
    """One vehicle ahead all the time, one that comes into the way after 2 s."""
    late = np.where(T >= 2.0, 5.0, np.nan)
    lower = np.stack([30 + 2 * T, late])
    return SpeedGraph(
        T, speed * T, ("ahead", HOSTILE), ("after", "before"), lower, lower + 4
    )


@pytest.fixture
def run(tmp_path):
    folder = write_run(tmp_path / "run", driven_trace(3))
    write_graphs([(0, graph(5.0)), (1, graph(6.0))], folder)
    return folder


def test_knots_are_thinned_and_those_of_nobody_left_out(run):
    table = read_graphs(run)
    own = table["id"] == ""
    first = (table["index"] == 0) & own
    np.testing.assert_allclose(table["t_s"][first], 0.2 * np.arange(21))
    np.testing.assert_allclose(table["lower_m"][first], np.arange(21.0))
    late = (table["index"] == 1) & (table["id"] == HOSTILE)
    assert table["t_s"][late].tolist() == pytest.approx(0.2 * np.arange(10, 21))
    assert set(table["side"][late]) == {"before"}


def test_page_has_the_lines_of_each_step(run):
    found = packed_graphs(read_graphs(run), driven_trace(3))
    starts = unpack(found["start"]).astype(int).tolist()
    assert starts == [0, 3, 6, 6]
    names = [found["ids"][int(k)] for k in unpack(found["id"])]
    assert names == ["", "ahead", HOSTILE] * 2
    assert unpack(found["after"]).tolist() == [0, 1, 0] * 2
    knots = unpack(found["knots"]).astype(int)
    assert np.diff(knots).tolist() == [21, 21, 11] * 2
    upper = unpack(found["upper"])[knots[1] : knots[2]]
    np.testing.assert_allclose(upper, 34 + 0.4 * np.arange(21), atol=0.05)
    page = run_page(run)
    assert data_of(page)["graphs"] == found
    assert any(at.get("id") == "graph" for tag, at in Tags(page).found)
    assert not any(tag == "img" for tag, _ in Tags(page).found)


def test_no_graphs_no_file_and_no_place_on_the_page(tmp_path):
    folder = write_run(tmp_path / "run", driven_trace(3))
    write_graphs([], folder)
    assert read_graphs(folder) is None
    page = run_page(folder)
    assert data_of(page)["graphs"] is None
    assert not any(at.get("id") == "graph" for _, at in Tags(page).found)
