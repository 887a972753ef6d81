"""Cost of the ego to the vehicles behind it, against the same seed without the ego.

Each vehicle is compared with itself at the same place of the road, with the ego and
without. A negative delay is a gain, for example where the ego left a lane free.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from experiments.metrics.pairs import neighbours
from experiments.trace.schema import Table, Trace
from planner.states import FloatArray

MIN_ADVANCE = 1e-6  # below this a vehicle stands [m]
FAR_AHEAD = 50.0  # centre to centre; no vehicle reacts to one behind it [m]
MIN_STRETCH = 1.0  # shortest stretch on which two drives are compared [m]


@dataclass(frozen=True, slots=True, eq=False)
class VehicleDrive:
    """One vehicle along the ego's path until it leaves the road; arrays are (n,)."""

    time: FloatArray  # [s]
    s: FloatArray  # [m]
    speed: FloatArray  # [m/s]
    acceleration: FloatArray  # [m/s²]

    def time_at(self, s: float) -> float:
        """Return the time at which a place is reached [s]."""
        reached = np.maximum.accumulate(self.s)
        moving = np.diff(reached, prepend=-np.inf) > MIN_ADVANCE
        return float(np.interp(s, reached[moving], self.time[moving]))

    def speed_at(self, s: FloatArray) -> FloatArray:
        """Return the speed at places [m/s]."""
        reached = np.maximum.accumulate(self.s)
        moving = np.diff(reached, prepend=-np.inf) > MIN_ADVANCE
        return np.asarray(np.interp(s, reached[moving], self.speed[moving]))

    def hardest_braking(self, begin: float, end: float) -> float:
        """Return the hardest braking on a stretch, >= 0 [m/s²]."""
        inside = (self.s >= begin) & (self.s <= end)
        return max(0.0, float(-self.acceleration[inside].min(initial=0.0)))


@dataclass(frozen=True, slots=True)
class Cost:
    """Loss of one vehicle due to the ego."""

    id: str
    delay: float  # [s]
    speed_loss: float  # >= 0 [m/s]
    added_deceleration: float  # >= 0 [m/s²]
    # when the delay was complete, most speed lost, and braking hardest [s]
    delayed_at: float = field(default=0.0, compare=False)
    lost_at: float = field(default=0.0, compare=False)
    braked_at: float = field(default=0.0, compare=False)


def costs(trace: Trace, without: Table, other: Table | None = None) -> list[Cost]:
    """Compare the same-direction vehicles that were behind the ego when first observed.

    Args:
        trace: The episode.
        without: The vehicles of the same seed without the ego, in the format of the
            trace's own table, at the same times.
        other: A second run without the ego, which takes the place of the episode: what
            differs then is chance.

    Returns:
        One entry per vehicle; a vehicle whose two drives share no stretch of the road
        is left out.
    """
    driven = trace.vehicles if other is None else other
    return _compared(trace, _behind(trace), driven, without)


def costs_ahead(trace: Trace, without: Table) -> list[Cost]:
    """Compare the vehicles that the ego cannot have influenced: far ahead, always.

    Those of its direction whose centre is at least `FAR_AHEAD` ahead in every step in
    which both have a place on the path. What differs is chance.
    """
    return _compared(trace, _far_ahead(trace), trace.vehicles, without)


def _compared(
    trace: Trace, names: Iterator[str], driven: Table, without: Table
) -> list[Cost]:
    """Compare vehicles in two tables; see `costs`."""
    found = []
    for name in names:
        pair = drive_of(trace, driven, name), drive_of(trace, without, name)
        if all(one.time.size > 1 for one in pair):
            cost = _cost(name, *pair)
            if cost is not None:
                found.append(cost)
    return found


def n_compared(found: Sequence[Cost] | None) -> int | None:
    """Count the compared vehicles; None without the run to compare with."""
    return None if found is None else len(found)


def mean_delay(found: Sequence[Cost] | None) -> float | None:
    """Average the delays [s]; None without compared vehicles, here and below."""
    return sum(cost.delay for cost in found) / len(found) if found else None


def max_delay(found: Sequence[Cost] | None) -> float | None:
    """Return the largest delay [s]."""
    return max((cost.delay for cost in found or ()), default=None)


def max_speed_loss(found: Sequence[Cost] | None) -> float | None:
    """Return the largest speed loss, >= 0 [m/s]."""
    return max((cost.speed_loss for cost in found or ()), default=None)


def max_added_deceleration(found: Sequence[Cost] | None) -> float | None:
    """Return the largest added deceleration, >= 0 [m/s²]."""
    return max((cost.added_deceleration for cost in found or ()), default=None)


def _cost(name: str, driven: VehicleDrive, free: VehicleDrive) -> Cost | None:
    """Compare a drive with the one without the ego."""
    begin = max(float(driven.s[0]), float(free.s[0]))
    end = min(float(driven.s.max()), float(free.s.max()))
    if end - begin < MIN_STRETCH:
        return None
    inside = (driven.s >= begin) & (driven.s <= end)
    lost = free.speed_at(driven.s[inside]) - driven.speed[inside]
    braking = driven.hardest_braking(begin, end) - free.hardest_braking(begin, end)
    times = driven.time[inside]
    return Cost(
        name,
        _delay(driven, free),
        max(0.0, float(lost.max())),
        max(0.0, braking),
        driven.time_at(end),
        float(times[lost.argmax()]),
        float(times[driven.acceleration[inside].argmin()]),
    )


def _delay(driven: VehicleDrive, free: VehicleDrive) -> float:
    """Return the delay at the last place that both drives reach [s].

    A vehicle that ends there stands there until the end: the shorter drive counts with
    its last time, the longer one with the time at which it passes.
    """
    last, free_last = float(driven.s[-1]), float(free.s[-1])
    if last <= free_last:
        return float(driven.time[-1]) - free.time_at(last)
    return driven.time_at(free_last) - float(free.time[-1])


def _behind(trace: Trace) -> Iterator[str]:
    """Yield the same-direction vehicles that are behind the ego when first observed."""
    vehicles, steps = trace.vehicles, trace.steps
    names, first = np.unique(vehicles["id"].astype(str), return_index=True)
    ego_s = np.ma.filled(steps["centre_s_m"], np.nan)
    ego_s = ego_s[np.searchsorted(steps["index"], vehicles["index"][first])]
    s = np.ma.filled(vehicles["s_m"], np.nan)[first]
    error = np.ma.filled(vehicles["heading_error_rad"], np.nan)[first]
    # comparisons with NaN are false: no place on the path
    for number in np.flatnonzero((s < ego_s) & (np.cos(error) > 0.0)):
        yield str(names[number])


def _far_ahead(trace: Trace) -> Iterator[str]:
    """Yield the same-direction vehicles that are always far ahead of the ego."""
    pairs = neighbours(trace)
    names, inverse = np.unique(pairs.id.astype(str), return_inverse=True)
    near = (pairs.ds < FAR_AHEAD) | (np.cos(pairs.heading) <= 0.0)
    ever_near = np.bincount(inverse[near], minlength=names.size) > 0
    for number in np.flatnonzero(~ever_near):
        yield str(names[number])


def drive_of(trace: Trace, table: Table, name: str) -> VehicleDrive:
    """Select one vehicle's rows until it leaves the ego's carriageway."""
    rows = np.flatnonzero(table["id"] == name)
    s, l = (np.ma.filled(table[key], np.nan)[rows] for key in ("s_m", "l_m"))
    rows = rows[: _still_on(trace.road, s, l)]
    time = table["index"][rows] * float(trace.fact("step_s"))
    return VehicleDrive(
        time.astype(np.float64),
        np.ma.getdata(table["s_m"])[rows],
        np.ma.getdata(table["speed_mps"])[rows],
        np.ma.getdata(table["acceleration_mps2"])[rows],
    )


def _still_on(road: Table, s: FloatArray, l: FloatArray) -> int:
    """Count the rows before the first one off the road or off the path."""
    left = np.interp(s, road["s_m"], np.ma.getdata(road["left_m"]))
    right = np.interp(s, road["s_m"], np.ma.getdata(road["right_m"]))
    inside: NDArray[np.bool_] = (l <= left) & (l >= right)
    return int(inside.size if inside.all() else np.argmin(inside))
