"""The space-aware profiling map; [Thesis] 5.3."""

import math

from planner.numerics.compiled import inlined
from planner.states import FloatArray

MIN_DISTANCE = 1e-3  # eq. 5.3 has a pole where the ego stands on an obstacle [m]


@inlined
def obstacle_influence(
    away: float,
    radius: float,
    ego_radius: float,
    size_weight: float,
    distance_weight: float,
) -> float:
    """Compute the weight of one obstacle for the ego; [Thesis] eq. 5.3, pole cut off.

    Args:
        away: Its centre's distance from the ego [m].
        radius: r_ob [m].
        ego_radius: r_ev [m].
        size_weight: w1.
        distance_weight: w2.

    Returns:
        h_i [m].
    """
    size = size_weight * radius * ego_radius
    return size / (distance_weight * max(away, MIN_DISTANCE))


@inlined
def profile(
    s: float,
    l: float,
    obstacle_s: FloatArray,
    obstacle_l: FloatArray,
    influence: FloatArray,
    position_weight: float,
) -> float:
    """Compute the map at one place; [Thesis] eq. 5.1, 5.2, with n terms.

    Args:
        s: Of the place [m].
        l: Of the place [m].
        obstacle_s: (n,) [m].
        obstacle_l: (n,) [m].
        influence: h_i, (n,) [m].
        position_weight: w0 [1/m].

    Returns:
        f(s, l) >= 0 [m].
    """
    value = 0.0
    for i in range(obstacle_s.size):
        away = math.hypot(s - obstacle_s[i], l - obstacle_l[i])
        value += math.exp(-position_weight * away) * influence[i]
    return value
