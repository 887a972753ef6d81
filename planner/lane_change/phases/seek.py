"""Look for the cheapest change, now or farther on."""

import math
from dataclasses import dataclass
from functools import partial

import numpy as np

from planner.lane_change.path import ChangePath, ChangeTarget, best_change
from planner.lane_change.phases.candidate import PlanCandidate, SearchCounts
from planner.lane_change.phases.cycle_view import Situation, blockage_ahead, speed_task
from planner.lane_change.phases.gap_safety import has_way_out
from planner.lane_change.phases.memory import Change, Memory, Phase
from planner.lane_change.road_edges import stays_on_road
from planner.lane_change.settings import LaneChangeSettings, SpeedSettings
from planner.lane_change.speed.plan import SpeedPlan, plan_speed
from planner.lane_change.speed.program import SpeedTask, free_cost
from planner.lane_change.speed.st_graph import st_graph
from planner.lane_change.surroundings import in_lane
from planner.states import BoolArray

STARTS_A_CYCLE = 2  # that are planned in full, if one of them can be driven
AT_ONCE = 1.0  # a change that begins within as much begins now [m]


@dataclass(frozen=True, slots=True, eq=False)
class _Search:
    """Data that the changes of one cycle share."""

    here: Situation
    target: int
    centre: float  # of the target lane [m]
    counted: BoolArray  # bodies that a change has to keep clear of
    task: SpeedTask
    blockage: float  # room to what stands in the ego's lane [m]
    least_speed_cost: float  # no speed plan costs less
    settings: LaneChangeSettings
    counts: SearchCounts


@dataclass(frozen=True, slots=True, eq=False)
class _Planned:
    """One change with its speed."""

    cost: float  # of path, speed and putting off
    start: float  # how far ahead it begins [m]
    change: ChangePath
    speed: SpeedPlan


def seek(
    here: Situation,
    last: Memory | None,
    lane: int,
    target: int,
    settings: LaneChangeSettings,
    counts: SearchCounts,
) -> PlanCandidate | None:
    """Look for the cheapest change, now or farther on."""
    scene = here.scene
    ego = scene.ego_frenet
    followers = in_lane(scene, here.bodies, lane) & here.behind
    task = speed_task(here)
    search = _Search(
        here,
        target,
        float(np.interp(ego.s, scene.lanes.s, scene.lanes.centre[target])),
        ~followers,
        task,
        blockage_ahead(here, lane),
        free_cost(task, scene.vehicle, settings.speed),
        settings,
        counts,
    )
    best: _Planned | None = None
    first_look = last is None or last.phase is Phase.KEEP
    most = len(settings.manoeuvre.starts) if first_look else STARTS_A_CYCLE
    for number, start in enumerate(starts(ego.s, last, settings)):
        if best is not None and number >= most:
            break
        best = _planned_from(start, search, best) or best
    if best is None:
        return None
    change, speed, at_once = best.change, best.speed, best.start == 0.0
    begun = Change(lane, target, change.path, change.end, speed.order)
    return PlanCandidate(
        Phase.CHANGE if at_once else Phase.SEEK,
        lane,
        change.path,
        speed,
        begun if at_once else None,
        None if at_once else ego.s + best.start,
        why=_gap_between(speed),
    )


def _gap_between(speed: SpeedPlan) -> str:
    """Name the vehicles of a gap."""
    behind = "nobody" if speed.ahead is None else speed.ahead
    before = "nobody" if speed.behind is None else speed.behind
    return f"gap behind {behind}, ahead of {before}"


def _planned_from(
    start: float, search: _Search, best: _Planned | None
) -> _Planned | None:
    """Plan the change that begins `start` ahead; None unless it is the cheapest yet."""
    here, settings, counts = search.here, search.settings, search.counts
    scene = here.scene
    put_off = settings.manoeuvre.start_weight * start
    cutoff = math.inf if best is None else best.cost - put_off
    change, refused = best_change(
        scene.path,
        scene.ego_frenet,
        ChangeTarget(search.centre, start, here.total),
        scene.vehicle,
        settings.path,
        partial(refusal, here, settings.speed),
        cutoff - search.least_speed_cost,
    )
    counts.paths(refused)
    if change is None:
        return None
    speed = plan_speed(
        change.path,
        scene.vehicle,
        here.ahead,
        search.counted,
        search.task,
        settings.speed,
        cutoff - change.cost,
    )
    counts.speeds(speed)
    if speed.profile is None or speed.cost >= cutoff - change.cost:
        return None
    target, blockage = search.target, search.blockage
    if not has_way_out(here, target, blockage, speed.profile, start, settings):
        counts.no_way_out()
        return None
    return _Planned(put_off + change.cost + speed.cost, start, change, speed)


def refusal(here: Situation, settings: SpeedSettings, change: ChangePath) -> str | None:
    """Say why a change cannot be driven: road's edges, or what stands on its path."""
    end = change.end + here.scene.vehicle.front_reach
    if not stays_on_road(here.scene, change.path, end):
        return "over the road's edge"
    beside_or_ahead = ~here.behind[here.stands]
    if not beside_or_ahead.any():
        return None
    graph = st_graph(
        change.path,
        here.scene.vehicle,
        here.standing,
        beside_or_ahead,
        settings.along_margin,
        settings.across_margin,
    )
    return "blockage" if np.any(graph.lower[:, 0] < change.end) else None


def starts(
    s: float, last: Memory | None, settings: LaneChangeSettings
) -> tuple[float, ...]:
    """Return where a change may begin: all places at first, then by turns.

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
