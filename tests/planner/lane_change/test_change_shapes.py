"""Samples and prices of changes against the spline itself, in plain NumPy."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planner.lane_change.b_spline import CUBIC, LANE_CHANGE_KNOTS, b_spline
from planner.lane_change.change_shapes import (
    BASIS,
    SAMPLES,
    control_points,
    prices,
    sample,
)

starts = st.tuples(st.floats(-3, 3), st.floats(-0.1, 0.1), st.floats(-0.01, 0.01))
targets = st.floats(-4.0, 4.0)


def of_spline(points):
    """(driven, l, dl/ds, d²l/ds²) by the pieces of the spline."""
    pieces = b_spline(points, LANE_CHANGE_KNOTS, CUBIC)
    share = np.linspace(0.0, 1.0, SAMPLES) * len(pieces)
    rows = []
    for at in share:
        k = min(int(at), len(pieces) - 1)
        (s, l), (ds, dl), (dds, ddl) = pieces[k](np.array([at - k]))[:3, :, 0]
        rows.append((s, l, dl / ds, (ddl * ds - dds * dl) / ds**3))
    return np.array(rows).T


@settings(max_examples=20)
@given(starts, targets, st.floats(20.0, 90.0), st.floats(0.15, 0.4))
def test_samples_lie_on_the_spline(start, target, length, ratio):
    (points,) = control_points(start, target, [length], [ratio])
    np.testing.assert_allclose(sample(points, BASIS), of_spline(points), atol=1e-9)


@given(starts, targets, st.floats(20.0, 90.0))
def test_changes_begin_as_the_ego_moves_and_end_in_the_lane(start, target, length):
    for points in control_points(start, target, [length], [0.2, 0.3, 0.4]):
        shape = sample(points, BASIS)
        np.testing.assert_allclose(shape[:, 0], [0.0, *start], atol=1e-9)
        np.testing.assert_allclose(shape[:, -1], [length, target, 0, 0], atol=1e-9)
        assert (np.diff(shape[0]) > 0.0).all()


def test_each_length_meets_each_ratio():
    points = control_points((0.0, 0.0, 0.0), 3.5, [30.0, 60.0], [0.2, 0.3])
    assert points.shape == (4, 7, 2)
    assert points[:, -1, 0].tolist() == [30.0, 30.0, 60.0, 60.0]
    np.testing.assert_allclose(points[:, 2, 0], [6.0, 9.0, 12.0, 18.0])


@settings(max_examples=20)
@given(starts, targets, st.floats(20.0, 90.0))
def test_prices_are_integrals_of_squared_curvature_and_length(start, target, length):
    points = control_points(start, target, [length], [0.2, 0.35])
    cost, peak = prices(points, BASIS, 100.0, 0.01)
    for k, one in enumerate(points):
        s, _, slope, bend = of_spline(one)
        root = np.sqrt(1.0 + slope**2)
        curvature = bend / root**3
        bent = (curvature[1:] ** 2 * np.diff(s) * root[1:]).sum()
        assert cost[k] == pytest.approx(100.0 * bent + 0.01 * length, rel=1e-6)
        assert peak[k] == pytest.approx(np.abs(curvature).max(), abs=1e-9)


def test_a_change_that_is_none_costs_its_length_alone():
    points = control_points((2.0, 0.0, 0.0), 2.0, [50.0], [0.3])
    cost, peak = prices(points, BASIS, 100.0, 0.01)
    assert cost == pytest.approx([0.5])
    assert peak == pytest.approx([0.0], abs=1e-12)
