"""The lane that the route or the speed asks for."""

from typing import NamedTuple

import numpy as np

from planner.lane_change.lane_choice import (
    GONE,
    BodiesAhead,
    lane_worths,
    wanted_lane,
)
from planner.reference_path.path import ReferencePath
from planner.route.settings import RouteSettings
from planner.scene import Lanes, Scene
from planner.states import BoolArray, FloatArray

ENDS_TOGETHER = 1.0  # lanes whose ends are nearer than this end together [m]


TURN = 0.06  # where the path bends more, only the route's own lane is followed [1/m]
BESIDE = 0.3  # a lane this far from the path is another one [m]
SPACING = 1.0  # at which bends are looked for [m]
CROSSING_TIME = 2.0  # in which a change crosses the line [s]
BASE = 3.0  # over which the bend of a lane is measured, to both sides [m]


class LaneWish(NamedTuple):
    """The next lane over that is wanted, and why."""

    lane: int
    why: str
    forced: bool  # by the route, not by the speed


def lanes_to_follow(scene: Scene) -> Lanes:
    """Return the lanes without those beside the path where they turn.

    In a turn the path is planned for the ego's body; beside it there may be no room, so
    that whoever turns has to be in the route's lane before. Where the path alone winds,
    to swing out before a turn, the lanes beside it go on.
    """
    lanes, path = scene.lanes, scene.path
    if not lanes.width.size:
        return lanes
    grid = np.arange(0.0, path.length, SPACING)
    if not (np.abs(path.at(grid).curvature) > TURN).any():
        return lanes
    at = np.union1d(lanes.s, grid)
    centre = np.array([np.interp(at, lanes.s, row) for row in lanes.centre])
    width = np.array([np.interp(at, lanes.s, row) for row in lanes.width])
    bent = np.abs(path.at(at).curvature) > TURN
    # the path may still be on its way to the middle of its lane where it begins to turn
    nearest = np.where(width > GONE, np.abs(centre), np.inf).argmin(axis=0)
    # ... or on its way over to the lane that leads on, which is the route's
    leads = _leading(at, width)
    moves_over = ~np.take_along_axis(leads, nearest[None], axis=0)[0]
    for lane, (row, beside) in enumerate(zip(width, centre, strict=True)):
        own = np.interp(at, grid, _bend(path, grid, np.interp(grid, at, beside)))
        other = (np.abs(beside) > BESIDE) & (nearest != lane)
        other &= ~(leads[lane] & moves_over)
        row[bent & (own > TURN) & other] = 0.0
    held = np.maximum(np.searchsorted(lanes.s, at, side="right") - 1, 0)
    left, right = lanes.solid_left[:, held], lanes.solid_right[:, held]
    return Lanes(at, centre, width, lanes.left_hand, left, right)


def _leading(s: FloatArray, width: FloatArray) -> BoolArray:
    """Mark where each lane leads on as far as any beside it, (n_lanes, n).

    Args:
        s: Arc lengths of the samples, growing, (n,) [m].
        width: Of the lanes there, (n_lanes, n) [m].
    """
    there = width > GONE
    ends = np.where(there, np.inf, s)
    ends = np.minimum.accumulate(ends[:, ::-1], axis=1)[:, ::-1]
    ends = np.where(there, ends, -np.inf)
    return np.asarray(there & (ends >= ends.max(axis=0) - ENDS_TOGETHER))


def _bend(path: ReferencePath, grid: FloatArray, offset: FloatArray) -> FloatArray:
    """Measure the curvature of a line beside the path over `BASE` to both sides, (n,).

    Args:
        path: Of the scene.
        grid: Arc lengths on it, `SPACING` apart [m].
        offset: Of the line at them [m].
    """
    points = path.at(grid)
    x = points.x - offset * points.sin_heading
    y = points.y + offset * points.cos_heading
    n = min(round(BASE / SPACING), max(grid.size // 2, 1))
    back, here = np.clip(np.arange(grid.size) - n, 0, None), np.arange(grid.size)
    ahead = np.clip(here + n, None, grid.size - 1)
    first = np.arctan2(y - y[back], x - x[back])
    second = np.arctan2(y[ahead] - y, x[ahead] - x)
    turn = np.abs(np.angle(np.exp(1j * (second - first)))) / (n * SPACING)
    inside = (back + n == here) & (ahead - n == here)
    return np.asarray(np.where(inside, turn, 0.0))


def lane_ends(lanes: Lanes, s: float) -> FloatArray:
    """Find up to where each lane leads on from here.

    Args:
        lanes: Of the scene.
        s: Of the ego [m].

    Returns:
        (n_lanes,) [m]; inf for one that leads on to the end of the road, -inf for one
        that is not there.
    """
    ends = np.full(lanes.width.shape[0], np.inf)
    for lane, width in enumerate(lanes.width):
        if np.interp(s, lanes.s, width) <= GONE:
            ends[lane] = -np.inf
            continue
        gone = np.flatnonzero((lanes.s > s) & (width <= GONE))
        if gone.size:
            ends[lane] = lanes.s[gone[0]]
    return ends


def wish(
    scene: Scene,
    bodies: BodiesAhead,
    own: int,
    ends: FloatArray,
    settings: RouteSettings,
) -> LaneWish | None:
    """Choose the lane to change to; None if the own one will do.

    The route comes first: a lane that ends is left in time for one that leads on. For
    the sake of speed a lane is left where no line, junction or end of a lane is near.

    Args:
        scene: Along the reference path.
        bodies: On the road.
        own: Lane that is kept.
        ends: Of `lane_ends`.
        settings: See there.
    """
    front = scene.ego_frenet.s + scene.vehicle.front_reach
    best = leads_farthest(ends, own)
    speed = max(scene.target_speed, scene.ego.speed)
    if best != own:
        count = abs(best - own)
        room = count * (settings.need_time * speed + settings.need_room)
        neighbour = own + (1 if best > own else -1)
        side = neighbour - own
        place = _last_place(scene, own, side, ends)
        left = (ends[own] if place is None else place) - front
        crosses = place is None or _may_cross(scene, own, side)
        if left < room and ends[neighbour] > front and crosses:
            why = f"lane {own} ends in {left:.0f} m"
            return LaneWish(neighbour, why, forced=True)
    if not _has_time(scene, front, settings):
        return None
    worths = lane_worths(scene, bodies, settings.cruise.standstill_gap)
    worths = np.where(ends - front > 2.0 * settings.quiet, worths, -np.inf)
    worths[own] = max(worths[own], 0.0)
    left_hand = scene.lanes.left_hand
    worths = _within_lines(scene, worths, own)
    target = wanted_lane(worths, own, settings.gain, left_hand=left_hand)
    if target is None:
        return None
    faster = worths[target] - worths[own]
    return LaneWish(target, f"lane {target} is {faster:.1f} m/s faster", forced=False)


def _may_cross(scene: Scene, own: int, side: int) -> bool:
    """Check whether the line on a side of a lane may be crossed here."""
    s = scene.ego_frenet.s - scene.vehicle.rear_overhang
    reach = scene.vehicle.length + CROSSING_TIME * max(scene.ego.speed, 0.0)
    return scene.lanes.may_change(own, side, s, s + reach)


def _last_place(scene: Scene, own: int, side: int, ends: FloatArray) -> float | None:
    """Find where a lane that ends may be left for the last time [m].

    Returns:
        None where the line may not be crossed anywhere before that end: who has to
        leave the lane has no choice.
    """
    lanes = scene.lanes
    solid = (lanes.solid_left if side > 0 else lanes.solid_right)[own]
    here = max(int(np.searchsorted(lanes.s, scene.ego_frenet.s, side="right")) - 1, 0)
    samples = np.arange(lanes.s.size)
    ahead = samples[(samples >= here) & ((lanes.s < ends[own]) | (samples == here))]
    dashed = ahead[~solid[ahead]]
    if not dashed.size:
        return None
    if dashed[-1] == ahead[-1]:
        return float(ends[own])
    return float(lanes.s[dashed[-1] + 1])


def _within_lines(scene: Scene, worths: FloatArray, own: int) -> FloatArray:
    """Leave out the lanes beyond a line that may not be crossed here."""
    out = worths.copy()
    if own + 1 < out.size and not _may_cross(scene, own, 1):
        out[own + 1 :] = -np.inf
    if own > 0 and not _may_cross(scene, own, -1):
        out[:own] = -np.inf
    return out


def leads_farthest(ends: FloatArray, own: int) -> int:
    """Return the nearest of the lanes that lead on farthest; `own` if it is one."""
    farthest = ends.max()
    if ends[own] >= farthest - ENDS_TOGETHER:
        return own
    leading = np.flatnonzero(ends >= farthest - ENDS_TOGETHER)
    return int(leading[np.argmin(np.abs(leading - own))])


def _has_time(scene: Scene, front: float, settings: RouteSettings) -> bool:
    """Check that a change is over well before the next closed line or junction."""
    need = settings.settle_room + settings.settle_time * max(scene.ego.speed, 0.0)
    near = [line for line in scene.stop_lines if line > front]
    near += [x.stop_s for x in scene.junctions if x.exit_s > front]
    return all(s - front > need for s in near)
