"""Quintic splines on evenly spaced knots, and what a least-squares fit of one takes.

Values are those of `scipy.interpolate` to the last bit: de Boor's recursion in the same
order, here over all places at once. Importing scipy's takes longer than fitting a road.
"""

from dataclasses import dataclass

import numpy as np

from planner.states import FloatArray, IntArray

DEGREE = 5
N_BASIS = DEGREE + 1  # functions that are not zero at a place


@dataclass(frozen=True, slots=True, eq=False)
class UniformKnots:
    """Knots of `n_spans` equal spans over [0, end], and as many beyond as needed."""

    spacing: float
    n_spans: int

    @classmethod
    def over(cls, end: float, spacing: float) -> "UniformKnots":
        """Divide [0, end] into spans of about `spacing`, at least three."""
        n_spans = max(3, int(np.ceil(end / spacing)))
        return cls(end / n_spans, n_spans)

    @property
    def n_coefficients(self) -> int:
        """Coefficients of a spline on these knots."""
        return self.n_spans + DEGREE

    @property
    def knots(self) -> FloatArray:
        """All knots, (n_spans + 11,)."""
        numbers = np.arange(-DEGREE, self.n_spans + DEGREE + 1)
        return np.asarray(self.spacing * numbers, dtype=np.float64)

    def basis(self, u: FloatArray, order: int = 0) -> tuple[IntArray, FloatArray]:
        """Evaluate the functions that are not zero at places.

        Args:
            u: Places, (n,).
            order: Of the derivative.

        Returns:
            (number of the first function, (n,); values, (n, 6)).
        """
        knots = self.knots
        span = np.searchsorted(knots, u, side="right") - 1
        span = np.clip(span, DEGREE, self.n_spans + DEGREE - 1)
        now, before = np.zeros((N_BASIS, u.size)), np.empty((N_BASIS, u.size))
        now[0] = 1.0
        for degree in range(1, N_BASIS):
            before[:degree] = now[:degree]
            now[0] = 0.0
            for k in range(1, degree + 1):
                right, left = knots[span + k], knots[span + k - degree]
                if degree > DEGREE - order:
                    share = degree * before[k - 1] / (right - left)
                    now[k - 1] -= share
                    now[k] = share
                else:
                    share = before[k - 1] / (right - left)
                    now[k - 1] += share * (right - u)
                    now[k] = share * (u - left)
        return span - DEGREE, now.T.copy()


@dataclass(frozen=True, slots=True, eq=False)
class UniformSpline:
    """A curve in the plane."""

    on: UniformKnots
    coefficients: FloatArray  # (n_coefficients, 2)

    def __call__(self, u: FloatArray, order: int = 0) -> FloatArray:
        """Evaluate the curve or a derivative at places `u`, any shape: (*shape, 2)."""
        first, values = self.on.basis(np.ravel(u), order)
        return combine(first, values, self.coefficients).reshape(*np.shape(u), 2)


def combine(
    first: IntArray, values: FloatArray, coefficients: FloatArray
) -> FloatArray:
    """Weigh coefficients with the functions of a basis, (n, 2)."""
    total = np.zeros((first.size, 2))
    for k in range(N_BASIS):
        total += coefficients[first + k] * values[:, k, None]
    return total


def normal_bands(
    first: IntArray, values: FloatArray, weights: FloatArray, n: int
) -> FloatArray:
    """Return B' W B of a basis by diagonals, the main one first, (6, n)."""
    bands = np.zeros((N_BASIS, n))
    weighted = weights[:, None] * values
    for k in range(N_BASIS):
        columns = first[:, None] + np.arange(N_BASIS - k)
        products = values[:, k:] * weighted[:, : N_BASIS - k]
        bands[k] = np.bincount(columns.ravel(), products.ravel(), minlength=n)
    return bands


def normal_side(
    first: IntArray, values: FloatArray, weighted: FloatArray, n: int
) -> FloatArray:
    """Return B' W y of a basis and of weighted points, (n, 2)."""
    columns = (first[:, None] + np.arange(N_BASIS)).ravel()
    sides = [(values * side[:, None]).ravel() for side in weighted.T]
    return np.stack([np.bincount(columns, s, minlength=n) for s in sides], axis=1)


def hermite(
    x: FloatArray, y: FloatArray, slope: FloatArray, at: FloatArray
) -> FloatArray:
    """Evaluate the cubic Hermite spline through (x, y) with slopes at places."""
    width = np.diff(x)
    rise = np.diff(y) / width
    bend = (slope[:-1] + slope[1:] - 2.0 * rise) / width
    second, third = (rise - slope[:-1]) / width - bend, bend / width
    k = np.clip(np.searchsorted(x, at, side="right") - 1, 0, x.size - 2)
    d = at - x[k]
    return np.asarray(
        y[k] + slope[k] * d + second[k] * (d * d) + third[k] * (d * d * d)
    )
