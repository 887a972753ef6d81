"""Keep the lane behind the vehicle ahead, and wait before a blockage."""

import math
from dataclasses import replace
from functools import partial

from planner.lane_change.gaps.choice import GapPlan
from planner.lane_change.path import KeptLane, lane_keeping_path
from planner.lane_change.phases.candidate import PlanCandidate, SearchCounts
from planner.lane_change.phases.cycle_view import (
    Situation,
    blockage_ahead,
    place_to_wait,
    speed_task,
)
from planner.lane_change.phases.memory import Phase
from planner.lane_change.road_edges import worst_reach
from planner.lane_change.settings import LaneChangeSettings
from planner.lane_change.speed.plan import plan_speed, soft_speed
from planner.lane_change.speed.program import knot_times


def keep(
    here: Situation,
    lane: int,
    target: int | None,
    settings: LaneChangeSettings,
    counts: SearchCounts,
    gap: GapPlan | None = None,
) -> PlanCandidate | None:
    """Stay in the lane behind the vehicle ahead, on the way to a gap if there is one.

    Args:
        here: Of this cycle.
        lane: To stay in.
        target: Lane that the ego wants to go to.
        settings: See there.
        counts: Of the cycle's candidates.
        gap: To adjust the speed to.
    """
    scene = here.scene
    kept = KeptLane(scene.lanes.s, scene.lanes.centre[lane])
    path = lane_keeping_path(
        scene.path,
        scene.ego_frenet,
        kept,
        here.total,
        settings.path,
        partial(worst_reach, scene),
    )
    if path is None:
        return None
    phase = Phase.KEEP if target is None else Phase.SEEK
    why = "" if target is None else str(gap) if gap is not None else "no gap yet"
    name = None if gap is None else gap.name
    wished = None if gap is None else gap.at(knot_times(settings.speed))
    rooms = [math.inf]
    blockage = blockage_ahead(here, lane)
    wait = place_to_wait(here, blockage, settings)
    if math.isfinite(wait):
        rooms = [wait, 0.5 * (wait + blockage), math.inf]
    considered = ~here.behind
    for room in rooms:
        task = speed_task(here, room, wished)
        speed = plan_speed(
            path, scene.vehicle, here.ahead, considered, task, settings.speed
        )
        counts.speeds(speed)
        if speed.profile is not None:
            return PlanCandidate(phase, lane, path, speed, why=why, gap=name)
    held = PlanCandidate(phase, lane, path, speed, why=why, gap=name)
    return soften(here, held, settings)


def soften(
    here: Situation, candidate: PlanCandidate, settings: LaneChangeSettings
) -> PlanCandidate | None:
    """Plan with bounds that may be exceeded; None if even that does not work."""
    speed = soft_speed(
        candidate.path,
        here.scene.vehicle,
        candidate.speed.graph,
        speed_task(here),
        settings.speed,
    )
    if speed.profile is None or speed.slack > settings.speed.along_margin:
        return None
    return replace(
        candidate, speed=speed, why=f"bounds exceeded by {speed.slack:.2f} m"
    )
