"""The moment of a metric: the step in which its value occurred."""

from collections.abc import Callable, Mapping
from typing import Final

import numpy as np
from numpy.typing import NDArray

from experiments.metrics import (
    columns,
    computation,
    cut_in,
    efficiency,
    exposure,
    impact,
    right_of_way,
    safety,
)
from experiments.metrics.comfort import (
    front_wheel_angle,
    front_wheel_rate,
    lateral_acceleration,
)
from experiments.metrics.followers import followings
from experiments.metrics.lane_change import blockage, first_change
from experiments.metrics.limits import over_limits
from experiments.metrics.metric import MeasuredEpisode
from experiments.metrics.moments_of_means import (
    MOMENTS_OF_MEANS,
    Finder,
    first,
    largest,
    without_first_cycle,
)
from experiments.metrics.pairs import neighbours
from experiments.metrics.plans import plans_off_the_road
from experiments.metrics.static_bodies import least_static_time_to_collision
from experiments.metrics.tracking import tracked
from experiments.metrics.verdict.braking import braking_verdicts, hardest_braking
from experiments.metrics.verdict.of_trace import verdict_of
from experiments.metrics.verdict.records import Fault
from experiments.trace.schema import Trace
from planner.interface import PlanStatus
from planner.scene import OFF_ROAD_TOLERANCE

ROUNDING = 1e-6  # of times [s]
_BRAKING = ("added_deceleration", "braked_at")  # of a cost: its size and its time


def moments(trace: Trace) -> dict[str, int]:
    """Find the moments of all metrics that have one in the trace.

    Returns:
        Column of the results row -> row of the steps. Those that do not apply have
        none, nor has the distance.
    """
    if len(trace.steps["index"]) == 0:
        return {}
    found = {name: find(trace) for name, find in _MOMENTS.items()}
    return {name: step for name, step in found.items() if step is not None}


def moments_beside_the_trace(episode: MeasuredEpisode) -> dict[str, int]:
    """Find the moments of the metrics that need more than the trace.

    Those against the same seed without the ego, and against the vehicle's limits: they
    are found when an episode is measured, and kept in its manifest.

    Returns:
        Column of the results row -> row of the steps, as `moments`.
    """
    time = np.ma.getdata(episode.trace.steps["time_s"])
    found = {}
    for column, costs, size, at in (
        (columns.BEHIND_DELAY_MAX, episode.costs_behind, "delay", "delayed_at"),
        (columns.BEHIND_DELAY_MEAN, episode.costs_behind, "delay", "delayed_at"),
        (columns.BEHIND_SPEED_LOSS, episode.costs_behind, "speed_loss", "lost_at"),
        (columns.BEHIND_DECELERATION, episode.costs_behind, *_BRAKING),
        (columns.AHEAD_SPEED_LOSS, episode.costs_ahead, "speed_loss", "lost_at"),
        (columns.AHEAD_DECELERATION, episode.costs_ahead, *_BRAKING),
    ):
        if costs:
            worst = max(costs, key=lambda cost: float(getattr(cost, size)))
            row = np.searchsorted(time, getattr(worst, at) - ROUNDING)
            found[column] = min(int(row), time.size - 1)
    over = over_limits(episode.trace, episode.limits)
    if over is not None and over.any():
        found[columns.OVER_LIMITS_STEPS] = int(over.argmax())
    return found


def first_contact(trace: Trace) -> int | None:
    """Find the first step in which the ego touched a body."""
    found = impact.first_contact(trace)
    return None if found is None else found[0]


def least_clearance(trace: Trace) -> int | None:
    """Find the step of `min_clearance_m`: the first contact if there was one."""
    contact = first_contact(trace)
    return largest(-trace.steps["clearance_m"]) if contact is None else contact


def least_time_to_collision(trace: Trace) -> tuple[int, str, float] | None:
    """Find the step of `min_ttc_s`, the vehicle, and the value [s]."""
    pairs = neighbours(trace)
    times = safety.time_to_contact(pairs)
    if times.size == 0 or not times.min() <= safety.TTC_HORIZON:
        return None
    row = int(times.argmin())
    step = _row_of(trace, int(pairs.index[row]))
    return step, str(pairs.id[row]), float(times[row])


def hardest_following(trace: Trace) -> int | None:
    """Find the step in which a follower brakes hardest."""
    best: tuple[float, int] | None = None
    for run in followings(trace):
        at = int(run.acceleration.argmin())
        if best is None or run.acceleration[at] < best[0]:
            best = float(run.acceleration[at]), int(run.index[at])
    return None if best is None else _row_of(trace, best[1])


def _slowest_following(trace: Trace) -> int | None:
    """Find the step in which a follower has lost most speed."""
    best: tuple[float, int] | None = None
    for run in followings(trace):
        lost = np.maximum.accumulate(run.speed) - run.speed
        at = int(lost.argmax())
        if best is None or lost[at] > best[0]:
            best = float(lost[at]), int(run.index[at])
    return None if best is None else _row_of(trace, best[1])


def _least_headway(trace: Trace) -> int | None:
    """Find the step of `min_time_headway_s`."""
    pairs = neighbours(trace)
    gap, leads = safety.leader_gaps(pairs)
    leads &= pairs.ego_speed >= safety.MIN_HEADWAY_SPEED
    if not leads.any():
        return None
    headways = gap[leads] / pairs.ego_speed[leads]
    return _row_of(trace, int(pairs.index[leads][headways.argmin()]))


def _off_road(trace: Trace) -> int | None:
    """Find the first step off the road."""
    beyond = np.ma.filled(trace.steps["off_road_m"], 0.0)
    return first(beyond > OFF_ROAD_TOLERANCE)


def _arrival(trace: Trace) -> int | None:
    """Find the step of arrival."""
    last = len(trace.steps["index"]) - 1
    return last if efficiency.arrived(trace) else None


def _speeding(trace: Trace) -> int | None:
    """Find the step of the largest excess over a limit, if there was any."""
    excess = efficiency.over_the_limit(trace)
    if excess is None or not excess.size or excess.max() <= 0.0:
        return None
    return int(excess.argmax())


def _fallback(trace: Trace) -> int | None:
    """Find the first planning cycle without a fresh plan."""
    statuses = np.ma.filled(trace.steps["plan_status"], PlanStatus.OK)
    return first(statuses != PlanStatus.OK)


def _slowest_cycle(clock: computation.PlanningClock) -> Finder:
    """Return a function that finds the slowest cycle but the first."""

    def find(trace: Trace) -> int | None:
        return largest(without_first_cycle(trace, clock))

    return find


def _deadline_miss(trace: Trace) -> int | None:
    """Find the first cycle, from the second on, that took longer than the step."""
    times = without_first_cycle(trace, computation.PlanningClock.WALL)
    return first(times > computation.TO_MS * float(trace.fact("step_s")))


def _at_blockage(trace: Trace) -> int | None:
    """Find the step in which the front reached the blockage in its lane."""
    wall = blockage(trace)
    if wall is None:
        return None
    half = float(trace.fact("length_m")) / 2.0
    front = np.ma.filled(trace.steps["centre_s_m"], np.nan) + half
    return first(front >= wall)


def _change(end: int) -> Finder:
    """Return a function that finds begin (0) or end (1) of the first lane change."""

    def find(trace: Trace) -> int | None:
        found = first_change(trace)
        return None if found is None else found[end]

    return find


def _at(find: Callable[[Trace], tuple[float, int] | None]) -> Finder:
    """Return a function that finds the step whose index stands beside a value."""

    def row(trace: Trace) -> int | None:
        found = find(trace)
        return None if found is None else _row_of(trace, found[1])

    return row


def _first_of(find: Callable[[Trace], NDArray[np.int64] | None]) -> Finder:
    """Return a function that finds the first of the steps whose indices are listed."""

    def row(trace: Trace) -> int | None:
        found = find(trace)
        return None if found is None or not found.size else _row_of(trace, found[0])

    return row


def _passed_line(trace: Trace) -> int | None:
    """Find the step in which the first closed line was driven over."""
    return next(iter(right_of_way.passed_lines(trace)), None)


def _hindered(trace: Trace) -> int | None:
    """Find the step in which the first vehicle with the right of way braked."""
    return min((right_of_way.hindered(trace) or {}).values(), default=None)


def _hindered_person(trace: Trace) -> int | None:
    """Find the step in which the first person with the right of way stood."""
    return min((right_of_way.hindered_people(trace) or {}).values(), default=None)


def _gave_way(trace: Trace) -> int | None:
    """Find the step in which the ego first stood to give way."""
    return first(right_of_way.gives_way(trace))


def _junction_passage(trace: Trace) -> int | None:
    """Find the step of `junction_pet_s`."""
    found = right_of_way.closest_passage(trace)
    return None if found is None else found[1]


def _cut_in_braking(trace: Trace) -> int | None:
    """Find the step in which a follower of the lane change brakes hardest."""
    found = cut_in.hardest_braking_step(trace)
    return None if found is None else _row_of(trace, found)


def _begun_anew(trace: Trace) -> int | None:
    """Find the first plan that began off the last one."""
    anew = np.flatnonzero(trace.starts["rule"] == "anew")
    return _row_of(trace, trace.starts["index"][anew[0]]) if anew.size else None


def _largest_tracked(key: str) -> Finder:
    """Return a function that finds the largest magnitude of a tracking error."""
    return lambda trace: largest(np.abs(tracked(trace, key)))


def _at_limit(trace: Trace) -> int | None:
    """Find the first step at a limit of steering, drive or grip."""
    return first(tracked(trace, "limited") > 0.0)


def _avoidable(trace: Trace) -> int | None:
    """Find the last step in which the first contact could be avoided."""
    found = verdict_of(trace)
    return found.step if found is not None and found.is_avoidable else None


def _judged(trace: Trace) -> int | None:
    """Find the last step in which it could be avoided, else the contact."""
    avoidable = _avoidable(trace)
    return first_contact(trace) if avoidable is None else avoidable


def _hardest_braking(trace: Trace) -> int | None:
    """Find where the hardest braking of the ego or of a follower begins."""
    found = hardest_braking(trace)
    return None if found is None else found.stretch.first


def _braking_caused(trace: Trace) -> int | None:
    """Find where the first hard braking begins that the ego is at fault for."""
    own = (one for one in braking_verdicts(trace) if one.fault is Fault.EGO)
    return next((one.stretch.first for one in own), None)


def _largest(name: str) -> Finder:
    """Return a function that finds the largest magnitude of a column of the steps."""
    return lambda trace: largest(np.ma.abs(trace.steps[name]))


def _row_of(trace: Trace, index: int) -> int:
    """Return the row of the step with an index."""
    return int(np.searchsorted(np.ma.getdata(trace.steps["index"]), index))


def _least_ttc(trace: Trace) -> int | None:
    """Find the step of `min_ttc_s`."""
    found = least_time_to_collision(trace)
    return None if found is None else found[0]


_MOMENTS: Final[Mapping[str, Finder]] = {
    **MOMENTS_OF_MEANS,
    columns.COLLISIONS: first_contact,
    columns.FIRST_COLLISION_WITH: first_contact,
    columns.IMPACT_SPEED: first_contact,
    columns.VERDICT: _judged,
    columns.AVOIDABLE_UNTIL: _avoidable,
    columns.HARD_BRAKING_VERDICT: _hardest_braking,
    columns.HARD_BRAKINGS_CAUSED: _braking_caused,
    columns.MIN_CLEARANCE: least_clearance,
    columns.MIN_TTC: _least_ttc,
    columns.MIN_TIME_HEADWAY: _least_headway,
    columns.MIN_STATIC_TTC: _at(least_static_time_to_collision),
    columns.TIME_EXPOSED_TTC: _first_of(exposure.exposed_steps),
    columns.MAX_DRAC: _at(exposure.largest_drac),
    columns.MIN_PET: _at(exposure.closest_encroachment),
    columns.OFF_ROAD_PLANS: _first_of(plans_off_the_road),
    columns.OFF_ROAD_STEPS: _off_road,
    columns.TRAVEL_TIME: _arrival,
    columns.MAX_SPEEDING: _speeding,
    columns.LINE_VIOLATIONS: _passed_line,
    columns.ENCROACHMENTS: _hindered,
    columns.PEOPLE_HINDERED: _hindered_person,
    columns.GAVE_WAY: _gave_way,
    columns.JUNCTION_PET: _junction_passage,
    columns.MAX_ACCELERATION: _largest("acceleration_mps2"),
    columns.MAX_LATERAL_ACCELERATION: lambda trace: largest(
        np.abs(lateral_acceleration(trace.steps))
    ),
    columns.MAX_CURVATURE: _largest("curvature_1pm"),
    columns.MAX_FRONT_WHEEL: lambda trace: largest(np.abs(front_wheel_angle(trace))),
    columns.MAX_FRONT_WHEEL_RATE: lambda trace: largest(
        np.abs(front_wheel_rate(trace))
    ),
    columns.MAX_HEADING: _largest("heading_error_rad"),
    columns.FALLBACK_CYCLES: _fallback,
    columns.PLANNING_CPU_MAX: _slowest_cycle(computation.PlanningClock.CPU),
    columns.PLANNING_MAX: _slowest_cycle(computation.PlanningClock.WALL),
    columns.DEADLINE_MISSES: _deadline_miss,
    columns.REAR_MAX_DECELERATION: hardest_following,
    columns.REAR_SPEED_LOSS: _slowest_following,
    columns.LANE_CHANGE_TIME: _change(0),
    columns.LANE_CHANGE_DONE: _change(1),
    columns.BEFORE_BLOCKAGE: _at_blockage,
    columns.CUT_IN_DECELERATION: _cut_in_braking,
    columns.CUT_IN_ADDED: _cut_in_braking,
    columns.TRACKING_LATERAL_MAX: _largest_tracked("lateral_error_m"),
    columns.TRACKING_LONGITUDINAL_MAX: _largest_tracked("behind_m"),
    columns.LIMITED_SHARE: _at_limit,
    columns.GRIP_MAX: _largest_tracked("grip"),
    columns.PLANS_ANEW: _begun_anew,
}
