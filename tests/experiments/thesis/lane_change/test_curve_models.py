import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.interpolate import BPoly, BSpline

from experiments.thesis.lane_change.curve_models import (
    bernstein,
    bezier,
    cubic_bezier,
    half_cosine,
    lane_change_b_spline,
    quintic_bezier,
    sine_ramp,
)
from experiments.thesis.lane_change.plane_curve import sample_curve
from planner.lane_change.b_spline import LANE_CHANGE_KNOTS, b_spline, b_spline_basis

U = np.linspace(0.0, 1.0, 41)
POINT = st.tuples(st.floats(-50.0, 50.0), st.floats(-50.0, 50.0))


@given(st.lists(POINT, min_size=7, max_size=7))
def test_b_spline_is_that_of_scipy_with_three_derivatives(points):
    pieces = b_spline(points, LANE_CHANGE_KNOTS, 3)
    reference = BSpline(LANE_CHANGE_KNOTS, np.array(points), 3)
    for k, piece in enumerate(pieces):
        ours = piece(U)
        for order in range(4):
            inner = slice(0, -1)  # scipy takes the next piece at a knot
            theirs = reference(0.25 * (k + U), nu=order)[inner].T * 0.25**order
            np.testing.assert_allclose(ours[order][:, inner], theirs, atol=1e-8)


def test_uneven_knots_and_other_degrees():
    knots = np.array([0.0, 0.0, 0.0, 0.2, 0.2, 0.7, 1.0, 1.0, 1.0])
    points = np.array([[0, 0], [1, 2], [3, 3], [4, -1], [6, 0], [7, 1]], dtype=float)
    reference = BSpline(knots, points, 2)
    pieces = b_spline(points, knots, 2)
    assert len(pieces) == 3  # empty intervals carry nothing
    for piece, (a, b) in zip(pieces, [(0.0, 0.2), (0.2, 0.7), (0.7, 1.0)], strict=True):
        u = np.linspace(0.0, 1.0, 9)[:-1]
        np.testing.assert_allclose(
            piece(u)[0].T, reference(a + (b - a) * u), atol=1e-12
        )


def test_basis_functions_sum_to_one_also_at_the_knots():
    """As printed, 6.4 has two functions at a knot and the sum is 2."""
    for span, (a, b) in enumerate([(0.0, 0.25), (0.25, 0.5), (0.5, 0.75), (0.75, 1.0)]):
        basis = b_spline_basis(LANE_CHANGE_KNOTS, 3, np.linspace(a, b, 5), span + 3)
        np.testing.assert_allclose(basis.sum(axis=1), 1.0, atol=1e-12)
        assert basis.min() >= -1e-15


@given(st.lists(POINT, min_size=2, max_size=8))
def test_bezier_is_that_of_scipy_with_three_derivatives(points):
    (piece,) = bezier(points)
    reference = BPoly(np.array(points)[:, None, :], [0.0, 1.0])
    ours = piece(U)
    for order in range(4):
        theirs = (reference(U, nu=order) if order < len(points) else 0.0 * U[:, None]).T
        np.testing.assert_allclose(ours[order], theirs + 0.0 * ours[order], atol=1e-7)


def test_bernstein_of_known_values():
    np.testing.assert_allclose(
        bernstein(3, np.array([0.0, 0.5, 1.0])),
        [[1, 0, 0, 0], [0.125, 0.375, 0.375, 0.125], [0, 0, 0, 1]],
    )


def test_closed_forms_of_curvature():
    """With dy/dx = 0 at the ends the curvature there is y''."""
    length, shift = 60.0, 3.5
    cosine = sample_curve(half_cosine(length, shift), 0.5)
    expected = 0.5 * shift * (np.pi / length) ** 2
    assert cosine.curvature[0] == pytest.approx(expected)
    assert cosine.curvature[-1] == pytest.approx(-expected)
    ramp = sample_curve(sine_ramp(length, shift), 0.5)
    assert ramp.curvature[[0, -1]] == pytest.approx(0.0, abs=1e-15)
    cubic = sample_curve(cubic_bezier(length, shift, 0.4), 0.5)
    assert cubic.curvature[0] == pytest.approx(2 / 3 * shift / (0.4 * length) ** 2)
    quintic = sample_curve(quintic_bezier(length, shift), 0.5)
    assert quintic.curvature[[0, -1]] == pytest.approx(0.0, abs=1e-15)
    u = quintic.x / length
    smoothest = shift * (10 * u**3 - 15 * u**4 + 6 * u**5)
    np.testing.assert_allclose(quintic.y, smoothest, atol=1e-12)


def test_the_lane_change_spline_is_symmetric_about_o():
    curve = sample_curve(lane_change_b_spline(60.0, 3.5, 12.0), 0.25)
    mirrored = np.interp(60.0 - curve.x, curve.x, curve.y)
    np.testing.assert_allclose(mirrored, 3.5 - curve.y, atol=1e-5)
    assert curve.jumps == pytest.approx([0.0, 0.0, 0.0], abs=1e-14)
    assert curve.curvature[[0, -1]] == pytest.approx(0.0, abs=1e-14)
