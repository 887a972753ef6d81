"""From where on the whole road is open, round what stands in the lane."""

import numpy as np

from planner.lane_change.lane_choice import GONE, BodiesAhead
from planner.lane_change.surroundings import in_lane
from planner.scene import Lanes, Scene
from planner.states import BoolArray, FloatArray

OBSTACLES_FROM = 100.0  # ahead of the ego, obstacles open the whole road [m]
PASSED = 10.0  # behind the ego, an obstacle is passed [m]
QUEUE_GAP = 12.0  # to a vehicle behind which the ego queues [m]


def opens_at(scene: Scene, bodies: BodiesAhead, lane: int) -> float:
    """Find the place from which on the whole road may be used.

    An obstacle in the lane opens the road before it, but not before a line, a junction
    or a turn on the way there: whoever leaves the lane before them, past a queue, is in
    a wrong one there.

    Args:
        scene: Along the reference path, with the lanes that can be followed.
        bodies: On the road.
        lane: That is followed.

    Returns:
        Arc length on the reference path [m]; inf where no obstacle is near.
    """
    n, lanes = bodies.n_static, scene.lanes
    s, l = bodies.s[:n], bodies.l[:n]
    centre = np.interp(s, lanes.s, lanes.centre[lane])
    half = 0.5 * np.interp(s, lanes.s, lanes.width[lane])
    inside = _near(scene, s) & (np.abs(l - centre) < half + bodies.half_width[:n])
    if not inside.any():
        return np.inf
    return barrier_before(scene, float(s[inside].min()))


def obstacle_ahead(scene: Scene, bodies: BodiesAhead) -> bool:
    """Check whether an obstacle is near, on this side of a line, junction or turn."""
    s = bodies.s[: bodies.n_static]
    near = _near(scene, s)
    front = scene.ego_frenet.s + scene.vehicle.front_reach
    return bool(near.any() and barrier_before(scene, float(s[near].min())) <= front)


def queues(scene: Scene, bodies: BodiesAhead, lane: int) -> bool:
    """Check whether what is next ahead in a lane is a vehicle, and near.

    Args:
        scene: Along the reference path.
        bodies: On the road.
        lane: That is followed.
    """
    front = scene.ego_frenet.s + scene.vehicle.front_reach
    ahead = in_lane(scene, bodies, lane) & (bodies.s > front)
    gap = np.where(ahead, bodies.s - bodies.half_length - front, np.inf)
    if not gap.size or gap.min() > QUEUE_GAP:
        return False
    return int(np.argmin(gap)) >= bodies.n_static


def barrier_before(scene: Scene, obstacle: float) -> float:
    """Find the last line, junction or turn between the ego and an obstacle.

    Args:
        scene: With the lanes that can be followed.
        obstacle: Where it is [m].

    Returns:
        Arc length behind which the obstacle may be gone round [m]; -inf without any.
    """
    rear = scene.ego_frenet.s - scene.vehicle.rear_overhang
    places = [
        *scene.stop_lines,
        *(x.exit_s if x.exit_s < obstacle else x.stop_s for x in scene.junctions),
        *_changes_of_lanes(scene.lanes).tolist(),
    ]
    return max((x for x in places if rear < x < obstacle), default=-np.inf)


def _near(scene: Scene, s: FloatArray) -> BoolArray:
    """Check which obstacles are near the ego, (n,)."""
    ego = scene.ego_frenet.s
    return (s > ego - PASSED) & (s < ego + OBSTACLES_FROM)


def _changes_of_lanes(lanes: Lanes) -> FloatArray:
    """Find where a lane ends or begins, (n,) [m]."""
    there = lanes.width > GONE
    changes = np.any(there[:, 1:] != there[:, :-1], axis=0)
    return lanes.s[1:][changes]
