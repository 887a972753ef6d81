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
from planner.lane_change.standing import first_in_lane, stands_for_good
from planner.lane_change.surroundings import behind_ego
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
    bodies: BodiesAhead
    stands: BoolArray  # never moves, or waits before that: see `stands_for_good`
    standing: UsersInTime  # those that do, at one knot
    behind: BoolArray  # wholly behind the ego
    lane_speeds: FloatArray  # that each lane allows [m/s]
    static_lane_speeds: FloatArray  # the same, among what never moves [m/s]
    total: float  # length of paths [m]


def look(scene: Scene, settings: LaneChangeSettings) -> Situation:
    """Compute what every phase needs."""
    bodies = bodies_on_road(scene)
    fastest = max(scene.target_speed, scene.ego.speed)
    total = fastest * settings.speed.duration + BESIDE_THE_WAY
    ahead = in_time(scene.vehicles, knot_times(settings.speed), scene.obstacles)
    stands = stands_for_good(scene, bodies, total)
    return Situation(
        scene,
        ahead,
        bodies,
        stands,
        ahead.now(np.flatnonzero(stands)),
        behind_ego(scene, bodies),
        lane_worths(scene, bodies, settings.speed.front_gap),
        lane_worths(scene, bodies.static(), settings.speed.front_gap),
        total,
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
    first = first_in_lane(scene, bodies, here.stands, lane)
    if first >= 0:
        end = min(float(bodies.s[first] - bodies.half_length[first]), end)
    return end - scene.ego_frenet.s - scene.vehicle.front_reach


def blockage_end(here: Situation, lane: int) -> float:
    """Find where the first wall of a lane is over [m]; inf if it never is."""
    bodies = here.bodies
    never_moves = np.arange(bodies.s.size) < bodies.n_static
    k = first_in_lane(here.scene, bodies, never_moves, lane)
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
