"""Where to swerve out of the lane when neither braking nor the lane itself is free."""

import math
from collections.abc import Iterator

import numpy as np

from planner.scene import Scene
from planner.states import BoolArray, FloatArray, Trajectory

SPACING = 0.7  # between the offsets that are tried [m]
FARTHEST = 4.5  # to either side [m]
EDGE_GAP = 0.2  # that the body keeps from the road's edges [m]
BESIDE_GAP = 0.3  # a vehicle this near the ego's new corridor is in it [m]
REACTION = 1.0  # of the driver who comes from behind there [s]
PEAK = 10.0 / math.sqrt(3.0)  # largest second derivative of a quintic of length 1 [-]
SHARE = 0.8  # of the limits that the mere change of offset takes [-]


def swerves(scene: Scene) -> Iterator[tuple[float, float]]:
    """Yield (offset, length of the way there) beyond the ego's lane, nearest first [m].

    Args:
        scene: Of this cycle.
    """
    ego, half = scene.ego_frenet, 0.5 * scene.vehicle.width
    steps = SPACING * np.arange(1, int(FARTHEST / SPACING) + 1)
    for shift in np.column_stack((steps, -steps)).ravel().tolist():
        offset, length = ego.l + shift, settling_length(scene, shift)
        left, right = scene.road.at(np.linspace(ego.s, ego.s + length, 5))
        high, low = float(left.min()) - half, float(right.max()) + half
        if low + EDGE_GAP <= offset <= high - EDGE_GAP:
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


def keeps_to_the_road(scene: Scene, way: Trajectory) -> bool:
    """Check whether the body's corners stay between the road's edges.

    Args:
        scene: Of this cycle.
        way: To check; in the Frenet frame.
    """
    vehicle, half = scene.vehicle, 0.5 * scene.vehicle.width
    turned = way.heading - scene.path.at(way.s).heading
    across, along = np.sin(turned), np.cos(turned)
    for reach in (vehicle.front_reach, -vehicle.rear_overhang):
        left, right = scene.road.at(way.s + reach * along)
        middle, side = way.l + reach * across, half * np.abs(along)
        if np.any(middle + side > left) or np.any(middle - side < right):
            return False
    return True


def has_room_behind(scene: Scene, offset: float, braking: float) -> bool:
    """Check the gap to those who come from behind in the new corridor.

    They react, and then brake as hard as the ego's limits outside an emergency allow.
    Who drives in the ego's lane follows it as it is.

    Args:
        scene: Of this cycle.
        offset: That the ego moves to [m].
        braking: Of the ego [m/s²].
    """
    users, ahead = scene.vehicles, scene.vehicles.prediction
    if not users.ids:
        return True
    s, l, ego = ahead.s[:, 0], ahead.l[:, 0], scene.ego_frenet
    rear = ego.s - scene.vehicle.rear_overhang
    gap = rear - (s + 0.5 * users.length)
    apart = 0.5 * (scene.vehicle.width + users.width) + BESIDE_GAP
    own = (np.abs(l - ego.l) < apart) & in_one_lane(scene, l)
    low, high = min(ego.l, offset), max(ego.l, offset)
    there = (gap > 0.0) & ~own & (l > low - apart) & (l < high + apart)
    theirs = users.speed**2 / (2.0 * scene.vehicle.limits.max_deceleration)
    ours = scene.ego.speed**2 / (2.0 * braking)
    need = REACTION * users.speed + np.maximum(theirs - ours, 0.0)
    return bool(np.all(~there | (gap > need)))


def in_one_lane(scene: Scene, l: FloatArray) -> BoolArray:
    """Tell who is in the ego's lane: nearest to its middle.

    Args:
        scene: Of this cycle.
        l: Lateral offsets of the vehicles, (n,) [m].
    """
    centres, widths = scene.lanes.at(scene.ego_frenet.s)
    there = centres[widths > 0.0]
    if there.size == 0:
        return np.ones(l.shape, dtype=np.bool_)
    own = np.abs(there - scene.ego_frenet.l).argmin()
    lanes: BoolArray = np.abs(there[:, None] - l).argmin(axis=0) == own
    return lanes
