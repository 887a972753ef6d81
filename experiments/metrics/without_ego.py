"""What the ego costs those behind it, against the same seed without the ego.

The same vehicle is compared at the same place of the road, with the ego and without.
Negative delays are gains: someone found the lane free that the ego did not take.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from experiments.trace.schema import Table, Trace
from planner.states import FloatArray

LEAST_ADVANCE = 1e-6  # less is standing [m]
LEAST_STRETCH = 1.0  # on which two ways are compared [m]


@dataclass(frozen=True, slots=True, eq=False)
class Way:
    """One vehicle along the ego's path until it leaves the road; arrays are (n,)."""

    time: FloatArray  # [s]
    s: FloatArray  # [m]
    speed: FloatArray  # [m/s]
    acceleration: FloatArray  # [m/s²]

    def time_at(self, s: float) -> float:
        """Give the time of coming to a place [s]."""
        reached = np.maximum.accumulate(self.s)
        moving = np.diff(reached, prepend=-np.inf) > LEAST_ADVANCE
        return float(np.interp(s, reached[moving], self.time[moving]))

    def speed_at(self, s: FloatArray) -> FloatArray:
        """Give the speed at places [m/s]."""
        reached = np.maximum.accumulate(self.s)
        moving = np.diff(reached, prepend=-np.inf) > LEAST_ADVANCE
        return np.asarray(np.interp(s, reached[moving], self.speed[moving]))

    def hardest_braking(self, begin: float, end: float) -> float:
        """Give the hardest braking on a stretch, >= 0 [m/s²]."""
        inside = (self.s >= begin) & (self.s <= end)
        return max(0.0, float(-self.acceleration[inside].min(initial=0.0)))


@dataclass(frozen=True, slots=True)
class Cost:
    """What one vehicle lost to the ego."""

    id: str
    delay: float  # [s]
    speed_loss: float  # >= 0 [m/s]
    added_deceleration: float  # >= 0 [m/s²]


def costs(trace: Trace, without: Table) -> list[Cost]:
    """Compare everyone who was behind the ego when first seen.

    Args:
        trace: The episode.
        without: The vehicles of the same seed without the ego, as in the trace's own
            table, at the same moments.

    Returns:
        One entry a vehicle that heads the ego's way; those who share no stretch of
        the road with themselves are left out.
    """
    found = []
    for name in _behind(trace):
        pair = _way(trace, trace.vehicles, name), _way(trace, without, name)
        if all(way.time.size > 1 for way in pair):
            cost = _cost(name, *pair)
            if cost is not None:
                found.append(cost)
    return found


def _cost(name: str, way: Way, free: Way) -> Cost | None:
    """Compare a way with that without the ego."""
    begin = max(float(way.s[0]), float(free.s[0]))
    end = min(float(way.s.max()), float(free.s.max()))
    if end - begin < LEAST_STRETCH:
        return None
    inside = (way.s >= begin) & (way.s <= end)
    lost = free.speed_at(way.s[inside]) - way.speed[inside]
    braking = way.hardest_braking(begin, end) - free.hardest_braking(begin, end)
    return Cost(name, _delay(way, free), max(0.0, float(lost.max())), max(0.0, braking))


def _delay(way: Way, free: Way) -> float:
    """Say how much later a vehicle is at the last place that both ways reach [s].

    Who stands there stands until the end: the one who is behind then counts with its
    last moment, the other with that of its passing.
    """
    last, free_last = float(way.s[-1]), float(free.s[-1])
    if last <= free_last:
        return float(way.time[-1]) - free.time_at(last)
    return way.time_at(free_last) - float(free.time[-1])


def _behind(trace: Trace) -> Iterator[str]:
    """Name who heads the ego's way and is behind it when first seen."""
    vehicles, steps = trace.vehicles, trace.steps
    names, first = np.unique(vehicles["id"].astype(str), return_index=True)
    ego_s = np.ma.filled(steps["centre_s_m"], np.nan)
    ego_s = ego_s[np.searchsorted(steps["index"], vehicles["index"][first])]
    s = np.ma.filled(vehicles["s_m"], np.nan)[first]
    error = np.ma.filled(vehicles["heading_error_rad"], np.nan)[first]
    # comparisons with NaN are false: no place on the path
    for number in np.flatnonzero((s < ego_s) & (np.cos(error) > 0.0)):
        yield str(names[number])


def _way(trace: Trace, table: Table, name: str) -> Way:
    """Take one vehicle's rows until it leaves the ego's carriageway."""
    rows = np.flatnonzero(table["id"] == name)
    s, l = (np.ma.filled(table[key], np.nan)[rows] for key in ("s_m", "l_m"))
    rows = rows[: _still_on(trace.road, s, l)]
    time = table["index"][rows] * float(trace.fact("step_s"))
    return Way(
        time.astype(np.float64),
        np.ma.getdata(table["s_m"])[rows],
        np.ma.getdata(table["speed_mps"])[rows],
        np.ma.getdata(table["acceleration_mps2"])[rows],
    )


def _still_on(road: Table, s: FloatArray, l: FloatArray) -> int:
    """Count the rows before the first that is off the road, or off the path."""
    left = np.interp(s, road["s_m"], np.ma.getdata(road["left_m"]))
    right = np.interp(s, road["s_m"], np.ma.getdata(road["right_m"]))
    inside: NDArray[np.bool_] = (l <= left) & (l >= right)
    return int(inside.size if inside.all() else np.argmin(inside))
