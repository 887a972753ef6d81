"""Go into the best gap, now or later; the next best is kept ready."""

import math
from collections.abc import Sequence
from functools import partial

import numpy as np

from planner.lane_change.gaps.choice import GapPlan, choose_gaps
from planner.lane_change.path import ChangePath, ChangeTarget, best_change
from planner.lane_change.phases.candidate import PlanCandidate, SearchCounts
from planner.lane_change.phases.cycle_view import Situation, blockage_ahead, speed_task
from planner.lane_change.phases.gap_safety import has_way_out
from planner.lane_change.phases.gentle import is_gentle
from planner.lane_change.phases.keep import keep
from planner.lane_change.phases.memory import Change, Memory, Phase
from planner.lane_change.phases.seek import refusal
from planner.lane_change.phases.yielding import with_yielding
from planner.lane_change.settings import LaneChangeSettings
from planner.lane_change.speed.passing_orders import Side
from planner.lane_change.speed.plan import plan_speed
from planner.lane_change.surroundings import in_lane

# An entry this near is tried: the speed program adjusts what lacks, and others seldom
# do exactly what was rolled out [s]
AT_ONCE = 1.0
# A change into a gap that is as much too short begins: whether it is safe is decided
# where the body is about to enter, a second and a half later [m]
ALMOST = 3.0
TRIED = 2  # gaps whose change is planned in full in one cycle


def seek_gap(
    here: Situation,
    last: Memory | None,
    lane: int,
    targets: Sequence[int],
    settings: LaneChangeSettings,
    counts: SearchCounts,
) -> PlanCandidate | None:
    """Change into the best gap if it is time, else adjust the speed to it.

    Where the change into the best gap cannot be driven yet, the next best takes its
    place if its time has come, too.

    Args:
        here: Of this cycle.
        last: Memory of the last cycle.
        lane: That the ego is in.
        targets: Neighbour lanes to go to.
        settings: See there.
        counts: Of the cycle's candidates.

    Returns:
        None where no gap can be reached.
    """
    kept = None if last is None else last.gap
    plans = choose_gaps(here, lane, targets, kept, settings)
    if not plans:
        return None
    for plan in plans[:TRIED]:
        if plan.entry > AT_ONCE or plan.missing > ALMOST:
            continue
        candidate = _change_into(here, lane, plan, settings, counts)
        if candidate is not None:
            return candidate
    best = plans[0]
    return keep(here, lane, best.target, settings, counts, best)


def _change_into(
    here: Situation,
    lane: int,
    plan: GapPlan,
    settings: LaneChangeSettings,
    counts: SearchCounts,
) -> PlanCandidate | None:
    """Plan a change that begins now; None if it cannot be driven or taken back."""
    scene = here.scene
    change = _path_into(here, plan.target, settings, counts)
    if change is None:
        return None
    followers = in_lane(scene, here.bodies, lane) & here.behind
    begins = settings.gaps.line_time + settings.gaps.reaction
    speed = plan_speed(
        change.path,
        settings.in_change(scene.vehicle),
        with_yielding(here, plan.target, begins, settings),
        ~followers,
        speed_task(here),
        settings.entering,
    )
    counts.speeds(speed)
    if speed.profile is None:
        return None
    if not (is_in_gap(speed.order, plan) or is_gentle(speed.profile, settings)):
        counts.hard_braking()
        return None
    blockage = blockage_ahead(here, lane)
    if not has_way_out(here, plan.target, blockage, speed.profile, 0.0, settings):
        counts.no_way_out()
        return None
    begun = Change(lane, plan.target, change.path, change.end, speed.order)
    return PlanCandidate(
        Phase.CHANGE,
        lane,
        change.path,
        speed,
        begun,
        why=str(plan),
        gap=plan.name,
    )


def is_in_gap(order: tuple[tuple[str, Side], ...], plan: GapPlan) -> bool:
    """Tell whether a passing order leads into a gap, not behind it or ahead of it."""
    sides = dict(order)
    if plan.ahead is not None and sides.get(plan.ahead) is Side.BEFORE:
        return False
    return plan.behind is None or sides.get(plan.behind) is not Side.AFTER


def _path_into(
    here: Situation, target: int, settings: LaneChangeSettings, counts: SearchCounts
) -> ChangePath | None:
    """Find the way over that is the calmest that the room allows."""
    scene = here.scene
    ego, lanes = scene.ego_frenet, scene.lanes
    centre = float(np.interp(ego.s, lanes.s, lanes.centre[target]))
    for shape in (settings.calm_path, settings.path):
        change, refused = best_change(
            scene.path,
            ego,
            ChangeTarget(centre, 0.0, here.total),
            scene.vehicle,
            shape,
            partial(refusal, here, settings.speed),
            math.inf,
        )
        counts.paths(refused)
        if change is not None:
            return change
    return None
