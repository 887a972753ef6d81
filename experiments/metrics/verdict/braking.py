"""The verdict of hard braking: who has made the ego, or who follows it, brake hard."""

from dataclasses import dataclass
from typing import NamedTuple
from weakref import WeakKeyDictionary

import numpy as np

from experiments.metrics.followers import followings
from experiments.metrics.verdict.encroachment import MOVED, in_way
from experiments.metrics.verdict.own_braking import own_braking
from experiments.metrics.verdict.records import (
    USUAL_LIMITS,
    BodyTrack,
    Fault,
)
from experiments.metrics.verdict.tracks import (
    ego_track,
    obstacle_track,
    vehicle_track,
)
from experiments.trace.schema import Trace
from planner.numerics.angles import wrapped
from planner.states import BoolArray, IntArray

HARD_BRAKING = 3.0  # from which on it is judged [m/s²]
EGO = "ego"
BRIDGED = 0.5  # shorter pauses do not end a braking [s]
BEFORE = 6.0  # the beginning of the braking, that is looked at [s]
REACTION = USUAL_LIMITS.other_reaction  # [s]
MOVE = 2.0  # in which a move into the way happens [s]
LATEST = 2.0  # after the beginning, in which its cause comes into the way [s]
CROSSING = 0.6  # headings that differ by more cross [rad]
LEAST_GAP = 0.1  # [m]
MOST_OTHERS = 12  # vehicles looked at, the nearest to the ego


class BrakingStretch(NamedTuple):
    """Hard braking of the ego or of a follower; `first` and `last` are rows."""

    who: str  # EGO, or a vehicle
    first: int
    last: int
    hardest: float  # [m/s²], above 0


@dataclass(frozen=True, slots=True)
class BrakingVerdict:
    """Whose fault a hard braking is, and why in a few words."""

    stretch: BrakingStretch
    fault: Fault
    why: str
    cause: str = ""  # body for which it braked; empty where nothing was in the way


_JUDGED: WeakKeyDictionary[Trace, list[BrakingVerdict]] = WeakKeyDictionary()


def hardest_braking(trace: Trace) -> BrakingVerdict | None:
    """Return the verdict of the hardest braking; None where nobody braked hard."""
    found = braking_verdicts(trace)
    return max(found, key=lambda one: one.stretch.hardest, default=None)


def braking_verdicts(trace: Trace) -> list[BrakingVerdict]:
    """Judge every hard braking of the ego and of its followers, in order.

    1. For whom: of all that was in its way when the braking began, what asked for the
       hardest braking. Nothing there: the ego's own doing, or a driver's.
    2. Whoever moved into the way so close that a driver who reacts in time would have
       to brake hard is at fault; with more room both are, or after a while the one who
       braked late.
    3. Who brakes hard ahead is at fault, if that is the ego as far as its own braking
       is; who comes too fast to what was ahead all the time is at fault itself.
    """
    if trace not in _JUDGED:
        own = [_of_ego(trace, one) for one in _ego_stretches(trace)]
        others = [_of_follower(trace, one, own) for one in _follower_stretches(trace)]
        found = [*own, *others]
        _JUDGED[trace] = sorted(found, key=lambda one: one.stretch.first)
    return _JUDGED[trace]


def stretches_of(trace: Trace, marks: BoolArray) -> list[tuple[int, int]]:
    """Return first and last row of each marked stretch; short gaps are bridged."""
    rows = np.flatnonzero(marks)
    if rows.size == 0:
        return []
    gap = round(BRIDGED / float(trace.fact("step_s"))) + 1
    cuts = np.flatnonzero(np.diff(rows) > gap) + 1
    return [(int(run[0]), int(run[-1])) for run in np.split(rows, cuts)]


def _ego_stretches(trace: Trace) -> list[BrakingStretch]:
    """Find where the ego brakes hard."""
    rate = np.ma.getdata(trace.steps["acceleration_mps2"])
    return [
        BrakingStretch(EGO, first, last, float(-rate[first : last + 1].min()))
        for first, last in stretches_of(trace, rate <= -HARD_BRAKING)
    ]


def _follower_stretches(trace: Trace) -> list[BrakingStretch]:
    """Find where a follower brakes hard."""
    indices = np.ma.getdata(trace.steps["index"])
    found = []
    for run in followings(trace):
        rows = np.searchsorted(indices, run.index)
        for first, last in stretches_of(trace, run.acceleration <= -HARD_BRAKING):
            most = float(-run.acceleration[first : last + 1].min())
            found.append(
                BrakingStretch(run.id, int(rows[first]), int(rows[last]), most)
            )
    return found


def _of_ego(trace: Trace, stretch: BrakingStretch) -> BrakingVerdict:
    """Judge the ego's own braking."""
    found = _reason(trace, stretch)
    if found is None:
        fault, why = own_braking(trace, stretch.first, stretch.last)
        return BrakingVerdict(stretch, fault, why)
    faults = {"cause": Fault.OTHER, "braker": Fault.EGO, "both": Fault.SHARED}
    if found.stands and found.blamed == "cause":
        return BrakingVerdict(stretch, Fault.UNAVOIDABLE, found.why, found.cause)
    return BrakingVerdict(stretch, faults[found.blamed], found.why, found.cause)


def _of_follower(
    trace: Trace, stretch: BrakingStretch, own: list[BrakingVerdict]
) -> BrakingVerdict:
    """Judge the braking of a follower; `own` are the ego's."""
    found = _reason(trace, stretch)
    if found is None or found.cause != EGO:
        why = "brakes, but not for the ego"
        cause = "" if found is None else found.cause
        return BrakingVerdict(stretch, Fault.OTHER, why, cause)
    if found.blamed == "cause" and found.brakes:
        answered = _answered(trace, stretch, own)
        if answered is not None and answered.fault is not Fault.EGO:
            why, cause = answered.why, answered.cause
            return BrakingVerdict(stretch, answered.fault, why, cause)
    fault = {"cause": Fault.EGO, "braker": Fault.OTHER, "both": Fault.SHARED}
    return BrakingVerdict(stretch, fault[found.blamed], found.why, EGO)


def _answered(
    trace: Trace, stretch: BrakingStretch, own: list[BrakingVerdict]
) -> BrakingVerdict | None:
    """Return the ego's latest braking that a follower may brake for; None if over."""
    reaction = REACTION / float(trace.fact("step_s"))
    for one in reversed(own):
        begun = one.stretch.first <= stretch.last
        if begun and one.stretch.last >= stretch.first - reaction:
            return one
    return None


class _Reason(NamedTuple):
    """For whom someone brakes, and who is to blame."""

    cause: str
    blamed: str  # cause, braker or both
    why: str
    brakes: bool = False  # the cause brakes hard itself
    stands: bool = False  # the cause is an obstacle


def _reason(trace: Trace, stretch: BrakingStretch) -> _Reason | None:
    """Find for whom someone brakes; None for nothing that is in its way."""
    step = float(trace.fact("step_s"))
    last = min(stretch.first + round(LATEST / step), stretch.last)
    rows = np.arange(max(stretch.first - round(BEFORE / step), 0), last + 1)
    for on_path in (True, False):
        braker = _track(trace, stretch.who, rows, on_path=on_path)
        if braker is not None and np.isfinite(braker.x[-1]):
            break
    else:
        return None
    onset = stretch.first - int(rows[0])
    asked = []
    for name in _others(trace, stretch, rows):
        track = _track(trace, name, rows, on_path=on_path)
        if track is None or not in_way(braker, track)[onset:].any():
            continue
        asked.append((_needed(braker, track, onset), name, track))
    if not asked:
        return None
    _, name, track = max(asked, key=lambda one: one[0])
    stands = bool((trace.obstacles["id"] == name).any())
    blamed, why, brakes = _blame(braker, track, onset, step)
    return _Reason(name, blamed, why, brakes, stands)


def _others(trace: Trace, stretch: BrakingStretch, rows: IntArray) -> list[str]:
    """List who may be in the way of the one that brakes: the nearest to the ego."""
    table, steps = trace.vehicles, trace.steps
    names: dict[str, None] = {EGO: None}
    for row in (stretch.first, int(rows[-1])):
        here = np.flatnonzero(table["index"] == steps["index"][row])
        apart = np.hypot(
            table["x_m"][here] - steps["x_m"][row],
            table["y_m"][here] - steps["y_m"][row],
        )
        nearest = here[np.argsort(apart, kind="stable")][:MOST_OTHERS]
        names |= dict.fromkeys(map(str, table["id"][nearest]))
    names |= dict.fromkeys(map(str, trace.obstacles["id"]))
    return [name for name in names if name != stretch.who]


def _track(
    trace: Trace, name: str, rows: IntArray, *, on_path: bool
) -> BodyTrack | None:
    """Return the motion of the ego, a vehicle or an obstacle."""
    if name == EGO:
        return ego_track(trace, rows, on_path=on_path)
    if (trace.obstacles["id"] == name).any():
        return obstacle_track(trace, name, rows, on_path=on_path)
    return vehicle_track(trace, name, rows, on_path=on_path)


def _gap(braker: BodyTrack, other: BodyTrack, at: int) -> float:
    """Return the way to a body ahead, about from bumper to bumper [m]."""
    dx, dy = other.x[at] - braker.x[at], other.y[at] - braker.y[at]
    heading = float(braker.heading[at])
    along = float(dx * np.cos(heading) + dy * np.sin(heading))
    turned = abs(wrapped(float(other.heading[at]) - heading))
    reach = other.length * abs(np.cos(turned)) + other.width * abs(np.sin(turned))
    return max(along - 0.5 * (braker.length + float(reach)), LEAST_GAP)


def _needed(braker: BodyTrack, other: BodyTrack, at: int, delay: float = 0.0) -> float:
    """Return the deceleration that a body ahead asks for after a delay [m/s²]."""
    if not np.isfinite(other.x[at] + braker.x[at]):
        return 0.0
    turned = float(other.heading[at] - braker.heading[at])
    closing = float(braker.speed[at]) - float(other.speed[at]) * float(np.cos(turned))
    if closing <= 0.0:
        return 0.0
    left = max(_gap(braker, other, at) - closing * delay, LEAST_GAP)
    return closing**2 / (2.0 * left)


def _blame(
    braker: BodyTrack, other: BodyTrack, onset: int, step: float
) -> tuple[str, str, bool]:
    """Return who is to blame, why, and whether the other brakes hard."""
    marks = in_way(braker, other)
    since = int(np.flatnonzero(marks[onset:])[0]) + onset
    while since > 0 and marks[since - 1]:
        since -= 1
    there = since > 0 and bool(np.isfinite(other.x[since - 1] + braker.x[since - 1]))
    came = there and _moves_in(braker, other, since, step)
    seen = (onset - since) * step
    needed = _needed(braker, other, since, REACTION)
    if came and needed >= HARD_BRAKING:
        return "cause", "moves into the way of the one that brakes", False
    if (other.acceleration[since:] <= -HARD_BRAKING).any():
        return "cause", "brakes hard ahead of the one that brakes", True
    if came:
        late = seen > REACTION + USUAL_LIMITS.leisure
        words = "moves into the way, with room to brake gently"
        return ("braker" if late else "both"), words, False
    turned = abs(wrapped(float(other.heading[onset] - braker.heading[onset])))
    if turned > CROSSING and float(other.speed[onset]) > 1.0:
        return "both", "they cross, and one brakes hard", False
    return "braker", "comes too fast to what is ahead of it", False


def _moves_in(braker: BodyTrack, other: BodyTrack, since: int, step: float) -> bool:
    """Check whether a body came into the way from the side, not from ahead."""
    first = max(since - round(MOVE / step), 0)
    both = np.isfinite(other.x[first:since] + braker.x[first:since])
    if not both.any():
        return False
    first += int(both.argmax())
    heading = float(braker.heading[since])
    nx, ny = -np.sin(heading), np.cos(heading)
    across = [
        abs(
            float((other.x[at] - braker.x[at]) * nx + (other.y[at] - braker.y[at]) * ny)
        )
        for at in (first, since)
    ]
    return across[0] - across[1] > MOVED
