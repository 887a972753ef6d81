"""Drivers who err: they look away, brake for no reason, cut in, heed no red light.

When each of them errs is a Poisson process of its own, drawn from the seed and the
vehicle's id alone. Neither the ego nor other vehicles change it: with and without ego,
and with any planner, the same drivers err at the same moments.

Not so with a factor above 1: near the ego errors may then begin a number of times as
often, to see rare ones, so that who errs depends on where the ego is. The process is
drawn with the higher rate, and away from the ego thinned to the one asked for (Lewis
and Shedler, Naval Res. Logist. Q. 26 (1979) 403). The likelihood ratio of the run,
asked for over drawn, is exp((k - 1) r T) / k^n with n errors begun near the ego, T the
time in which they could have and r the rate asked for (Girsanov's theorem for point
processes: Brémaud, Point Processes and Queues, 1981, chapter VI).
"""

import math
from collections.abc import Iterable
from dataclasses import dataclass, field
from enum import StrEnum
from zlib import crc32

import numpy as np

from experiments.cosim.sumo.libsumo_api import Libsumo

AWARENESS = "device.driverstate.awareness"
HAS_DRIVER_STATE = "has.driverstate.device"
FULL_AWARENESS = 1.0
SECONDS_PER_HOUR = 3600.0
REACH = 50.0  # from the ego, within which errors may be drawn more often [m]
CHARACTER = b"character"  # of a driver: what does not change
STRATEGIC = "laneChangeModel.lcStrategic"
LATE = 0.05  # of the usual distance before a lane's end, in which to leave it
RED_BIT, WAY_BIT = 16, 8  # of SUMO's speed mode
# of a driver who cuts in: SUMO's parameters, times these
PUSHING = {"laneChangeModel.lcAssertive": 4.0, "laneChangeModel.lcSpeedGain": 20.0}
MIN_GAP_BETWEEN = 0.1  # from the end of one error to the next of its kind [s]


class DriverError(StrEnum):
    """What a driver does wrong."""

    LOOKS_AWAY = "looks_away"
    BRAKES = "brakes"
    STALLS = "stalls"
    CUTS_IN = "cuts_in"
    RUNS_RED = "runs_red"
    TAKES_WAY = "takes_way"  # heeds no right of way


@dataclass(frozen=True, slots=True)
class Occurrence:
    """How often an error happens to a driver, and how long it lasts."""

    per_hour: float
    shortest: float  # [s]
    longest: float  # [s]


@dataclass(frozen=True, slots=True)
class DriverErrorSettings:
    """Which errors there are; those with a rate of 0 never happen."""

    seed: int
    glances: Occurrence | None = None  # of drivers who have a driver state
    awareness: float = 0.2  # of a driver who looks away, in (0, 1]
    braking: Occurrence | None = None
    deceleration: float = 4.0  # of drivers who brake for no reason [m/s²]
    stalling: Occurrence | None = None
    cutting_in: Occurrence | None = None
    running_red: Occurrence | None = None
    taking_way: Occurrence | None = None
    late_mergers: float = 0.0  # share of drivers
    factor: float = 1.0  # on all rates near the ego

    @property
    def happen(self) -> bool:
        """Whether anybody errs at all."""
        return bool(self.occurrences()) or self.late_mergers > 0.0

    def occurrences(self) -> list[tuple[DriverError, Occurrence]]:
        """List the errors that happen at all."""
        pairs = (
            (DriverError.LOOKS_AWAY, self.glances),
            (DriverError.BRAKES, self.braking),
            (DriverError.STALLS, self.stalling),
            (DriverError.CUTS_IN, self.cutting_in),
            (DriverError.RUNS_RED, self.running_red),
            (DriverError.TAKES_WAY, self.taking_way),
        )
        return [(kind, one) for kind, one in pairs if one and one.per_hour > 0.0]


class ErrorTimes:
    """The intervals in which one driver commits one kind of error.

    Errors that may begin come as a Poisson process of `factor` times the rate asked
    for. Near the ego all of them begin, elsewhere one of `factor`; the others are over
    at once. While an error lasts, and shortly after it, no other may begin.

    Args:
        occurrence: How often, and for how long.
        key: Numbers that the random stream is made of.
        factor: Errors begin so many times as often near the ego.
    """

    def __init__(
        self, occurrence: Occurrence, key: list[int], factor: float = 1.0
    ) -> None:
        self._occurrence = occurrence
        self._rng = np.random.default_rng(key)
        self._factor = factor
        self._free = 0.0  # up to here is decided; from here on errors may begin [s]
        self._end = 0.0  # of the latest error [s]
        self.log_weight = 0.0  # of the likelihood ratio of all that was decided
        self._candidate = self._pause()  # when the next may begin [s]

    def active(self, time: float, *, near: bool = False) -> bool:
        """Check whether the driver errs at a time [s], which must not go back.

        Args:
            time: [s].
            near: Whether the ego is near, since the time asked about before.
        """
        while time >= self._candidate:
            begin = self._candidate
            self._pass(begin, near=near)
            one = self._occurrence
            lasts = self._rng.uniform(one.shortest, one.longest)
            mark = self._rng.random() if self._factor > 1.0 else 0.0
            if near or mark * self._factor < 1.0:
                self._end = begin + lasts
                self._free = self._end + MIN_GAP_BETWEEN
                if near:
                    self.log_weight -= math.log(self._factor)
            self._candidate = self._free + self._pause()
        self._pass(time, near=near)
        return time < self._end

    def remaining(self, time: float) -> float:
        """Return how long the present interval goes on from a time on [s]."""
        return self._end - time

    def _pass(self, time: float, *, near: bool) -> None:
        """Weigh that up to a time none has begun though it could have."""
        if time > self._free:
            if near:
                rate = self._occurrence.per_hour / SECONDS_PER_HOUR
                self.log_weight += (self._factor - 1.0) * rate * (time - self._free)
            self._free = time

    def _pause(self) -> float:
        """Draw the time to the next that may begin [s]."""
        drawn = self._occurrence.per_hour * self._factor
        return self._rng.exponential(SECONDS_PER_HOUR / drawn)


@dataclass(slots=True)
class _Driver:
    """One vehicle's errors."""

    times: dict[DriverError, ErrorTimes]
    active: set[DriverError] = field(default_factory=set)
    usual: dict[str, str] = field(default_factory=dict)  # before it cuts in


class DriverErrors:
    """Makes the drivers of a simulation err.

    Args:
        sumo: Running.
        settings: Which errors, how often.
        spared: Vehicles that are nobody's: the ego, its ghost, obstacles.
    """

    def __init__(
        self, sumo: Libsumo, settings: DriverErrorSettings, spared: Iterable[str]
    ) -> None:
        self._sumo = sumo
        self._settings = settings
        self._spared = frozenset(spared)
        self._occurrences = settings.occurrences()
        self._drivers: dict[str, _Driver] = {}
        self._log_weight = 0.0

    @property
    def log_weight(self) -> float | None:
        """Logarithm of the run's likelihood ratio so far; None where it is always 1."""
        return None if self._settings.factor == 1.0 else self._log_weight

    def update(self, time: float, ego: tuple[float, float] | None = None) -> None:
        """Begin and end errors; called before each step.

        Args:
            time: Since the simulation began [s].
            ego: Where it is [m]; None without one.
        """
        present = self._sumo.vehicle.getIDList()
        for name in sorted(set(present) - self._spared):
            driver = self._drivers.get(name)
            if driver is None:
                driver = self._drivers[name] = self._meet(name)
                near = False  # in the time before
            else:
                near = self._settings.factor > 1.0 and self._is_near(name, ego)
            now = set()
            for kind, times in driver.times.items():
                before = times.log_weight
                if times.active(time, near=near):
                    now.add(kind)
                self._log_weight += times.log_weight - before
            if DriverError.STALLS in now:  # who stands does not brake
                now.discard(DriverError.BRAKES)
            for kind in sorted(driver.active - now):
                self._end(name, kind)
            for kind in sorted(now - driver.active):
                self._begin(name, kind, driver.times[kind].remaining(time))
            driver.active = now
        for name in self._drivers.keys() - set(present):
            del self._drivers[name]

    def _is_near(self, name: str, ego: tuple[float, float] | None) -> bool:
        """Check whether a vehicle is where errors may be drawn more often."""
        if ego is None:
            return False
        return math.dist(self._sumo.vehicle.getPosition(name), ego) <= REACH

    def present(self) -> tuple[tuple[str, DriverError], ...]:
        """List who errs now, and how, sorted by id."""
        return tuple(
            (name, kind)
            for name, driver in sorted(self._drivers.items())
            for kind in sorted(driver.active)
        )

    def _meet(self, name: str) -> _Driver:
        """Draw the errors of a driver who has just departed."""
        kinds = self._occurrences
        if self._sumo.vehicle.getParameter(name, HAS_DRIVER_STATE) != "true":
            kinds = [pair for pair in kinds if pair[0] is not DriverError.LOOKS_AWAY]
        key = [self._settings.seed, crc32(name.encode())]
        factor = self._settings.factor
        driver = _Driver(
            {
                kind: ErrorTimes(one, [*key, crc32(kind.encode())], factor)
                for kind, one in kinds
            }
        )
        drawn = np.random.default_rng([*key, crc32(CHARACTER)])
        if drawn.random() < self._settings.late_mergers:
            self._sumo.vehicle.setParameter(name, STRATEGIC, repr(LATE))
        return driver

    def _begin(self, name: str, kind: DriverError, lasts: float) -> None:
        """Let a driver begin to err."""
        vehicle = self._sumo.vehicle
        if kind is DriverError.LOOKS_AWAY:
            vehicle.setParameter(name, AWARENESS, repr(self._settings.awareness))
        elif kind is DriverError.BRAKES:
            lost = self._settings.deceleration * lasts
            vehicle.slowDown(name, max(vehicle.getSpeed(name) - lost, 0.0), lasts)
        elif kind is DriverError.STALLS:
            vehicle.setSpeed(name, 0.0)
        elif kind in (DriverError.RUNS_RED, DriverError.TAKES_WAY):
            self._set_heed(name, kind, heeds=False)
        else:
            self._cut_in(name, self._drivers[name])

    def _end(self, name: str, kind: DriverError) -> None:
        """Let a driver drive on as usual."""
        if kind is DriverError.LOOKS_AWAY:
            self._sumo.vehicle.setParameter(name, AWARENESS, repr(FULL_AWARENESS))
        elif kind is DriverError.STALLS:
            self._sumo.vehicle.setSpeed(name, -1.0)
        elif kind in (DriverError.RUNS_RED, DriverError.TAKES_WAY):
            self._set_heed(name, kind, heeds=True)
        elif kind is DriverError.CUTS_IN:
            for key, value in self._drivers[name].usual.items():
                self._sumo.vehicle.setParameter(name, key, value)

    def _set_heed(self, name: str, kind: DriverError, *, heeds: bool) -> None:
        """Let a driver heed red lights, or who goes first, or not."""
        bit = RED_BIT if kind is DriverError.RUNS_RED else WAY_BIT
        vehicle = self._sumo.vehicle
        mode = vehicle.getSpeedMode(name)
        vehicle.setSpeedMode(name, mode | bit if heeds else mode & ~bit)

    def _cut_in(self, name: str, driver: _Driver) -> None:
        """Let a driver change lanes for little, into gaps that are too short.

        Not by a command: SUMO 1.28 writes past its memory when one changes lanes by
        command while changes take time.
        """
        vehicle = self._sumo.vehicle
        driver.usual = {key: vehicle.getParameter(name, key) for key in PUSHING}
        for key, factor in PUSHING.items():
            pushed = float(driver.usual[key]) * factor
            vehicle.setParameter(name, key, repr(pushed))
