"""What stands and drives on a road of lanes, as a driver model sees it."""

import math
from dataclasses import dataclass

import numpy as np

from planner.bodies import bodies_of
from planner.scene import Scene
from planner.states import BoolArray, FloatArray

MARKED = 0.5  # a lane narrower than this is none [m]
LANE_END_STEP = 2.0  # at which the lane ahead is looked at [m]
LANE_END_REACH = 600.0  # as far [m]
NARROW = 2.5  # a lane narrower than this ends for a car [m]
SIDE_ROOM = 0.3  # what is passed nearer than this is in the way [m]
BEND_REACH = 80.0  # bends are looked at this far ahead [m]
BEND_STEP = 2.0  # [m]
BEND_SHARE = 0.75  # of the lateral acceleration that is used in them [-]


@dataclass(frozen=True, slots=True, eq=False)
class LaneRoad:
    """Everybody on the road now, in the frame of the path; arrays are (n,)."""

    ids: tuple[str, ...]
    s: FloatArray  # centre [m]
    l: FloatArray
    half_length: FloatArray  # along the road [m]
    half_width: FloatArray
    speed: FloatArray  # along the road, at least 0 [m/s]
    static: BoolArray


def lane_road(scene: Scene) -> LaneRoad:
    """Collect obstacles and vehicles in the frame of the path, obstacles first."""
    table = bodies_of(scene, 1).table
    s, l = table.s[:, 0], table.l[:, 0]
    fixed, moving = scene.obstacles, scene.vehicles
    heading = np.concatenate([fixed.heading, moving.heading])
    turned = heading - scene.path.at(np.where(np.isfinite(s), s, 0.0)).heading
    cos, sin = np.abs(np.cos(turned)), np.abs(np.sin(turned))
    half_length, half_width, radius = table.extents.T
    return LaneRoad(
        (*fixed.ids, *moving.ids),
        s,
        l,
        half_length * cos + half_width * sin + radius,
        half_length * sin + half_width * cos + radius,
        np.maximum(table.speed * np.cos(turned), 0.0),
        np.arange(s.size) < table.n_static,
    )


def wished_speed(scene: Scene, braking: float) -> float:
    """Return the speed on a free road: the target, less before sharp bends [m/s]."""
    ahead = scene.ego_frenet.s + np.arange(0.0, BEND_REACH, BEND_STEP)
    ahead = ahead[ahead <= scene.path.length]
    bend = np.abs(scene.path.at(ahead).curvature) if ahead.size else np.zeros(0)
    most = BEND_SHARE * scene.vehicle.limits.max_lateral_acceleration
    square = most / np.maximum(bend, 1e-6) + 2.0 * braking * (ahead - ahead[:1])
    return float(min(scene.target_speed, np.sqrt(square.min(initial=np.inf))))


def lane_at(scene: Scene, l: float) -> int:
    """Return the lane nearest to an offset, -1 without lanes."""
    centres, widths = scene.lanes.at(scene.ego_frenet.s)
    there = widths > MARKED
    if not there.any():
        return -1
    return int(np.argmin(np.where(there, np.abs(centres - l), np.inf)))


def lane_centre(scene: Scene, lane: int) -> float:
    """Return the offset of a lane's centre here [m]."""
    return float(scene.lanes.at(scene.ego_frenet.s)[0][lane])


def lane_end(scene: Scene, lane: int) -> float:
    """Find where a lane ends ahead [m]; inf if it goes on."""
    here = scene.ego_frenet.s
    s = here + np.arange(0.0, LANE_END_REACH, LANE_END_STEP)
    width = np.interp(s, scene.lanes.s, scene.lanes.width[lane])
    gone = np.flatnonzero(width < NARROW)
    return float(s[max(gone[0] - 1, 0)]) if gone.size else math.inf


def in_lane(scene: Scene, road: LaneRoad, lane: int) -> BoolArray:
    """Mark the bodies that reach into a lane as far as the ego needs it."""
    lanes = scene.lanes
    centre = np.interp(road.s, lanes.s, lanes.centre[lane])
    reach = road.half_width + scene.vehicle.width / 2.0
    return np.asarray(np.abs(road.l - centre) < reach)


def on_way(scene: Scene, road: LaneRoad, offset: FloatArray) -> BoolArray:
    """Mark the bodies that the ego touches at its offset where it reaches them."""
    reach = road.half_width + scene.vehicle.width / 2.0 + SIDE_ROOM
    return np.asarray(np.abs(road.l - offset) < reach)


def beside(scene: Scene, road: LaneRoad, gap: float) -> BoolArray:
    """Mark the bodies alongside the ego, or nearer than `gap` to that."""
    ego, vehicle = scene.ego_frenet, scene.vehicle
    rear, front = ego.s - vehicle.rear_overhang, ego.s + vehicle.front_reach
    behind = road.s + road.half_length < rear - gap
    ahead = road.s - road.half_length > front + gap
    return np.asarray(~behind & ~ahead)
