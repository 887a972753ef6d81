"""What one cycle sees, worked out once."""

import math
from dataclasses import dataclass

import numpy as np

from planner.lane_change.lane_choice import BodiesAhead, bodies_on_road, lane_worths
from planner.lane_change.settings import LaneChangeSettings
from planner.lane_change.speed_program import SpeedTask
from planner.lane_change.surroundings import behind_ego, road_users
from planner.scene import Scene, Vehicles
from planner.states import BoolArray, FloatArray

BESIDE_THE_WAY = 60.0  # added to the path that the fastest drive needs [m]
STANDSTILL_ROOM = 0.05  # a program needs some room, also to stand still [m]


@dataclass(frozen=True, slots=True, eq=False)
class Situation:
    """What one cycle sees, worked out once."""

    scene: Scene
    users: Vehicles
    bodies: BodiesAhead
    behind: BoolArray  # wholly behind the ego
    worths: FloatArray  # of the lanes [m/s]
    lasting: FloatArray  # of the lanes, were there only what never moves [m/s]
    total: float  # length of paths [m]


def look(scene: Scene, settings: LaneChangeSettings) -> Situation:
    """Work out what every branch needs."""
    bodies = bodies_on_road(scene)
    fastest = max(scene.target_speed, scene.ego.speed)
    return Situation(
        scene,
        road_users(scene),
        bodies,
        behind_ego(scene, bodies),
        lane_worths(scene, bodies, settings.speed.front_gap),
        lane_worths(scene, bodies.static(), settings.speed.front_gap),
        fastest * settings.speed.duration + BESIDE_THE_WAY,
    )


def speed_task(here: Situation, end: float = math.inf) -> SpeedTask:
    """Say what a speed plan is for; closed stop lines end every path."""
    scene = here.scene
    ego = scene.ego_frenet
    lines = [line for line in scene.stop_lines if line > ego.s]
    if lines:
        end = min(end, min(lines) - ego.s - scene.vehicle.front_reach)
    return SpeedTask(
        scene.ego.speed, scene.ego.acceleration, scene.target_speed, max(end, 0.0)
    )


def room_before(here: Situation, lane: int, room: float) -> tuple[float, float]:
    """How far the ego may go in a lane that something standing blocks.

    It waits where it can still pull out, or as near to that as it can stop.

    Returns:
        (to the place to wait, to the blockage) [m]; inf if there is none.
    """
    scene, bodies = here.scene, here.bodies
    ego, lanes = scene.ego_frenet, scene.lanes
    centre = np.interp(bodies.s, lanes.s, lanes.centre[lane])
    reach = bodies.half_width + 0.5 * scene.vehicle.width
    front = ego.s + scene.vehicle.front_reach
    blocks = (
        (np.abs(bodies.l - centre) < reach)
        & (np.arange(bodies.s.size) < bodies.n_static)
        & (bodies.s > ego.s)
    )
    if not blocks.any():
        return math.inf, math.inf
    wall = float((bodies.s - bodies.half_length)[blocks].min()) - front
    stop = 0.5 * scene.ego.speed + scene.ego.speed**2 / (
        1.4 * scene.vehicle.limits.max_deceleration
    )
    place = max(wall - room, stop + STANDSTILL_ROOM)
    return (place if place < wall else math.inf), wall
