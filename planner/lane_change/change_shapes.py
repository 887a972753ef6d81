"""Shapes of lane changes over the road, sampled and priced; [Thesis] 6.3.5, 6.11.

The clamped cubic B-spline of `planner.lane_change.b_spline`, with its first control
points placed such that position, slope and second derivative are those of the ego: so a
change can be planned anew from the middle of another one.
"""

from collections.abc import Sequence

import numpy as np

from planner.lane_change.b_spline import (
    CUBIC,
    LANE_CHANGE_KNOTS,
    b_spline,
    lane_change_points,
)
from planner.numerics.compiled import compiled
from planner.states import FloatArray, freeze

SAMPLES = 161  # of the spline's parameter


def _basis() -> FloatArray:
    """Sample the basis functions and two derivatives, (3, 7, SAMPLES)."""
    pieces = b_spline(np.eye(7), LANE_CHANGE_KNOTS, CUBIC)
    n = (SAMPLES - 1) // len(pieces)
    u = np.arange(n + 1) / n
    parts = [
        piece(u if k == len(pieces) - 1 else u[:-1]) for k, piece in enumerate(pieces)
    ]
    per_parameter = np.array([1.0, len(pieces), len(pieces) ** 2])
    return freeze(np.concatenate(parts, axis=2)[:3] * per_parameter[:, None, None])


BASIS = _basis()


def control_points(
    start: tuple[float, float, float],
    target: float,
    lengths: Sequence[float],
    ratios: Sequence[float],
) -> FloatArray:
    """Place the control points of changes, (n, 7, 2): along the road and across.

    Args:
        start: l [m], dl/ds, d²l/ds² [1/m] where the change begins.
        target: Offset of the lane to go to [m].
        lengths: Of the changes along the road [m].
        ratios: Places of C over the length [-]; each with each length.
    """
    return _control_points(start, target, np.array(lengths), np.array(ratios))


@compiled
def _control_points(
    start: tuple[float, float, float],
    target: float,
    lengths: FloatArray,
    ratios: FloatArray,
) -> FloatArray:
    """Return the points of `control_points`."""
    points = np.empty((lengths.size * ratios.size, 7, 2))
    for i in range(lengths.size):
        for j in range(ratios.size):
            points[i * ratios.size + j] = lane_change_points(
                lengths[i], ratios[j] * lengths[i], start, target
            )
    return points


@compiled
def sample(points: FloatArray, basis: FloatArray) -> FloatArray:
    """Sample a spline as (driven, l, dl/ds, d²l/ds²), (4, SAMPLES).

    Args:
        points: (7, 2).
        basis: `BASIS`.
    """
    n = basis.shape[2]
    s, l = np.zeros((3, n)), np.zeros((3, n))
    for order in range(3):
        for j in range(basis.shape[1]):
            along, across = points[j, 0], points[j, 1]
            # a cubic basis function lasts four of the four knot intervals at most
            first, last = max(j - 3, 0) * n // 4, min((j + 1) * (n // 4) + 1, n)
            for i in range(first, last):
                s[order, i] += basis[order, j, i] * along
                l[order, i] += basis[order, j, i] * across
    shape = np.empty((4, n))
    for i in range(n):
        rate = s[1, i]
        shape[0, i], shape[1, i], shape[2, i] = s[0, i], l[0, i], l[1, i] / rate
        shape[3, i] = (l[2, i] * rate - s[2, i] * l[1, i]) / (rate * rate * rate)
    return shape


@compiled
def prices(
    points: FloatArray,
    basis: FloatArray,
    curvature_weight: float,
    length_weight: float,
) -> tuple[FloatArray, FloatArray]:
    """Price changes by the corrected eq. 6.11: (cost, peak curvature [1/m]), (n,) each.

    The curvature is that of the change itself, as on a straight road.

    Args:
        points: (n, 7, 2).
        basis: `BASIS`.
        curvature_weight: Of the integral of squared curvature [m].
        length_weight: [1/m].
    """
    cost, peak = np.zeros(points.shape[0]), np.zeros(points.shape[0])
    for c in range(points.shape[0]):
        shape = sample(points[c], basis)
        bent = 0.0
        for i in range(shape.shape[1]):
            stretch = 1.0 + shape[2, i] * shape[2, i]
            root = np.sqrt(stretch)
            curvature = shape[3, i] / (stretch * root)
            peak[c] = max(peak[c], abs(curvature))
            if i > 0:
                bent += curvature**2 * (shape[0, i] - shape[0, i - 1]) * root
        cost[c] = curvature_weight * bent + length_weight * shape[0, -1]
    return cost, peak
