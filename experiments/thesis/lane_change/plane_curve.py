"""Plane curves sampled by arc length, from any parametrisation.

A curve is a chain of pieces. A piece maps a parameter in [0, 1] to the point and its
first three derivatives; heading, curvature and its rate follow from them. Pieces are
sampled one by one, ends included: at a joint there are two points at one distance, so
that a jump of the curvature is seen and never smeared.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from planner.errors import InvalidInputError
from planner.lane_change.b_spline import Piece
from planner.states import FloatArray, freeze

INTERVALS = 32  # of a piece, for the integral of its speed
ROUNDS = 4  # of Newton's method from distance to parameter
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(8)


@dataclass(frozen=True, slots=True, eq=False)
class Curve:
    """Points of a plane curve; all arrays are (n,)."""

    distance: FloatArray  # along the curve, from 0, equal at joints [m]
    x: FloatArray  # [m]
    y: FloatArray  # [m]
    heading: FloatArray  # unwrapped [rad]
    curvature: FloatArray  # [1/m]
    curvature_rate: FloatArray  # over the distance [1/m²]

    def __post_init__(self) -> None:
        """Copy, check and freeze the columns."""
        for name in ("distance", "x", "y", "heading", "curvature", "curvature_rate"):
            column = freeze(getattr(self, name))
            if column.shape != np.shape(self.distance) or column.ndim != 1:
                raise InvalidInputError(f"{name} has shape {column.shape}")
            object.__setattr__(self, name, column)

    @property
    def length(self) -> float:
        """Length of the curve [m]."""
        return float(self.distance[-1])

    @property
    def jumps(self) -> FloatArray:
        """Changes of the curvature at the joints, (n_joints,) [1/m]."""
        joint = np.diff(self.distance) == 0.0
        return np.asarray(np.diff(self.curvature)[joint])


def sample_curve(pieces: Sequence[Piece], spacing: float) -> Curve:
    """Sample a chain of pieces evenly in arc length, at least every `spacing` [m].

    Raises:
        InvalidInputError: If there is no piece, a piece stands still somewhere, or
            `spacing` is not positive.
    """
    if not pieces or not spacing > 0.0:
        raise InvalidInputError(
            f"{len(pieces)} pieces and spacing = {spacing}: both must be positive"
        )
    columns, driven = [], 0.0
    for piece in pieces:
        u, distance = _even_parameters(piece, spacing)
        columns.append(np.vstack([driven + distance, _shape(piece(u))]))
        driven += float(distance[-1])
    distance, x, y, heading, curvature, rate = np.hstack(columns)
    return Curve(distance, x, y, np.unwrap(heading), curvature, rate)


def _shape(derivatives: FloatArray) -> FloatArray:
    """Return (x, y, heading, curvature, curvature rate), (5, n)."""
    (x, y), (x1, y1), (x2, y2), (x3, y3) = derivatives
    square = x1 * x1 + y1 * y1
    speed = np.sqrt(square)
    turn = x1 * y2 - y1 * x2
    curvature = turn / (square * speed)
    # d(curvature)/du over ds/du
    rate = (x1 * y3 - y1 * x3 - 3.0 * turn * (x1 * x2 + y1 * y2) / square) / square**2
    return np.vstack([x, y, np.arctan2(y1, x1), curvature, rate])


def _even_parameters(piece: Piece, spacing: float) -> tuple[FloatArray, FloatArray]:
    """Return the parameters and distances of even steps along one piece."""
    knots = np.linspace(0.0, 1.0, INTERVALS + 1)
    steps = _length(piece, knots[:-1], knots[1:])
    to_knot = np.concatenate([[0.0], np.cumsum(steps)])
    n = max(int(np.ceil(to_knot[-1] / spacing - 1e-9)), 1) + 1
    wanted = np.linspace(0.0, to_knot[-1], n)
    u = np.interp(wanted, to_knot, knots)
    for _ in range(ROUNDS):
        k = np.minimum((u * INTERVALS).astype(np.int64), INTERVALS - 1)
        missing = wanted - to_knot[k] - _length(piece, knots[k], u)
        tangent = piece(u)[1]
        u = np.clip(u + missing / np.hypot(tangent[0], tangent[1]), 0.0, 1.0)
    return u, wanted


def _length(piece: Piece, start: FloatArray, end: FloatArray) -> FloatArray:
    """Integrate the speed of a piece between parameters, (n,) [m]."""
    half = 0.5 * (end - start)
    inner = start[:, None] + half[:, None] * (1.0 + _NODES)  # (n, n_nodes)
    tangent = piece(inner.ravel())[1].reshape(2, *inner.shape)
    speed = np.hypot(tangent[0], tangent[1])
    if not speed.min() > 0.0:
        raise InvalidInputError("a piece of the curve stands still")
    return np.asarray(half * (speed @ _WEIGHTS))
