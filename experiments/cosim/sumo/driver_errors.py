"""Drivers who err: they look away, brake for no reason, or stop in their lane.

When each of them errs is a Poisson process of its own, drawn from the seed and the
vehicle's id alone. Neither the ego nor other vehicles change it: with and without ego,
and with any planner, the same drivers err at the same moments.
"""

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
MIN_GAP_BETWEEN = 0.1  # from the end of one error to the next of its kind [s]


class DriverError(StrEnum):
    """What a driver does wrong."""

    LOOKS_AWAY = "looks_away"
    BRAKES = "brakes"
    STALLS = "stalls"


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

    def occurrences(self) -> list[tuple[DriverError, Occurrence]]:
        """List the errors that happen at all."""
        pairs = (
            (DriverError.LOOKS_AWAY, self.glances),
            (DriverError.BRAKES, self.braking),
            (DriverError.STALLS, self.stalling),
        )
        return [(kind, one) for kind, one in pairs if one and one.per_hour > 0.0]


class ErrorTimes:
    """The intervals in which one driver commits one kind of error.

    Args:
        occurrence: How often, and for how long.
        key: Numbers that the random stream is made of.
    """

    def __init__(self, occurrence: Occurrence, key: list[int]) -> None:
        self._occurrence = occurrence
        self._rng = np.random.default_rng(key)
        self._begin = self._end = -MIN_GAP_BETWEEN
        self._next()

    def active(self, time: float) -> bool:
        """Check whether the driver errs at a time [s], which must not go back."""
        while time >= self._end:
            self._next()
        return time >= self._begin

    def remaining(self, time: float) -> float:
        """Return how long the present interval goes on from a time on [s]."""
        return self._end - time

    def _next(self) -> None:
        """Draw the next interval."""
        one = self._occurrence
        pause = self._rng.exponential(SECONDS_PER_HOUR / one.per_hour)
        self._begin = self._end + MIN_GAP_BETWEEN + pause
        self._end = self._begin + self._rng.uniform(one.shortest, one.longest)


@dataclass(slots=True)
class _Driver:
    """One vehicle's errors."""

    times: dict[DriverError, ErrorTimes]
    active: set[DriverError] = field(default_factory=set)


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

    def update(self, time: float) -> None:
        """Begin and end errors; called before each step.

        Args:
            time: Since the simulation began [s].
        """
        present = self._sumo.vehicle.getIDList()
        for name in sorted(set(present) - self._spared):
            driver = self._drivers.get(name)
            if driver is None:
                driver = self._drivers[name] = self._meet(name)
            now = {kind for kind, times in driver.times.items() if times.active(time)}
            if DriverError.STALLS in now:  # who stands does not brake
                now.discard(DriverError.BRAKES)
            for kind in sorted(driver.active - now):
                self._end(name, kind)
            for kind in sorted(now - driver.active):
                self._begin(name, kind, driver.times[kind].remaining(time))
            driver.active = now
        for name in self._drivers.keys() - set(present):
            del self._drivers[name]

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
        return _Driver(
            {kind: ErrorTimes(one, [*key, crc32(kind.encode())]) for kind, one in kinds}
        )

    def _begin(self, name: str, kind: DriverError, lasts: float) -> None:
        """Let a driver begin to err."""
        vehicle = self._sumo.vehicle
        if kind is DriverError.LOOKS_AWAY:
            vehicle.setParameter(name, AWARENESS, repr(self._settings.awareness))
        elif kind is DriverError.BRAKES:
            lost = self._settings.deceleration * lasts
            vehicle.slowDown(name, max(vehicle.getSpeed(name) - lost, 0.0), lasts)
        else:
            vehicle.setSpeed(name, 0.0)

    def _end(self, name: str, kind: DriverError) -> None:
        """Let a driver drive on as usual."""
        if kind is DriverError.LOOKS_AWAY:
            self._sumo.vehicle.setParameter(name, AWARENESS, repr(FULL_AWARENESS))
        elif kind is DriverError.STALLS:
            self._sumo.vehicle.setSpeed(name, -1.0)
