"""The events of an episode: what happened, when, and to whom.

Found in the trace alone, so that any recorded run has them.
"""

import json
import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from enum import StrEnum
from typing import Final

import numpy as np

from experiments.metrics.lane_crossings import lane_crossings
from experiments.metrics.moments import (
    least_clearance,
    least_time_to_collision,
)
from experiments.metrics.tracking import tracked, unseen
from experiments.metrics.verdict.braking import EGO, braking_verdicts, stretches_of
from experiments.metrics.verdict.of_trace import verdict_of
from experiments.trace.schema import Trace
from planner.interface import PlanStatus
from planner.scene import OFF_ROAD_TOLERANCE

STANDING = 0.1  # slower is standing [m/s]
STOOD = 1.0  # a shorter stand is no event [s]
LASTING = 0.3  # a phase of a planner that is shorter is no event [s]
AT_LIMIT = 0.5  # share of a step at a limit, from which on it is an event
UNSEEN_REACH = 10.0  # from the rear axle; farther ones may well be hidden [m]
MISSED = 0.5  # a shorter time for which a vehicle nearby is not seen is no event [s]
MOST_PHASES = 12  # a planner that names more says a sentence, not a phase

_PHASE = re.compile(r"([a-z][a-z_ ]*)(?::|$)")
COMMITTED = "committed"  # the phase from which a planner does not turn back
_SIGNALS = {"r": "red", "u": "red and amber", "y": "amber", "g": "green"}


class EventKind(StrEnum):
    """Kinds of events."""

    CONTACT = "contact"
    VERDICT = "last_chance"  # to avoid a contact, and whose fault it is
    OFF_ROAD = "off_road"
    EMERGENCY = "emergency"  # the planner found no way but to brake
    FALLBACK = "fallback"  # a cycle without a fresh plan
    EGO_BRAKING = "ego_braking"
    FOLLOWER_BRAKING = "follower_braking"
    AT_LIMIT = "at_limit"  # of steering, drive or grip
    ANEW = "plan_anew"  # the ego was too far from its plan
    UNSEEN = "unseen"  # a vehicle nearby that the ego does not believe in
    TRACKING = "largest_tracking_error"
    CLEARANCE = "least_clearance"
    TTC = "least_ttc"
    OVER_LINE = "over_line"
    NEW_LANE = "new_lane"
    COMMITMENT = "commitment"
    PHASE = "phase"
    SIGNAL = "signal"
    STANDING = "standing"
    END = "end"


class Gravity(StrEnum):
    """How bad an event is."""

    BAD = "bad"
    WARNING = "warning"
    NOTE = "note"


_GRAVITY: Final = {
    EventKind.CONTACT: Gravity.BAD,
    EventKind.OFF_ROAD: Gravity.BAD,
    EventKind.VERDICT: Gravity.BAD,
    EventKind.EMERGENCY: Gravity.BAD,
    EventKind.FALLBACK: Gravity.WARNING,
    EventKind.EGO_BRAKING: Gravity.WARNING,
    EventKind.FOLLOWER_BRAKING: Gravity.WARNING,
    EventKind.AT_LIMIT: Gravity.WARNING,
    EventKind.ANEW: Gravity.WARNING,
    EventKind.UNSEEN: Gravity.WARNING,
}


@dataclass(frozen=True, slots=True)
class Event:
    """Something that happened at a moment, or from it on.

    `step` and `until` are rows of the steps; `until` is None for a moment, else the
    last row of the stretch.
    """

    kind: EventKind
    step: int
    text: str  # a few words
    until: int | None = None
    subject: str = ""  # body or signal
    value: float | None = None
    unit: str = ""

    @property
    def gravity(self) -> Gravity:
        """How bad it is."""
        return _GRAVITY.get(self.kind, Gravity.NOTE)


def events(trace: Trace) -> list[Event]:
    """Find all events of an episode, in the order of time.

    Args:
        trace: With any number of steps; without any there are none.
    """
    if len(trace.steps["index"]) == 0:
        return []
    found = [event for find in _FINDERS for event in find(trace)]
    order = list(EventKind)
    return sorted(found, key=lambda event: (event.step, order.index(event.kind)))


def _contacts(trace: Trace) -> Iterator[Event]:
    """Find the first contact with each body."""
    seen: set[str] = set()
    for step, cell in enumerate(trace.steps["contacts"]):
        for body in json.loads(cell):
            if body not in seen:
                seen.add(body)
                yield Event(EventKind.CONTACT, step, f"touches {body}", subject=body)


def _last_chance(trace: Trace) -> Iterator[Event]:
    """Find the last step in which the first contact could be avoided, and by whom."""
    found = verdict_of(trace)
    if found is None:
        return
    could = [
        name
        for name, step in (("ego", found.last_ego), ("other", found.last_other))
        if step == found.step
    ]
    chance = f"last chance of {' and '.join(could)}" if could else "no chance"
    yield Event(EventKind.VERDICT, found.step, f"{chance}; {found.fault}: {found.why}")


def _off_road(trace: Trace) -> Iterator[Event]:
    """Find the stretches off the road."""
    beyond = np.ma.filled(trace.steps["off_road_m"], 0.0)
    for first, last in stretches_of(trace, beyond > OFF_ROAD_TOLERANCE):
        most = float(beyond[first : last + 1].max())
        words = f"off the road by up to {most:.2f} m"
        yield Event(EventKind.OFF_ROAD, first, words, last, value=most, unit="m")


def _fallbacks(trace: Trace) -> Iterator[Event]:
    """Find the stretches without a fresh plan, by status."""
    statuses = np.ma.filled(trace.steps["plan_status"], PlanStatus.OK).astype(str)
    for status in sorted(set(statuses.tolist()) - {str(PlanStatus.OK)}):
        braking = status == PlanStatus.EMERGENCY_BRAKING
        kind = EventKind.EMERGENCY if braking else EventKind.FALLBACK
        for first, last in stretches_of(trace, statuses == status):
            words = status.replace("_", " ")
            yield Event(kind, first, words, last, value=last - first + 1, unit="cycles")


def _braking(trace: Trace) -> Iterator[Event]:
    """Find where the ego or a follower brakes hard, and whose fault it is."""
    for found in braking_verdicts(trace):
        who, first, last, most = found.stretch
        kind = EventKind.EGO_BRAKING if who == EGO else EventKind.FOLLOWER_BRAKING
        name = "ego" if who == EGO else f"{who} behind"
        cause = f" ({found.cause})" if found.cause not in ("", EGO) else ""
        judged = f"{found.fault}: {found.why}{cause}"
        words = f"{name} brakes with up to {most:.1f} m/s²; {judged}"
        yield Event(kind, first, words, last, who, most, "m/s²")


def _limits(trace: Trace) -> Iterator[Event]:
    """Find the stretches in which steering, drive or grip is at a limit."""
    share = np.nan_to_num(tracked(trace, "limited"))
    step = float(trace.fact("step_s"))
    for first, last in stretches_of(trace, share >= AT_LIMIT):
        lasted = (last - first + 1) * step
        words = f"at a limit of steering, drive or grip for {lasted:.1f} s"
        yield Event(EventKind.AT_LIMIT, first, words, last, "ego", lasted, "s")


def _anew(trace: Trace) -> Iterator[Event]:
    """Find the plans that began off the last one."""
    starts = trace.starts
    anew = np.flatnonzero(starts["rule"] == "anew")
    for row in np.searchsorted(trace.steps["index"], starts["index"][anew]).tolist():
        yield Event(EventKind.ANEW, row, "too far from its plan: plans anew")


def _tracking(trace: Trace) -> Iterator[Event]:
    """Find the moment of the largest lateral tracking error."""
    errors = np.abs(tracked(trace, "lateral_error_m"))
    if not np.isfinite(errors).any():
        return
    step = int(np.nanargmax(errors))
    value = float(errors[step])
    words = f"farthest beside its plan: {value:.2f} m"
    yield Event(EventKind.TRACKING, step, words, None, "ego", value, "m")


def _unseen(trace: Trace) -> Iterator[Event]:
    """Find the stretches in which a vehicle nearby is not believed in."""
    time = np.ma.getdata(trace.steps["time_s"])
    marks = np.zeros(time.size, dtype=bool)
    for name, rows in unseen(trace, UNSEEN_REACH).items():
        marks[:] = False
        marks[rows] = True
        for first, last in stretches_of(trace, marks):
            lasted = float(time[last] - time[first]) + float(trace.fact("step_s"))
            if lasted >= MISSED:
                words = f"{name} nearby is not seen for {lasted:.1f} s"
                yield Event(EventKind.UNSEEN, first, words, last, name, lasted, "s")


def _clearance(trace: Trace) -> Iterator[Event]:
    """Find the moment of the least clearance, if nothing was touched."""
    step = least_clearance(trace)
    if step is None or any(json.loads(cell) for cell in trace.steps["contacts"]):
        return
    value = float(trace.steps["clearance_m"][step])
    body = str(np.ma.filled(trace.steps["nearest"], "")[step] or "")
    words = f"least clearance: {value:.2f} m" + (f" to {body}" if body else "")
    yield Event(EventKind.CLEARANCE, step, words, None, body, value, "m")


def _time_to_collision(trace: Trace) -> Iterator[Event]:
    """Find the moment of the least time to collision."""
    found = least_time_to_collision(trace)
    if found is not None:
        step, body, value = found
        words = f"least TTC: {value:.1f} s to {body}"
        yield Event(EventKind.TTC, step, words, None, body, value, "s")


def _lines(trace: Trace) -> Iterator[Event]:
    """Find when the body crosses lane lines and is in another lane."""
    for crossing in lane_crossings(trace):
        side = "left" if crossing.left else "right"
        back = crossing.lane == crossing.home
        words = f"body over the line to the {side}"
        yield Event(
            EventKind.OVER_LINE,
            crossing.begin,
            words + (", comes back" if back else ""),
            crossing.end,
        )
        if crossing.lane is not None and crossing.end is not None and not back:
            side = "left" if crossing.lane > crossing.home else "right"
            words = f"in the next lane to the {side}"
            yield Event(EventKind.NEW_LANE, crossing.end, words)


def _phases(trace: Trace) -> Iterator[Event]:
    """Find when a planner that names its phase changes it."""
    said = np.ma.filled(trace.steps["explanation"], "").astype(str)
    named = [match[1] if (match := _PHASE.match(text)) else "" for text in said]
    phases = np.array(named)
    if len(set(named)) > MOST_PHASES or len(set(named) - {""}) < 2:  # noqa: PLR2004
        return
    changes = np.flatnonzero(phases[1:] != phases[:-1]) + 1
    ends = np.append(changes[1:], phases.size)
    step_s = float(trace.fact("step_s"))
    before = phases[0]
    for first, end in zip(changes.tolist(), ends.tolist(), strict=True):
        phase = str(phases[first])
        if phase in ("", before) or (end - first) * step_s < LASTING:
            continue
        before = phase
        kind = EventKind.COMMITMENT if phase == COMMITTED else EventKind.PHASE
        yield Event(kind, first, f"planner: {phase}")


def _signals(trace: Trace) -> Iterator[Event]:
    """Find the changes of the signals whose stop line is ahead."""
    table = trace.signals
    reach = float(trace.fact("length_m") - trace.fact("rear_overhang_m"))
    front = np.ma.filled(trace.steps["s_m"], np.nan) + reach
    rows = np.searchsorted(
        np.ma.getdata(trace.steps["index"]), np.ma.getdata(table["index"])
    )
    last: dict[tuple[str, float], str] = {}
    for row, name, stop, state in zip(
        rows.tolist(),
        table["id"],
        np.ma.getdata(table["stop_m"]).tolist(),
        table["state"],
        strict=True,
    ):
        colour = _SIGNALS.get(str(state)[:1].lower(), f"state {state}")
        before = last.get((name, stop))
        last[name, stop] = colour
        if before not in (None, colour) and front[row] <= stop:
            yield Event(EventKind.SIGNAL, row, f"{name} turns {colour}", None, name)


def _standing(trace: Trace) -> Iterator[Event]:
    """Find the stretches in which the ego stands."""
    time = np.ma.getdata(trace.steps["time_s"])
    slow = np.abs(np.ma.getdata(trace.steps["speed_mps"])) < STANDING
    for first, last in stretches_of(trace, slow):
        stood = float(time[last] - time[first])
        if stood >= STOOD:
            words = f"stands for {stood:.1f} s"
            yield Event(EventKind.STANDING, first, words, last, "ego", stood, "s")


def _end(trace: Trace) -> Iterator[Event]:
    """Return the end of the episode."""
    status = str(trace.fact("status")).replace("_", " ")
    yield Event(EventKind.END, len(trace.steps["index"]) - 1, f"end: {status}")


_FINDERS: Final[tuple[Callable[[Trace], Iterator[Event]], ...]] = (
    _contacts,
    _last_chance,
    _off_road,
    _fallbacks,
    _braking,
    _limits,
    _anew,
    _unseen,
    _tracking,
    _clearance,
    _time_to_collision,
    _lines,
    _phases,
    _signals,
    _standing,
    _end,
)
