"""Curve models that shift a vehicle by one lane; [Thesis] 6.3.1, 6.3.2.

Each runs from the origin, heading along +x, to (length, shift), heading along +x. All
are tuples of pieces as `experiments.thesis.lane_change.plane_curve` samples them.
"""

import numpy as np
from numpy.typing import ArrayLike

from planner.lane_change.b_spline import (
    CUBIC,
    LANE_CHANGE_KNOTS,
    Piece,
    b_spline,
    lane_change_points,
)
from planner.states import FloatArray


def half_cosine(length: float, shift: float) -> tuple[Piece, ...]:
    """Build y = shift/2 (1 - cos(pi x / length)); bent at both ends."""

    def piece(u: FloatArray) -> FloatArray:
        w, c, s = np.pi, np.cos(np.pi * u), np.sin(np.pi * u)
        half = 0.5 * shift
        return _graph(
            length,
            u,
            (half * (1.0 - c), half * w * s, half * w**2 * c, -half * w**3 * s),
        )

    return (piece,)


def sine_ramp(length: float, shift: float) -> tuple[Piece, ...]:
    """Build y = shift (u - sin(2 pi u) / 2 pi), u = x / length; ends straight."""

    def piece(u: FloatArray) -> FloatArray:
        w = 2.0 * np.pi
        c, s = np.cos(w * u), np.sin(w * u)
        return _graph(
            length,
            u,
            (shift * (u - s / w), shift * (1.0 - c), shift * w * s, shift * w**2 * c),
        )

    return (piece,)


def _graph(length: float, u: FloatArray, y: tuple[FloatArray, ...]) -> FloatArray:
    """Combine y and its derivatives with x = length u, (4, 2, n)."""
    none = np.zeros_like(u)
    return np.stack([[length * u, np.full_like(u, length), none, none], y], axis=1)


def bezier(points: ArrayLike) -> tuple[Piece, ...]:
    """Build a Bézier curve; [Thesis] eq. 6.1 and 6.2.

    Args:
        points: Control points, (n, 2) [m].
    """
    chain = [np.asarray(points, dtype=np.float64)]
    for _ in range(3):  # the derivative is a Bézier curve of the differences
        degree = chain[-1].shape[0] - 1
        chain.append(
            degree * np.diff(chain[-1], axis=0) if degree > 0 else np.zeros((1, 2))
        )

    def piece(u: FloatArray) -> FloatArray:
        return np.stack([(bernstein(p.shape[0] - 1, u) @ p).T for p in chain])

    return (piece,)


def bernstein(degree: int, u: FloatArray) -> FloatArray:
    """Return the Bernstein polynomials of one degree, eq. 6.2, (n_u, degree + 1)."""
    basis = np.ones((u.size, 1))
    for k in range(1, degree + 1):  # by de Casteljau's recursion, without factorials
        higher = np.zeros((u.size, k + 1))
        higher[:, :-1] += (1.0 - u)[:, None] * basis
        higher[:, 1:] += u[:, None] * basis
        basis = higher
    return basis


def cubic_bezier(length: float, shift: float, handle: float) -> tuple[Piece, ...]:
    """Build the Bézier curve of four points, the fewest that fix both headings.

    Args:
        length: Along x [m].
        shift: Along y [m].
        handle: Length of both end edges over `length` [-].
    """
    a = handle * length
    return bezier([[0.0, 0.0], [a, 0.0], [length - a, shift], [length, shift]])


def quintic_bezier(length: float, shift: float) -> tuple[Piece, ...]:
    """Build the Bézier curve of six points, even along x, three in line at each end.

    Three end points in line take the curvature to zero there.
    """
    x = np.linspace(0.0, length, 6)
    return bezier(np.column_stack([x, shift * (np.arange(6) > 2)]))


def lane_change_b_spline(length: float, shift: float, c: float) -> tuple[Piece, ...]:
    """Build the clamped cubic B-spline A, B, C, O, D, E, F; [Thesis] 6.3.5.

    B is the middle of A and C, both halves are symmetric about O.

    Args:
        length: From A to F along x [m].
        shift: From A to F along y [m].
        c: From A to C along x [m].
    """
    points = lane_change_points(float(length), float(c), (0.0, 0.0, 0.0), float(shift))
    return b_spline(points, LANE_CHANGE_KNOTS, CUBIC)
