"""Who came into whose way before a contact, and when."""

from dataclasses import dataclass

import numpy as np

from experiments.metrics.verdict.overlap import RectangleRows, overlap
from experiments.metrics.verdict.records import BodyTrack, ContactCase
from planner.states import BoolArray, FloatArray

AHEAD = 4.0  # a body's way is as long as it drives in this time [s]
LEAST = 3.0  # but no shorter [m]
BEFORE = 3.0  # over which it is seen who moved sideways [s]
MOST = 0.7  # share of the approach sideways that makes it one's own doing
MOVED = 0.3  # less than this sideways is no move [m]


@dataclass(frozen=True, slots=True)
class WaysBefore:
    """Whether each was in the other's way, and since which step.

    `other_in_ego_way` is the first step of the last uninterrupted stretch up to the
    contact in which the other was in the ego's way; None if it was not just before.
    """

    other_in_ego_way: int | None
    ego_in_other_way: int | None


def ways_before(case: ContactCase) -> WaysBefore:
    """Find who was in whose way up to the contact."""
    return WaysBefore(
        _since(in_way(case.ego, case.other)),
        None if case.standing else _since(in_way(case.other, case.ego)),
    )


def sideways(case: ContactCase) -> tuple[float, float]:
    """Return how far ego and other moved toward each other across the ego's heading.

    Over `BEFORE`, against going on as they did then: both [m], positive toward the
    other one.
    """
    last = len(case.ego.x) - 1
    first = max(last - round(BEFORE / case.step), 0)
    there = np.flatnonzero(np.isfinite(case.other.x))
    first = max(first, int(there[0]) if there.size else last)
    normal = float(case.ego.heading[first]) + 0.5 * np.pi
    nx, ny = np.cos(normal), np.sin(normal)
    gap = (case.other.x - case.ego.x) * nx + (case.other.y - case.ego.y) * ny
    side = np.sign(gap[first]) if gap[first] else 1.0
    own = side * _moved(case.ego, first, nx, ny)
    return own, -side * _moved(case.other, first, nx, ny)


def _moved(track: BodyTrack, first: int, nx: float, ny: float) -> float:
    """Return the displacement of a track along a direction since a step [m]."""
    dx, dy = track.x[-1] - track.x[first], track.y[-1] - track.y[first]
    return float(dx * nx + dy * ny)


def in_way(body: BodyTrack, other: BodyTrack) -> BoolArray:
    """Check in which steps the other is in a body's way, straight ahead of it."""
    reach: FloatArray = np.maximum(AHEAD * body.speed, LEAST)
    way = RectangleRows(
        body.x + 0.5 * reach * np.cos(body.heading),
        body.y + 0.5 * reach * np.sin(body.heading),
        body.heading,
        body.length + reach,
        np.asarray(body.width),
    )
    is_ahead = (other.x - body.x) * np.cos(body.heading) + (other.y - body.y) * np.sin(
        body.heading
    ) > 0.0
    row = RectangleRows(
        other.x,
        other.y,
        other.heading,
        np.asarray(other.length),
        np.asarray(other.width),
    )
    return overlap(way, row) & is_ahead


def _since(marks: BoolArray) -> int | None:
    """Return the first step of the stretch of marks that lasts up to the contact.

    The contact itself and the step before it may be unmarked: the body is beside then.
    """
    rows = np.flatnonzero(marks)
    last = len(marks) - 1
    if not rows.size or rows[-1] < last - 1:
        return None
    first = int(rows[-1])
    while first > 0 and marks[first - 1]:
        first -= 1
    return first
