"""The metrics of an episode: every column of the results row, in its order.

The row, the tables on the terminal and on pages, the default metrics of a comparison
and the reference in the documentation are all derived from this list.
`python -m experiments.metrics.catalogue` prints the reference as Markdown.
"""

import math
import sys
from collections.abc import Mapping
from functools import partial
from typing import Final

from experiments.metrics import (
    columns,
    comfort,
    computation,
    cut_in,
    efficiency,
    exposure,
    followers,
    impact,
    lane_change,
    limits,
    plans,
    right_of_way,
    safety,
    static_bodies,
    tracking,
    without_ego,
)
from experiments.metrics.computation import PlanningClock
from experiments.metrics.fleet_catalogue import FLEET_METRICS
from experiments.metrics.metric import Better, CellKind, MeasuredEpisode, Metric
from experiments.metrics.verdict.braking import braking_verdicts, hardest_braking
from experiments.metrics.verdict.records import Fault

LOWER, HIGHER = Better.LOWER, Better.HIGHER
TEXT, WHOLE, FLAG = CellKind.TEXT, CellKind.WHOLE, CellKind.FLAG

_PERCENTILES = {
    50: ("median", columns.PLANNING_CPU_P50, columns.PLANNING_P50),
    95: ("p95", columns.PLANNING_CPU_P95, columns.PLANNING_P95),
    99: ("p99", columns.PLANNING_CPU_P99, columns.PLANNING_P99),
    100: ("max", columns.PLANNING_CPU_MAX, columns.PLANNING_MAX),
}
_SHOWN_PERCENTILES = (50, 99)  # on the terminal and in comparisons


def _planning_times() -> tuple[Metric, ...]:
    """List the percentiles of the planning time, by CPU time and by wall clock.

    Comparisons take CPU time: wall clock depends on what else the machine does.
    """
    return tuple(
        Metric(
            column=cpu if clock is PlanningClock.CPU else wall,
            label=f"{name}, {which}",
            compute=partial(_planning_percentile, percentile=percentile, clock=clock),
            formula=f"{words}, {which}; the first cycle, which loads compiled loops, "
            "is excluded",
            unit="ms",
            digits=2,
            better=LOWER,
            in_terminal=percentile in _SHOWN_PERCENTILES,
            compared=percentile in _SHOWN_PERCENTILES and clock is PlanningClock.CPU,
            timing=True,
            of_planner=True,
        )
        for clock, name, words in (
            (
                PlanningClock.CPU,
                "planning CPU time",
                "CPU time that the planning thread spends on a cycle",
            ),
            (
                PlanningClock.WALL,
                "planning time",
                "wall-clock time of a planning cycle",
            ),
        )
        for percentile, (which, cpu, wall) in _PERCENTILES.items()
    )


def _planning_percentile(
    episode: MeasuredEpisode, percentile: float, clock: PlanningClock
) -> float | None:
    """Return a percentile of the planning time [ms]."""
    return computation.planning_percentile(episode.trace, percentile, clock)


def _avoidable_until(episode: MeasuredEpisode) -> float | None:
    """Return the time until which the first contact could be avoided [s]."""
    found = episode.verdict
    if found is None or not found.is_avoidable:
        return None
    return float(episode.trace.steps["time_s"][found.step])


def _hard_braking(episode: MeasuredEpisode) -> str | None:
    """Return the verdict of the hardest braking."""
    found = hardest_braking(episode.trace)
    return None if found is None else str(found.fault)


def _importance_weight(episode: MeasuredEpisode) -> float | None:
    """Return the likelihood ratio of a run whose errors were drawn more often."""
    found = episode.trace.weights["log_weight"]
    return math.exp(float(found[-1])) if len(found) else None


_IDENTITY = (
    Metric(
        column=columns.SCENARIO,
        label="scenario",
        kind=TEXT,
        compute=lambda e: str(e.trace.fact("scenario")),
        formula="name of the resolved scenario",
        identity=True,
    ),
    Metric(
        column=columns.PLANNER,
        label="planner",
        kind=TEXT,
        compute=lambda e: str(e.trace.fact("planner")),
        formula="name of the planner",
        identity=True,
    ),
    Metric(
        column=columns.SEED,
        label="seed",
        kind=WHOLE,
        compute=lambda e: int(e.trace.fact("seed")),
        formula="seed of traffic and obstacles",
        identity=True,
    ),
    Metric(
        column=columns.STATUS,
        label="status",
        kind=TEXT,
        compute=lambda e: str(e.trace.fact("status")),
        formula="how the episode ended: `arrived`, `blocked`, `timeout`, `collision`, "
        "`off_road`, `no_room`, `planner_failed`, `simulator_failed` or `crashed`",
        identity=True,
    ),
    Metric(
        column=columns.ARRIVED,
        label="arrived",
        kind=FLAG,
        compute=lambda e: efficiency.arrived(e.trace),
        formula="whether the status is `arrived`",
        better=HIGHER,
        identity=True,
        compared=True,
        rate="arrived",
    ),
)
_SAFETY = (
    Metric(
        column=columns.COLLISIONS,
        label="collisions",
        compute=lambda e: len(safety.contacts(e.trace)),
        formula="number of distinct bodies touched by the ego's rectangle, swept "
        "between steps",
        better=LOWER,
        in_terminal=True,
        compared=True,
        rate="collided",
    ),
    Metric(
        column=columns.FIRST_COLLISION_WITH,
        label="first collision with",
        kind=TEXT,
        compute=lambda e: next(iter(safety.contacts(e.trace)), None),
        formula="id of the first body touched",
    ),
    Metric(
        column=columns.VERDICT,
        label="verdict",
        kind=TEXT,
        compute=lambda e: None if e.verdict is None else str(e.verdict.fault),
        formula="whose fault the first contact, or leaving the road, is: `ego at "
        "fault`, `other at fault`, `shared`, `unavoidable` or `artefact of the "
        "simulator`; null without one",
    ),
    Metric(
        column=columns.AVOIDABLE_UNTIL,
        label="avoidable until",
        compute=_avoidable_until,
        formula="time of the last step in which the ego or the other could still avoid "
        "it: the ego by braking with 8 m/s² and swerving on its road with 4 m/s², the "
        "other by braking with 6 m/s²; null without a verdict, and where it could "
        "never be avoided",
        unit="s",
        digits=1,
    ),
    Metric(
        column=columns.HARD_BRAKING_VERDICT,
        label="verdict of hard braking",
        kind=TEXT,
        compute=_hard_braking,
        formula="whose fault the hardest braking of the ego or of a follower is, from "
        "3 m/s² on, in the words of `verdict`; null without one",
    ),
    Metric(
        column=columns.HARD_BRAKINGS_CAUSED,
        label="hard brakings caused",
        kind=WHOLE,
        compute=lambda e: sum(
            one.fault is Fault.EGO for one in braking_verdicts(e.trace)
        ),
        formula="brakings of the ego and of its followers with 3 m/s² or more that the "
        "ego is at fault for",
        better=LOWER,
    ),
    Metric(
        column=columns.IMPACT_SPEED,
        label="impact speed",
        compute=lambda e: impact.impact_speed(e.trace),
        formula="difference of both velocities in the first step in which the ego "
        "touches a body; null without a contact",
        unit="m/s",
        digits=2,
        better=LOWER,
    ),
    Metric(
        column=columns.MIN_CLEARANCE,
        label="min clearance",
        compute=lambda e: safety.min_clearance(e.trace),
        formula="smallest distance between the ego's rectangle and any vehicle or "
        "obstacle over all steps; 0 after a contact; null without bodies",
        unit="m",
        digits=2,
        better=HIGHER,
        in_terminal=True,
        compared=True,
    ),
    Metric(
        column=columns.MIN_TTC,
        label="min TTC",
        compute=lambda e: safety.min_time_to_collision(e.trace),
        formula="smallest time to collision with any vehicle, in the Frenet plane of "
        "the reference path; null above 10 s",
        unit="s",
        digits=1,
        better=HIGHER,
        in_terminal=True,
        compared=True,
    ),
    Metric(
        column=columns.MIN_TIME_HEADWAY,
        label="min time headway",
        compute=lambda e: safety.min_time_headway(e.trace),
        formula="smallest (gap to a leader) / (ego speed) at 1 m/s and above; a leader "
        "travels in the ego's direction, its rear bumper is 0 to 100 m ahead of the "
        "ego's front bumper, and its footprint reaches into the corridor of the ego's "
        "width along the path, where the gap ends",
        unit="s",
        digits=2,
        better=HIGHER,
        in_terminal=True,
    ),
    Metric(
        column=columns.MIN_STATIC_TTC,
        label="min TTC to obstacles",
        compute=lambda e: static_bodies.min_static_time_to_collision(e.trace),
        formula="smallest time to collision with any obstacle, in the same way; null "
        "above 10 s",
        unit="s",
        digits=1,
        better=HIGHER,
    ),
    Metric(
        column=columns.TIME_EXPOSED_TTC,
        label="time with TTC < 3 s",
        compute=lambda e: exposure.time_exposed_ttc(e.trace),
        formula="time exposed: steps in which the TTC to some vehicle is below 3 s, "
        "times the step; null without vehicles",
        unit="s",
        digits=1,
        better=LOWER,
    ),
    Metric(
        column=columns.MAX_DRAC,
        label="max DRAC",
        compute=lambda e: exposure.max_drac(e.trace),
        formula="largest deceleration rate to avoid a crash with a leader, (ṡ - ṡ of "
        "the leader)² / (2 gap) while the gap closes; leader and gap as for the time "
        "headway; null without leaders",
        unit="m/s²",
        digits=2,
        better=LOWER,
    ),
    Metric(
        column=columns.MIN_PET,
        label="min PET",
        compute=lambda e: exposure.min_post_encroachment_time(e.trace),
        formula="post-encroachment time: shortest time from when the ego or a vehicle "
        "leaves a cell of 0.5 m of the road to when the other covers it, anywhere and "
        "in any direction, followers and leaders too; null above 5 s",
        unit="s",
        digits=1,
        better=HIGHER,
    ),
    Metric(
        column=columns.OFF_ROAD_PLANS,
        label="plans off the road",
        compute=lambda e: plans.off_road_plans(e.trace),
        formula="plans in which the ego's body somewhere extends more than 1 cm beyond "
        "the road edge, driven or not; null without plans",
        better=LOWER,
        of_planner=True,
    ),
    Metric(
        column=columns.OFF_ROAD_STEPS,
        label="off-road steps",
        compute=lambda e: safety.off_road_steps(e.trace),
        formula="steps in which the ego's body extended more than 1 cm beyond the "
        "road edge",
        better=LOWER,
        in_terminal=True,
        compared=True,
        rate="off road",
    ),
)
_EFFICIENCY = (
    Metric(
        column=columns.TRAVEL_TIME,
        label="travel time",
        compute=lambda e: efficiency.travel_time(e.trace),
        formula="time from entry to arrival; null unless the ego arrived",
        unit="s",
        digits=1,
        better=LOWER,
        in_terminal=True,
        compared=True,
    ),
    Metric(
        column=columns.DISTANCE,
        label="distance",
        compute=lambda e: efficiency.distance(e.trace),
        formula="path length of the rear axle, Σ ‖p_(k+1) - p_k‖",
        unit="m",
        digits=1,
        in_terminal=True,
    ),
    Metric(
        column=columns.MEAN_SPEED,
        label="mean speed",
        compute=lambda e: efficiency.mean_speed(e.trace),
        formula="distance over duration",
        unit="m/s",
        digits=1,
        better=HIGHER,
        in_terminal=True,
        compared=True,
    ),
    Metric(
        column=columns.SPEEDING,
        label="speeding",
        compute=lambda e: efficiency.speeding_time(e.trace),
        formula="time in which the speed is more than 0.5 m/s over the limit at the "
        "front bumper; null on a road without limits",
        unit="s",
        digits=1,
        better=LOWER,
    ),
    Metric(
        column=columns.MAX_SPEEDING,
        label="max speeding",
        compute=lambda e: efficiency.max_speeding(e.trace),
        formula="largest (speed - limit at the front bumper), at least 0; null on a "
        "road without limits",
        unit="m/s",
        digits=2,
        better=LOWER,
    ),
)
_RULES = (
    Metric(
        column=columns.LINE_VIOLATIONS,
        label="closed lines passed",
        compute=lambda e: right_of_way.line_violations(e.trace),
        formula="stop lines of signals and junctions that the front bumper drove over "
        "while they were closed for the ego",
        of_planner=True,
        unit="",
        digits=0,
        better=LOWER,
        kind=WHOLE,
    ),
    Metric(
        column=columns.ENCROACHMENTS,
        label="hindered others",
        compute=lambda e: right_of_way.encroachments(e.trace),
        formula="vehicles with the right of way that brake by 2 m/s² more than their "
        "own turn asks for before a conflict zone, so near that 2 m/s² would not stop "
        "them after 1 s, while the ego is over its line and not out of the zone; null "
        "without a junction",
        unit="",
        digits=0,
        better=LOWER,
        kind=WHOLE,
    ),
    Metric(
        column=columns.GAVE_WAY,
        label="waited at junctions",
        compute=lambda e: right_of_way.gave_way_time(e.trace),
        formula="time for which the ego stood to give way; null without a junction",
        unit="s",
        digits=1,
        better=LOWER,
    ),
    Metric(
        column=columns.JUNCTION_PET,
        label="least time in between at junctions",
        compute=lambda e: right_of_way.post_encroachment_time(e.trace),
        formula="post-encroachment time: least time between one of ego and another "
        "vehicle leaving a conflict zone of a junction and the other entering it, "
        "crossing and merging traffic alone, however long; null if none did",
        unit="s",
        digits=1,
        better=HIGHER,
    ),
)
_COMFORT = (
    Metric(
        column=columns.MEAN_J_JERK,
        label="mean jerk cost",
        compute=lambda e: comfort.mean_cost(e.trace, comfort.JERK_COST),
        formula="mean over planning cycles of ∫ jerk² dt of the selected trajectory; "
        "null unless the planner reports `jerk_integral`",
        unit="m²/s⁵",
        digits=3,
        better=LOWER,
    ),
    Metric(
        column=columns.MEAN_J_OFFSET,
        label="mean offset cost",
        compute=lambda e: comfort.mean_cost(e.trace, comfort.OFFSET_COST),
        formula="mean over planning cycles of the mean l² of the selected trajectory; "
        "null unless the planner reports `mean_offset_squared`",
        unit="m²",
        digits=3,
        better=LOWER,
    ),
    Metric(
        column=columns.RMS_JERK,
        label="RMS jerk",
        compute=lambda e: comfort.rms_jerk(e.trace),
        formula="√ mean ‖a_(k+1) - a_k‖² / Δt² with a = (tangential acceleration, "
        "κv²), as experienced by a passenger",
        unit="m/s³",
        digits=2,
        better=LOWER,
        in_terminal=True,
        compared=True,
        of_planner=True,
    ),
    Metric(
        column=columns.MAX_ACCELERATION,
        label="max abs. acceleration",
        compute=lambda e: comfort.max_abs_acceleration(e.trace),
        formula="max |tangential acceleration|",
        unit="m/s²",
        digits=2,
        better=LOWER,
        in_terminal=True,
        compared=True,
    ),
    Metric(
        column=columns.MAX_LATERAL_ACCELERATION,
        label="max lateral acceleration",
        compute=lambda e: comfort.max_abs_lateral_acceleration(e.trace),
        formula="max |κv²|",
        unit="m/s²",
        digits=2,
        better=LOWER,
        in_terminal=True,
        of_planner=True,
    ),
    Metric(
        column=columns.LATERAL_DISCOMFORT,
        label="uncomfortable sideways",
        compute=lambda e: comfort.lateral_discomfort(e.trace),
        formula="share of steps with |κv²| > 2.2 m/s²",
        digits=3,
        better=LOWER,
        of_planner=True,
    ),
    Metric(
        column=columns.BRAKING_DISCOMFORT,
        label="uncomfortable braking",
        compute=lambda e: comfort.braking_discomfort(e.trace),
        formula="share of steps with a deceleration > 3.5 m/s²",
        digits=3,
        better=LOWER,
        of_planner=True,
    ),
    Metric(
        column=columns.MAX_LATERAL_JERK,
        label="max lateral jerk",
        compute=lambda e: comfort.max_lateral_jerk(e.trace),
        formula="max |change of κv² in 0.5 s| / 0.5 s; null for a shorter episode",
        unit="m/s³",
        digits=2,
        better=LOWER,
        of_planner=True,
    ),
    Metric(
        column=columns.MAX_TANGENTIAL_JERK,
        label="max jerk along the path",
        compute=lambda e: comfort.max_tangential_jerk(e.trace),
        formula="max |change of the tangential acceleration in 0.5 s| / 0.5 s; null for"
        " a shorter episode",
        unit="m/s³",
        digits=2,
        better=LOWER,
        of_planner=True,
    ),
    Metric(
        column=columns.LATERAL_REVERSALS,
        label="lateral reversals",
        compute=lambda e: comfort.lateral_reversals(e.trace),
        formula="changes of sign of κv² where |κv²| > 0.3 m/s², in a minute",
        unit="1/min",
        digits=1,
        better=LOWER,
        of_planner=True,
    ),
    Metric(
        column=columns.MAX_CURVATURE,
        label="max curvature",
        compute=lambda e: comfort.max_abs_curvature(e.trace),
        formula="max |κ| of the driven path",
        unit="1/m",
        digits=4,
        of_planner=True,
    ),
    Metric(
        column=columns.MAX_FRONT_WHEEL,
        label="max front-wheel angle",
        compute=lambda e: comfort.max_front_wheel_angle(e.trace),
        formula="max |δ|, tan δ = L κ with the wheelbase L: kinematic single-track "
        "model, [Thesis] eq. 3.8",
        unit="rad",
        digits=3,
        of_planner=True,
    ),
    Metric(
        column=columns.MAX_FRONT_WHEEL_RATE,
        label="max front-wheel rate",
        compute=lambda e: comfort.max_front_wheel_rate(e.trace),
        formula="max |δ_(k+1) - δ_k| / Δt; null for a single step",
        unit="rad/s",
        digits=3,
        better=LOWER,
        of_planner=True,
    ),
    Metric(
        column=columns.MAX_HEADING,
        label="max heading error",
        compute=lambda e: comfort.max_heading(e.trace),
        formula="max |ego heading - path heading|; null if the ego was never projected "
        "on the path",
        unit="rad",
        digits=3,
        of_planner=True,
    ),
    Metric(
        column=columns.OVER_LIMITS_STEPS,
        label="steps over vehicle limits",
        kind=WHOLE,
        compute=lambda e: limits.steps_over_limits(e.trace, e.limits),
        formula="steps in which speed, acceleration, braking (against emergency "
        "braking), lateral acceleration or curvature is more than 1 % over the limit "
        "in `ego.vehicle.limits`; null without a step",
        better=LOWER,
    ),
)
_COMPUTATION = (
    Metric(
        column=columns.EMERGENCY_CYCLES,
        label="emergency cycles",
        compute=lambda e: computation.emergency_cycles(e.trace),
        formula="planning cycles with the status `emergency_braking`",
        better=LOWER,
        of_planner=True,
    ),
    Metric(
        column=columns.FALLBACK_CYCLES,
        label="fallback cycles",
        compute=lambda e: computation.fallback_cycles(e.trace),
        formula="planning cycles without a fresh plan",
        better=LOWER,
        in_terminal=True,
        of_planner=True,
    ),
    Metric(
        column=columns.CANDIDATES_MEAN,
        label="candidates per cycle",
        compute=lambda e: computation.mean_count(e.trace, "candidates"),
        formula="mean number of candidates over planning cycles; null without cycles",
        in_terminal=True,
        of_planner=True,
    ),
    Metric(
        column=columns.FEASIBLE_MEAN,
        label="feasible candidates",
        compute=lambda e: computation.mean_count(e.trace, "survivors"),
        formula="mean number of feasible candidates over planning cycles; null without "
        "cycles, or if the planner was not asked to count them",
        in_terminal=True,
        of_planner=True,
    ),
    *_planning_times(),
    Metric(
        column=columns.DEADLINE_MISSES,
        label="deadline misses",
        compute=lambda e: computation.deadline_misses(e.trace),
        formula="planning cycles, from the second on, whose wall-clock time exceeded "
        "the step",
        better=LOWER,
        timing=True,
        of_planner=True,
    ),
    Metric(
        column=columns.STEPS_PER_SECOND,
        label="loop rate",
        compute=lambda e: computation.steps_per_second(e.trace),
        formula="steps of the closed loop per second of wall clock, planner included, "
        "from the second step on",
        unit="steps/s",
        better=HIGHER,
        in_terminal=True,
        timing=True,
    ),
)
_FOLLOWERS = (
    Metric(
        column=columns.REAR_MAX_DECELERATION,
        label="max follower deceleration",
        compute=lambda e: followers.rear_max_deceleration(e.trace),
        formula="hardest braking of any follower while following, at least 0; null "
        "without followers",
        unit="m/s²",
        digits=2,
        better=LOWER,
        in_terminal=True,
        compared=True,
    ),
    Metric(
        column=columns.REAR_SPEED_LOSS,
        label="max follower speed loss",
        compute=lambda e: followers.rear_speed_loss(e.trace),
        formula="largest drop of a follower's speed while following: max (highest "
        "speed so far - current speed); null without followers",
        unit="m/s",
        digits=2,
        better=LOWER,
    ),
)
_LANE_CHANGE = (
    Metric(
        column=columns.LANE_CHANGE_TIME,
        label="lane-change duration",
        compute=lambda e: lane_change.lane_change_time(e.trace),
        formula="duration of the first lane change: from the last step within 0.1 m of "
        "the initial offset to the first after which the offset, at least 2.5 m away, "
        "stays within 0.1 m for 2 s; null without one",
        unit="s",
        digits=1,
        of_planner=True,
    ),
    Metric(
        column=columns.LANE_CHANGE_DONE,
        label="lane change completed",
        compute=lambda e: lane_change.lane_change_done(e.trace),
        formula="time from entry to the end of that lane change; null without one",
        unit="s",
        digits=1,
        of_planner=True,
    ),
    Metric(
        column=columns.BEFORE_BLOCKAGE,
        label="changed before blockage",
        kind=FLAG,
        compute=lambda e: lane_change.changed_before_blockage(e.trace),
        formula="whether the point of the ego's body nearest to the blockage was "
        "beside it when the front reached it; the blockage is the first obstacle "
        "ahead that covers the ego's full width at its initial offset; false if the "
        "ego never reached it; null without a blockage",
        better=HIGHER,
    ),
)
_WITHOUT_EGO = (
    Metric(
        column=columns.BEHIND_COMPARED,
        label="vehicles compared with no-ego run",
        compute=lambda e: without_ego.n_compared(e.costs_behind),
        formula="vehicles behind the ego that are compared with the run without it; "
        "null, like the next four, without `simulation.without_ego`",
    ),
    Metric(
        column=columns.BEHIND_DELAY_MEAN,
        label="mean delay vs. no-ego run",
        compute=lambda e: without_ego.mean_delay(e.costs_behind),
        formula="mean delay at the last place that both runs reach; negative is a gain",
        unit="s",
        digits=2,
        better=LOWER,
    ),
    Metric(
        column=columns.BEHIND_DELAY_MAX,
        label="max delay vs. no-ego run",
        compute=lambda e: without_ego.max_delay(e.costs_behind),
        formula="the same, largest",
        unit="s",
        digits=2,
        better=LOWER,
    ),
    Metric(
        column=columns.BEHIND_SPEED_LOSS,
        label="max speed loss vs. no-ego run",
        compute=lambda e: without_ego.max_speed_loss(e.costs_behind),
        formula="largest (speed without the ego - speed with it) at the same place",
        unit="m/s",
        digits=2,
        better=LOWER,
    ),
    Metric(
        column=columns.BEHIND_DECELERATION,
        label="added deceleration vs. no-ego run",
        compute=lambda e: without_ego.max_added_deceleration(e.costs_behind),
        formula="largest (hardest braking with the ego - without it) of one vehicle on "
        "the stretch shared by both runs, at least 0",
        unit="m/s²",
        digits=2,
        better=LOWER,
    ),
)
_CAUSAL = (
    Metric(
        column=columns.CUT_IN_DECELERATION,
        label="cut-in: max follower deceleration",
        compute=lambda e: cut_in.max_deceleration(e.trace),
        formula="hardest braking of the follower in the lane that the ego changes to, "
        "from its body's first step over the line to 5 s after it is wholly in that "
        "lane, at least 0; null without a change or a follower",
        unit="m/s²",
        digits=2,
        better=LOWER,
    ),
    Metric(
        column=columns.CUT_IN_ADDED,
        label="cut-in: added deceleration vs. no-ego run",
        compute=lambda e: cut_in.added_deceleration(e.trace, e.vehicles_without_ego),
        formula="the same less the hardest braking of that vehicle on that stretch "
        "without the ego, at least 0; null without `simulation.without_ego`",
        unit="m/s²",
        digits=2,
        better=LOWER,
    ),
    Metric(
        column=columns.PLACEBO_DELAY_MEAN,
        label="placebo: mean delay",
        compute=lambda e: without_ego.mean_delay(e.costs_placebo),
        formula="mean delay of the same vehicles behind between two runs without the "
        "ego that differ in SUMO's random numbers from the ego's entry on: chance; "
        "null, like the next two, without `simulation.placebo`",
        unit="s",
        digits=2,
    ),
    Metric(
        column=columns.PLACEBO_SPEED_LOSS,
        label="placebo: max speed loss",
        compute=lambda e: without_ego.max_speed_loss(e.costs_placebo),
        formula="the same of the largest speed loss",
        unit="m/s",
        digits=2,
    ),
    Metric(
        column=columns.PLACEBO_DECELERATION,
        label="placebo: added deceleration",
        compute=lambda e: without_ego.max_added_deceleration(e.costs_placebo),
        formula="the same of the largest added deceleration",
        unit="m/s²",
        digits=2,
    ),
    Metric(
        column=columns.AHEAD_COMPARED,
        label="vehicles far ahead compared",
        compute=lambda e: without_ego.n_compared(e.costs_ahead),
        formula="vehicles always at least 50 m ahead of the ego, which it cannot "
        "influence, compared with the run without it; null, like the next three, "
        "without `simulation.without_ego`",
    ),
    Metric(
        column=columns.AHEAD_DELAY_MEAN,
        label="far ahead: mean delay",
        compute=lambda e: without_ego.mean_delay(e.costs_ahead),
        formula="mean delay of these vehicles: chance",
        unit="s",
        digits=2,
    ),
    Metric(
        column=columns.AHEAD_SPEED_LOSS,
        label="far ahead: max speed loss",
        compute=lambda e: without_ego.max_speed_loss(e.costs_ahead),
        formula="largest speed loss of these vehicles",
        unit="m/s",
        digits=2,
    ),
    Metric(
        column=columns.AHEAD_DECELERATION,
        label="far ahead: added deceleration",
        compute=lambda e: without_ego.max_added_deceleration(e.costs_ahead),
        formula="largest added deceleration of these vehicles",
        unit="m/s²",
        digits=2,
    ),
)
_TRACKING = (
    Metric(
        column=columns.TRACKING_LATERAL_MAX,
        label="max lateral tracking error",
        compute=lambda e: tracking.max_error(e.trace, "lateral_error_m"),
        formula="largest distance of the rear axle from the plan that it follows; "
        "null, like the next seven, with a perfect plant",
        unit="m",
        digits=3,
        better=LOWER,
    ),
    Metric(
        column=columns.TRACKING_LATERAL_RMS,
        label="RMS lateral tracking error",
        compute=lambda e: tracking.rms_error(e.trace, "lateral_error_m"),
        formula="the same, root mean square",
        unit="m",
        digits=3,
        better=LOWER,
    ),
    Metric(
        column=columns.TRACKING_LONGITUDINAL_MAX,
        label="max longitudinal tracking error",
        compute=lambda e: tracking.max_error(e.trace, "behind_m"),
        formula="largest distance along the plan from the plan's point of the same "
        "time",
        unit="m",
        digits=3,
        better=LOWER,
    ),
    Metric(
        column=columns.TRACKING_LONGITUDINAL_RMS,
        label="RMS longitudinal tracking error",
        compute=lambda e: tracking.rms_error(e.trace, "behind_m"),
        formula="the same, root mean square",
        unit="m",
        digits=3,
        better=LOWER,
    ),
    Metric(
        column=columns.LIMITED_SHARE,
        label="time at a limit",
        compute=lambda e: tracking.limited_share(e.trace),
        formula="share of time in which steering, drive or grip is at its limit",
        digits=3,
        better=LOWER,
    ),
    Metric(
        column=columns.COMMAND_JERK,
        label="RMS commanded jerk",
        compute=lambda e: tracking.rms_command_jerk(e.trace),
        formula="√ mean (Δ drive command / Δt)²; the driven one is `rms_jerk_mps3`",
        unit="m/s³",
        digits=2,
        better=LOWER,
    ),
    Metric(
        column=columns.GRIP_MAX,
        label="max share of grip",
        compute=lambda e: tracking.max_error(e.trace, "grip"),
        formula="largest acceleration in the plane over friction times gravity",
        digits=2,
        better=LOWER,
    ),
    Metric(
        column=columns.PLANS_ANEW,
        label="plans begun anew",
        compute=lambda e: tracking.plans_anew(e.trace),
        formula="plans that did not begin on the last one, because the ego was too "
        "far from it",
        better=LOWER,
    ),
    Metric(
        column=columns.NEAREST_ERROR,
        label="position error of the nearest vehicle",
        compute=lambda e: tracking.nearest_error(e.trace),
        formula="mean distance from where the nearest vehicle is to where the ego "
        "believes it; null, like the next one, with perfect perception",
        unit="m",
        digits=2,
        better=LOWER,
    ),
    Metric(
        column=columns.UNSEEN_NEAR,
        label="vehicles nearby not believed in",
        compute=lambda e: tracking.unseen_near(e.trace),
        formula="share of vehicles within 30 m of the rear axle that the ego does "
        "not believe in",
        digits=3,
        better=LOWER,
    ),
)

_WORLD = (
    Metric(
        column=columns.RECORDED_TRAFFIC,
        label="traffic is a recording",
        kind=FLAG,
        compute=lambda e: True if e.recorded_traffic else None,
        formula="world commonroad: the others follow a recording and do not react to "
        "the ego; null in other worlds",
    ),
    Metric(
        column=columns.IMPORTANCE_WEIGHT,
        label="importance weight",
        compute=_importance_weight,
        formula="how much likelier the drivers' errors are with the rates asked for "
        "than with those of `traffic.drivers.near_ego_factor`; null without one",
        digits=4,
    ),
)

METRICS: Final[Mapping[str, Metric]] = {
    metric.column: metric
    for metric in (
        *_IDENTITY,
        *_SAFETY,
        *_EFFICIENCY,
        *_RULES,
        *_COMFORT,
        *_COMPUTATION,
        *_FOLLOWERS,
        *_LANE_CHANGE,
        *_WITHOUT_EGO,
        *_CAUSAL,
        *_TRACKING,
        *FLEET_METRICS,
        *_WORLD,
    )
}
# what others do because of the ego: null where they follow a recording
REACTIONS: Final = frozenset(
    {
        columns.REAR_MAX_DECELERATION,
        columns.REAR_SPEED_LOSS,
        columns.CUT_IN_DECELERATION,
    }
)
ALL_COLUMNS: Final = tuple(METRICS)
TIMING_COLUMNS: Final = tuple(m.column for m in METRICS.values() if m.timing)
IN_TERMINAL: Final = tuple(m for m in METRICS.values() if m.in_terminal)
# share of runs with a value above zero -> its column
RATES: Final[Mapping[str, str]] = {m.rate: m.column for m in METRICS.values() if m.rate}
MEANS: Final = tuple(m.column for m in METRICS.values() if m.compared and not m.rate)


def markdown_table() -> str:
    """Return the reference of all metrics as a Markdown table."""
    lines = [
        "| column | label | unit | better | default in | definition |",
        "|---|---|---|---|---|---|",
    ]
    for metric in METRICS.values():
        shown = [
            name
            for name, is_in in (
                ("run", metric.in_terminal),
                ("compare", metric.compared),
            )
            if is_in
        ]
        formula = metric.formula.replace("|", "\\|")
        lines.append(
            f"| `{metric.column}` | {metric.label} | {metric.unit or '-'} "
            f"| {metric.better} | {', '.join(shown) or '-'} | {formula} |"
        )
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    sys.stdout.write(markdown_table())
