"""How far the road itself turns aside: its curvature, integrated twice over s."""

import numpy as np

from planner.numerics.compiled import compiled, inlined
from planner.states import FloatArray

AT_THE_POINT = 1e-6  # a disc this near to the ego's point turns with it [m]


@compiled
def road_turn(s: FloatArray, curvature: FloatArray) -> FloatArray:
    """Integrate the curvature twice, linear between points: (K, K', K''), (n, 3).

    K and K' are zero at the first point.

    Args:
        s: Strictly growing, (n,) [m].
        curvature: Of the road there, (n,) [1/m].
    """
    turn = np.zeros((s.size, 3))
    turn[:, 2] = curvature
    for k in range(s.size - 1):
        h, first, last = s[k + 1] - s[k], curvature[k], curvature[k + 1]
        turn[k + 1, 0] = turn[k, 0] + h * (turn[k, 1] + h * (2.0 * first + last) / 6.0)
        turn[k + 1, 1] = turn[k, 1] + 0.5 * h * (first + last)
    return turn


@inlined
def turn_between(place: float, s: FloatArray, turn: FloatArray) -> tuple[float, float]:
    """Read (K, K') at a place; beyond the points the curvature is held.

    Args:
        place: [m].
        s: As in `road_turn`.
        turn: As it makes it.
    """
    k = max(int(np.searchsorted(s, place)) - 1, 0)
    k = min(k, s.size - 1)
    rate = 0.0
    if 0 < k + 1 < s.size and place > s[0]:
        rate = (turn[k + 1, 2] - turn[k, 2]) / (s[k + 1] - s[k])
    x, bend = place - s[k], turn[k, 2]
    slope = turn[k, 1] + x * (bend + 0.5 * x * rate)
    return turn[k, 0] + x * (turn[k, 1] + x * (0.5 * bend + x * rate / 6.0)), slope


@compiled
def turn_to_discs(
    s: FloatArray, offset: FloatArray, road_s: FloatArray, curvature: FloatArray
) -> FloatArray:
    """Compute the curvature of the circle that leads as far aside as the road does.

    From the ego's point at s to a disc d ahead the road leads K(s + d) - K(s) - d K'(s)
    aside, a circle d²/2 times its curvature.

    Args:
        s: Of the ego's point, (n,) [m].
        offset: Of the discs, (n_discs,) [m].
        road_s: Samples of the road, (m,) [m].
        curvature: There, (m,) [1/m].

    Returns:
        (n_discs, n) [1/m].
    """
    turn = road_turn(road_s, curvature)
    out = np.empty((offset.size, s.size))
    for k in range(s.size):
        aside, slope = turn_between(s[k], road_s, turn)
        for d in range(offset.size):
            ahead = offset[d]
            if abs(ahead) < AT_THE_POINT:
                out[d, k] = np.interp(s[k], road_s, curvature)
                continue
            there, _ = turn_between(s[k] + ahead, road_s, turn)
            out[d, k] = 2.0 * (there - aside - ahead * slope) / (ahead * ahead)
    return out
