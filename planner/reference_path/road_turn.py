"""How far the road itself turns aside: its curvature, integrated twice over s.

A body is longer than the place of its axle: its front is in a bend before the axle is.
What counts at a point ahead of the axle is how far the road has led aside by then.
"""

from typing import NamedTuple

import numpy as np

from planner.numerics.compiled import compiled, inlined
from planner.states import FloatArray

AT_THE_POINT = 1e-6  # a point this near to the axle turns with it [m]


class RoadTurn(NamedTuple):
    """A road's curvature, linear between points, and its integrals from the first."""

    s: FloatArray  # strictly growing, (n,) [m]
    turn: FloatArray  # K, K' and the curvature K'' with its rate after s, (n, 4)


@compiled
def road_turn(s: FloatArray, curvature: FloatArray) -> RoadTurn:
    """Integrate the curvature twice, linear between points.

    Args:
        s: Strictly growing, (n,) [m].
        curvature: Of the road there, (n,) [1/m].
    """
    rate = np.zeros(s.size)
    for k in range(s.size - 1):
        rate[k] = (curvature[k + 1] - curvature[k]) / (s[k + 1] - s[k])
    return turn_of_pieces(s, curvature, rate)


@inlined
def turn_of_pieces(s: FloatArray, curvature: FloatArray, rate: FloatArray) -> RoadTurn:
    """Integrate the curvature of pieces, which may jump from one to the next.

    Args:
        s: Where they begin, strictly growing, (n,) [m].
        curvature: There, (n,) [1/m].
        rate: Of each, d(curvature)/ds, (n,) [1/m²].
    """
    turn = np.zeros((s.size, 4))
    for k in range(s.size):
        turn[k, 2], turn[k, 3] = curvature[k], rate[k]
        if k > 0:
            h = s[k] - s[k - 1]
            _, slope, bend, change = turn[k - 1]
            turn[k, 0] = turn[k - 1, 0] + h * (
                slope + h * (0.5 * bend + h * change / 6.0)
            )
            turn[k, 1] = slope + h * (bend + 0.5 * h * change)
    return RoadTurn(s, turn)


@inlined
def turn_between(place: float, road: RoadTurn) -> tuple[float, float, float]:
    """Read (K, K', curvature) at a place; beyond the points the curvature is held."""
    k = max(int(np.searchsorted(road.s, place, side="right")) - 1, 0)
    return turn_on_piece(k, place, road)


@inlined
def turn_on_piece(k: int, place: float, road: RoadTurn) -> tuple[float, float, float]:
    """Read what `turn_between` does on a piece that is known."""
    s, turn = road
    rate = turn[k, 3] if place >= s[0] and k + 1 < s.size else 0.0
    x, bend = place - s[k], turn[k, 2]
    slope = turn[k, 1] + x * (bend + 0.5 * x * rate)
    lead = turn[k, 0] + x * (turn[k, 1] + x * (0.5 * bend + x * rate / 6.0))
    return lead, slope, bend + x * rate


@inlined
def circle_to(place: float, ahead: float, road: RoadTurn) -> tuple[float, float]:
    """Compute the circle that leads as far aside as the road does.

    From s to a point d ahead the road leads K(s + d) - K(s) - d K'(s) aside, a circle
    d²/2 times its curvature; that is 2/d² times the integral of (d - u) kappa(s + u)
    over u from 0 to d.

    Args:
        place: s of the axle [m].
        ahead: d, negative behind the axle [m].
        road: See there.

    Returns:
        (its curvature [1/m], by how much the road has turned at the point [rad]).
    """
    lead, slope, bend = turn_between(place, road)
    if abs(ahead) < AT_THE_POINT:
        return bend, 0.0
    there, turned, _ = turn_between(place + ahead, road)
    aside = there - lead - ahead * slope
    return 2.0 * aside / (ahead * ahead), turned - slope


@compiled
def circles_to(
    s: FloatArray, ahead: FloatArray, road: RoadTurn
) -> tuple[FloatArray, FloatArray]:
    """Compute `circle_to` for many places and points of a body.

    Args:
        s: Of the axle, in about growing order, (n,) [m].
        ahead: Of the points, (n_points,) [m].
        road: See there.

    Returns:
        (curvatures [1/m], turns [rad]), (n_points, n) each.
    """
    bend, turned = np.empty((ahead.size, s.size)), np.empty((ahead.size, s.size))
    for d in range(ahead.size):
        here = there = 0  # pieces, looked for from the ones before
        way = ahead[d]
        near = abs(way) < AT_THE_POINT
        for k in range(s.size):
            here = _piece(here, s[k], road.s)
            lead, slope, curvature = turn_on_piece(here, s[k], road)
            bend[d, k], turned[d, k] = curvature, 0.0
            if not near:
                there = _piece(there, s[k] + way, road.s)
                aside, turn, _ = turn_on_piece(there, s[k] + way, road)
                bend[d, k] = 2.0 * (aside - lead - way * slope) / (way * way)
                turned[d, k] = turn - slope
    return bend, turned


@inlined
def _piece(k: int, place: float, s: FloatArray) -> int:
    """Find the piece that holds a place, from another one near it."""
    while k + 1 < s.size and place >= s[k + 1]:
        k += 1
    while k > 0 and place < s[k]:
        k -= 1
    return k
