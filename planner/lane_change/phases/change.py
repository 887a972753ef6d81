"""Continue a change, wait at the line, or give it up."""

from dataclasses import replace
from functools import partial

import numpy as np

from planner.lane_change.path import lane_keeping_path
from planner.lane_change.phases.candidate import PlanCandidate, SearchCounts
from planner.lane_change.phases.cycle_view import (
    STANDSTILL_ROOM,
    Situation,
    blockage_ahead,
    hard_stop,
    speed_task,
)
from planner.lane_change.phases.gap_safety import gap_is_safe, has_way_out
from planner.lane_change.phases.gentle import is_gentle
from planner.lane_change.phases.keep import keep, soften
from planner.lane_change.phases.memory import (
    COMMIT_MARGIN,
    SETTLED,
    Change,
    Memory,
    Phase,
    about_to_enter,
    lane_line,
    progress_on,
    reaches_over,
    settled,
)
from planner.lane_change.phases.yielding import with_yielding
from planner.lane_change.place_on_path import rest_from
from planner.lane_change.road_edges import worst_reach
from planner.lane_change.settings import LaneChangeSettings, SpeedSettings
from planner.lane_change.speed.passing_orders import Side
from planner.lane_change.speed.plan import SpeedPlan, plan_speed
from planner.lane_change.surroundings import in_lane
from planner.states import BoolArray, Path
from planner.vehicle import body_scale

NEAR = 2.0  # who is farther ahead than it drives in that time is no matter [s]


def go_on(
    here: Situation,
    last: Memory,
    change: Change,
    settings: LaneChangeSettings,
    counts: SearchCounts,
) -> PlanCandidate | None:
    """Continue a change; None if it is over, or has to be given up."""
    scene, committed = here.scene, last.phase is Phase.COMMITTED
    change, place = _followed(here, change, committed, settings)
    rest = rest_from(change.path, place) if place is not None else None
    if place is None or rest is None:
        return None
    if place >= change.end - 1e-6 and settled(scene, change.target):
        return keep(here, change.target, None, settings, counts)
    path = _extended(here, rest, settings)
    followers = here.behind & in_lane(scene, here.bodies, change.lane)
    entering_in = 0.0 if committed else 0.5 * settings.gaps.line_time
    users = with_yielding(
        here, change.target, entering_in + settings.gaps.reaction, settings
    )
    speed = plan_speed(
        path,
        settings.in_change(scene.vehicle),
        users,
        ~followers,
        speed_task(here),
        _margins(here, change, committed, settings),
    )
    counts.speeds(speed)
    entering = about_to_enter(scene, change.lane, change.target, scene.step)
    if not committed and entering:
        if speed.profile is None or not gap_is_safe(here, change.target, settings):
            waiting = PlanCandidate(Phase.CHANGE, change.lane, path, speed, change)
            return _wait_at_line(here, waiting, followers, settings, counts)
        committed = True
    elif not committed and _is_given_up(here, change, speed, settings):
        return None
    phase = Phase.COMMITTED if committed else Phase.CHANGE
    going = Change(change.lane, change.target, change.path, change.end, speed.order)
    candidate = PlanCandidate(phase, change.lane, path, speed, going)
    if speed.profile is not None:
        return candidate
    if not committed:
        return _wait_at_line(here, candidate, followers, settings, counts)
    speed = plan_speed(
        path,
        settings.in_change(scene.vehicle),
        here.ahead,
        ~here.behind,
        speed_task(here),
        _margins(here, change, committed, settings),
    )
    counts.speeds(speed)
    if speed.profile is not None:
        return replace(candidate, speed=speed, why="those behind have to react")
    return soften(here, replace(candidate, speed=speed), settings)


def _margins(
    here: Situation,
    change: Change,
    committed: bool,  # noqa: FBT001 - a state, not a switch
    settings: LaneChangeSettings,
) -> SpeedSettings:
    """Return the gaps that a change keeps.

    Inside the target lane the gap ahead is opened, where anybody is or may come there.
    To who stays in the lane that is left it is not: the ego is about to drive past.
    """
    scene, bodies = here.scene, here.bodies
    stays = in_lane(scene, bodies, change.lane)
    ahead = bodies.s - bodies.half_length - scene.ego_frenet.s
    near = ahead < scene.vehicle.front_reach + NEAR * max(scene.ego.speed, 0.0)
    opened = committed and bool(np.any(near & ~stays & ~here.behind))
    return settings.committed if opened else settings.entering


def _is_given_up(
    here: Situation, change: Change, speed: SpeedPlan, settings: LaneChangeSettings
) -> bool:
    """Tell whether to give up a change to which the ego is not committed.

    Either it could not be taken back a cycle later, or the ego would brake hard to let
    a vehicle go first that it was to go ahead of, with room to stay in its lane.
    """
    if speed.profile is None:
        return False
    blockage = blockage_ahead(here, change.lane)
    if not has_way_out(here, change.target, blockage, speed.profile, 0.0, settings):
        return True
    room = settings.manoeuvre.pull_out_room * body_scale(here.scene.vehicle)
    stop = hard_stop(here, max(here.scene.ego.speed, 0.0), settings)
    return (
        stop < blockage - room
        and lets_go_by(change.order, speed.order)
        and not is_gentle(speed.profile, settings)
    )


def lets_go_by(
    before: tuple[tuple[str, Side], ...], now: tuple[tuple[str, Side], ...]
) -> bool:
    """Tell whether a vehicle goes first now that the ego was to go ahead of."""
    first = dict(before)
    return any(
        side is Side.AFTER and first.get(name) is Side.BEFORE for name, side in now
    )


def _followed(
    here: Situation,
    change: Change,
    committed: bool,  # noqa: FBT001 - a state, not a switch
    settings: LaneChangeSettings,
) -> tuple[Change, float | None]:
    """Return the change to follow, and how far along its path the ego is [m].

    A fallback may have taken the ego off the path. A change that binds it goes on from
    where it is now; any other is given up (None), as where the Frenet frame ends.
    """
    scene = here.scene
    place = progress_on(change.path, scene)
    if place is not None or not committed:
        return change, place
    ego, lanes = scene.ego_frenet, scene.lanes
    centre = float(np.interp(ego.s, lanes.s, lanes.centre[change.target]))
    path = lane_keeping_path(
        scene.path,
        ego,
        centre,
        here.total,
        settings.path,
        partial(worst_reach, scene),
    )
    if path is None:
        return change, None
    off = np.flatnonzero(np.abs(path.l - centre) > SETTLED)
    end = float(path.distance[off[-1]]) if off.size else 0.0
    return replace(change, path=path, end=end), 0.0


def _wait_at_line(
    here: Situation,
    candidate: PlanCandidate,
    followers: BoolArray,
    settings: LaneChangeSettings,
    counts: SearchCounts,
) -> PlanCandidate | None:
    """Stop on the way over, before the body enters the target lane.

    Only where turning back would lead into a blockage; None means to turn back.
    """
    scene, change = here.scene, candidate.change
    blockage = blockage_ahead(here, candidate.lane)
    scale = body_scale(scene.vehicle)
    if change is None or blockage > 2.0 * scale * settings.manoeuvre.pull_out_room:
        return None
    line = lane_line(scene, change.lane, change.target)
    side = 1 if change.target > change.lane else -1
    path = candidate.path
    slope = np.gradient(path.l, path.s)
    over = [
        reaches_over(scene.vehicle, float(l), float(rise), line, side)
        for l, rise in zip(path.l, slope, strict=True)
    ]
    entered = np.flatnonzero(np.array(over) > -COMMIT_MARGIN)
    end = float(path.distance[max(int(entered[0]) - 1, 0)]) if entered.size else 0.0
    task = speed_task(here, max(end, STANDSTILL_ROOM))
    speed = plan_speed(
        path, scene.vehicle, here.ahead, ~followers, task, settings.speed
    )
    counts.speeds(speed)
    if speed.profile is None:
        return None
    return replace(candidate, phase=Phase.CHANGE, speed=speed, why="waits at the line")


def _extended(here: Situation, rest: Path, settings: LaneChangeSettings) -> Path:
    """Lengthen what is left of a change where it has become too short to plan on."""
    scene = here.scene
    need = max(scene.target_speed, scene.ego.speed) * settings.speed.duration
    if rest.distance[-1] >= need:
        return rest
    centre = float(rest.l[-1])
    end = replace(
        scene.ego_frenet, s=float(rest.s[-1]), l=centre, l_prime=0.0, l_second=0.0
    )
    tail = lane_keeping_path(scene.path, end, centre, here.total, settings.path)
    if tail is None:
        return rest
    joined = (
        np.concatenate([getattr(rest, name), getattr(tail, name)[1:]])
        for name in ("x", "y", "heading", "curvature", "s", "l")
    )
    distance = np.concatenate([rest.distance, rest.distance[-1] + tail.distance[1:]])
    return Path(distance, *joined)
