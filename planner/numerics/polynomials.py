"""Quintic and quartic polynomials of time through boundary values, in closed form.

Coefficients stand lowest order first on the last axis. Time runs from 0 to T.
"""

import numpy as np
from numpy.typing import ArrayLike

from planner.errors import InvalidInputError
from planner.numerics.compiled import compiled, inlined
from planner.states import FloatArray


@inlined
def quintic_coefficients(
    p0: float, v0: float, a0: float, p1: float, v1: float, a1: float, T: float
) -> tuple[float, float, float, float, float, float]:
    """Solve [Thesis] eq. 4.4/4.5: position, speed and acceleration at both ends.

    Args:
        p0: Position at 0 [m].
        v0: Speed at 0 [m/s].
        a0: Acceleration at 0 [m/s²].
        p1: Position at T [m].
        v1: Speed at T [m/s].
        a1: Acceleration at T [m/s²].
        T: Duration, positive [s].

    Returns:
        Six coefficients, lowest order first.
    """
    # what is missing at T, as multiples of T^3, T^2 and T
    p = (p1 - p0 - T * (v0 + 0.5 * a0 * T)) / (T * T * T)
    v = (v1 - v0 - a0 * T) / (T * T)
    a = (a1 - a0) / T
    return (
        p0,
        v0,
        0.5 * a0,
        10.0 * p - 4.0 * v + 0.5 * a,
        (-15.0 * p + 7.0 * v - a) / T,
        (6.0 * p - 3.0 * v + 0.5 * a) / (T * T),
    )


@inlined
def quartic_coefficients(
    p0: float, v0: float, a0: float, v1: float, a1: float, T: float
) -> tuple[float, float, float, float, float]:
    """Solve [Thesis] eq. 4.10: as `quintic_coefficients`, the end position free.

    Returns:
        Five coefficients, lowest order first.
    """
    v = (v1 - v0 - a0 * T) / (T * T)
    a = (a1 - a0) / T
    return p0, v0, 0.5 * a0, v - a / 3.0, (0.25 * a - 0.5 * v) / T


def quintic(
    start: tuple[ArrayLike, ArrayLike, ArrayLike],
    end: tuple[ArrayLike, ArrayLike, ArrayLike],
    T: ArrayLike,
) -> FloatArray:
    """Solve many quintics; all arguments broadcast against each other.

    Args:
        start: Position [m], speed [m/s] and acceleration [m/s²] at 0.
        end: The same at T.
        T: Durations, positive [s].

    Returns:
        (..., 6) coefficients.

    Raises:
        InvalidInputError: If a duration is not positive.
    """
    rows, shape = _rows((*start, *end), T)
    return _quintics(rows).reshape(*shape, 6)


def quartic(
    start: tuple[ArrayLike, ArrayLike, ArrayLike],
    end: tuple[ArrayLike, ArrayLike],
    T: ArrayLike,
) -> FloatArray:
    """Solve many quartics; all arguments broadcast against each other.

    Args:
        start: Position [m], speed [m/s] and acceleration [m/s²] at 0.
        end: Speed [m/s] and acceleration [m/s²] at T.
        T: Durations, positive [s].

    Returns:
        (..., 5) coefficients.

    Raises:
        InvalidInputError: If a duration is not positive.
    """
    rows, shape = _rows((*start, *end), T)
    return _quartics(rows).reshape(*shape, 5)


def evaluate(coefficients: FloatArray, t: ArrayLike, derivative: int = 0) -> FloatArray:
    """Evaluate polynomials or one of their derivatives.

    Args:
        coefficients: (..., n), lowest order first.
        t: Times, broadcast against the leading axes [s]; for one polynomial any
            shape, for many give the coefficients a last-but-one axis of 1.
        derivative: Its order, 0 for the value itself.

    Returns:
        Values in the broadcast shape.
    """
    times = np.asarray(t, dtype=np.float64)
    factors = _derivative_factors(coefficients.shape[-1], derivative)
    remaining = coefficients[..., derivative:] * factors
    value = np.zeros(np.broadcast_shapes(coefficients.shape[:-1], times.shape))
    for k in range(remaining.shape[-1] - 1, -1, -1):
        value = value * times + remaining[..., k]
    return value


def _derivative_factors(n: int, derivative: int) -> FloatArray:
    """Return k (k - 1) ... of the powers left after `derivative` differentiations."""
    powers = np.arange(derivative, n, dtype=np.float64)
    factors = np.ones(powers.size)
    for k in range(derivative):
        factors *= powers - k
    return factors


def _rows(
    values: tuple[ArrayLike, ...], T: ArrayLike
) -> tuple[FloatArray, tuple[int, ...]]:
    """Broadcast boundary values and durations into rows; (rows, common shape)."""
    durations = np.asarray(T, dtype=np.float64)
    if not np.all((durations > 0.0) & np.isfinite(durations)):
        raise InvalidInputError(f"T = {durations} must be positive")
    columns = np.broadcast_arrays(*(np.asarray(v, np.float64) for v in values), T)
    rows = np.stack([column.reshape(-1) for column in columns], axis=1)
    return rows.astype(np.float64, copy=False), columns[0].shape


@compiled
def _quintics(rows: FloatArray) -> FloatArray:
    """Solve one quintic per row (p0, v0, a0, p1, v1, a1, T)."""
    out = np.empty((rows.shape[0], 6))
    for i in range(rows.shape[0]):
        r = rows[i]
        out[i] = quintic_coefficients(r[0], r[1], r[2], r[3], r[4], r[5], r[6])
    return out


@compiled
def _quartics(rows: FloatArray) -> FloatArray:
    """Solve one quartic per row (p0, v0, a0, v1, a1, T)."""
    out = np.empty((rows.shape[0], 5))
    for i in range(rows.shape[0]):
        r = rows[i]
        out[i] = quartic_coefficients(r[0], r[1], r[2], r[3], r[4], r[5])
    return out
