"""May the ego drive over a junction now, and if not, where does it stop."""

from collections.abc import Sequence

from planner.right_of_way.gaps import HARD_BRAKING, SLOW, counts, is_open
from planner.right_of_way.records import (
    MUST_STOP,
    AtCrossing,
    Conflict,
    Crossing,
    Permission,
    Rule,
    Waiting,
)

GAP = 2.0  # between the ego that leaves and the next one, when it sets off [s]
KEPT_GAP = 1.0  # the same once it goes [s]
AT_LINE = 4.0  # an ego that stands so near to its line has stopped there [m]
STANDING = 0.1  # slower is standing [m/s]
OVERSHOOT = 0.3  # a bumper stopped this far over the line still waits there [m]
BEFORE_ZONE = 0.7  # from the front bumper to the zone, where the ego stops inside [m]
DEADLOCK = 5.0  # standing before others that stand, after this the ego goes [s]
FOES_STOOD = 3.0  # ... if they have stood for so long [s]
LOOK_AHEAD = 1.5  # gentle braking before a line: nobody decides earlier [m/s²]
REACTION = 1.0  # [s]
ROOM = 5.0  # [m]


def is_near(ego: AtCrossing, crossing: Crossing) -> bool:
    """Check whether it is time to decide: gentle braking would begin here."""
    way = crossing.stop_s - ego.front
    braking = ego.speed**2 / (2.0 * LOOK_AHEAD)
    return way <= braking + REACTION * ego.speed + ROOM and ego.rear < crossing.exit_s


def decide(
    ego: AtCrossing,
    crossing: Crossing,
    conflicts: Sequence[Conflict],
    memory: Waiting,
    step: float,
) -> Permission:
    """Decide whether the ego may drive over one junction.

    Args:
        ego: Near the crossing.
        crossing: The junction.
        conflicts: With the vehicles there, all of this crossing.
        memory: Of the cycle before.
        step: Since then [s].

    Returns:
        The decision. The ego stops at its line; further inside if it may wait there,
        or if it is over the line already and can stop before the zone.
    """
    memory = _waited(ego, crossing, memory, step)
    if crossing.rule in MUST_STOP and not memory.stopped and _at_line(ego, crossing):
        return _closed(ego, crossing, (), memory, "stop sign")
    blocking = tuple(
        conflict for conflict in conflicts if _blocks(ego, crossing, conflict, memory)
    )
    if blocking and _is_deadlock(blocking, memory):
        blocking = ()
    if not blocking:
        return Permission(None, memory._replace(goes=True), "")
    first = min(blocking, key=lambda conflict: (conflict.entry, conflict.vehicle))
    return _closed(ego, crossing, blocking, memory, first.vehicle)


def _waited(
    ego: AtCrossing, crossing: Crossing, memory: Waiting, step: float
) -> Waiting:
    """Remember an ego that stands at its line."""
    if abs(ego.speed) >= STANDING:
        return memory._replace(stood=0.0)
    near = ego.front >= crossing.stop_s - AT_LINE
    stood = memory.stood + step if near else 0.0
    return memory._replace(stopped=memory.stopped or near, stood=stood)


def _at_line(ego: AtCrossing, crossing: Crossing) -> bool:
    """Check whether the ego is not over its line yet."""
    return ego.front <= crossing.stop_s + OVERSHOOT


def _blocks(
    ego: AtCrossing, crossing: Crossing, conflict: Conflict, memory: Waiting
) -> bool:
    """Check whether the ego has to wait for another vehicle."""
    if ego.front > conflict.begin_s or ego.rear > conflict.end_s:
        return False  # in the zone: out of it, not back
    if crossing.rule is Rule.ALL_WAY_STOP and conflict.to_line > -OVERSHOOT:
        return _comes_before(conflict, memory)
    if not counts(conflict):
        return False
    return not is_open(ego, crossing, conflict, KEPT_GAP if memory.goes else GAP)


def _comes_before(conflict: Conflict, memory: Waiting) -> bool:
    """Check whether the other goes first where everybody has to stop."""
    if memory.goes:
        return False
    if conflict.speed >= SLOW:  # it has not stopped yet; perhaps it cannot
        return conflict.speed**2 / (2.0 * HARD_BRAKING) > conflict.entry
    at_line = conflict.to_line <= AT_LINE
    return at_line and conflict.goes_first and conflict.stood >= memory.stood


def _is_deadlock(blocking: Sequence[Conflict], memory: Waiting) -> bool:
    """Check whether everybody waits for everybody."""
    return memory.stood >= DEADLOCK and all(
        conflict.entry > 0.0 and conflict.stood >= FOES_STOOD for conflict in blocking
    )


def _closed(
    ego: AtCrossing,
    crossing: Crossing,
    blocking: Sequence[Conflict],
    memory: Waiting,
    why: str,
) -> Permission:
    """Find where the ego stops; it goes on if it cannot stop any more."""
    zone = min((x.begin_s for x in blocking), default=crossing.exit_s) - BEFORE_ZONE
    inside = crossing.wait_s
    places = [(crossing.stop_s, ego.deceleration)]
    if inside is not None and inside <= zone:
        places.insert(0, (inside, ego.deceleration))
    places.append((max(zone, crossing.stop_s), ego.emergency_deceleration))
    for stop_s, deceleration in places:
        room = stop_s - ego.front + OVERSHOOT
        if room >= 0.0 and ego.speed**2 <= 2.0 * deceleration * room:
            return Permission(stop_s, memory._replace(goes=False), why)
    return Permission(None, memory._replace(goes=True), "")
