"""Which bodies are in which lane, and which only follow the ego."""

import numpy as np

from planner.lane_change.lane_choice import BodiesAhead
from planner.numerics.compiled import compiled
from planner.numerics.interpolation import interpolated
from planner.scene import Scene
from planner.states import BoolArray, FloatArray

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
    return now & later


def claims_lane(scene: Scene, bodies: BodiesAhead, index: int) -> BoolArray:
    """Mark the bodies that are in a lane or on their way into it, (n,).

    Args:
        scene: Of this cycle, with lanes.
        bodies: On the road.
        index: Of the lane.
    """
    now, later = _inside(scene, bodies, index)
    return now | later


def _inside(
    scene: Scene, bodies: BodiesAhead, index: int
) -> tuple[BoolArray, BoolArray]:
    """Mark the bodies in a lane: now, and after their lateral motion."""
    lanes = scene.lanes
    lane = (lanes.s, lanes.centre[index], lanes.width[index])
    marks: tuple[BoolArray, BoolArray] = _marked(
        lane, bodies.s, bodies.l, bodies.later_l
    )
    return marks


@compiled
def _marked(
    lane: tuple[FloatArray, FloatArray, FloatArray],
    s: FloatArray,
    l: FloatArray,
    later_l: FloatArray,
) -> tuple[BoolArray, BoolArray]:
    """Mark the bodies of `_inside`.

    Args:
        lane: Arc lengths of the road, and the lane's centre and width there.
        s: Of the bodies, (n,); inf without a place, which is beyond the last one [m].
        l: Now, (n,) [m].
        later_l: After their lateral motion, (n,) [m].
    """
    lanes_s, centre, width = lane
    at = np.minimum(s, lanes_s[-1])
    middle, wide = (
        interpolated(at, lanes_s, centre),
        interpolated(at, lanes_s, width),
    )
    now, later = np.empty(s.size, np.bool_), np.empty(s.size, np.bool_)
    for b in range(s.size):
        half = 0.5 * wide[b]
        now[b] = abs(l[b] - middle[b]) < half
        later[b] = abs(later_l[b] - middle[b]) < half
    return now, later
