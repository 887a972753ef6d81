"""A world without a simulator: a road, static bodies and vehicles that follow a script.

For the layouts of the thesis, for tests, and for scenarios of other people: nothing in
it reacts to the ego, everything in it can be calculated by hand.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np

from experiments.cosim.records import Signal, TrafficState
from experiments.cosim.scene_builder import state_on_path
from experiments.cosim.sumo import frames
from planner.errors import InvalidInputError
from planner.reference_path.path import ReferencePath
from planner.scene import Obstacles, RoadBounds
from planner.states import CartesianState, FloatArray

MIN_STRETCH = 0.2  # 1 - kappa_r l, below which an offset is too near to the pole


@dataclass(frozen=True, slots=True)
class ScriptedVehicle:
    """A vehicle that follows the reference path at a constant offset."""

    id: str
    s: float  # centre at the start [m]
    l: float  # centre, positive to the left [m]
    speed: float  # along its own way; negative drives against the path [m/s]
    length: float = 4.8  # [m]
    width: float = 1.9  # [m]
    # (time [s], speed from then on [m/s]), times growing
    speed_changes: tuple[tuple[float, float], ...] = ()

    def __post_init__(self) -> None:
        """Check that the changes are in order."""
        times = [time for time, _ in self.speed_changes]
        if any(later <= earlier for earlier, later in pairwise(times)):
            raise InvalidInputError(f"{self.id}: times {times} must grow")

    def speed_at(self, time: float) -> float:
        """Give the speed from `time` [s] on, negative against the path [m/s]."""
        speed = self.speed
        for start, changed in self.speed_changes:
            if time < start:
                break
            speed = changed
        return speed

    def driven(self, begin: float, end: float) -> float:
        """Give the distance driven between two times, signed [m]."""
        inside = [time for time, _ in self.speed_changes if begin < time < end]
        cuts = [begin, *inside, end]
        spans = pairwise(cuts)
        return sum(self.speed_at(a) * (b - a) for a, b in spans)


@dataclass(frozen=True, slots=True)
class ScriptedSignal:
    """A traffic light with a fixed cycle of (duration [s], SUMO's letter)."""

    id: str
    stop_s: float  # [m]
    cycle: tuple[tuple[float, str], ...]

    def __post_init__(self) -> None:
        """Check that the cycle has a length."""
        if not self.cycle or any(duration <= 0.0 for duration, _ in self.cycle):
            raise InvalidInputError(f"{self.id}: durations must be positive")

    def at(self, time: float) -> Signal:
        """Give the light at `time` [s]."""
        rest = math.fmod(time, math.fsum(duration for duration, _ in self.cycle))
        state = self.cycle[-1][1]
        for duration, letter in self.cycle:
            if rest < duration:
                state = letter
                break
            rest -= duration
        return Signal(self.id, self.stop_s, state)


@dataclass(frozen=True, slots=True, eq=False)
class KinematicSettings:
    """All that a kinematic world is made of."""

    path: ReferencePath
    road: RoadBounds
    start_speed: float  # of the ego [m/s]
    start_s: float = 0.0  # of the ego's rear axle [m]
    start_offset: float = 0.0  # positive to the left [m]
    obstacles: Obstacles = field(default_factory=Obstacles.none)
    vehicles: tuple[ScriptedVehicle, ...] = ()
    signals: tuple[ScriptedSignal, ...] = ()
    step: float = 0.1  # [s]


def constant_road(path: ReferencePath, half_width: float) -> RoadBounds:
    """Make a road of the same half width [m] on both sides of the path."""
    ends = np.array([0.0, path.length])
    side = np.full(2, half_width)
    return RoadBounds(ends, side, -side)


class KinematicWorld:
    """Scripted vehicles on a road; `observe` is a function of the step count alone."""

    def __init__(self, settings: KinematicSettings) -> None:
        self._settings = settings
        self._steps = 0
        self._s = np.array([vehicle.s for vehicle in settings.vehicles])
        self._l = np.array([vehicle.l for vehicle in settings.vehicles])
        self._length = np.array([vehicle.length for vehicle in settings.vehicles])
        self._width = np.array([vehicle.width for vehicle in settings.vehicles])
        self._ids = tuple(vehicle.id for vehicle in settings.vehicles)
        self._speed = np.array([vehicle.speed for vehicle in settings.vehicles])
        self._changing = [
            number
            for number, vehicle in enumerate(settings.vehicles)
            if vehicle.speed_changes
        ]
        # A vehicle that comes to rest keeps looking the way it drove.
        self._against = np.array(
            [_first_direction(vehicle) < 0.0 for vehicle in settings.vehicles], bool
        )

    @property
    def step(self) -> float:
        """Time step [s]."""
        return self._settings.step

    @property
    def path(self) -> ReferencePath:
        """Reference path of the ego."""
        return self._settings.path

    @property
    def road(self) -> RoadBounds:
        """Lateral room along `path`."""
        return self._settings.road

    @property
    def obstacles(self) -> Obstacles:
        """Static bodies."""
        return self._settings.obstacles

    def enter(self) -> CartesianState:
        """Put the ego's rear axle at its start."""
        settings = self._settings
        return state_on_path(
            settings.path, settings.start_s, settings.start_offset, settings.start_speed
        )

    def observe(self) -> TrafficState:
        """Say where everyone is now; the speed is never negative."""
        time = self._steps * self.step
        settings = self._settings
        point = settings.path.at(self._s)
        turned = point.heading + np.where(self._against, math.pi, 0.0)
        speed = np.abs(self._speed_at(time))
        return TrafficState(
            time,
            self._ids,
            point.x - self._l * point.sin_heading,
            point.y + self._l * point.cos_heading,
            frames.wrapped_all(turned),
            speed,
            np.zeros_like(speed),
            self._length,
            self._width,
            tuple(signal.at(time) for signal in settings.signals),
        )

    def advance(self, ego: CartesianState) -> CartesianState:
        """Move everyone one step on; nobody reacts to the ego."""
        begin = self._steps * self.step
        end = (self._steps + 1) * self.step
        driven = self._speed * (end - begin)
        for number in self._changing:
            driven[number] = self._settings.vehicles[number].driven(begin, end)
        middle = self._s + 0.5 * driven / self._stretch(self._s)
        self._s = self._s + driven / self._stretch(middle)
        now = self._speed_at(end)
        self._against = np.where(now == 0.0, self._against, now < 0.0)
        self._steps += 1
        return ego

    def close(self) -> None:
        """Do nothing: there is nothing to end."""

    def _speed_at(self, time: float) -> FloatArray:
        """Give all speeds at `time`, negative against the path [m/s]."""
        speed = self._speed.copy()
        for number in self._changing:
            speed[number] = self._settings.vehicles[number].speed_at(time)
        return speed

    def _stretch(self, s: FloatArray) -> FloatArray:
        """Length of each vehicle's own way per metre of path."""
        stretch = 1.0 - self._settings.path.at(s).curvature * self._l
        kept: FloatArray = np.maximum(stretch, MIN_STRETCH)
        return kept


def _first_direction(vehicle: ScriptedVehicle) -> float:
    """Give the first speed that is not zero, to know which way a vehicle looks."""
    speeds: Sequence[float] = [vehicle.speed, *(v for _, v in vehicle.speed_changes)]
    return next((speed for speed in speeds if speed != 0.0), 1.0)
