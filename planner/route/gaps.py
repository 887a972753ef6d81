"""Gaps in the lane beside: whether one is safe, and how to come beside one."""

from typing import NamedTuple

import numpy as np

from planner.lane_change.lane_choice import BodiesAhead
from planner.lane_change.phases.gap_safety import rss_distance
from planner.lane_change.settings import ManoeuvreSettings
from planner.lane_change.surroundings import in_lane
from planner.scene import Scene

SLOWER = 2.0  # than the vehicle that the ego lets pass [m/s]
SLOWEST = 2.0  # while looking for a gap [m/s]
LEAST_AHEAD = 1.2  # that is left to who is ahead there: the ego keeps it anyway [s]
CALM_GAP = 1.0  # that is left to who is behind, if there is the way for it [s]
WAY_SHARE = 0.7  # of the lane that is left, to get ahead of one who is behind [-]


class Gap(NamedTuple):
    """What is beside the ego in a lane."""

    is_safe: bool
    because_of: int  # the body that is too near, as a row; -1 without one
    is_ahead: bool  # whether that body is ahead of the ego's middle
    lack: float = 0.0  # by which it is too near [m]
    lane: int = -1


def gap_beside(
    scene: Scene, bodies: BodiesAhead, lane: int, settings: ManoeuvreSettings
) -> Gap:
    """Judge the gap beside the ego by RSS.

    The driver behind reacts after `reaction` and brakes with `rear_braking`; the ego
    promises no more than its service braking.

    Args:
        scene: With lanes.
        bodies: On the road.
        lane: The other lane.
        settings: Reaction and braking.
    """
    ego, vehicle, limits = scene.ego_frenet, scene.vehicle, scene.vehicle.limits
    there = in_lane(scene, bodies, lane) & np.isfinite(bodies.s)
    speed = np.full(bodies.speed.shape, max(scene.ego.speed, 0.0))
    other = np.maximum(bodies.speed, 0.0)
    middle = ego.s + 0.5 * (vehicle.front_reach - vehicle.rear_overhang)
    is_ahead = bodies.s >= middle
    rear_gap = ego.s - vehicle.rear_overhang - (bodies.s + bodies.half_length)
    front_gap = bodies.s - bodies.half_length - (ego.s + vehicle.front_reach)
    behind = rss_distance(
        other, speed, settings.reaction, settings.rear_braking, limits.max_deceleration
    )
    hard = limits.emergency_deceleration
    before = rss_distance(speed, other, scene.step, hard, hard)
    lack = np.where(is_ahead, before - front_gap, behind - rear_gap)
    lack = np.where(there, lack, -np.inf)
    if not lack.size or lack.max() <= 0.0:
        return Gap(is_safe=True, because_of=-1, is_ahead=False)
    worst = int(np.argmax(lack))
    return Gap(
        is_safe=False,
        because_of=worst,
        is_ahead=bool(is_ahead[worst]),
        lack=float(lack[worst]),
        lane=lane,
    )


def seeking_speed(
    scene: Scene, bodies: BodiesAhead, gap: Gap, room: float = 0.0
) -> float:
    """Return the speed at which the ego comes beside another gap [m/s].

    Whoever is ahead of its middle is let go; one behind that is slower is left behind,
    if only a little slower where the lane is long enough for it.

    Args:
        scene: Along the reference path.
        bodies: On the road.
        gap: Beside the ego.
        room: To the end of the ego's lane [m].
    """
    if gap.is_safe:
        return scene.target_speed
    other = float(bodies.speed[gap.because_of])
    if not gap.is_ahead and (
        other < scene.ego.speed - SLOWER
        or _gains(scene, bodies, gap.lane, max(gap.lack, 0.0), other, room)
    ):
        return scene.target_speed
    return min(scene.target_speed, max(other - SLOWER, SLOWEST))


def grows_calm(scene: Scene, bodies: BodiesAhead, lane: int, room: float) -> bool:
    """Check whether the gap to who is behind in a lane grows to a calm one in time.

    Args:
        scene: With lanes.
        bodies: On the road.
        lane: The other lane.
        room: To the end of the ego's lane [m].
    """
    ego, vehicle = scene.ego_frenet, scene.vehicle
    rear_gap = ego.s - vehicle.rear_overhang - (bodies.s + bodies.half_length)
    behind = in_lane(scene, bodies, lane) & np.isfinite(bodies.s) & (rear_gap > 0.0)
    if not behind.any():
        return False
    nearest = int(np.argmin(np.where(behind, rear_gap, np.inf)))
    other = max(float(bodies.speed[nearest]), 0.0)
    lack = CALM_GAP * other - float(rear_gap[nearest])
    return lack > 0.0 and _gains(scene, bodies, lane, lack, other, room)


def _gains(
    scene: Scene,
    bodies: BodiesAhead,
    lane: int,
    lack: float,
    other: float,
    room: float,
) -> bool:
    """Check whether the ego gains so much on one who is behind in a lane, in time.

    Its own lane goes on for long enough, and it does not come too near to whoever is
    ahead in the other one.

    Args:
        scene: With lanes.
        bodies: On the road.
        lane: The other lane.
        lack: What it has to gain [m].
        other: Speed of the one behind [m/s].
        room: To the end of the ego's lane [m].
    """
    own = scene.ego.speed
    if own <= other:
        return False
    time = lack / (own - other)
    front = scene.ego_frenet.s + scene.vehicle.front_reach
    gap = bodies.s - bodies.half_length - front
    ahead = in_lane(scene, bodies, lane) & np.isfinite(bodies.s) & (gap > 0.0)
    later = np.where(ahead, gap - np.maximum(own - bodies.speed, 0.0) * time, np.inf)
    in_time = time * max(own, SLOWEST) < WAY_SHARE * room
    return bool(in_time and later.min(initial=np.inf) > LEAST_AHEAD * own)
