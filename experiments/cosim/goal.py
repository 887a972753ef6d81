"""A goal with place, time, speed and heading, and the speed at which to drive to it."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from planner.states import CartesianState
from planner.vehicle import Vehicle, centre_from_rear_axle

TIME_TOLERANCE = 1e-6  # [s]
IN_TIME = 0.9  # share of the time that is left in which one wants to be there
SPARE_WAY = 1.0  # before the end of an area in which one waits for its time [m]
BRAKING = 1.2  # towards the goal's speed [m/s²]
SPEEDING_UP = 0.8  # the same [m/s²]
LEAD = 1.0  # by which that begins earlier: planners follow a speed with a lag [s]
INNER = 0.25  # share of the goal's interval of speeds that is kept free at both ends
BEYOND = 5.0  # farther behind its area a goal is missed [m]
FULL_TURN = 2.0 * math.pi


@dataclass(frozen=True, slots=True, eq=False)
class GoalWindow:
    """A state that ends an episode; every part of it must hold at once."""

    time: tuple[float, float]  # since the ego entered [s]
    area: BaseGeometry | None = None  # that holds the centre of the ego's body
    begin: float = -math.inf  # where the ego's path comes into the area [m]
    end: float = math.inf  # where it leaves it [m]
    speed: tuple[float, float] = (-math.inf, math.inf)  # [m/s]
    heading: tuple[float, float] | None = None  # from, to, counter-clockwise [rad]

    def holds(self, x: float, y: float, ego: CartesianState, time: float) -> bool:
        """Tell whether the ego, with its centre at (x, y), is in the state."""
        first, last = self.time
        if not first - TIME_TOLERANCE <= time <= last + TIME_TOLERANCE:
            return False
        if not self.speed[0] <= ego.speed <= self.speed[1]:
            return False
        if not self._has_heading(ego):
            return False
        return self.area is None or bool(shapely.contains_xy(self.area, x, y))

    def way_to(self, place: float) -> float:
        """Return the way to the area: below 0 behind it, 0 in it [m]."""
        return max(self.begin - place, 0.0) - max(place - self.end, 0.0)

    @property
    def asked(self) -> str:
        """What has to hold in the area, in words."""
        (first, last), (low, high) = self.time, self.speed
        words = f"t = {first:.1f} to {last:.1f} s"
        if math.isfinite(low) or math.isfinite(high):
            words += f", {low:.1f} to {high:.1f} m/s"
        if self.heading is not None:
            words += (
                f", a heading of {self.heading[0]:.2f} to {self.heading[1]:.2f} rad"
            )
        return words

    def lacking(self, place: float, ego: CartesianState) -> str:
        """Say what keeps an ego out of the state, its time aside.

        Args:
            place: Of the body's centre on the path [m].
            ego: Its state.
        """
        way = self.way_to(place)
        if way and math.isfinite(way):
            side = "before" if way > 0.0 else "behind"
            return f"the ego is {abs(way):.1f} m {side} its area"
        if not self.speed[0] <= ego.speed <= self.speed[1]:
            low, high = self.speed
            return f"the ego drives {ego.speed:.1f} m/s, not {low:.1f} to {high:.1f}"
        if not self._has_heading(ego):
            return (
                f"the ego's heading is {ego.heading:.2f} rad; asked for is {self.asked}"
            )
        return "the ego is beside its area, or in it at another time"

    def _has_heading(self, ego: CartesianState) -> bool:
        """Tell whether the ego's heading is one that is asked for."""
        if self.heading is None:
            return True
        begin, end = self.heading
        return (ego.heading - begin) % FULL_TURN <= end - begin


@dataclass(frozen=True, slots=True, eq=False)
class GoalRegion:
    """States of which one has to be reached; the first is the one driven to."""

    windows: tuple[GoalWindow, ...]
    centre: float  # from the rear axle to the body's centre [m]

    @classmethod
    def of(cls, windows: Sequence[GoalWindow], vehicle: Vehicle) -> "GoalRegion":
        """Make the region of a vehicle."""
        for window in windows:
            if window.area is not None:
                shapely.prepare(window.area)
        return cls(tuple(windows), vehicle.centre_offset)

    def is_reached(self, ego: CartesianState, vehicle: Vehicle, time: float) -> bool:
        """Tell whether the ego is in one of the states."""
        x, y = centre_from_rear_axle(ego, vehicle)
        return any(window.holds(x, y, ego, time) for window in self.windows)

    def why_missed(self, s: float, ego: CartesianState, time: float) -> str | None:
        """Say why no state can be reached any more, and what was lacking; else None.

        Args:
            s: Of the rear axle on the path [m].
            ego: Its state.
            time: Since the ego entered [s].
        """
        place = s + self.centre
        last = max(window.time[1] for window in self.windows)
        if time > last + TIME_TOLERANCE:
            return self.not_met(s, ego, last)
        if all(place > window.end + BEYOND for window in self.windows):
            return (
                f"the ego drove past the goal's area by t = {time:.1f} s at "
                f"{ego.speed:.1f} m/s; asked for was {self._nearest(place).asked}"
            )
        return None

    def not_met(self, s: float, ego: CartesianState, time: float) -> str:
        """Say what is lacking when the time is over; see `why_missed`."""
        place = s + self.centre
        lacking = self._nearest(place).lacking(place, ego)
        return f"the goal is not met by t = {time:.1f} s: {lacking}"

    def _nearest(self, place: float) -> GoalWindow:
        """Return the state whose area is nearest along the path."""
        return min(self.windows, key=lambda window: abs(window.way_to(place)))

    def wanted_speed(
        self, preferred: float, s: float, time: float, speed: float
    ) -> float:
        """Return the speed at which to drive to the first state now [m/s].

        It is fast enough to arrive before the time is over, slow enough not to leave
        the area before its time begins, and comes to the state's own speed.

        Args:
            preferred: Where the goal leaves the choice [m/s].
            s: Of the rear axle on the path [m].
            time: Since the ego entered [s].
            speed: Of the ego [m/s].
        """
        window = self.windows[0]
        place = s + self.centre
        to_area, to_end = window.begin - place, window.end - place
        until, left = window.time[0] - time, window.time[1] - time
        wanted = preferred
        if 0.0 < to_area < math.inf and left > 0.0:
            mean = to_area / max(IN_TIME * left, 0.1)
            # an even change of speed has this end
            wanted = max(wanted, mean, 2.0 * mean - speed)
        if until > 0.0 and math.isfinite(to_end):
            mean = max(to_end - SPARE_WAY, 0.0) / until
            wanted = min(wanted, mean, max(2.0 * mean - speed, 0.0))
        way = to_area if math.isfinite(to_area) else until * max(wanted, 0.0)
        return _with_own_speed(window, wanted, max(way - LEAD * speed, 0.0))


def _with_own_speed(window: GoalWindow, wanted: float, way: float) -> float:
    """Bring a speed to the state's own one near the goal, `way` [m] ahead."""
    low, high = window.speed
    if math.isinf(low) and math.isinf(high):
        return wanted
    inner = INNER * (high - low) if math.isfinite(high - low) else 0.0
    most = math.sqrt(max(high - inner, 0.0) ** 2 + 2.0 * BRAKING * way)
    least = max(low + inner, 0.0) ** 2 - 2.0 * SPEEDING_UP * way
    least = math.sqrt(max(least, 0.0))
    return float(np.clip(wanted, least, max(most, least)))
