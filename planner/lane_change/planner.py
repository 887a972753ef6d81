"""The lane-change planner: keep, seek a gap, change, and turn back while possible."""

from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from planner.bodies import bodies_of
from planner.contact_check import Contact, contacts_of
from planner.fallback.ladder import HARD_GAP, ContactCheck, fallback
from planner.interface import Indicator, PlanResult, PlanStats, PlanStatus
from planner.lane_change.lane_choice import lane_at, wanted_lane
from planner.lane_change.phases.candidate import PlanCandidate, SearchCounts
from planner.lane_change.phases.change import go_on
from planner.lane_change.phases.cycle_view import Situation, look
from planner.lane_change.phases.keep import keep
from planner.lane_change.phases.memory import Change, Memory, Phase
from planner.lane_change.phases.seek import seek
from planner.lane_change.phases.seek_gap import seek_gap
from planner.lane_change.settings import GapRule, LaneChangeSettings
from planner.lane_change.speed.drawn_graph import speed_graph_of
from planner.path_velocity import trajectory_on
from planner.scene import Scene
from planner.scene_checks import invalid
from planner.states import Trajectory

FOR_A_WALL = 0.05  # advantage of a lane without what stands in the own one [m/s]
AS_GOOD_AS_STANDING = 0.5  # driven in the whole duration of a plan [m]
PRINTED = (
    "eq. 6.20 as printed minimises the distance and the speed themselves, so that "
    "to stand is cheapest"
)


@dataclass(frozen=True, slots=True, eq=False)
class LaneChangePlanner:
    """Plan path and speed of keeping and changing lanes; `plan` is pure."""

    settings: LaneChangeSettings

    def plan(self, scene: Scene, memory: object) -> PlanResult:
        """Plan one cycle; see `planner.interface.Planner`."""
        reason = invalid(scene)
        if (
            reason is None
            and lane_at(scene.lanes, scene.ego_frenet.s, scene.ego_frenet.l) < 0
        ):
            reason = "the road has no marked lanes"
        if reason is not None:
            stats = PlanStats(reason=reason)
            return PlanResult(PlanStatus.INVALID_SCENE, None, memory, stats)
        last = memory if isinstance(memory, Memory) else None
        situation = look(scene, self.settings)
        counts = SearchCounts()
        candidate = _decide(situation, last, self.settings, counts)
        if candidate is None or (
            not self.settings.speed.printed.objective
            and _runs_into_something(situation, candidate)
        ):
            result = _fall_back(situation, last, self.settings, counts)
            change = None if last is None else last.change  # it is still wanted
            indicator = _indicator(situation, change, last, self.settings)
            return replace(result, indicator=indicator)
        return _result(situation, candidate, last, self.settings, counts)


def _decide(
    here: Situation,
    last: Memory | None,
    settings: LaneChangeSettings,
    counts: SearchCounts,
) -> PlanCandidate | None:
    """Try the phases in turn; None if nothing can be planned."""
    bound = settings.manoeuvre.consistent or (
        last is not None and last.phase is Phase.COMMITTED
    )
    if last is not None and last.change is not None and bound:
        candidate = go_on(here, last, last.change, settings, counts)
        if candidate is not None:
            return candidate
        if last.phase is Phase.COMMITTED:
            return None
    lane, target, least = _wanted(here, last, settings)
    if target is not None:
        if settings.gaps.rule is GapRule.HORIZON:
            targets = _targets(here, lane, target, least)
            found = seek_gap(here, last, lane, targets, settings, counts)
        else:
            found = seek(here, last, lane, target, settings, counts)
        if found is not None:
            return found
    return keep(here, lane, target, settings, counts)


def _wanted(
    here: Situation, last: Memory | None, settings: LaneChangeSettings
) -> tuple[int, int | None, float]:
    """Return the lane kept, the one wanted, and the gain that it has to have [m/s]."""
    scene, ego = here.scene, here.scene.ego_frenet
    lane = last.lane if last is not None else lane_at(scene.lanes, ego.s, ego.l)
    if not np.isfinite(here.lane_speeds[min(lane, here.lane_speeds.size - 1)]):
        lane = lane_at(scene.lanes, ego.s, ego.l)
    seeking = last is not None and last.phase is not Phase.KEEP
    gain = 0.3 * settings.manoeuvre.gain if seeking else settings.manoeuvre.gain
    left_hand = scene.lanes.left_hand
    # queues dissolve, walls do not; the earlier it begins, the calmer is the change
    least = FOR_A_WALL if settings.gaps.rule is GapRule.HORIZON else gain
    target = wanted_lane(here.static_lane_speeds, lane, least, left_hand=left_hand)
    if target is None:
        target = wanted_lane(here.lane_speeds, lane, gain, left_hand=left_hand)
        if (
            target is not None
            and here.static_lane_speeds[target] + gain < here.static_lane_speeds[lane]
        ):
            target = None
    return lane, target, least


def _indicator(
    here: Situation,
    change: Change | None,
    last: Memory | None,
    settings: LaneChangeSettings,
) -> Indicator:
    """Return the side of the lane that is being changed to, or else is wanted."""
    if change is not None:
        lane, target = change.lane, change.target
    else:
        lane, wanted, _ = _wanted(here, last, settings)
        if wanted is None:
            return Indicator.NONE
        target = wanted
    centres, _ = here.scene.lanes.at(here.scene.ego_frenet.s)
    return Indicator.LEFT if centres[target] > centres[lane] else Indicator.RIGHT


def _targets(here: Situation, lane: int, target: int, gain: float) -> tuple[int, ...]:
    """Return the neighbour lanes to look for gaps in, the wanted one first.

    Away from a blockage the one on the other side will do as well, if nothing that
    stands makes it worse.
    """
    other = 2 * lane - target
    static = here.static_lane_speeds
    if static[lane] + gain > static[target] or not 0 <= other < static.size:
        return (target,)
    if not np.isfinite(static[other]) or static[other] + gain < static[target]:
        return (target,)
    return target, other


def _result(
    here: Situation,
    candidate: PlanCandidate,
    last: Memory | None,
    settings: LaneChangeSettings,
    counts: SearchCounts,
) -> PlanResult:
    """Turn a candidate into what the caller gets."""
    profile = candidate.speed.profile
    assert profile is not None  # noqa: S101 - candidates without one are never returned
    trajectory = trajectory_on(candidate.path, profile)
    lane = candidate.lane
    memory = Memory(
        candidate.phase,
        lane,
        trajectory,
        candidate.change,
        candidate.start_s,
        0 if last is None else last.cycle + 1,
        candidate.gap,
    )
    stands = float(profile.distance[-1]) < AS_GOOD_AS_STANDING
    stats = PlanStats(
        reason=PRINTED if stands and settings.speed.printed.objective else "",
        candidates=counts.candidates,
        survivors=max(counts.feasible, 1),
        removed=counts.removed,
        costs={"speed": candidate.speed.cost},
        blocker=candidate.speed.ahead,
        explanation=f"{candidate.phase}: {candidate.why}"
        if candidate.why
        else candidate.phase,
    )
    graph = partial(speed_graph_of, candidate.speed, profile)
    return PlanResult(
        PlanStatus.OK,
        trajectory,
        memory,
        stats,
        speed_graph=graph,
        indicator=_indicator(here, candidate.change, last, settings),
    )


def _runs_into_something(here: Situation, candidate: PlanCandidate) -> bool:
    """Check whether a plan that exceeds its bounds uses up more than the margins.

    One that does ends the braking that alone would do, and touches what it brakes for.
    """
    profile = candidate.speed.profile
    if profile is None or candidate.speed.slack <= 0.0:
        return False
    return bool(_contacts(here)(trajectory_on(candidate.path, profile), 0.0))


def _contacts(here: Situation) -> ContactCheck:
    """Return the check of what a trajectory touches."""
    scene, ahead = here.scene, here.scene.vehicles.prediction
    bodies = bodies_of(scene, max(ahead.x.shape[1], 1), ahead.step)

    def contacts(trajectory: Trajectory, margin: float) -> tuple[Contact, ...]:
        return contacts_of(trajectory, scene.vehicle, bodies, here.behind, margin)

    return contacts


def _fall_back(
    here: Situation,
    last: Memory | None,
    settings: LaneChangeSettings,
    counts: SearchCounts,
) -> PlanResult:
    """Fall back where nothing can be planned, with the reason."""
    scene, contacts = here.scene, _contacts(here)

    def blocker(trajectory: Trajectory) -> str | None:
        hits = contacts(trajectory, HARD_GAP)
        return hits[0].id if hits else None

    driven = None if last is None else last.trajectory
    status, trajectory = fallback(
        scene, driven, blocker, settings.speed.duration, contacts
    )
    ego = scene.ego_frenet
    lane = lane_at(scene.lanes, ego.s, ego.l)
    phase, change = Phase.KEEP, None
    if last is not None and last.phase is Phase.COMMITTED:
        phase, change, lane = last.phase, last.change, last.lane
    memory = Memory(
        phase, lane, trajectory, change, None, 0 if last is None else last.cycle + 1
    )
    stats = PlanStats(
        reason=f"no speed plan on any path ({counts.candidates} tried)",
        candidates=counts.candidates,
        removed=counts.removed,
        blocker=blocker(trajectory),
    )
    return PlanResult(status, trajectory, memory, stats)
