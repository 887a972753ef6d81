"""Contacts, distances, times to collision, and whose fault it was."""

from typing import Final

from experiments.metrics import columns, exposure, impact, plans, safety, static_bodies
from experiments.metrics.metric import Better, CellKind, MeasuredEpisode, Metric
from experiments.metrics.verdict.braking import braking_verdicts, hardest_braking
from experiments.metrics.verdict.records import Fault


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


SAFETY: Final = (
    Metric(
        column=columns.COLLISIONS,
        label="collisions",
        compute=lambda e: len(safety.contacts(e.trace)),
        formula="number of distinct bodies touched by the ego's rectangle, swept "
        "between steps",
        better=Better.LOWER,
        in_terminal=True,
        compared=True,
        rate="collided",
    ),
    Metric(
        column=columns.FIRST_COLLISION_WITH,
        label="first collision with",
        kind=CellKind.TEXT,
        compute=lambda e: next(iter(safety.contacts(e.trace)), None),
        formula="id of the first body touched",
    ),
    Metric(
        column=columns.VERDICT,
        label="verdict",
        kind=CellKind.TEXT,
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
        kind=CellKind.TEXT,
        compute=_hard_braking,
        formula="whose fault the hardest braking of the ego or of a follower is, from "
        "3 m/s² on, in the words of `verdict`; null without one",
    ),
    Metric(
        column=columns.HARD_BRAKINGS_CAUSED,
        label="hard brakings caused",
        kind=CellKind.WHOLE,
        compute=lambda e: sum(
            one.fault is Fault.EGO for one in braking_verdicts(e.trace)
        ),
        formula="brakings of the ego and of its followers with 3 m/s² or more that the "
        "ego is at fault for",
        better=Better.LOWER,
    ),
    Metric(
        column=columns.IMPACT_SPEED,
        label="impact speed",
        compute=lambda e: impact.impact_speed(e.trace),
        formula="difference of both velocities in the first step in which the ego "
        "touches a body; null without a contact",
        unit="m/s",
        digits=2,
        better=Better.LOWER,
    ),
    Metric(
        column=columns.MIN_CLEARANCE,
        label="min clearance",
        compute=lambda e: safety.min_clearance(e.trace),
        formula="smallest distance between the ego's rectangle and any vehicle or "
        "obstacle over all steps; 0 after a contact; null without bodies",
        unit="m",
        digits=2,
        better=Better.HIGHER,
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
        better=Better.HIGHER,
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
        better=Better.HIGHER,
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
        better=Better.HIGHER,
    ),
    Metric(
        column=columns.TIME_EXPOSED_TTC,
        label="time with TTC < 3 s",
        compute=lambda e: exposure.time_exposed_ttc(e.trace),
        formula="time exposed: steps in which the TTC to some vehicle is below 3 s, "
        "times the step; null without vehicles",
        unit="s",
        digits=1,
        better=Better.LOWER,
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
        better=Better.LOWER,
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
        better=Better.HIGHER,
    ),
    Metric(
        column=columns.OFF_ROAD_PLANS,
        label="plans off the road",
        compute=lambda e: plans.off_road_plans(e.trace),
        formula="plans in which the ego's body somewhere extends more than 1 cm beyond "
        "the road edge, driven or not; null without plans",
        better=Better.LOWER,
        of_planner=True,
    ),
    Metric(
        column=columns.OFF_ROAD_STEPS,
        label="off-road steps",
        compute=lambda e: safety.off_road_steps(e.trace),
        formula="steps in which the ego's body extended more than 1 cm beyond the "
        "road edge",
        better=Better.LOWER,
        in_terminal=True,
        compared=True,
        rate="off road",
    ),
)
