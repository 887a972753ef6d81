"""Figures and times of chapter 6 show what was measured."""

import numpy as np
import pytest

from experiments.thesis.claims import ClaimVerdict
from experiments.thesis.lane_change.claims import LENGTHS
from experiments.thesis.lane_change.curve_comparison import LaneShift, compare_curves
from experiments.thesis.lane_change.curves import claim_table
from experiments.thesis.lane_change.curves import curve_table as printed_curves
from experiments.thesis.lane_change.figures import (
    case_pictures,
    curve_pictures,
    path_picture,
)
from experiments.thesis.lane_change.published_cases import solve_case
from experiments.thesis.lane_change.random_scenes import GRIDS, RULES, Found
from experiments.thesis.lane_change.solver_times import ALL_SOLVERS, Timed
from experiments.thesis.lane_change.times import (
    crowd_times,
    scene_times,
    time_claim,
    time_table,
)


def timed(missing=()):
    """Return times: 1 ms direct, 3 ms of every search, 2 ms of every solver."""
    qp = {solver: 2.0 for solver in ALL_SOLVERS if solver not in missing}
    return Timed(9.0, 1.0, dict.fromkeys(GRIDS, 3.0), qp, dict.fromkeys(missing, "why"))


def test_the_direct_method_is_set_against_the_search():
    claim = time_claim([timed(), timed()])
    assert claim.measured == {"DP QP ms": 5, "ours ms": 3, "decline percent": 40}
    assert claim.verdict is ClaimVerdict.HOLDS
    assert claim.share.of == len(GRIDS) * len(ALL_SOLVERS)


def test_a_solver_without_a_time_has_a_row_that_says_why():
    missing = ALL_SOLVERS[-1]
    cases = [timed(missing=(missing,)), timed()]
    table = time_table(cases)
    assert (missing, "-", "why", "-", "-") in table.rows
    assert len(table.rows) == len(GRIDS) * (len(ALL_SOLVERS) - 1) + 1
    assert table.rows[0][2:] == (5, 3, 40.0)


def test_times_of_scenes_are_medians():
    scenes = [
        Found(dict.fromkeys(RULES, 1.0), dict.fromkeys(RULES, t), 1, 1, 1, None)
        for t in (1.0, 2.0, 9.0)
    ]
    assert {row[1] for row in scene_times(scenes).rows} == {2}
    assert crowd_times({3: scenes}).rows == ((3, 2),)


def test_curves_and_candidates_are_drawn():
    ways, bends = curve_pictures()
    assert [s.name for s in ways.series] == [s.name for s in bends.series]
    for series in ways.series:  # all change to the same lane
        assert series.y[0] == pytest.approx(0.0, abs=1e-6)
        assert series.y[-1] == pytest.approx(3.5, abs=0.2)
    candidates = path_picture()
    assert candidates.series[-1].name == "chosen"
    assert len(candidates.series) <= len(LENGTHS) + 1


def test_both_cases_have_a_graph_and_three_curves():
    pictures = list(case_pictures([solve_case(speed) for speed in (9.0, 15.0)]))
    assert [p.id[4:] for p in pictures] == [f"6.{n}{x}" for n in (8, 9) for x in "abcd"]
    graph, speed = pictures[0], pictures[1]
    distance = np.array(graph.series[0].y)
    assert (np.diff(distance) >= 0.0).all()
    assert speed.series[0].y[0] == pytest.approx(9.0)


def test_the_study_prints_a_column_for_each_curve_and_a_row_for_each_claim():
    task = LaneShift()
    comparison = compare_curves(task)
    assert len(printed_curves(comparison, task).columns) == 1 + len(comparison.measures)
    table = claim_table(comparison)
    assert table.row_count == len(comparison.claims)
