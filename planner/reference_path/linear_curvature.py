"""Pieces of linear curvature: the closed form behind every reference path.

A path is a table of knots, one row each; between two knots the curvature is linear in
arc length (a line, an arc or a clothoid). A point is reached from the knot before it by
a short series instead of trigonometry.

Compiled functions that take arrays and are not inlined have one exit and read the
arrays before they call on: otherwise numba counts references atomically, which costs
more than the sums.
"""

import numpy as np
from numpy.typing import NDArray

from planner.numerics.compiled import compiled, inlined
from planner.states import FloatArray

IndexArray = NDArray[np.int64]

# Columns of the knot table; one row is one cache line.
S, X, Y, COS, SIN, CURVATURE, RATE, HEADING = range(8)

BIN_WIDTH = 0.5  # [m], of the look-up from arc length to piece
MAX_SPACING = 0.5  # [m], between knots
# The series below are cut where they err by less than 2e-13 m up to these bounds.
MAX_TURN = 0.125  # [rad], of one piece by its curvature
MAX_TURN_BY_RATE = 1.0 / 64.0  # [rad], of one piece by its curvature rate


@inlined
def advance(
    curvature: float, rate: float, u: float
) -> tuple[float, float, float, float]:
    """Follow a piece for `u` [m] from the origin, heading along +x.

    The integral of exp(i phi) is taken about the middle of the piece, where only even
    powers are left.

    Args:
        curvature: At the start [1/m].
        rate: d(curvature)/ds [1/m²].
        u: Arc length from the start [m].

    Returns:
        (x [m], y [m], cos, sin) of the end point and its heading.
    """
    a = 0.5 * u
    middle = curvature + rate * a
    q = (middle * a) ** 2
    p = 0.5 * rate * a * a
    pp = p * p
    # sums of u**k / k!, multiplied out: a division costs as much as the whole line
    along = u * (
        1.0
        - q * (1 / 6 - q * (1 / 120 - q * (1 / 5040 - q * (1 / 362880))))
        - pp * (1 / 10 - q * (1 / 28))
    )
    across = u * p * (1 / 3 - q * (1 / 10 - q * (1 / 168)) - pp * (1 / 42))
    cos_mid, sin_mid = rotation(a * (curvature + 0.5 * rate * a))
    cos_end, sin_end = rotation(u * middle)
    return (
        along * cos_mid - across * sin_mid,
        along * sin_mid + across * cos_mid,
        cos_end,
        sin_end,
    )


@inlined
def rotation(angle: float) -> tuple[float, float]:
    """Return (cos, sin) of an angle below 0.15 rad to the last digit, by series."""
    q = angle * angle
    cos = 1.0 - q * (
        1 / 2 - q * (1 / 24 - q * (1 / 720 - q * (1 / 40320 - q * (1 / 3628800))))
    )
    sin = angle * (
        1.0 - q * (1 / 6 - q * (1 / 120 - q * (1 / 5040 - q * (1 / 362880))))
    )
    return cos, sin


@inlined
def piece_index(knots: FloatArray, bins: IndexArray, s: float) -> int:
    """Find the piece of `knots` that holds arc length `s`; the ends are held."""
    last = knots.shape[0] - 2
    # nan must not become an index, hence the order of the comparison
    place = min(s * (1.0 / BIN_WIDTH), bins.size - 1.0) if s > 0.0 else 0.0
    i = bins[int(place)]
    while i < last and s >= knots[i + 1, S]:
        i += 1
    return int(i)


@inlined
def follow(
    x: float,
    y: float,
    cos: float,
    sin: float,
    curvature: float,
    rate: float,
    u: float,
) -> tuple[float, float, float, float]:
    """Follow a piece for `u` [m] from a point and a direction; (x, y, cos, sin)."""
    if curvature == 0.0 and rate == 0.0:
        return x + u * cos, y + u * sin, cos, sin
    return follow_bent(x, y, cos, sin, curvature, rate, u)


@inlined
def follow_bent(
    x: float,
    y: float,
    cos: float,
    sin: float,
    curvature: float,
    rate: float,
    u: float,
) -> tuple[float, float, float, float]:
    """Follow a piece as `follow` does, bit by bit, but without a branch.

    For loops that become vector instructions.
    """
    along, across, cos_turn, sin_turn = advance(curvature, rate, u)
    return (
        x + along * cos - across * sin,
        y + along * sin + across * cos,
        cos * cos_turn - sin * sin_turn,
        sin * cos_turn + cos * sin_turn,
    )


@inlined
def point_at(
    knots: FloatArray, bins: IndexArray, s: float
) -> tuple[float, float, float, float, float, float, float]:
    """Evaluate the path at `s` [m]; beyond both ends it goes straight on.

    Returns:
        (x, y, cos_heading, sin_heading, curvature, curvature_rate, heading).
    """
    i = piece_index(knots, bins, s)
    beyond = s > knots[i + 1, S]
    bent = 0.0 if beyond or s < 0.0 else 1.0
    i += int(beyond)
    u = s - knots[i, S]
    curvature, rate = bent * knots[i, CURVATURE], bent * knots[i, RATE]
    heading = knots[i, HEADING] + u * (curvature + 0.5 * rate * u)
    x, y, cos, sin = knots[i, X], knots[i, Y], knots[i, COS], knots[i, SIN]
    x, y, cos, sin = follow(x, y, cos, sin, curvature, rate, u)
    return x, y, cos, sin, curvature + rate * u, rate, heading


@inlined
def curvature_at(knots: FloatArray, bins: IndexArray, s: float) -> float:
    """Return the curvature at `s` [1/m], as `point_at` does; 0 beyond both ends."""
    i = piece_index(knots, bins, s)
    inside = 0.0 <= s <= knots[i + 1, S]
    curvature = knots[i, CURVATURE] + knots[i, RATE] * (s - knots[i, S])
    return float(curvature) if inside else 0.0


@compiled
def points_at(knots: FloatArray, bins: IndexArray, s: FloatArray) -> FloatArray:
    """Evaluate the path at many arc lengths; rows as in `point_at`, (7, n)."""
    out = np.empty((7, s.size))
    for i in range(s.size):
        x, y, cos, sin, curvature, rate, heading = point_at(knots, bins, s[i])
        out[0, i] = x
        out[1, i] = y
        out[2, i] = cos
        out[3, i] = sin
        out[4, i] = curvature
        out[5, i] = rate
        out[6, i] = heading
    return out


@inlined
def trace(knots: FloatArray, bins: IndexArray, s: FloatArray, out: FloatArray) -> None:
    """Evaluate the path at many arc lengths in about growing order, as `point_at` does.

    Each piece is looked for from the one before, and no function that takes arrays is
    called on the way.

    Args:
        knots: Table of pieces.
        bins: Its look-up.
        s: Arc lengths, (n,) [m].
        out: Filled, (6, >= n): x, y, cos and sin of the heading, curvature and its
            rate.
    """
    last = knots.shape[0] - 2
    i = piece_index(knots, bins, s[0]) if s.size > 0 else 0
    for k in range(s.size):
        at = s[k]
        while i < last and at >= knots[i + 1, S]:
            i += 1
        while i > 0 and at < knots[i, S]:
            i -= 1
        beyond = at > knots[i + 1, S]
        bent = 0.0 if beyond or at < 0.0 else 1.0
        j = i + int(beyond)
        u = at - knots[j, S]
        curvature, rate = bent * knots[j, CURVATURE], bent * knots[j, RATE]
        x, y, cos, sin = knots[j, X], knots[j, Y], knots[j, COS], knots[j, SIN]
        x, y, cos, sin = follow(x, y, cos, sin, curvature, rate, u)
        out[0, k] = x
        out[1, k] = y
        out[2, k] = cos
        out[3, k] = sin
        out[4, k] = curvature + rate * u
        out[5, k] = rate


def index_bins(s: FloatArray) -> IndexArray:
    """Return, for each multiple of `BIN_WIDTH`, the last knot at or before it."""
    edges = np.arange(int(s[-1] / BIN_WIDTH) + 1) * BIN_WIDTH
    bins = np.clip(np.searchsorted(s, edges, side="right") - 1, 0, s.size - 2)
    bins = bins.astype(np.int64)
    bins.setflags(write=False)
    return bins


@compiled
def place_knots(
    x0: float,
    y0: float,
    heading0: float,
    s: FloatArray,
    curvature: FloatArray,
    rate: FloatArray,
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Place the knots of pieces one after the other."""
    x, y, heading = np.empty(s.size), np.empty(s.size), np.empty(s.size)
    x[0], y[0], heading[0] = x0, y0, heading0
    for i in range(s.size - 1):
        u = s[i + 1] - s[i]
        along, across, _, _ = advance(curvature[i], rate[i], u)
        cos, sin = np.cos(heading[i]), np.sin(heading[i])
        x[i + 1] = x[i] + along * cos - across * sin
        y[i + 1] = y[i] + along * sin + across * cos
        heading[i + 1] = heading[i] + u * (curvature[i] + 0.5 * rate[i] * u)
    return x, y, heading
