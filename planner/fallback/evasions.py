"""Evasions: within the lane, and out of it as a last resort."""

import math
from collections.abc import Iterator

import numpy as np

from planner.fallback.braking import MIN_PATH_LENGTH, motion_along
from planner.fallback.swerve import has_room_behind, keeps_to_the_road, swerves
from planner.scene import Scene
from planner.states import Trajectory

HOLD_TIME = 2.0  # for which an evasion holds the speed before it brakes [s]
EVASION_TIME = 1.2  # in which an evasion reaches its offset [s]
LINE_GAP = 0.05  # that an evading body keeps from the lines of its lane [m]


def evasions(scene: Scene, horizon: float) -> Iterator[Trajectory]:
    """Yield manoeuvres that stay in the lane, the mildest first.

    The speed is held for `HOLD_TIME`, or braked down within the limits, or with the
    emergency deceleration; the ego stays at its offset or moves to where its body is
    nearer to, or at, either line of its lane. Speed is not held towards a closed stop
    line or the end of the path.

    Args:
        scene: Of this cycle.
        horizon: Of the trajectories [s].
    """
    speeds = _speeds(scene)
    length = max(MIN_PATH_LENGTH, EVASION_TIME * max(scene.ego_frenet.s_dot, 0.0))
    for offset in _offsets_in_lane(scene):
        yield from _motions_to(scene, offset, length, speeds, horizon)


def swerving(scene: Scene, horizon: float) -> Iterator[Trajectory]:
    """Yield the same out of the lane, on a road with several; see `swerves`.

    Args:
        scene: Of this cycle.
        horizon: Of the trajectories [s].
    """
    if scene.lanes.centre.shape[0] > 1:
        speeds = _speeds(scene)
        for offset, length in swerves(scene):
            free = [one for one in speeds if has_room_behind(scene, offset, one[1])]
            for way in _motions_to(scene, offset, length, free, horizon):
                if keeps_to_the_road(scene, way):
                    yield way


def _speeds(scene: Scene) -> list[tuple[float, float]]:
    """Return for how long speed is held [s], and the braking then [m/s²]."""
    limits, ego = scene.vehicle.limits, scene.ego_frenet
    front = ego.s + scene.vehicle.front_reach
    held = ego.s_dot * HOLD_TIME + ego.s_dot**2 / (2.0 * limits.max_deceleration)
    lines = [line for line in scene.stop_lines if line > front]
    may_hold = front + held < min(lines, default=scene.path.length)
    speeds = [(HOLD_TIME, limits.max_deceleration)] if may_hold else []
    return [
        *speeds,
        (0.0, limits.max_deceleration),
        (0.0, limits.emergency_deceleration),
    ]


def _motions_to(
    scene: Scene,
    offset: float,
    length: float,
    speeds: list[tuple[float, float]],
    horizon: float,
) -> Iterator[Trajectory]:
    """Yield the drivable motions to an offset, one for each way to brake."""
    for braking in speeds:
        way = motion_along(scene, offset, braking, length, horizon)
        if way is not None and _is_drivable(scene, way):
            yield way


def _is_drivable(scene: Scene, trajectory: Trajectory) -> bool:
    """Check the limits of curvature and of lateral acceleration."""
    limits, curvature = scene.vehicle.limits, np.abs(trajectory.curvature)
    lateral = curvature * trajectory.speed**2
    start = abs(scene.ego.curvature)  # what is driven now is allowed
    sharpest = max(limits.max_curvature, start)
    hardest = max(limits.max_lateral_acceleration, start * scene.ego.speed**2)
    return bool(curvature.max() <= sharpest + 1e-9 and lateral.max() <= hardest + 1e-9)


def _offsets_in_lane(scene: Scene) -> tuple[float, ...]:
    """Return the present offset and those nearer to the lines of the ego's lane."""
    ego, half = scene.ego_frenet, 0.5 * scene.vehicle.width
    ahead = np.array([ego.s, ego.s + MIN_PATH_LENGTH + EVASION_TIME * ego.s_dot])
    left, right = scene.road.at(ahead)
    high, low = float(left.min()), float(right.max())
    lanes = scene.lanes
    for s in ahead.tolist() if lanes.centre.shape[0] else ():
        centres, widths = lanes.at(s)
        there = np.where(widths > 0.0, np.abs(centres - ego.l), np.inf)
        lane = int(np.argmin(there))
        high = min(high, float(centres[lane] + 0.5 * widths[lane]))
        low = max(low, float(centres[lane] - 0.5 * widths[lane]))
    ends = (high - half - LINE_GAP, low + half + LINE_GAP)
    offsets = [ego.l]
    if ends[0] > ends[1]:
        offsets += [
            ego.l + share * (end - ego.l) for share in (0.5, 1.0) for end in ends
        ]
    return tuple(offset for offset in offsets if math.isfinite(offset))
