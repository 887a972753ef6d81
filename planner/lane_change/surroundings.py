"""Which bodies are in which lane, and which only follow the ego."""

import numpy as np

from planner.lane_change.lane_choice import BodiesAhead
from planner.scene import Scene
from planner.states import BoolArray

BEHIND = 0.5  # a front bumper this far ahead of the ego's rear is beside it [m]


def behind_ego(scene: Scene, bodies: BodiesAhead) -> BoolArray:
    """Mark the bodies that are wholly behind the ego's rear bumper, (n,)."""
    rear = scene.ego_frenet.s - scene.vehicle.rear_overhang
    return bodies.s + bodies.half_length < rear + BEHIND


def in_lane(scene: Scene, bodies: BodiesAhead, index: int) -> BoolArray:
    """Mark the bodies that are in a lane and will be after their lateral motion.

    Args:
        scene: Of this cycle, with lanes.
        bodies: On the road.
        index: Of the lane.

    Returns:
        (n,).
    """
    now, later = _inside(scene, bodies, index)
    return np.asarray(now & later)


def claims_lane(scene: Scene, bodies: BodiesAhead, index: int) -> BoolArray:
    """Mark the bodies that are in a lane or on their way into it, (n,).

    Args:
        scene: Of this cycle, with lanes.
        bodies: On the road.
        index: Of the lane.
    """
    now, later = _inside(scene, bodies, index)
    return np.asarray(now | later)


def _inside(
    scene: Scene, bodies: BodiesAhead, index: int
) -> tuple[BoolArray, BoolArray]:
    """Mark the bodies in a lane: now, and after their lateral motion."""
    lanes = scene.lanes
    centre = np.interp(bodies.s, lanes.s, lanes.centre[index])
    half = 0.5 * np.interp(bodies.s, lanes.s, lanes.width[index])
    now = np.abs(bodies.l - centre) < half
    return np.asarray(now), np.asarray(np.abs(bodies.later_l - centre) < half)
