"""Why the ego stops, in words that a person can use."""

import numpy as np

from planner.dense.field import Cover, FrenetObstacles
from planner.dense.path_ladder import ChosenPath
from planner.dense.speed import DrivablePath
from planner.scene import Scene
from planner.states import Trajectory

STANDS = 0.1  # a plan that stays below this speed does not move off [m/s]
CREEPS = 0.5  # nor does one that drives no farther [m]
AT_THE_LINE = 5.0  # nearer, an ego that stands waits at a stop line [m]


def no_passage(
    chosen: ChosenPath, field: FrenetObstacles, scene: Scene, margin: float
) -> str:
    """Say where the way ends, what is in it, and what room is left beside that.

    Args:
        chosen: Ends before the road does.
        field: Obstacles and road.
        scene: Gives the body.
        margin: The least that is kept to either side [m].
    """
    words = f"found no passage beyond s = {chosen.end_s:.1f} m"
    name = chosen.blocked_by
    if name is None or name not in field.ids:
        return words
    left, right = room_beside(field, name)
    cover = Cover.of(scene.vehicle)
    need = 2.0 * (cover.radius + margin)
    words += f", {name} is in the way: no way round it for a body"
    words += f" {scene.vehicle.length:g} m long that takes {need:.1f} m, {left:.1f} m"
    words += f" are free to its left and {right:.1f} m to its right"
    if max(left, right) >= need:
        words += ", too little to turn in"
    return words


def room_beside(field: FrenetObstacles, name: str) -> tuple[float, float]:
    """Measure the free road to the left and to the right of an obstacle [m].

    What touches it there counts to it; what else overlaps it along the road narrows it.
    """
    own = np.array([other == name for other in field.ids])
    s, l, radius = field.s[own], field.l[own], field.radius[own]
    left_edge, right_edge, _ = field.road_at(s)
    highest, lowest = float((l + radius).max()), float((l - radius).min())
    left, right = float(left_edge.min()), float(right_edge.max())
    reach = radius[:, None] + field.radius[~own]
    beside = (np.abs(s[:, None] - field.s[~own]) < reach).any(axis=0)
    at, size = field.l[~own][beside], field.radius[~own][beside]
    for _ in range(at.size):  # each round joins those that touch what is joined
        joined = (at - size <= highest) & (at + size >= lowest)
        highest = max(highest, float((at + size)[joined].max(initial=-np.inf)))
        lowest = min(lowest, float((at - size)[joined].min(initial=np.inf)))
    left = min(left, float((at - size)[at - size > highest].min(initial=np.inf)))
    right = max(right, float((at + size)[at + size < lowest].max(initial=-np.inf)))
    return max(left - highest, 0.0), max(lowest - right, 0.0)


def no_path(field: FrenetObstacles, scene: Scene) -> str:
    """Say what is nearest to an ego that has no path at all."""
    ego, cover = scene.ego_frenet, Cover.of(scene.vehicle)
    words = "no path from here"
    left, right, _ = field.road_at(np.array([ego.s]))
    half = 0.5 * scene.vehicle.width
    over = ego.l + half > left[0] or ego.l - half < right[0]
    if over or not field.n_obstacles:
        return f"{words}: the body is at l = {ego.l:.1f} m, at or over the road's edge"
    discs = np.array(cover.offsets)
    along = ego.s + discs[:, None] - field.s
    across = ego.l + ego.l_prime * discs[:, None] - field.l
    gaps = np.hypot(along, across) - cover.radius - field.radius
    nearest = int(np.argmin(gaps.min(axis=0)))
    name = field.ids[nearest] if field.ids else "an obstacle"
    gap = max(float(gaps[:, nearest].min()), 0.0)
    return f"{words}: {name} is {gap:.1f} m away, and none turns past it in time"


def no_speed(
    scene: Scene, way: DrivablePath, blockers: list[str | None], ended_by: str | None
) -> str:
    """Say what the ego is too fast for, or too near to.

    Args:
        scene: Of this cycle.
        way: On which no speed was found.
        blockers: The vehicle that bounds it at each knot.
        ended_by: The obstacle that ends it.
    """
    speed, limits = scene.ego.speed, scene.vehicle.limits
    stop = speed**2 / (2.0 * limits.max_deceleration)
    nearest = int(np.argmin(way.ahead))
    room, what = float(way.ahead[nearest]), blockers[nearest] or "a vehicle"
    if way.end < room:
        front = scene.ego_frenet.s + scene.vehicle.front_reach
        lines = [line - front for line in scene.stop_lines]
        at_line = any(abs(line - way.end) < AT_THE_LINE for line in lines)
        line = "the stop line" if at_line else "the end of the way"
        room, what = way.end, ended_by or line
    words = "no speed along the path"
    if room < stop + speed:
        return f"{words}: {max(room, 0.0):.1f} m to {what} at {speed:.1f} m/s"
    return f"{words}: it bends too much for {speed:.1f} m/s"


def standstill(scene: Scene, trajectory: Trajectory, blocker: str | None) -> str:
    """Say why a plan does not move off; empty if it does, or if a body holds it up."""
    driven = float(trajectory.s[-1] - trajectory.s[0])
    if blocker is not None or scene.ego.speed > STANDS or driven > CREEPS:
        return ""
    if scene.target_speed <= STANDS:
        return "the target speed is zero"
    front = scene.ego_frenet.s + scene.vehicle.front_reach
    lines = [line - front for line in scene.stop_lines if line > scene.ego_frenet.s]
    if lines and min(lines) < AT_THE_LINE:
        return f"waits at the stop line, {max(min(lines), 0.0):.1f} m ahead"
    return f"the path has no room to move off at s = {scene.ego_frenet.s:.1f} m"
