"""The verdict: who could have avoided a contact, and whose it was to do so."""

import math
from typing import NamedTuple

from experiments.metrics.verdict.artefact import impossible_motion
from experiments.metrics.verdict.encroachment import (
    MOST,
    MOVED,
    WaysBefore,
    sideways,
    ways_before,
)
from experiments.metrics.verdict.escape import (
    last_escape_of_ego,
    last_escape_of_other,
)
from experiments.metrics.verdict.records import (
    USUAL_LIMITS,
    AvoidanceLimits,
    ContactCase,
    ContactVerdict,
    Fault,
)
from planner.numerics.angles import wrapped

OPPOSED = 2.4  # headings that differ by more meet head-on [rad]
CROSSING = 0.6  # by more: they cross [rad]


def judge_contact(
    case: ContactCase, limits: AvoidanceLimits = USUAL_LIMITS
) -> ContactVerdict:
    """Say who could have avoided a contact, and had to.

    1. A vehicle that moved as none can in the second before: an artefact.
    2. Whose it was: of the one that has to yield; of the one that moved sideways into
       the other's way; of the one that drove into what was in its way.
    3. Unless it drove into what was ahead of it: the other one may have had the time
       to help it. With its reaction time and `leisure` to spare it is at fault
       instead, with its reaction time alone both share it.
    4. Unavoidable if neither could avoid it at any time.

    Args:
        case: The motions up to the contact.
        limits: What each may be expected to do.

    Returns:
        The verdict, with the last step in which anyone could avoid it.
    """
    last_ego = last_escape_of_ego(case, limits)
    last_other = last_escape_of_other(case, limits)
    known = [step for step in (last_ego, last_other) if step is not None]
    fault, why = _fault(case, limits, last_ego, last_other)
    return ContactVerdict(fault, max(known, default=0), why, last_ego, last_other)


class _Obliged(NamedTuple):
    """Who had to avoid a contact: `ego`, `other`, or nobody more than the other."""

    who: str
    why: str
    drove_into: bool = False  # what was ahead of it: nobody else could help it


def _fault(
    case: ContactCase,
    limits: AvoidanceLimits,
    last_ego: int | None,
    last_other: int | None,
) -> tuple[Fault, str]:
    """Return the fault and why."""
    if case.standing:
        if last_ego is None:
            return Fault.UNAVOIDABLE, "the ego could not have stopped or passed"
        return Fault.EGO, "drives into what stands"
    motion = _artefact(case)
    if motion:
        return Fault.ARTEFACT, f"the other {motion}"
    ways = ways_before(case)
    obliged = _obliged(case, ways)
    if last_ego is None and last_other is None:
        return Fault.UNAVOIDABLE, f"{obliged.why}, and neither could avoid it"
    if not obliged.who:
        return Fault.SHARED, obliged.why
    spare = _spare_time(case, limits, obliged.who, ways, (last_ego, last_other))
    own, theirs = Fault.EGO, Fault.OTHER
    if obliged.who == "other":
        own, theirs = theirs, own
    if obliged.drove_into or spare < 0.0:
        return own, obliged.why
    if spare < limits.leisure:
        return Fault.SHARED, f"{obliged.why}, but there was time to brake"
    return theirs, f"{obliged.why}, long before"


def _spare_time(
    case: ContactCase,
    limits: AvoidanceLimits,
    obliged: str,
    ways: WaysBefore,
    last: tuple[int | None, int | None],
) -> float:
    """Return how long the one in whose way the other came could still wait to act [s].

    Its reaction time aside; minus infinity if it never saw it or could do nothing.
    """
    if obliged == "ego":  # the other's last chance is before it reacts
        chance, seen, reaction = last[1], ways.ego_in_other_way, 0.0
    else:
        chance, seen = last[0], ways.other_in_ego_way
        reaction = limits.ego_reaction
    if seen is None or chance is None:
        return -math.inf
    return (chance - seen) * case.step - reaction


def _artefact(case: ContactCase) -> str:
    """Name the motion of the other that no vehicle makes; empty without one."""
    track = case.plane[0] if case.plane else case.other
    return impossible_motion(track, case.step)


def _obliged(case: ContactCase, ways: WaysBefore) -> _Obliged:
    """Return who had to avoid the contact, and why."""
    if case.yields:
        words = "the ego has" if case.yields == "ego" else "the other has"
        return _Obliged(case.yields, f"{words} to give way")
    turned = abs(wrapped(float(case.other.heading[-1] - case.ego.heading[-1])))
    if CROSSING < turned < OPPOSED:
        return _who_came_later(ways)
    own, others = sideways(case)
    total = max(own, 0.0) + max(others, 0.0)
    if total > MOVED and max(own, others) >= MOST * total:
        return _mover(ways, is_ego=own > others)
    if min(own, others) > MOVED or (total > MOVED and turned >= OPPOSED):
        return _Obliged("", "both move toward each other")
    if turned >= OPPOSED:
        return _Obliged("other", "the other drives against the ego's direction")
    return _hitter(case, ways)


def _mover(ways: WaysBefore, *, is_ego: bool) -> _Obliged:
    """Return who moved sideways, and whether into the side or what was ahead of it."""
    ahead, behind = ways.other_in_ego_way, ways.ego_in_other_way
    if is_ego and ahead is not None and behind is None:
        return _Obliged("ego", "drives into what is ahead of it", drove_into=True)
    if is_ego:
        return _Obliged("ego", "the ego moves into its way")
    if behind is not None and ahead is None:
        return _Obliged("other", "drives into the ego from behind", drove_into=True)
    return _Obliged("other", "the other moves into the ego's way")


def _hitter(case: ContactCase, ways: WaysBefore) -> _Obliged:
    """Return who drove into what was ahead of it; beside each other, the faster one."""
    ahead, behind = ways.other_in_ego_way, ways.ego_in_other_way
    if ahead is not None and behind is None:
        return _Obliged("ego", "drives into what is ahead of it", drove_into=True)
    if behind is not None and ahead is None:
        return _Obliged("other", "drives into the ego from behind", drove_into=True)
    faster = float(case.ego.speed[-1]) >= float(case.other.speed[-1])
    return _Obliged("ego" if faster else "other", "drives into it", drove_into=True)


def _who_came_later(ways: WaysBefore) -> _Obliged:
    """Return who came last into the other's way at a crossing."""
    ego, other = ways.ego_in_other_way, ways.other_in_ego_way
    if ego == other:
        return _Obliged("", "both come to the crossing at once")
    if other is None or (ego is not None and ego > other):
        return _Obliged("ego", "the ego comes into its way from the side")
    return _Obliged("other", "the other comes into the ego's way from the side")
