"""B-splines against SciPy's, and the laws of a lane change's control points."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy.interpolate import BSpline

from planner.lane_change.b_spline import (
    CUBIC,
    LANE_CHANGE_KNOTS,
    b_spline,
    b_spline_basis,
    lane_change_points,
)
from planner.numerics.compiled import compiled

coordinates = st.floats(-20.0, 20.0)
points = arrays(np.float64, (7, 2), elements=coordinates)
U = np.linspace(0.0, 1.0, 21)


@compiled
def placed(length, c, start, end):
    return lane_change_points(length, c, start, end)


@given(points)
def test_pieces_are_those_of_scipy_with_three_derivatives(control):
    pieces = b_spline(control, LANE_CHANGE_KNOTS, CUBIC)
    assert len(pieces) == 4
    for number, piece in enumerate(pieces):
        found = piece(U)
        at = (number + U) / 4.0
        for order in range(4):
            spline = BSpline(LANE_CHANGE_KNOTS, control, CUBIC)
            # a derivative of order 3 jumps at knots: look inside
            inside = slice(1, -1) if order == 3 else slice(None)
            expected = spline.derivative(order)(at) if order else spline(at)
            np.testing.assert_allclose(
                found[order][:, inside],
                expected.T[:, inside] / 4.0**order,
                atol=1e-9,
            )


@given(points)
def test_a_clamped_curve_begins_and_ends_at_its_outer_points(control):
    pieces = b_spline(control, LANE_CHANGE_KNOTS, CUBIC)
    np.testing.assert_allclose(pieces[0](U)[0][:, 0], control[0], atol=1e-12)
    np.testing.assert_allclose(pieces[-1](U)[0][:, -1], control[-1], atol=1e-12)


@pytest.mark.parametrize("degree", [0, 1, 2, 3])
def test_basis_functions_are_shares_of_one(degree):
    knots = np.concatenate([np.zeros(degree), np.linspace(0, 1, 5), np.ones(degree)])
    for span in range(degree, degree + 4):
        at = knots[span] + (knots[span + 1] - knots[span]) * U
        basis = b_spline_basis(knots, degree, at, span)
        assert basis.shape == (U.size, knots.size - degree - 1)
        assert (basis >= -1e-12).all()
        np.testing.assert_allclose(basis.sum(axis=1), 1.0)
        assert np.count_nonzero(basis.any(axis=0)) == degree + 1


@given(
    st.floats(10.0, 120.0),
    st.floats(0.1, 0.45),
    st.tuples(st.floats(-4, 4), st.floats(-0.2, 0.2), st.floats(-0.02, 0.02)),
    coordinates,
)
def test_a_change_begins_as_the_ego_moves_and_ends_straight(length, ratio, start, end):
    control = placed(length, ratio * length, start, end)
    pieces = b_spline(control, LANE_CHANGE_KNOTS, CUBIC)
    (x, y), (dx, dy), (ddx, ddy) = pieces[0](np.zeros(1))[:3, :, 0]
    assert (x, y) == pytest.approx((0.0, start[0]), abs=1e-9)
    assert dy / dx == pytest.approx(start[1], abs=1e-9)
    bend = (ddy * dx - ddx * dy) / dx**3  # d²y/dx²
    assert bend == pytest.approx(start[2], abs=1e-9)
    (x, y), (dx, dy), (ddx, ddy) = pieces[-1](np.ones(1))[:3, :, 0]
    assert (x, y) == pytest.approx((length, end), abs=1e-9)
    assert dy / dx == pytest.approx(0.0, abs=1e-9)
    assert ddy * dx - ddx * dy == pytest.approx(0.0, abs=1e-6)
