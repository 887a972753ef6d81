"""Whether the ego fits before or behind another vehicle in a conflict zone.

SUMO's own rule (`MSLink::blockedByFoe`): either one of the two has left before the
other arrives, with a time between them. Times of arrival are early and times of
leaving late ones, since neither driver keeps to a plan.
"""

import math

from planner.right_of_way.records import AtJunction, Foe, JunctionAhead

EARLY_EGO = 2.0  # acceleration with which the ego may arrive early [m/s²]
LATE_EGO = 1.2  # with which it surely leaves [m/s²] ...
LATE_IN_A_HURRY = 1.6  # ... at least once it has waited for long: it drives so [m/s²]
START = 0.6  # that a standing ego takes to move off [s] ...
START_IN_A_HURRY = 0.4  # ... once it has waited for long [s]
EARLY_FOE = 1.5  # acceleration with which another may arrive early [m/s²]
TURN_BRAKING = 3.0  # with which another slows down before it turns [m/s²]
SLOW = 0.5  # a slower vehicle is not counted on to leave [m/s]
GENTLE = 2.0  # braking of one behind a merging ego [m/s²]
HARD_BRAKING = 4.5  # with which a vehicle that has to give way can stop [m/s²]
OVERSHOOT = 0.3  # a bumper stopped this far over the line still waits there [m]
STUCK = 5.0  # a vehicle that has stood so long does not use its right of way [s]
MARGIN_BEHIND = 0.5  # between a vehicle that leaves and the ego [s]


def travel_time(
    distance: float, speed: float, acceleration: float, highest: float
) -> float:
    """Compute how long a distance takes [s].

    Args:
        distance: To go; none or less takes no time [m].
        speed: Now [m/s].
        acceleration: Until the highest speed is reached; positive [m/s²].
        highest: Speed; one who is faster keeps the speed [m/s].
    """
    if distance <= 0.0:
        return 0.0
    highest = max(highest, speed, 1e-3)
    ramp = (highest - speed) / acceleration
    covered = 0.5 * (speed + highest) * ramp
    if covered >= distance:
        root = math.sqrt(speed * speed + 2.0 * acceleration * distance)
        return (root - speed) / acceleration
    return ramp + (distance - covered) / highest


def ego_interval(
    ego: AtJunction, junction: JunctionAhead, foe: Foe, hurry: float = 0.0
) -> tuple[float, float]:
    """Compute when the ego arrives at the zone at the earliest, and has surely left.

    Args:
        ego: On its way to the junction.
        junction: Of the foe.
        foe: With the other vehicle.
        hurry: From 0 to 1: how long it has waited, see `planner.right_of_way.decision`.

    Returns:
        (early, late) from now on [s].
    """
    through = min(junction.speed, ego.target_speed)
    early = travel_time(foe.begin_s - ego.front, ego.speed, EARLY_EGO, through)
    standing = START + hurry * (START_IN_A_HURRY - START)
    start = standing if ego.speed < SLOW else 0.0
    slow = min(ego.speed, through)
    pulls = LATE_EGO + hurry * (LATE_IN_A_HURRY - LATE_EGO)
    late = travel_time(_clear_at(foe) - ego.rear, slow, pulls, through)
    return early, start + late


def _clear_at(foe: Foe) -> float:
    """Return where the ego's rear has to be for the other to come [m].

    Beyond the zone; where both go on in one lane the zone does not end, and the other
    is behind the ego as soon as that is in it.
    """
    return foe.begin_s if foe.merges else foe.end_s


def foe_interval(foe: Foe) -> tuple[float, float]:
    """Compute when the other arrives at the zone at the earliest, and has surely left.

    Returns:
        (early, late) from now on [s]; late is inf if it is not sure to leave.
    """
    early = _early_arrival(foe)
    if foe.exit <= 0.0:
        return early, 0.0
    if foe.speed < SLOW:
        return early, math.inf
    return early, foe.exit / foe.speed


def _early_arrival(foe: Foe) -> float:
    """Compute when the other is at the zone at the earliest [s].

    On its last road it keeps the limit, and it slows down for its turn, but late.
    """
    turn, limit, speed = foe.turn_speed, foe.limit, foe.speed
    inside = max(foe.entry - max(foe.to_line, 0.0), 0.0)
    if foe.to_line <= 0.0:
        return travel_time(foe.entry, speed, EARLY_FOE, max(turn, limit))
    before = max(foe.to_line - foe.road, 0.0)
    early = travel_time(before, speed, EARLY_FOE, max(speed, limit))
    way = foe.to_line - before
    if before > 0.0:
        speed = limit
    straight = travel_time(way + inside, speed, EARLY_FOE, limit)
    if turn >= limit:
        return early + straight
    fastest = math.sqrt(turn * turn + 2.0 * TURN_BRAKING * way)
    highest = min(max(limit, speed), fastest)
    braking = max((highest**2 - turn**2) / (2.0 * TURN_BRAKING), 0.0)
    turned = travel_time(way - braking, min(speed, highest), EARLY_FOE, highest)
    turned += min(braking, way) / (0.5 * (highest + turn)) + inside / turn
    return early + max(straight, turned)


def _catching_up(ego: AtJunction, junction: JunctionAhead, foe: Foe) -> float:
    """Compute the time that another behind a merging ego needs for slowing down [s].

    It is faster than the ego that has just come into their lane, and brakes gently.
    """
    if not foe.merges:
        return 0.0
    way = max(_clear_at(foe) - ego.rear, 0.0)
    through = min(junction.speed, ego.target_speed)
    slow = min(ego.speed, through)
    own = min(math.sqrt(slow * slow + 2.0 * LATE_EGO * way), through)
    fast = max(foe.speed, foe.limit)
    return max(fast - own, 0.0) ** 2 / (2.0 * GENTLE) / fast


def _seems_first(ego: AtJunction, junction: JunctionAhead, foe: Foe) -> bool:
    """Check whether one that is to go first finds the ego in the junction before it.

    Where ways meet far behind the ego's line, the other brakes for an ego that has
    passed that line, although it would be the first where they meet.
    """
    way = junction.stop_s - ego.front
    if not foe.goes_first or foe.entry <= 0.0 or way < -OVERSHOOT:
        return False
    through = min(junction.speed, ego.target_speed)
    enters = travel_time(max(way, 0.0), ego.speed, EARLY_EGO, through)
    return enters < foe.entry / max(foe.speed, SLOW)


def is_open(
    ego: AtJunction,
    junction: JunctionAhead,
    foe: Foe,
    gap: float,
    hurry: float = 0.0,
) -> bool:
    """Check whether the ego can go without getting into the other's way.

    Args:
        ego: On its way to the junction.
        junction: Of the foe.
        foe: With the other vehicle.
        gap: Time between the ego that leaves and the other that arrives [s].
        hurry: From 0 to 1: how long the ego has waited.
    """
    early, late = ego_interval(ego, junction, foe, hurry)
    foe_early, foe_late = foe_interval(foe)
    if early > foe_late + MARGIN_BEHIND and not _seems_first(ego, junction, foe):
        return True
    needed = late + gap + _catching_up(ego, junction, foe)
    return foe.entry > 0.0 and foe_early > needed


def counts(foe: Foe) -> bool:
    """Check whether the other vehicle is one to give way to.

    One with the right of way is; one that is in the zone is; and one without the right
    of way, or before a yellow or red light, if it cannot stop.
    """
    if foe.exit <= 0.0:
        return False
    if foe.entry <= 0.0:
        return True
    if foe.goes_first and not foe.held:
        return True
    return foe.speed**2 / (2.0 * HARD_BRAKING) > (
        foe.to_line if foe.held else foe.entry
    )
