"""Keep the lane behind the vehicle ahead, and wait before a blockage."""

import math
from dataclasses import replace

from planner.lane_change.path import KeptLane, lane_keeping_path
from planner.lane_change.phases.candidate import PlanCandidate, SearchCounts
from planner.lane_change.phases.cycle_view import (
    Situation,
    blockage_ahead,
    place_to_wait,
    speed_task,
)
from planner.lane_change.phases.memory import Phase
from planner.lane_change.settings import LaneChangeSettings
from planner.lane_change.speed.plan import plan_speed, soft_speed


def keep(
    here: Situation,
    lane: int,
    target: int | None,
    settings: LaneChangeSettings,
    counts: SearchCounts,
) -> PlanCandidate | None:
    """Stay in the lane behind the vehicle ahead."""
    scene = here.scene
    kept = KeptLane(scene.lanes.s, scene.lanes.centre[lane])
    path = lane_keeping_path(
        scene.path, scene.ego_frenet, kept, here.total, settings.path
    )
    if path is None:
        return None
    phase = Phase.KEEP if target is None else Phase.SEEK
    why = "" if target is None else "no gap yet"
    rooms = [math.inf]
    blockage = blockage_ahead(here, lane)
    wait = place_to_wait(here, blockage, settings)
    if math.isfinite(wait):
        rooms = [wait, 0.5 * (wait + blockage), math.inf]
    considered = ~here.behind
    for room in rooms:
        task = speed_task(here, room)
        speed = plan_speed(
            path, scene.vehicle, here.ahead, considered, task, settings.speed
        )
        counts.speeds(speed)
        if speed.profile is not None:
            return PlanCandidate(phase, lane, path, speed, why=why)
    return soften(here, PlanCandidate(phase, lane, path, speed, why=why), settings)


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
