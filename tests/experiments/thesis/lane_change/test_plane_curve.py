import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import quad

from experiments.thesis.lane_change.curve_comparison import (
    LaneShift,
    lane_change_curves,
)
from experiments.thesis.lane_change.plane_curve import Curve, sample_curve
from planner.errors import InvalidInputError

CURVES = lane_change_curves(LaneShift(spacing=0.05))


def finite_differences_agree(curve: Curve, tolerance: float) -> None:
    """Heading and curvatures are derivatives of the points, joints left out."""
    joints = np.flatnonzero(np.diff(curve.distance) == 0.0)
    starts = [0, *(joints + 1)]
    ends = [*(joints + 1), curve.distance.size]
    for a, b in zip(starts, ends, strict=True):
        d = curve.distance[a:b]
        x, y = np.gradient(curve.x[a:b], d), np.gradient(curve.y[a:b], d)
        inner = slice(1, -1)
        away = np.arctan2(y, x) - curve.heading[a:b]
        np.testing.assert_allclose(np.sin(away)[inner], 0.0, atol=tolerance)
        turned = np.gradient(curve.heading[a:b], d)
        np.testing.assert_allclose(
            turned[inner], curve.curvature[a:b][inner], atol=tolerance
        )
        bent = np.gradient(curve.curvature[a:b], d)
        np.testing.assert_allclose(
            bent[inner], curve.curvature_rate[a:b][inner], atol=tolerance
        )


@pytest.mark.parametrize("name", CURVES)
def test_heading_and_curvatures_are_derivatives_along_the_arc_length(name):
    finite_differences_agree(CURVES[name], 2e-6)


@pytest.mark.parametrize("name", CURVES)
def test_every_model_changes_the_lane(name):
    curve = CURVES[name]
    start = curve.x[0], curve.y[0], curve.heading[0]
    end = curve.x[-1], curve.y[-1], curve.heading[-1]
    assert start == pytest.approx((0.0, 0.0, 0.0), abs=1e-12)
    assert end == pytest.approx((60.0, 3.5, 0.0), abs=1e-9)


@pytest.mark.parametrize("name", CURVES)
def test_points_are_even_in_arc_length(name):
    curve = CURVES[name]
    chord = np.hypot(np.diff(curve.x), np.diff(curve.y))
    steps = np.diff(curve.distance)
    np.testing.assert_allclose(chord, steps, atol=1e-8)
    assert steps.max() <= 0.05 + 1e-12


@given(st.floats(5.0, 80.0), st.floats(-20.0, 20.0))
def test_the_length_is_the_integral_of_the_speed(a, b):
    """A parabola has its length in closed form, and a third way by quadrature."""

    def piece(u):
        one = np.ones_like(u)
        none = 0.0 * u
        return np.array(
            [
                [a * u, b * u * u],
                [a * one, 2 * b * u],
                [none, 2 * b * one],
                [none, none],
            ]
        )

    curve = sample_curve([piece], 0.5)
    exact, _ = quad(lambda u: math.hypot(a, 2 * b * u), 0.0, 1.0, epsabs=1e-12)
    assert curve.length == pytest.approx(exact, abs=1e-9)
    u = curve.x / a
    np.testing.assert_allclose(
        curve.curvature, 2 * a * b / np.hypot(a, 2 * b * u) ** 3, atol=1e-12
    )


def test_what_makes_no_curve_is_refused():
    with pytest.raises(InvalidInputError, match="0 pieces"):
        sample_curve([], 0.1)
    with pytest.raises(InvalidInputError, match="stands still"):
        sample_curve([lambda u: np.zeros((4, 2, u.size))], 0.1)
