"""Look for the cheapest change, now or farther on."""

import math
from functools import partial

import numpy as np

from planner.lane_change.path import ChangePath, best_change
from planner.lane_change.phases.candidate import Attempt, Tally
from planner.lane_change.phases.cycle_view import Situation, blockage_ahead, speed_task
from planner.lane_change.phases.gap_safety import has_way_out
from planner.lane_change.phases.memory import Change, Memory, Phase
from planner.lane_change.settings import LaneChangeSettings, SpeedSettings
from planner.lane_change.speed.plan import SpeedPlan, plan_speed
from planner.lane_change.speed.program import free_cost
from planner.lane_change.speed.st_graph import st_graph
from planner.lane_change.surroundings import in_lane

STARTS_A_CYCLE = 2  # that are planned in full, if one of them can be driven
AT_ONCE = 1.0  # a change that begins within as much begins now [m]


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
    followers = in_lane(scene, here.bodies, lane) & here.behind
    task, blockage = speed_task(here), blockage_ahead(here, lane)
    # No speed plan costs less than the one that nobody bounds.
    least = free_cost(task, scene.vehicle, settings.speed)
    is_free = partial(_is_free, here, settings.speed)
    first_look = last is None or last.phase is Phase.KEEP
    enough = len(settings.manoeuvre.starts) if first_look else STARTS_A_CYCLE
    for number, start in enumerate(starts(ego.s, last, settings)):
        if best is not None and number >= enough:
            break
        put_off = settings.manoeuvre.start_weight * start
        to_beat = math.inf if best is None else best[0] - put_off
        change, refused = best_change(
            scene.path,
            ego,
            centre,
            start,
            here.total,
            scene.vehicle,
            settings.path,
            is_free,
            to_beat - least,
        )
        tally.paths(refused)
        if change is None:
            continue
        speed = plan_speed(
            change.path,
            scene.vehicle,
            here.ahead,
            ~followers,
            task,
            settings.speed,
            to_beat - change.cost,
        )
        tally.speeds(speed)
        if speed.profile is None or speed.cost >= to_beat - change.cost:
            continue
        if not has_way_out(here, target, blockage, speed.profile, start, settings):
            tally.removed["no way out"] = tally.removed.get("no way out", 0) + 1
        else:
            best = put_off + change.cost + speed.cost, start, change, speed
    if best is None:
        return None
    _, start, change, speed = best
    at_once = start == 0.0
    begun = Change(lane, target, change.path, change.end, speed.order)
    return Attempt(
        Phase.CHANGE if at_once else Phase.SEEK,
        lane,
        change.path,
        speed,
        begun if at_once else None,
        None if at_once else ego.s + start,
        why=f"gap behind {speed.ahead}, ahead of {speed.behind}",
    )


def _is_free(here: Situation, settings: SpeedSettings, change: ChangePath) -> bool:
    """Tell whether nothing that stands is on the path before the change is over."""
    beside_or_ahead = ~here.behind[: here.bodies.n_static]
    if not beside_or_ahead.any():
        return True
    graph = st_graph(
        change.path,
        here.scene.vehicle,
        here.standing,
        beside_or_ahead,
        settings.along_margin,
        settings.across_margin,
    )
    return not np.any(graph.lower[:, 0] < change.end)


def starts(
    s: float, last: Memory | None, settings: LaneChangeSettings
) -> tuple[float, ...]:
    """Where a change may begin: all places at first, then by turns.

    What was best in the last cycle comes first: it is likely to be so again. Now and
    one of the places farther on take turns to come next, so that a cycle stays short
    and none is forgotten.
    """
    grid = settings.manoeuvre.starts
    if last is None or last.phase is Phase.KEEP:
        return grid
    farther = grid[1 + (last.cycle // 2) % max(len(grid) - 1, 1) :][:1]
    kept = 0.0 if last.start_s is None else max(last.start_s - s, 0.0)
    if kept <= AT_ONCE:
        return 0.0, *farther
    return (kept, 0.0, *farther) if last.cycle % 2 else (kept, *farther, 0.0)
