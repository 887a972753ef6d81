"""Polyline of lane points to a path of linear-curvature pieces.

The polyline is sampled by arc length and fitted by a quintic spline that minimises the
squared distance plus a penalty on the third derivative: what is cheap is a line, an arc
or a clothoid. How hard the penalty smooths is one length; it acts everywhere, and only
where the bound on the deviation would be broken do the samples gain weight.
"""

import numpy as np
from numpy.typing import ArrayLike
from scipy.linalg import solveh_banded

from planner.errors import InvalidInputError
from planner.numerics.uniform_spline import (
    DEGREE,
    UniformKnots,
    UniformSpline,
    combine,
    hermite,
    normal_bands,
    normal_side,
)
from planner.reference_path.linear_curvature import MAX_TURN, place_knots
from planner.reference_path.projection import feet, search_tables
from planner.reference_path.segments import Knots, knot_table
from planner.states import FloatArray, freeze

SAMPLE_STEP = 0.25  # [m], of the polyline
SPLINE_STEP = 0.5  # [m], between spline knots: room for a corner of 1 m
KNOT_STEP = 0.25  # [m], of the path
SMOOTHING_LENGTH = 2.0  # [m]; takes 4 cm off where a line meets an arc of R = 15 m
ENDS_WEIGHT = 1e4  # the path begins and ends where the polyline does
ROUNDS = 60  # of reweighting; each solves one banded system
TARGET = 0.9  # of the bound, so that the reweighting ends
SPREAD = 0.5  # [m], reach of a raised weight to both sides
MIN_DISTANCE = 1e-6  # [m]; points nearer than this are one point
MIN_SPEED = 0.2  # |dc/du| below this is a cusp: the polyline turns back
REACH = 5.0  # [m], of the search for the path point beside a sample
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(5)


def smooth_polyline(points: ArrayLike, max_deviation: float) -> tuple[Knots, float]:
    """Smooth a polyline into knots of a path.

    Args:
        points: (n, 2), at least two distinct points [m].
        max_deviation: Bound of the distance between polyline and path [m].

    Returns:
        The knots and the largest distance measured [m].

    Raises:
        InvalidInputError: If the points make no line, or if the bound cannot be met.
    """
    if not 0.0 < max_deviation < np.inf:
        raise InvalidInputError(f"max_deviation = {max_deviation} must be positive")
    u, corners = _distinct_points(points)
    spline = _fit(u, corners - corners[0], TARGET * max_deviation)
    node_u, node_s = _arc_lengths(spline, u[-1], corners[0])
    knots = _knots(spline, node_u, node_s, corners[0])
    every = _samples(u)
    wanted = np.stack([np.interp(every, u, corners[:, k]) for k in range(2)])
    distances = _distances(knots, wanted, np.interp(every, node_u, node_s))
    worst = int(np.argmax(distances))
    if distances[worst] > max_deviation:
        raise InvalidInputError(
            f"the path cannot stay within {max_deviation:g} m of the polyline: "
            f"{distances[worst]:.3f} m {_place(wanted[:, worst])}"
        )
    return knots, float(distances[worst])


def _distinct_points(points: ArrayLike) -> tuple[FloatArray, FloatArray]:
    """Check the polyline and drop repeated points; (arc lengths, points)."""
    corners = np.asarray(points, dtype=np.float64)
    if corners.ndim != 2 or corners.shape[1] != 2:
        raise InvalidInputError(f"points must be (n, 2), not {corners.shape}")
    bad = np.flatnonzero(~np.isfinite(corners).all(axis=1))
    if bad.size:
        raise InvalidInputError(f"point {bad[0]} is not finite: {corners[bad[0]]}")
    kept = np.ones(corners.shape[0], dtype=bool)
    kept[1:] = np.hypot(*np.diff(corners, axis=0).T) > MIN_DISTANCE
    corners = corners[kept]
    if corners.shape[0] < 2:
        raise InvalidInputError(
            f"a polyline needs two distinct points, got {corners.shape[0]}"
        )
    lengths = np.hypot(*np.diff(corners, axis=0).T)
    return np.concatenate([[0.0], np.cumsum(lengths)]), corners


def _samples(u: FloatArray) -> FloatArray:
    """Space arc lengths evenly over the polyline and add those of its corners."""
    n_steps = max(8, int(np.ceil(u[-1] / SAMPLE_STEP)))
    return np.union1d(np.linspace(0.0, u[-1], n_steps + 1), u)


def _fit(u: FloatArray, corners: FloatArray, bound: float) -> UniformSpline:
    """Fit the penalised spline; raise weights where it would leave the bound."""
    samples = _samples(u)
    wanted = np.stack([np.interp(samples, u, corners[:, k]) for k in range(2)], axis=1)
    on = UniformKnots.over(u[-1], SPLINE_STEP)
    n = on.n_coefficients
    basis = on.basis(samples)
    # differences of the coefficients stand for the third derivative (P-spline)
    penalty = SMOOTHING_LENGTH**6 / on.spacing**5 * _third_differences(n)
    spread = int(np.ceil(SPREAD / SAMPLE_STEP))
    weights = np.gradient(samples)  # so that the sum of squares is an integral
    weights[[0, -1]] = ENDS_WEIGHT
    spline = UniformSpline(on, np.zeros((n, 2)))
    tangent = on.basis(samples, 1)
    for _ in range(ROUNDS):
        bands = normal_bands(*basis, weights, n) + penalty
        right = normal_side(*basis, weights[:, None] * wanted, n)
        spline = UniformSpline(on, solveh_banded(bands, right, lower=True))
        excess = (
            _normal_distances(
                combine(*basis, spline.coefficients),
                combine(*tangent, spline.coefficients),
                wanted,
            )
            / bound
        )
        if excess.max() <= 1.0:
            break
        weights *= _largest_near(np.clip(excess, 1.0, 2.0) ** 2, spread)
    return spline


def _third_differences(n: int) -> FloatArray:
    """Return D^T D of the third differences of n coefficients by diagonals, (6, n)."""
    difference = np.array([-1.0, 3.0, -3.0, 1.0])
    bands = np.zeros((DEGREE + 1, n))
    for k in range(difference.size):
        for i in range(difference.size - k):
            bands[k, i : n - 3 + i] += difference[i] * difference[i + k]
    return bands


def _largest_near(values: FloatArray, reach: int) -> FloatArray:
    """Return the largest of each value and `reach` neighbours on both sides."""
    padded = np.pad(values, reach, mode="symmetric")
    windows = np.lib.stride_tricks.sliding_window_view(padded, 2 * reach + 1)
    return np.asarray(windows.max(axis=1))


def _normal_distances(
    points: FloatArray, tangent: FloatArray, wanted: FloatArray
) -> FloatArray:
    """Return the distance of samples from points of a spline, across its direction [m].

    Args:
        points: Of the spline, (n, 2).
        tangent: Its derivative there, (n, 2).
        wanted: Samples, (n, 2).
    """
    gap = wanted - points
    speed = np.maximum(np.hypot(tangent[:, 0], tangent[:, 1]), MIN_SPEED)
    across = gap[:, 1] * tangent[:, 0] - gap[:, 0] * tangent[:, 1]
    return np.asarray(np.abs(across) / speed)


def _arc_lengths(
    spline: UniformSpline, end: float, origin: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Integrate the speed of the spline; (parameters, arc lengths) of nodes."""
    nodes = np.linspace(0.0, end, 2 * (spline.on.knots.size - 1))
    half = 0.5 * nodes[1]
    inner = nodes[:-1, None] + half * (1.0 + _NODES)  # (n_nodes - 1, 5)
    tangent = spline(inner, 1)
    speed = np.hypot(tangent[..., 0], tangent[..., 1])
    if speed.min() < MIN_SPEED:
        place = spline(inner.ravel()[int(np.argmin(speed))]) + origin
        raise InvalidInputError(f"the polyline turns back {_place(place)}")
    return nodes, np.concatenate([[0.0], np.cumsum(half * speed @ _WEIGHTS)])


def _knots(
    spline: UniformSpline, node_u: FloatArray, node_s: FloatArray, origin: FloatArray
) -> Knots:
    """Sample the curvature of the spline evenly in arc length and chain the pieces."""
    tangent = spline(node_u, 1)
    speed = np.hypot(tangent[:, 0], tangent[:, 1])
    sharpest = float(np.abs(_curvature(spline, node_u)).max())
    step = min(KNOT_STEP, MAX_TURN / max(sharpest, 1e-9))
    s = np.linspace(0.0, node_s[-1], max(2, int(np.ceil(node_s[-1] / step)) + 1))
    curvature = _curvature(spline, hermite(node_s, node_u, 1.0 / speed, s))
    if s.size > 2:
        # trapezoids then integrate to the heading of the spline up to order four
        bend = np.diff(curvature, 2)
        curvature = curvature - np.pad(bend, 1, mode="edge") / 12.0
    rate = np.append(np.diff(curvature) / np.diff(s), 0.0)
    x0, y0 = spline(np.zeros(())) + origin
    heading = np.arctan2(tangent[0, 1], tangent[0, 0])
    x, y, headings = place_knots(
        float(x0), float(y0), float(heading), s, curvature, rate
    )
    return Knots(s, x, y, headings, curvature, rate)


def _curvature(spline: UniformSpline, u: FloatArray) -> FloatArray:
    """Return the signed curvature of the spline [1/m]."""
    first, second = spline(u, 1), spline(u, 2)
    cross = first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0]
    return np.asarray(cross / np.hypot(first[:, 0], first[:, 1]) ** 3)


def _distances(knots: Knots, wanted: FloatArray, near: FloatArray) -> FloatArray:
    """Return the distance of points (2, n) from the path [m]."""
    tables = search_tables(knot_table(knots))
    x, y = freeze(wanted[0]), freeze(wanted[1])
    _, l = feet(*tables, x, y, freeze(near), REACH, freeze(()))
    return np.abs(l)


def _place(point: FloatArray) -> str:
    """Name a place, for a message."""
    return f"at ({point[0]:.2f}, {point[1]:.2f})"
