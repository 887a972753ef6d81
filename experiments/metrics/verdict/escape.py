"""The last step in which a body could still have avoided a contact.

Going backwards from the contact, the first step is sought from which one of a few
manoeuvres keeps the body clear of everything: braking, and for the ego braking with a
swerve inside its road. What all others do is what they did; after the contact they go
on with the acceleration that they had.
"""

import numpy as np

from experiments.metrics.verdict.overlap import RectangleRows, overlap
from experiments.metrics.verdict.records import (
    AvoidanceLimits,
    BodyTrack,
    ContactCase,
)
from planner.states import FloatArray

LOOK_BACK = 8.0  # before the contact [s]
MOVES = 0.05  # in a step; its course is known from there on [m]
CLEAR_FOR = 1.5  # after the moment of the contact [s]
SHIFTS = (0.0, 0.5, 1.0, 2.0, 3.5)  # of a swerve, to both sides [m]


def last_escape_of_ego(case: ContactCase, limits: AvoidanceLimits) -> int | None:
    """Return the last step in which the ego could avoid; None if it never could."""
    bodies = (case.other, *case.bystanders)
    for start in _backwards(case):
        room = case.right[start], case.left[start]
        shifts = [s for s in (*SHIFTS, *(-s for s in SHIFTS[1:])) if _fits(s, room)]
        ways = [
            _way(case.ego, start, braking, shift, case, limits)
            for braking in (limits.ego_braking, 0.5 * limits.ego_braking, 0.0)
            for shift in shifts
        ]
        if _any_clear(ways, bodies, start, case):
            return start
    return None


def last_escape_of_other(case: ContactCase, limits: AvoidanceLimits) -> int | None:
    """Return the last step in which the other could decide to brake and so avoid.

    It brakes after its reaction time, on the course that it has: a change of lane goes
    on.
    """
    if case.standing:
        return None
    reaction = round(limits.other_reaction / case.step)
    for start in _backwards(case):
        if not np.isfinite(case.other.x[start]):
            return None
        way = _way(case.other, start, limits.other_braking, 0.0, case, limits)
        if _any_clear([way], (case.ego,), start, case):
            decided = start - reaction
            there = decided >= 0 and bool(np.isfinite(case.other.x[decided]))
            return decided if there else None
    return None


def _backwards(case: ContactCase) -> range:
    """Return the steps before the contact, the latest first."""
    last = len(case.ego.x) - 1
    return range(last - 1, max(last - round(LOOK_BACK / case.step), 0) - 1, -1)


def _fits(shift: float, room: tuple[float, float]) -> bool:
    """Check that a shift stays inside the room to the right and left [m]."""
    return shift == 0.0 or -room[0] <= shift <= room[1]


def _times(start: int, case: ContactCase) -> FloatArray:
    """Return the times of a manoeuvre, its first step aside [s]."""
    until = len(case.ego.x) - 1 - start + round(CLEAR_FOR / case.step)
    times: FloatArray = case.step * np.arange(1.0, until + 1.0)
    return times


def _way(
    body: BodyTrack,
    start: int,
    braking: float,
    shift: float,
    case: ContactCase,
    limits: AvoidanceLimits,
) -> RectangleRows:
    """Return where a manoeuvre leads a body; arrays are (n_times,).

    The shift goes with constant lateral acceleration, first to the side and then back,
    its slope bounded: a standing car does not move sideways.
    """
    t = _times(start, case)
    speed = float(body.speed[start])
    moving = np.minimum(t, speed / braking) if braking > 0.0 else t
    along = speed * moving - 0.5 * braking * moving**2
    side = np.sign(shift) * _eased(t, abs(shift), limits.ego_lateral)
    before = np.concatenate(([0.0], along[:-1]))
    steps = np.diff(side, prepend=0.0)
    most = limits.ego_slope * np.maximum(along - before, 0.0)
    side = np.cumsum(np.clip(steps, -most, most))
    heading = float(body.heading[start])
    course = _course(body, start)
    cos, sin = np.cos(course), np.sin(course)
    slope = np.diff(side, prepend=0.0) / np.maximum(along - before, 0.1)
    return RectangleRows(
        body.x[start] + along * cos - side * sin,
        body.y[start] + along * sin + side * cos,
        heading + np.arctan(slope),
        np.asarray(body.length),
        np.asarray(body.width),
    )


def _course(body: BodyTrack, start: int) -> float:
    """Return the direction in which a body moves, its heading where it stands [rad]."""
    before = max(start - 1, 0)
    dx, dy = body.x[start] - body.x[before], body.y[start] - body.y[before]
    moves = np.isfinite(dx + dy) and np.hypot(dx, dy) > MOVES
    return float(np.arctan2(dy, dx) if moves else body.heading[start])


def _eased(t: FloatArray, shift: float, acceleration: float) -> FloatArray:
    """Return a shift over time: half of it faster and faster, half slower [m]."""
    if shift == 0.0:
        return np.zeros_like(t)
    half = np.sqrt(shift / acceleration)
    rising = 0.5 * acceleration * np.minimum(t, half) ** 2
    left = np.clip(2.0 * half - t, 0.0, half)
    return np.where(t < half, rising, shift - 0.5 * acceleration * left**2)


def _any_clear(
    ways: list[RectangleRows],
    bodies: tuple[BodyTrack, ...],
    start: int,
    case: ContactCase,
) -> bool:
    """Check whether one of the ways stays clear of all bodies."""
    length = np.array([float(way.length) for way in ways])[:, None]
    width = np.array([float(way.width) for way in ways])[:, None]
    all_ways = RectangleRows(
        np.array([way.x for way in ways]),
        np.array([way.y for way in ways]),
        np.array([way.heading for way in ways]),
        length,
        width,
    )
    clear = np.ones(len(ways), dtype=bool)
    for body in bodies:
        clear &= ~overlap(all_ways, _goes_on(body, start, case)).any(axis=1)
        if not clear.any():
            return False
    return True


def _goes_on(body: BodyTrack, start: int, case: ContactCase) -> RectangleRows:
    """Return where a body was after a step, and where it would have been later."""
    recorded = len(body.x) - 1
    count = len(_times(start, case))
    later = case.step * np.arange(1, count - (recorded - start) + 1)
    speed, rate = float(body.speed[-1]), float(body.acceleration[-1])
    moving = np.minimum(later, speed / -rate) if rate < 0.0 else later
    along = speed * moving + 0.5 * rate * moving**2
    heading = float(body.heading[-1])
    rows = slice(start + 1, recorded + 1)
    return RectangleRows(
        np.concatenate((body.x[rows], body.x[-1] + along * np.cos(heading))),
        np.concatenate((body.y[rows], body.y[-1] + along * np.sin(heading))),
        np.concatenate((body.heading[rows], np.full(later.size, heading))),
        np.asarray(body.length),
        np.asarray(body.width),
    )
