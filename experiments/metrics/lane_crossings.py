"""When the ego's body crosses lane lines, and when it is in another lane."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from experiments.trace.schema import Trace
from planner.states import FloatArray

TOLERANCE = 0.01  # a body this far over a line is still inside [m]
NO_LANE = 0.1  # a lane less wide is not there [m]
SETTLED_TIME = 1.0  # for which a body has to be inside a lane after a crossing [s]

OVER, UNKNOWN = -1, -2  # instead of the number of a lane


@dataclass(frozen=True, slots=True)
class Crossing:
    """A stay of the ego's body over a lane line; `begin` and `end` are rows of steps.

    Lanes are numbered from the right. `end` and `lane` are None if the episode ended
    before the body was inside one lane again.
    """

    begin: int
    end: int | None
    home: int
    lane: int | None
    left: bool  # it began over the line to the left


def lane_crossings(trace: Trace) -> list[Crossing]:
    """Find every time the ego's body is over a lane line.

    A crossing begins in the first step in which the body reaches more than 1 cm beyond
    the lane that it was inside, and ends when it has been inside one lane for 1 s.
    Roads without marked lanes have none.
    """
    lanes, offsets = _lanes_of(trace)
    held = max(1, round(SETTLED_TIME / float(trace.fact("step_s"))))
    return list(_crossings(lanes, offsets, held)) if lanes.size else []


def _crossings(
    lanes: NDArray[np.int64], offsets: FloatArray, held: int
) -> Iterator[Crossing]:
    """Yield the crossings of a body.

    Args:
        lanes: In each step, the lane that holds the body, `OVER` or `UNKNOWN`.
        offsets: Of the body's centre from that of its last lane; as long.
        held: Steps inside a lane that end a crossing.
    """
    home, begin = UNKNOWN, None
    for step, lane in enumerate(lanes.tolist()):
        if lane == UNKNOWN:
            home, begin = UNKNOWN, None
        elif begin is None:
            if lane == OVER and home != UNKNOWN:
                begin = step
            elif lane != OVER:
                home = lane
        elif lane != OVER and _stays(lanes[step : step + held], lane, held):
            yield Crossing(begin, step, home, lane, bool(offsets[begin] > 0.0))
            home, begin = lane, None
    if begin is not None:
        yield Crossing(begin, None, home, None, bool(offsets[begin] > 0.0))


def _stays(lanes: NDArray[np.int64], lane: int, held: int) -> bool:
    """Check whether a body is inside one lane for so many steps."""
    return lanes.size == held and bool((lanes == lane).all())


def _lanes_of(trace: Trace) -> tuple[NDArray[np.int64], FloatArray]:
    """Return the lane that holds the body in each step, and the offset from the last.

    Both are (n_steps,), or empty on a road without lanes.
    """
    steps, table = trace.steps, trace.lanes
    numbers = np.unique(np.ma.getdata(table["lane"]))
    if numbers.size == 0 or len(steps["index"]) == 0:
        return np.empty(0, dtype=np.int64), np.empty(0)
    s, l, turn = (
        np.ma.filled(steps[key].astype(np.float64), np.nan)
        for key in ("centre_s_m", "centre_l_m", "heading_error_rad")
    )
    reach = (
        np.abs(np.sin(turn)) * float(trace.fact("length_m"))
        + np.abs(np.cos(turn)) * float(trace.fact("width_m"))
    ) / 2.0
    centre, width = (
        np.array(
            [
                np.interp(s, *(np.ma.getdata(table[k])[own] for k in ("s_m", key)))
                for own in (np.ma.getdata(table["lane"]) == lane for lane in numbers)
            ]
        )
        for key in ("centre_m", "width_m")
    )
    beyond = np.abs(l - centre) + reach - width / 2.0  # (n_lanes, n_steps)
    inside = (beyond <= TOLERANCE) & (width > NO_LANE)
    lane = np.where(inside.any(axis=0), inside.argmax(axis=0), OVER)
    lane[~np.isfinite(l + turn)] = UNKNOWN
    last = np.maximum.accumulate(np.where(lane >= 0, np.arange(lane.size), 0))
    home = np.maximum(lane[last], 0)
    return lane, l - centre[home, np.arange(lane.size)]
