"""Whether an ego waits, or is stuck or slowed down and has to find another way."""

import numpy as np

from planner.interface import PlanResult, PlanStatus
from planner.lane_change.lane_choice import lane_at
from planner.lane_change.phases.memory import Phase
from planner.route.changes import OVER_ROOM, Look
from planner.route.memory import LaneManoeuvre
from planner.route.open_road import opens_at, queues
from planner.route.settings import RouteSettings
from planner.states import Trajectory

LEAST_DRIVEN = 3.0  # a plan that drives less stands [m]
BEND = 0.06  # curvature in which an ego is caught in a bend [1/m]
SLOWED = 0.9  # share of the wished way below which obstacles slow a plan down
FASTER = 1.05  # times as fast is faster
ALONE = 60.0  # from the ego to any vehicle [m]


def gets_on(result: PlanResult) -> bool:
    """Check whether a plan of the usual kind leads on."""
    way = result.trajectory
    if result.status is not PlanStatus.OK or way is None:
        return False
    return bool(way.s[-1] - way.s[0] >= LEAST_DRIVEN)


def is_held(look: Look) -> bool:
    """Check whether a closed line is so near that no plan could get on."""
    line = min(look.scene.stop_lines, default=np.inf)
    return bool(look.front <= line < look.front + LEAST_DRIVEN)


def has_no_way(look: Look, manoeuvre: LaneManoeuvre, settings: RouteSettings) -> bool:
    """Check whether the ego stands at its lane's end for want of a way over.

    Neither in a queue nor before a closed line.
    """
    scene, target = look.scene, manoeuvre.target
    changes = manoeuvre.phase in (Phase.CHANGE, Phase.COMMITTED)
    if not changes or target is None or look.stood < settings.stuck_after:
        return False
    front = look.front
    held = any(front - 1.0 < x < front + OVER_ROOM for x in scene.stop_lines)
    lanes = (manoeuvre.lane, target)
    queued = any(queues(scene, look.bodies, lane) for lane in lanes)
    ends = look.ends[manoeuvre.lane] - front < OVER_ROOM + LEAST_DRIVEN
    return bool(ends) and not held and not queued


def is_caught(look: Look, lane: int, settings: RouteSettings) -> bool:
    """Check whether the ego has stood in no queue and at no line."""
    scene, front = look.scene, look.front
    if look.stood < settings.stuck_after or queues(scene, look.bodies, lane):
        return False
    return not any(front - 1.0 < x < front + OVER_ROOM for x in scene.stop_lines)


def is_caught_in_bend(look: Look, lane: int, settings: RouteSettings) -> bool:
    """Check whether the ego has stood in a bend, in no queue and at no line."""
    if not is_caught(look, lane, settings):
        return False
    scene = look.scene
    at = np.arange(scene.ego_frenet.s, look.front + OVER_ROOM)
    return bool((np.abs(scene.path.at(at).curvature) > BEND).any())


def is_slowed(look: Look, last: Trajectory) -> bool:
    """Check whether obstacles slow an ego down that is alone among them.

    Args:
        look: This cycle.
        last: What the cycle before has planned.
    """
    scene, bodies = look.scene, look.bodies
    wished = scene.target_speed * (last.t[-1] - last.t[0])
    if last.s[-1] - last.s[0] > SLOWED * wished:
        return False
    moving = bodies.s[bodies.n_static :]
    if (np.abs(moving - scene.ego_frenet.s) < ALONE).any():
        return False
    lane = lane_at(scene.lanes, scene.ego_frenet.s, scene.ego_frenet.l)
    return lane < 0 or opens_at(scene, bodies, lane) < np.inf


def gets_on_faster(way: Trajectory, last: Trajectory, step: float) -> bool:
    """Check whether a plan leads on faster than that of the cycle before.

    Both over the same time.

    Args:
        way: Of this cycle.
        last: Of the cycle before.
        step: Between the two [s].
    """
    time = min(way.t[-1], last.t[-1] - step)
    gained = np.interp(time, way.t, way.s) - way.s[0]
    begin, end = np.interp([step, step + time], last.t, last.s)
    return bool(gained > FASTER * (end - begin))


def is_stuck(look: Look, settings: RouteSettings) -> bool:
    """Check whether the ego stands before obstacles, not in a queue."""
    scene, ego = look.scene, look.scene.ego_frenet
    lane = lane_at(scene.lanes, ego.s, ego.l)
    queued = lane >= 0 and queues(scene, look.bodies, lane)
    return look.stood >= (settings.patience if queued else settings.stuck_after)
