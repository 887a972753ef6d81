"""Whether an ego that stands could drive on at all, before its motions are sought."""

import numpy as np

from planner.bodies import Leader
from planner.cruise.feasibility import TOLERANCE
from planner.cruise.sampling.longitudinal import front_limit
from planner.scene import Scene

STAYS = 0.1  # who moves less to the side stays where it is [m]
SLACK = 0.5  # by which a starting body may reach over an edge, at most [m]


def is_held(scene: Scene, leader: Leader | None, least: float) -> bool:
    """Check whether a closed line or one that stands ahead leaves no way of a length.

    Such an ego waits in every cycle; what it holds for sure need not be searched for.

    Args:
        scene: Of this cycle.
        leader: The nearest body ahead in the ego's corridor.
        least: Length of a way that counts [m].
    """
    front = scene.ego_frenet.s + scene.vehicle.front_reach
    if front_limit(scene) + TOLERANCE - front <= least:
        return True
    if leader is None or leader.s.max() - front > least:
        return False
    if not np.ptp(leader.l) < STAYS:  # it may clear the way
        return False
    left, right = scene.road.at(leader.s[:1])
    l, half = float(leader.l[0]), leader.half_width
    free = max(float(left[0]) - l - half, l - half - float(right[0]))
    return bool(np.isfinite(free)) and free < scene.vehicle.width - SLACK
