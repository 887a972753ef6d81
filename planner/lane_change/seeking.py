"""Look for the cheapest change, now or farther on."""

import math

import numpy as np

from planner.lane_change.attempt import Attempt, Tally
from planner.lane_change.manoeuvre import Change, Memory, Phase
from planner.lane_change.path import ChangePath, best_change
from planner.lane_change.settings import LaneChangeSettings
from planner.lane_change.situation import Situation, speed_task
from planner.lane_change.speed import SpeedPlan, plan_speed
from planner.lane_change.surroundings import in_lane

KEPT = 1e-6  # a start this near to that of the last cycle is the same [m]


def seek(
    here: Situation,
    last: Memory | None,
    lane: int,
    target: int,
    settings: LaneChangeSettings,
    tally: Tally,
) -> Attempt | None:
    """Look for the cheapest change, now or farther on."""
    scene = here.scene
    ego = scene.ego_frenet
    centre = float(np.interp(ego.s, scene.lanes.s, scene.lanes.centre[target]))
    best: tuple[float, float, ChangePath, SpeedPlan] | None = None
    followers = in_lane(scene, here.bodies, here.users, lane) & here.behind
    task = speed_task(here)
    for base, start, change in _changes(here, last, centre, settings, tally):
        to_beat = math.inf if best is None else best[0] - base
        if to_beat <= 0.0:  # even a speed plan that costs nothing would be dearer
            continue
        speed = plan_speed(
            change.path,
            scene.vehicle,
            here.users,
            ~followers,
            task,
            settings.speed,
            to_beat,
        )
        tally.speeds(speed)
        if _runs_into_blockage(here, change, speed):
            tally.removed["blockage"] = tally.removed.get("blockage", 0) + 1
        elif speed.profile is not None and speed.cost < to_beat:
            best = base + speed.cost, start, change, speed
    if best is None:
        return None
    _, start, change, speed = best
    if start > 0.0:
        return Attempt(
            Phase.SEEK,
            lane,
            change.path,
            speed,
            start_s=ego.s + start,
            why=f"gap behind {speed.ahead}, ahead of {speed.behind}",
        )
    begun = Change(lane, target, change.path, change.end, speed.order)
    return Attempt(
        Phase.CHANGE,
        lane,
        change.path,
        speed,
        begun,
        why=f"gap behind {speed.ahead}, ahead of {speed.behind}",
    )


def _changes(
    here: Situation,
    last: Memory | None,
    centre: float,
    settings: LaneChangeSettings,
    tally: Tally,
) -> list[tuple[float, float, ChangePath]]:
    """Give (cost without speed, start, path) of the possible changes.

    The one that was the best in the last cycle comes first: it is likely to be so
    again, and a good one makes the others short work. The rest follow by their cost.
    """
    scene = here.scene
    ego = scene.ego_frenet
    changes = []
    for start in _starts(ego.s, last, settings):
        change, refused = best_change(
            scene.path, ego, centre, start, here.total, scene.vehicle, settings.path
        )
        tally.paths(refused)
        if change is not None:
            base = change.cost + settings.manoeuvre.start_weight * start
            changes.append((base, start, change))
    kept = -math.inf if last is None or last.start_s is None else last.start_s - ego.s
    return sorted(changes, key=lambda c: (abs(c[1] - kept) > KEPT, *c[:2]))


def _runs_into_blockage(here: Situation, change: ChangePath, speed: SpeedPlan) -> bool:
    """Tell whether something that stands is on the path before the change is over."""
    graph = speed.graph
    n_static = len(here.scene.obstacles.ids)
    return any(
        index < n_static and float(graph.lower[k, 0]) < change.end
        for k, index in enumerate(graph.index)
    )


def _starts(
    s: float, last: Memory | None, settings: LaneChangeSettings
) -> tuple[float, ...]:
    """Where a change may begin: now, where it was to begin, and one more place.

    The further places take turns, so that a cycle stays short and none is forgotten.
    """
    grid = settings.manoeuvre.starts
    if last is None or last.phase is Phase.KEEP:
        return grid
    turn = grid[1 + last.cycle % max(len(grid) - 1, 1)] if len(grid) > 1 else grid[0]
    kept = () if last.start_s is None else (max(last.start_s - s, 0.0),)
    return tuple(sorted({0.0, *(k for k in kept if k > 1.0), turn}))
