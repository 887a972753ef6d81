"""The check that a gap is safe, before the body enters the lane."""

import numpy as np

from planner.lane_change.phases.cycle_view import Situation, can_still_wait
from planner.lane_change.settings import LaneChangeSettings
from planner.lane_change.surroundings import claims_lane
from planner.states import FloatArray, SpeedProfile


def gap_is_safe(here: Situation, target: int, settings: LaneChangeSettings) -> bool:
    """Check the gap in the target lane by RSS before the body enters it.

    The driver behind reacts after `reaction` and brakes with `rear_braking`; the ego
    promises to brake no harder than `promised_braking`. To a vehicle ahead the ego
    itself keeps a distance from which it can stop, reacting in one step. Who is still
    on the way into the lane counts, and who is on the way out of it. Without
    `rss_gate` every gap is taken for safe.
    """
    if not settings.manoeuvre.rss_gate:
        return True
    scene, bodies = here.scene, here.bodies
    ego, vehicle = scene.ego_frenet, scene.vehicle
    there = claims_lane(scene, bodies, target)
    limits, speed = vehicle.limits, scene.ego.speed
    rear_gap = ego.s - vehicle.rear_overhang - (bodies.s + bodies.half_length)
    behind = there & (bodies.s < ego.s)
    need = rss_distance(
        np.maximum(bodies.speed, 0.0),
        np.full(bodies.speed.shape, speed),
        settings.rear_reaction,
        settings.manoeuvre.rear_braking,
        settings.promised_braking(limits.max_deceleration),
    )
    if np.any(rear_gap[behind] < need[behind]):
        return False
    front_gap = bodies.s - bodies.half_length - (ego.s + vehicle.front_reach)
    ahead = there & (bodies.s >= ego.s)
    need = rss_distance(
        np.full(bodies.speed.shape, speed),
        np.maximum(bodies.speed, 0.0),
        scene.step,
        limits.emergency_deceleration,
        limits.emergency_deceleration,
    )
    least = settings.speed.along_margin + settings.speed.front_gap
    return not np.any(front_gap[ahead] < np.maximum(need[ahead], least))


def has_way_out(
    here: Situation,
    target: int,
    blockage: float,
    profile: SpeedProfile,
    start: float,
    settings: LaneChangeSettings,
) -> bool:
    """Check whether the ego may go on with a change that does not bind it yet.

    A cycle on it can still stop where it can pull out again; or it changes now, and the
    gap is safe already.

    Args:
        here: Of this cycle.
        target: Lane to change to.
        blockage: Room to what stands in its lane [m], inf if nothing does.
        profile: What it would drive.
        start: How far ahead the change begins, 0 for now [m].
        settings: See there.
    """
    if can_still_wait(here, blockage, profile, settings):
        return True
    return start == 0.0 and gap_is_safe(here, target, settings)


def rss_distance(
    rear: FloatArray,
    front: FloatArray,
    reaction: float,
    rear_braking: float,
    front_braking: float,
) -> FloatArray:
    """Compute the distance that a follower needs [m].

    The follower keeps its speed for `reaction`, then both brake to a stand;
    Shalev-Shwartz et al. 2017, longitudinal.
    """
    need = rear * reaction + rear**2 / (2.0 * rear_braking)
    return np.asarray(np.maximum(need - front**2 / (2.0 * front_braking), 0.0))
