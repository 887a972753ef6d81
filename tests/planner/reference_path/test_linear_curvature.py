"""The series of a piece against integration, and the look-up against a search."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from planner.numerics.compiled import compiled
from planner.reference_path import linear_curvature as lc
from planner.reference_path.segments import (
    arc,
    clothoid,
    knot_table,
    knots_of_segments,
    line,
)

NODES, WEIGHTS = np.polynomial.legendre.leggauss(20)
CHAIN = [
    line(7.0),
    clothoid(9.0, 0.0, 0.15),
    arc(11.0, 0.15),
    clothoid(5.0, 0.15, -0.1),
]
KNOTS = knot_table(knots_of_segments(CHAIN, (3.0, -2.0, 0.7)))
BINS = lc.index_bins(KNOTS[:, lc.S])
END = float(KNOTS[-1, lc.S])


@compiled
def _advance(curvature, rate, u):
    return lc.advance(curvature, rate, u)


@compiled
def _piece_index(knots, bins, s):
    return lc.piece_index(knots, bins, s)


@compiled
def _curvature_at(knots, bins, s):
    return lc.curvature_at(knots, bins, s)


@compiled
def _trace(knots, bins, s, out):
    lc.trace(knots, bins, s, out)


@compiled
def _follow_both(x, y, cos, sin, curvature, rate, u):
    return (
        lc.follow(x, y, cos, sin, curvature, rate, u),
        lc.follow_bent(x, y, cos, sin, curvature, rate, u),
    )


@given(st.floats(-1.0, 1.0), st.floats(-1.0, 1.0), st.floats(0.01, lc.MAX_SPACING))
def test_a_piece_ends_where_integration_does(turn, turn_by_rate, u):
    curvature = turn * lc.MAX_TURN / u
    rate = turn_by_rate * lc.MAX_TURN_BY_RATE / u**2
    at = 0.5 * u * (1.0 + NODES)
    headings = at * (curvature + 0.5 * rate * at)
    expected = (
        0.5 * u * np.cos(headings) @ WEIGHTS,
        0.5 * u * np.sin(headings) @ WEIGHTS,
        math.cos(u * (curvature + 0.5 * rate * u)),
        math.sin(u * (curvature + 0.5 * rate * u)),
    )
    assert _advance(curvature, rate, u) == pytest.approx(expected, abs=2e-13)


@given(st.floats(-5.0, END + 5.0))
def test_the_piece_of_a_place_is_the_one_that_a_search_finds(s):
    expected = int(np.searchsorted(KNOTS[:, lc.S], s, side="right")) - 1
    expected = min(max(expected, 0), KNOTS.shape[0] - 2)
    assert _piece_index(KNOTS, BINS, s) == expected


def test_no_number_is_no_index():
    assert _piece_index(KNOTS, BINS, math.nan) == 0


@given(st.floats(0.0, END))
def test_curvature_is_that_of_the_segment(s):
    begin = 0.0
    for one in CHAIN:
        if s <= begin + one.length or one is CHAIN[-1]:
            break
        begin += one.length
    expected = one.curvature + one.rate * (s - begin)
    assert _curvature_at(KNOTS, BINS, s) == pytest.approx(expected, abs=1e-9)
    assert lc.points_at(KNOTS, BINS, np.array([s]))[4, 0] == pytest.approx(
        expected, abs=1e-9
    )


@pytest.mark.parametrize("beyond", [-4.0, END + 4.0])
def test_beyond_its_ends_a_path_goes_straight_on(beyond):
    end = 0.0 if beyond < 0.0 else END
    at, there = lc.points_at(KNOTS, BINS, np.array([end, beyond])).T
    way = beyond - end
    np.testing.assert_allclose(there[0], at[0] + way * at[2], atol=1e-12)
    np.testing.assert_allclose(there[1], at[1] + way * at[3], atol=1e-12)
    assert there[4] == there[5] == 0.0
    assert there[6] == pytest.approx(at[6])
    assert _curvature_at(KNOTS, BINS, beyond) == 0.0


@given(st.lists(st.floats(-3.0, END + 3.0), max_size=12))
def test_tracing_finds_the_same_points_in_any_order(places):
    s = np.array(places)
    out = np.full((6, s.size + 2), np.nan)
    _trace(KNOTS, BINS, s, out)
    np.testing.assert_array_equal(out[:, : s.size], lc.points_at(KNOTS, BINS, s)[:6])
    assert np.isnan(out[:, s.size :]).all()


@given(
    st.floats(-9.0, 9.0),
    st.floats(-3.0, 3.0),
    st.sampled_from([0.0, 0.2, -0.1]),
    st.sampled_from([0.0, 0.05]),
    st.floats(0.0, lc.MAX_SPACING),
)
def test_following_with_and_without_a_branch_agree(x, heading, curvature, rate, u):
    cos, sin = math.cos(heading), math.sin(heading)
    one, other = _follow_both(x, 1.0, cos, sin, curvature, rate, u)
    assert one == other


def test_knots_placed_one_after_the_other_are_those_of_the_segments():
    s, curvature, rate = (KNOTS[:, k] for k in (lc.S, lc.CURVATURE, lc.RATE))
    x, y, heading = lc.place_knots(3.0, -2.0, 0.7, s, curvature, rate)
    np.testing.assert_allclose(x, KNOTS[:, lc.X], atol=1e-10)
    np.testing.assert_allclose(y, KNOTS[:, lc.Y], atol=1e-10)
    np.testing.assert_allclose(heading, KNOTS[:, lc.HEADING], atol=1e-10)
