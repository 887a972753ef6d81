"""Where to swerve out of the lane when neither braking nor the lane itself is free."""

import math
from collections.abc import Iterator

import numpy as np

from planner.scene import Scene

SPACING = 0.7  # between the offsets that are tried [m]
FARTHEST = 4.5  # to either side [m]
EDGE_GAP = 0.2  # that the body keeps from the road's edges [m]
BESIDE_GAP = 0.3  # a vehicle this near the ego's new corridor is in it [m]
REACTION = 1.0  # of the driver who comes from behind there [s]
PEAK = 10.0 / math.sqrt(3.0)  # largest second derivative of a quintic of length 1 [-]
SHARE = 0.8  # of the limits that the mere change of offset takes [-]


def swerves(scene: Scene) -> Iterator[tuple[float, float]]:
    """Yield (offset, length of the way there) beyond the ego's lane, nearest first [m].

    Only where whoever comes from behind has the room to brake as the ego may have to.

    Args:
        scene: Of this cycle.
    """
    ego, half = scene.ego_frenet, 0.5 * scene.vehicle.width
    steps = SPACING * np.arange(1, int(FARTHEST / SPACING) + 1)
    for shift in np.column_stack((steps, -steps)).ravel().tolist():
        offset, length = ego.l + shift, settling_length(scene, shift)
        left, right = scene.road.at(np.linspace(ego.s, ego.s + length, 5))
        high, low = float(left.min()) - half, float(right.max()) + half
        inside = low + EDGE_GAP <= offset <= high - EDGE_GAP
        if inside and has_room_behind(scene, offset):
            yield offset, length


def settling_length(scene: Scene, shift: float) -> float:
    """Return the way on which the offset changes within the limits [m].

    Args:
        scene: Of this cycle.
        shift: To the side [m].
    """
    limits, speed = scene.vehicle.limits, max(scene.ego.speed, 0.0)
    bend = SHARE * limits.max_curvature
    if speed > 0.0:
        bend = min(bend, SHARE * limits.max_lateral_acceleration / speed**2)
    return math.sqrt(PEAK * abs(shift) / bend)


def has_room_behind(scene: Scene, offset: float) -> bool:
    """Check the gap to those who come from behind in the new corridor.

    They react, and then brake as hard as the ego may within its limits.

    Args:
        scene: Of this cycle.
        offset: That the ego moves to [m].
    """
    users, ahead = scene.vehicles, scene.vehicles.prediction
    if not users.ids:
        return True
    s, l, ego = ahead.s[:, 0], ahead.l[:, 0], scene.ego_frenet
    rear = ego.s - scene.vehicle.rear_overhang
    behind = s + 0.5 * users.length < rear
    apart = 0.5 * (scene.vehicle.width + users.width) + BESIDE_GAP
    low, high = min(ego.l, offset), max(ego.l, offset)
    own = np.abs(l - ego.l) < apart  # they follow the ego as it is
    there = behind & ~own & (l > low - apart) & (l < high + apart)
    speed = users.speed
    braking = 2.0 * scene.vehicle.limits.max_deceleration
    need = REACTION * speed + np.maximum(speed**2 - scene.ego.speed**2, 0.0) / braking
    gap = rear - (s + 0.5 * users.length)
    return bool(np.all(~there | (gap > need)))
