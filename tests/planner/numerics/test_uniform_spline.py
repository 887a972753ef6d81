import numpy as np
import pytest
from scipy.interpolate import BSpline, CubicHermiteSpline
from scipy.sparse import csr_array, diags_array

from planner.numerics.uniform_spline import (
    DEGREE,
    UniformKnots,
    UniformSpline,
    hermite,
    normal_bands,
    normal_side,
)

RNG = np.random.default_rng(3)
ON = UniformKnots.over(23.7, 0.5)
PLACES = np.sort(np.concatenate([RNG.uniform(0.0, 23.7, 300), [0.0, 23.7], ON.knots]))
INSIDE = PLACES[(PLACES >= 0.0) & (PLACES <= 23.7)]


@pytest.mark.parametrize("order", [0, 1, 2])
def test_the_values_are_those_of_scipy(order):
    coefficients = RNG.normal(size=(ON.n_coefficients, 2))
    ours = UniformSpline(ON, coefficients)(INSIDE, order)
    np.testing.assert_array_equal(
        ours, BSpline(ON.knots, coefficients, 5)(INSIDE, order)
    )


def test_the_normal_equations_are_those_of_sparse_matrices():
    weights = RNG.uniform(0.1, 3.0, INSIDE.size)
    wanted = RNG.normal(size=(INSIDE.size, 2))
    basis, n = ON.basis(INSIDE), ON.n_coefficients
    matrix = csr_array(BSpline.design_matrix(INSIDE, ON.knots, 5, extrapolate=True))
    gram = matrix.T @ (diags_array(weights) @ matrix)
    bands = normal_bands(*basis, weights, n)
    for k in range(DEGREE + 1):
        np.testing.assert_array_equal(bands[k, : n - k], gram.diagonal(-k))
        assert not bands[k, n - k :].any()
    side = normal_side(*basis, weights[:, None] * wanted, n)
    np.testing.assert_array_equal(side, matrix.T @ (weights[:, None] * wanted))


def test_the_hermite_spline_is_that_of_scipy():
    x = np.cumsum(RNG.uniform(0.1, 1.0, 40))
    y, slope = RNG.normal(size=(2, 40))
    at = RNG.uniform(x[0], x[-1], 200)
    at[:3] = x[0], x[20], x[-1]
    np.testing.assert_array_equal(
        hermite(x, y, slope, at), CubicHermiteSpline(x, y, slope)(at)
    )
