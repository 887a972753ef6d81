import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planner.errors import InvalidInputError
from planner.numerics.polynomials import (
    evaluate,
    quartic,
    quartic_coefficients,
    quintic,
    quintic_coefficients,
)

values = st.floats(-30.0, 30.0)
durations = st.floats(0.5, 12.0)


def row(T, n, derivative):
    """One row of the printed matrices: a derivative of the powers of T."""
    powers = np.polynomial.polynomial.polyvander(T, n - 1).ravel()
    out = np.zeros(n)
    for k in range(derivative, n):
        factor = np.prod(np.arange(k, k - derivative, -1.0))
        out[k] = factor * powers[k - derivative]
    return out


@settings(deadline=None)
@given(
    start=st.tuples(values, values, values),
    end=st.tuples(values, values, values),
    T=durations,
)
def test_quintic_solves_the_printed_system(start, end, T):
    A = [row(t, 6, d) for t in (0.0, T) for d in range(3)]
    solved = np.linalg.solve(A, [*start, *end])
    np.testing.assert_allclose(quintic(start, end, T), solved, rtol=1e-6, atol=1e-6)


@settings(deadline=None)
@given(
    start=st.tuples(values, values, values), end=st.tuples(values, values), T=durations
)
def test_quartic_solves_the_printed_system(start, end, T):
    A = [row(0.0, 5, d) for d in range(3)] + [row(T, 5, d) for d in (1, 2)]
    solved = np.linalg.solve(A, [*start, *end])
    np.testing.assert_allclose(quartic(start, end, T), solved, rtol=1e-6, atol=1e-6)


def test_batch_meets_its_boundary_values():
    T = np.linspace(1.0, 8.0, 15)[:, None]
    offsets = np.linspace(-5.0, 5.0, 21)
    batch = quintic((1.0, -0.5, 0.3), (offsets, 0.2, -0.1), T)
    assert batch.shape == (15, 21, 6)
    for derivative, (first, last) in enumerate(
        [(1.0, offsets), (-0.5, 0.2), (0.3, -0.1)]
    ):
        at_start = evaluate(batch, 0.0, derivative)
        at_end = evaluate(batch, T, derivative)
        np.testing.assert_allclose(at_start, first, atol=1e-12)
        np.testing.assert_allclose(at_end, np.broadcast_to(last, (15, 21)), atol=1e-11)
    speeds = quartic((0.0, 9.0, 0.5), (offsets + 6.0, 0.0), T)
    assert speeds.shape == (15, 21, 5)
    np.testing.assert_allclose(
        evaluate(speeds, T, 1), np.broadcast_to(offsets + 6.0, (15, 21)), atol=1e-11
    )
    np.testing.assert_allclose(evaluate(speeds, T, 2), 0.0, atol=1e-11)


def test_batch_equals_the_scalar_kernels():
    rng = np.random.default_rng(0)
    p = rng.uniform(-10.0, 10.0, (6, 40))
    T = rng.uniform(0.5, 9.0, 40)
    quintics = quintic(tuple(p[:3]), tuple(p[3:]), T)
    quartics = quartic(tuple(p[:3]), tuple(p[4:]), T)
    for i in range(40):
        assert tuple(quintics[i]) == quintic_coefficients(*p[:, i], T[i])
        assert tuple(quartics[i]) == quartic_coefficients(*p[:3, i], *p[4:, i], T[i])


def test_evaluate_matches_numpy():
    coefficients = np.array([[1.0, -2.0, 0.5, 0.3, -0.1, 0.02], [0, 1, 2, 3, 4, 5.0]])
    t = np.linspace(0.0, 3.0, 7)
    for derivative in range(7):
        found = evaluate(coefficients[:, None, :], t, derivative)
        for i in range(2):
            expected = np.polynomial.Polynomial(coefficients[i]).deriv(derivative)(t)
            np.testing.assert_allclose(found[i], expected, atol=1e-12)


def squared_jerk(coefficients, T):
    jerk = np.polynomial.Polynomial(coefficients).deriv(3)
    return (jerk**2).integ()(T)


def test_quintic_is_the_smoothest_way_between_its_ends():
    T = 4.0
    best = quintic((0.0, 5.0, 1.0), (30.0, 8.0, 0.0), T)
    # any other polynomial with these ends adds t^3 (T - t)^3 times something
    bump = (
        np.polynomial.Polynomial([0, 1]) ** 3 * np.polynomial.Polynomial([T, -1]) ** 3
    )
    for size in (-0.01, 0.01):
        other = (np.polynomial.Polynomial(best) + size * bump).coef
        assert squared_jerk(other, T) > squared_jerk(best, T)


@pytest.mark.parametrize("T", [0.0, -1.0, np.nan, np.inf, [1.0, 0.0]])
def test_a_duration_that_is_not_positive_is_refused(T):
    with pytest.raises(InvalidInputError, match="T ="):
        quintic((0, 0, 0), (1, 0, 0), T)
    with pytest.raises(InvalidInputError, match="T ="):
        quartic((0, 0, 0), (1, 0), T)
