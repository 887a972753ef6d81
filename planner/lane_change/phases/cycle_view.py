"""The view of one cycle, computed once for all phases."""

import math
from dataclasses import dataclass

import numpy as np

from planner.lane_change.lane_choice import (
    BodiesAhead,
    bodies_on_road,
    lane_end,
    lane_worths,
)
from planner.lane_change.settings import LaneChangeSettings
from planner.lane_change.speed.program import SpeedTask, knot_times
from planner.lane_change.speed.st_graph import UsersInTime, in_time
from planner.lane_change.surroundings import behind_ego
from planner.numerics.compiled import compiled
from planner.numerics.interpolation import interpolated
from planner.scene import Scene
from planner.states import BoolArray, FloatArray, SpeedProfile
from planner.vehicle import body_scale

BESIDE_THE_WAY = 60.0  # added to the path that the fastest drive needs [m]
STANDSTILL_ROOM = 0.005  # a program needs some room, also to stand still [m]


@dataclass(frozen=True, slots=True, eq=False)
class Situation:
    """The view of one cycle, computed once for all phases."""

    scene: Scene
    ahead: UsersInTime  # obstacles, then vehicles, at the knots of a speed plan
    standing: UsersInTime  # those of them that never move, at one knot
    bodies: BodiesAhead
    behind: BoolArray  # wholly behind the ego
    lane_speeds: FloatArray  # that each lane allows [m/s]
    static_lane_speeds: FloatArray  # the same, among what never moves [m/s]
    total: float  # length of paths [m]


def look(scene: Scene, settings: LaneChangeSettings) -> Situation:
    """Compute what every phase needs."""
    bodies = bodies_on_road(scene)
    fastest = max(scene.target_speed, scene.ego.speed)
    ahead = in_time(scene.vehicles, knot_times(settings.speed), scene.obstacles)
    return Situation(
        scene,
        ahead,
        ahead.first(bodies.n_static),
        bodies,
        behind_ego(scene, bodies),
        lane_worths(scene, bodies, settings.speed.front_gap),
        lane_worths(scene, bodies.static(), settings.speed.front_gap),
        fastest * settings.speed.duration + BESIDE_THE_WAY,
    )


def speed_task(
    here: Situation, end: float = math.inf, wished: FloatArray | None = None
) -> SpeedTask:
    """Return the task of a speed plan; closed stop lines end every path.

    Args:
        here: Of this cycle.
        end: Not to be passed by the rear axle [m].
        wished: Distance and speed to follow at the knots, (2, n_knots); the target
            speed if None.
    """
    scene = here.scene
    ego = scene.ego_frenet
    lines = [line for line in scene.stop_lines if line > ego.s]
    if lines:
        end = min(end, min(lines) - ego.s - scene.vehicle.front_reach)
    return SpeedTask(
        scene.ego.speed,
        scene.ego.acceleration,
        scene.target_speed,
        max(end, 0.0),
        wished,
    )


def blockage_ahead(here: Situation, lane: int) -> float:
    """Compute the room to what stands in a lane, or to its end [m]; inf without."""
    scene, bodies = here.scene, here.bodies
    end = lane_end(scene.lanes, lane, scene.ego_frenet.s, here.total)
    first = _first_blockage(here, lane)
    if first >= 0:
        end = min(float(bodies.s[first] - bodies.half_length[first]), end)
    return end - scene.ego_frenet.s - scene.vehicle.front_reach


def _first_blockage(here: Situation, lane: int) -> int:
    """Return which of the bodies is the first that stands in a lane ahead, or -1."""
    scene, bodies = here.scene, here.bodies
    lanes_s, n = scene.lanes.s, bodies.n_static
    return int(
        _first(
            (bodies.s[:n], bodies.l[:n], bodies.half_length[:n], bodies.half_width[:n]),
            lanes_s,
            scene.lanes.centre[lane],
            scene.ego_frenet.s,
            0.5 * scene.vehicle.width,
        )
    )


@compiled
def _first(
    bodies: tuple[FloatArray, FloatArray, FloatArray, FloatArray],
    lanes_s: FloatArray,
    centre: FloatArray,
    ego_s: float,
    half_width: float,
) -> int:
    """Find the body of `_first_blockage`.

    Args:
        bodies: s, l, half length and half width of what never moves, (n,) [m].
        lanes_s: Arc lengths of the road, (m,) [m].
        centre: Of the lane there, (m,) [m].
        ego_s: Where the ego is [m].
        half_width: Of the ego [m].
    """
    s, l, long, wide = bodies
    middle = interpolated(np.minimum(s, lanes_s[-1]), lanes_s, centre)
    found, nearest = -1, np.inf
    for b in range(s.size):
        inside = abs(l[b] - middle[b]) < wide[b] + half_width
        if inside and s[b] > ego_s and s[b] - long[b] < nearest:
            found, nearest = b, s[b] - long[b]
    return found


def blockage_end(here: Situation, lane: int) -> float:
    """Find where the first blockage of a lane is over [m]; inf if it never is."""
    bodies, k = here.bodies, _first_blockage(here, lane)
    return math.inf if k < 0 else float(bodies.s[k] + bodies.half_length[k])


def place_to_wait(
    here: Situation, blockage: float, settings: LaneChangeSettings
) -> float:
    """Compute how far the ego may go towards a blockage [m]; inf where it cannot stop.

    It waits where it can still pull out, or as near to that as it can stop. What is
    too near for gentle braking is braked for hard only with half of the room at stake.
    """
    speed = max(here.scene.ego.speed, 0.0)
    braking = here.scene.vehicle.limits.max_deceleration
    gentle = 0.5 * speed + speed**2 / (1.4 * braking)
    hard = hard_stop(here, speed, settings)
    room = settings.manoeuvre.pull_out_room * body_scale(here.scene.vehicle)
    stop = min(gentle, max(blockage - 0.5 * room, hard))
    place = max(blockage - room, stop + STANDSTILL_ROOM)
    return place if place < blockage else math.inf


def can_still_wait(
    here: Situation,
    blockage: float,
    profile: SpeedProfile,
    settings: LaneChangeSettings,
) -> bool:
    """Check whether the ego, a cycle on, can still stop where it can pull out again.

    As long as it has no right to a gap, that is its way out.
    """
    step = here.scene.step
    driven = float(np.interp(step, profile.t, profile.distance))
    speed = float(np.interp(step, profile.t, profile.speed))
    stop = driven + hard_stop(here, speed, settings)
    room = settings.manoeuvre.tight_room * body_scale(here.scene.vehicle)
    return stop <= blockage - room


def hard_stop(here: Situation, speed: float, settings: LaneChangeSettings) -> float:
    """Return the distance that service braking takes [m]."""
    braking = here.scene.vehicle.limits.max_deceleration
    build_up = speed * braking / (2.0 * settings.speed.max_jerk)
    return build_up + speed**2 / (2.0 * braking)
