"""The verdict: who could have avoided a contact, and whose it was to do so."""

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
    3. Of the one in whose way the other came, if it had the time for it: at fault
       alone with its reaction time and `leisure` to spare, shared with less, the other
       one's fault alone without.
    4. Unavoidable if the one whose it was could not avoid it either.

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


def _fault(
    case: ContactCase,
    limits: AvoidanceLimits,
    last_ego: int | None,
    last_other: int | None,
) -> tuple[Fault, str]:
    """Return the fault and why."""
    motion = "" if case.standing else _artefact(case)
    if motion:
        return Fault.ARTEFACT, f"the other {motion}"
    ways = ways_before(case)
    if case.standing:
        if last_ego is None:
            return Fault.UNAVOIDABLE, "the ego could not have stopped or passed"
        return Fault.EGO, "drives into what stands"
    to_yield, why = _obliged(case, ways)
    if to_yield == "":
        return Fault.SHARED, why
    # who else could have helped it, and since when the conflict could be seen
    if to_yield == "ego":
        own, helper = last_ego, last_other
        seen, reaction = ways.ego_in_other_way, limits.other_reaction
        alone, theirs = Fault.EGO, Fault.OTHER
    else:
        own, helper = last_other, last_ego
        seen, reaction = ways.other_in_ego_way, limits.ego_reaction
        alone, theirs = Fault.OTHER, Fault.EGO
    if own is None and helper is None:
        return Fault.UNAVOIDABLE, f"{why}, and neither could avoid it"
    spare = 0.0
    if seen is not None and helper is not None:
        spare = (helper - seen) * case.step - reaction
    if spare >= limits.leisure and not why.startswith(_OWN_DOING):
        return theirs, f"{why}, long before"
    if spare >= 0.0 and seen is not None and not why.startswith(_OWN_DOING):
        return Fault.SHARED, f"{why}, but there was time to brake"
    return alone, why


_INTO = "drives into"
_OWN_DOING = (_INTO,)


def _artefact(case: ContactCase) -> str:
    """Name the motion of the other that no vehicle makes; empty without one."""
    track = case.plane[0] if case.plane else case.other
    return impossible_motion(track, case.step)


def _obliged(case: ContactCase, ways: WaysBefore) -> tuple[str, str]:
    """Return who had to avoid the contact, `ego`, `other` or nobody, and why."""
    if case.yields:
        words = "the ego has" if case.yields == "ego" else "the other has"
        return case.yields, f"{words} to give way"
    turned = abs(wrapped(float(case.other.heading[-1] - case.ego.heading[-1])))
    own, others = sideways(case)
    if CROSSING < turned < OPPOSED:
        return _who_came_later(ways)
    total = max(own, 0.0) + max(others, 0.0)
    if total > MOVED and max(own, others) >= MOST * total:
        if own > others:
            return _mover("ego", "the ego moves into its way", ways)
        return _mover("other", "the other moves into the ego's way", ways)
    if min(own, others) > MOVED:
        return "", "both move toward each other"
    if turned >= OPPOSED:
        if total > MOVED:
            return "", "both leave their side"
        return "other", "the other drives against the ego's direction"
    return _hitter(case, ways, total)


def _mover(who: str, why: str, ways: WaysBefore) -> tuple[str, str]:
    """Return who moved sideways, unless it is the one that drives into the other."""
    behind = ways.other_in_ego_way if who == "ego" else ways.ego_in_other_way
    beside = ways.ego_in_other_way if who == "ego" else ways.other_in_ego_way
    if behind is not None and beside is None:
        return who, f"{_INTO} what is ahead of it while moving sideways"
    return who, why


def _hitter(case: ContactCase, ways: WaysBefore, total: float) -> tuple[str, str]:
    """Return who drove into what was ahead of it."""
    if ways.other_in_ego_way is not None and ways.ego_in_other_way is None:
        return "ego", f"{_INTO} what is ahead of it"
    if ways.ego_in_other_way is not None and ways.other_in_ego_way is None:
        return "other", f"{_INTO} the ego from behind"
    if total > MOVED:
        return "", "both move toward each other"
    faster = float(case.ego.speed[-1]) >= float(case.other.speed[-1])
    return ("ego" if faster else "other"), f"{_INTO} the other"


def _who_came_later(ways: WaysBefore) -> tuple[str, str]:
    """Return who came last into the other's way at a crossing."""
    ego, other = ways.ego_in_other_way, ways.other_in_ego_way
    if ego is None and other is None:
        return "", "both come to the crossing at once"
    if other is None or (ego is not None and ego > other):
        return "ego", "the ego comes into its way from the side"
    if ego is None or other > ego:
        return "other", "the other comes into the ego's way from the side"
    return "", "both come to the crossing at once"
