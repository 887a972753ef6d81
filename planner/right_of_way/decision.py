"""May the ego drive over a junction now, and if not, where does it stop."""

import math
from collections.abc import Sequence
from dataclasses import replace

from planner.right_of_way.gaps import (
    HARD_BRAKING,
    OVERSHOOT,
    SLOW,
    STUCK,
    counts,
    is_open,
)
from planner.right_of_way.records import (
    MUST_STOP,
    AtJunction,
    Foe,
    JunctionAhead,
    Permission,
    Rule,
    Waiting,
)

GAP = 2.0  # between the ego that leaves and the next one, when it sets off [s]
KEPT_GAP = 1.0  # the same once it goes [s]
PATIENT = 5.0  # who has waited for longer takes shorter gaps ... [s]
IMPATIENT = 20.0  # ... the shortest after this [s]
SHORTEST_GAP = 1.0  # for an ego that sets off [s]
SHORTEST_KEPT = 0.5  # once it goes [s]
AT_LINE = 4.0  # an ego that stands so near to its line has stopped there [m]
STANDING = 0.1  # slower is standing [m/s]
BEFORE_ZONE = 0.7  # from the front bumper to the zone, where the ego stops inside [m]
DEADLOCK = 5.0  # standing before others that stand, after this the ego goes [s]
FOES_STOOD = 3.0  # ... if they have stood for so long [s]
QUIET = 2.0  # one that stands sets off within this once nobody comes any more [s]
LETS_PASS = 1.0  # one that gives way inside the junction has stood for so long [s]
LOOK_AHEAD = 1.5  # gentle braking before a line: nobody decides earlier [m/s²]
REACTION = 1.0  # [s]
ROOM = 5.0  # [m]


def is_near(ego: AtJunction, junction: JunctionAhead) -> bool:
    """Check whether it is time to decide: gentle braking would begin here."""
    way = junction.stop_s - ego.front
    braking = ego.speed**2 / (2.0 * LOOK_AHEAD)
    return way <= braking + REACTION * ego.speed + ROOM and ego.rear < junction.exit_s


def decide(
    ego: AtJunction,
    junction: JunctionAhead,
    foes: Sequence[Foe],
    memory: Waiting,
    step: float,
) -> Permission:
    """Decide whether the ego may drive over one junction.

    Args:
        ego: Near the junction.
        junction: The junction.
        foes: With the vehicles there, all of this junction.
        memory: Of the cycle before.
        step: Since then [s].

    Returns:
        The decision. The ego stops at its line; further inside if it may wait there,
        or if it is over the line already and can stop before the zone.
    """
    memory = _waited(ego, junction, memory, step)
    if junction.rule in MUST_STOP and not memory.stopped and _at_line(ego, junction):
        return _closed(ego, junction, (), memory, "stop sign")
    standing = [foe for foe in foes if _stands_for_good(foe)]
    blocking = tuple(
        foe
        for foe in foes
        if _blocks(ego, junction, foe, memory)
        and not any(_is_behind(foe, first) for first in standing)
    )
    if blocking and _is_deadlock(blocking, memory):
        blocking = ()
    memory = memory._replace(quiet=0.0 if blocking else memory.quiet + step)
    if not memory.goes and memory.quiet < QUIET:
        blocking = blocking or _about_to_go(ego, junction, standing)
    if not blocking:
        return Permission(None, memory._replace(goes=True, place=math.inf), "")
    if any(_comes_through(ego, junction.wait_s, foe) for foe in foes):
        junction = replace(junction, wait_s=None)
    first = min(blocking, key=lambda foe: (foe.entry, foe.vehicle))
    return _closed(ego, junction, blocking, memory, first.vehicle)


def _about_to_go(
    ego: AtJunction, junction: JunctionAhead, standing: Sequence[Foe]
) -> tuple[Foe, ...]:
    """List those that have stood for long for the same vehicles as the ego.

    When the last of these is gone they set off as the ego does, and go first. Where
    everybody has to stop, the time of waiting decides.
    """
    if junction.rule is Rule.ALL_WAY_STOP or not _at_line(ego, junction):
        return ()
    return tuple(
        x for x in standing if x.goes_first and x.to_line <= AT_LINE and counts(x)
    )


def _waited(
    ego: AtJunction, junction: JunctionAhead, memory: Waiting, step: float
) -> Waiting:
    """Remember an ego that stands at its line."""
    if abs(ego.speed) >= STANDING:
        return memory._replace(stood=0.0)
    near = ego.front >= junction.stop_s - AT_LINE
    stood = memory.stood + step if near else 0.0
    waited = memory.waited + step if near else memory.waited
    return memory._replace(stopped=memory.stopped or near, stood=stood, waited=waited)


def _at_line(ego: AtJunction, junction: JunctionAhead) -> bool:
    """Check whether the ego is not over its line yet."""
    return ego.front <= junction.stop_s + OVERSHOOT


def _blocks(
    ego: AtJunction, junction: JunctionAhead, foe: Foe, memory: Waiting
) -> bool:
    """Check whether the ego has to wait for another vehicle."""
    if ego.front > foe.begin_s or ego.rear > foe.end_s:
        return False  # in the zone: out of it, not back
    if not _at_line(ego, junction) and _lets_pass(foe):
        return False
    if junction.rule is Rule.ALL_WAY_STOP and foe.to_line > -OVERSHOOT:
        return _comes_before(foe, memory)
    if not counts(foe) or (_stands_for_good(foe) and memory.waited >= DEADLOCK):
        return False
    hurry = _hurry(memory)
    gap, least = (KEPT_GAP, SHORTEST_KEPT) if memory.goes else (GAP, SHORTEST_GAP)
    gap += hurry * (least - gap)
    return not is_open(ego, junction, foe, gap, hurry)


def _stands_for_good(foe: Foe) -> bool:
    """Check whether the other has stood for so long that it may not go at all.

    It may also stand in a queue, or wait for somebody else: an ego that has waited for
    long itself goes nevertheless, others only if it may set off now.
    """
    return foe.entry > 0.0 and foe.stood >= STUCK


def _is_behind(foe: Foe, first: Foe) -> bool:
    """Check whether one of two comes behind the other on the same way.

    Behind one that stands at its line it cannot come before that, however it creeps up;
    one that stands farther off, as at a stop, can be overtaken.
    """
    if first.to_line > AT_LINE:
        return False
    same = foe.begin_s == first.begin_s and foe.end_s == first.end_s
    same = same and foe.road == first.road and foe.turn_speed == first.turn_speed
    return same and foe.to_line > first.to_line


def _hurry(memory: Waiting) -> float:
    """Return how much shorter the gaps are that an ego takes after its wait, 0 to 1.

    Drivers accept shorter gaps the longer they have waited: in dense flows those that
    hold with all margins may not come at all.
    """
    return min(max((memory.waited - PATIENT) / (IMPATIENT - PATIENT), 0.0), 1.0)


def _comes_through(ego: AtJunction, place: float | None, foe: Foe) -> bool:
    """Check whether an ego that waits inside the junction stands in another's way.

    Args:
        ego: Near the junction.
        place: Where its front would wait, if it may [m].
        foe: One of all at the junction.
    """
    if place is None or not (foe.goes_first and counts(foe)) or foe.entry <= 0.0:
        return False
    return foe.begin_s < place and place - (ego.front - ego.rear) < foe.end_s


def _lets_pass(foe: Foe) -> bool:
    """Check whether the other waits inside the junction for the ego to go by.

    It reaches into the zone of its whole way, but the ego meets a body that stands:
    whether there is room beside it is a matter of the clearance of plans. Two that both
    wait there for the other would stand for ever: one that has stood for long lets the
    ego go by although it would go first.
    """
    inside = foe.entry <= 0.0 < foe.exit
    return inside and foe.stood >= (LETS_PASS if foe.gives_way else STUCK)


def _comes_before(foe: Foe, memory: Waiting) -> bool:
    """Check whether the other goes first where everybody has to stop."""
    if memory.goes:
        return False
    if foe.speed >= SLOW:  # it has not stopped yet; perhaps it cannot
        return foe.speed**2 / (2.0 * HARD_BRAKING) > foe.entry
    at_line = foe.to_line <= AT_LINE
    return at_line and foe.goes_first and foe.stood >= memory.stood


def _is_deadlock(blocking: Sequence[Foe], memory: Waiting) -> bool:
    """Check whether everybody waits for everybody."""
    return memory.stood >= DEADLOCK and all(
        foe.entry > 0.0 and foe.stood >= FOES_STOOD for foe in blocking
    )


def _closed(
    ego: AtJunction,
    junction: JunctionAhead,
    blocking: Sequence[Foe],
    memory: Waiting,
    why: str,
) -> Permission:
    """Find where the ego stops; it goes on if it cannot stop any more.

    Over its line it does not creep on while anybody blocks it: farther in it would
    stand in the way of others, who may come later.
    """
    zone = min((x.begin_s for x in blocking), default=junction.exit_s) - BEFORE_ZONE
    if not _at_line(ego, junction) and ego.front <= memory.place + OVERSHOOT:
        zone = min(zone, memory.place)
    inside = junction.wait_s
    places = [(junction.stop_s, ego.deceleration)]
    if inside is not None and inside <= zone:
        places.insert(0, (inside, ego.deceleration))
    places.append((max(zone, junction.stop_s), ego.emergency_deceleration))
    for stop_s, deceleration in places:
        room = stop_s - ego.front + OVERSHOOT
        if room >= 0.0 and ego.speed**2 <= 2.0 * deceleration * room:
            waits = memory._replace(goes=False, place=stop_s)
            return Permission(stop_s, waits, why)
    return Permission(None, memory._replace(goes=True, place=math.inf), "")
