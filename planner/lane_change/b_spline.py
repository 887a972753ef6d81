"""Clamped cubic B-splines of a lane change; [Thesis] 6.3.3-6.3.5.

A piece maps a parameter in [0, 1] to the point and its first three derivatives.
"""

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike

from planner.numerics.compiled import inlined
from planner.states import FloatArray, freeze

# u, (n,) -> x and y and their derivatives over u of order 0 to 3, (4, 2, n)
Piece = Callable[[FloatArray], FloatArray]

CUBIC = 3
# Clamped: the curve starts at A and ends at F, which an open cubic does not.
LANE_CHANGE_KNOTS = freeze([0, 0, 0, 0, 0.25, 0.5, 0.75, 1, 1, 1, 1])


@inlined
def lane_change_points(
    length: float, c: float, start: tuple[float, float, float], end: float
) -> FloatArray:
    """Place the control points A, B, C, O, D, E, F of a lane change, (7, 2) [m].

    With b the length of BC along x and AB the same, C's place across follows from the
    derivatives of a clamped cubic at its start: y'' = (rise of BC - b y') / (3 b²).

    Args:
        length: From A to F along x [m].
        c: From A to C along x [m].
        start: y, dy/dx and d²y/dx² at A [m, -, 1/m].
        end: y at F, where the curve ends straight [m].
    """
    y0, slope, bend = start
    b = 0.5 * c
    third = y0 + c * slope + 3.0 * b * b * bend
    x = (0.0, b, c, 0.5 * length, length - c, length - b, length)
    y = (y0, y0 + b * slope, third, 0.5 * (y0 + end), end, end, end)
    points = np.empty((7, 2))
    for k in range(7):
        points[k, 0], points[k, 1] = x[k], y[k]
    return points


def b_spline(points: ArrayLike, knots: FloatArray, degree: int) -> tuple[Piece, ...]:
    """Make a B-spline, one piece for each knot interval that is not empty; eq. 6.3.

    Args:
        points: Control points, (n, 2) [m].
        knots: (n + degree + 1,), not falling.
        degree: At least 1.
    """
    chain = [(np.asarray(points, dtype=np.float64), np.asarray(knots), degree)]
    for _ in range(3):
        chain.append(_derived(*chain[-1]))
    spans = np.flatnonzero(np.diff(knots) > 0.0)
    return tuple(
        _spline_piece(chain, float(knots[k]), float(knots[k + 1])) for k in spans
    )


def _derived(
    points: FloatArray, knots: FloatArray, degree: int
) -> tuple[FloatArray, FloatArray, int]:
    """Give control points, knots and degree of the derivative of a B-spline."""
    if degree == 0:
        return np.zeros_like(points), knots, 0
    width = knots[degree + 1 : -1] - knots[1 : -degree - 1]
    safe = np.where(width > 0.0, width, 1.0)
    slopes = np.where(width > 0.0, degree / safe, 0.0)
    return slopes[:, None] * np.diff(points, axis=0), knots[1:-1], degree - 1


def _spline_piece(
    chain: list[tuple[FloatArray, FloatArray, int]], start: float, end: float
) -> Piece:
    """Make the polynomial of a B-spline on one knot interval."""
    width = end - start

    def piece(u: FloatArray) -> FloatArray:
        at = start + width * u
        rows = []
        for order, (points, knots, degree) in enumerate(chain):
            span = int(np.searchsorted(knots, start, side="right")) - 1
            rows.append(
                width**order * (b_spline_basis(knots, degree, at, span) @ points).T
            )
        return np.stack(rows)

    return piece


def b_spline_basis(
    knots: FloatArray, degree: int, u: FloatArray, span: int
) -> FloatArray:
    """Return the basis functions on one knot interval; [Thesis] eq. 6.4, 6.5 corrected.

    Args:
        knots: (m,), not falling.
        degree: At least 0.
        u: Parameters in the closed interval, (n,).
        span: Index of the knot at which the interval begins; it says which
            polynomial holds at a knot, where eq. 6.4 as printed takes both.

    Returns:
        (n, m - degree - 1).
    """
    basis = np.zeros((u.size, knots.size - 1))
    basis[:, span] = 1.0
    for p in range(1, degree + 1):
        n = knots.size - 1 - p
        rise = _share(u, knots[:n], knots[p : p + n])
        fall = 1.0 - _share(u, knots[1 : n + 1], knots[p + 1 : p + 1 + n])
        basis = rise * basis[:, :n] + fall * basis[:, 1 : n + 1]
    return basis


def _share(u: FloatArray, start: FloatArray, end: FloatArray) -> FloatArray:
    """Return (u - start) / (end - start), 0/0 := 0, (n_u, n).

    An empty interval carries no basis function, so its share multiplies 0.
    """
    width = end - start
    safe = np.where(width > 0.0, width, 1.0)
    return np.where(width > 0.0, (u[:, None] - start) / safe, 0.0)
