"""A world without a simulator: a road, static bodies and vehicles that follow a script.

For the layouts of the thesis, for tests, and for scenarios of other people: nothing in
it reacts to the ego, everything in it can be calculated by hand.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from experiments.cosim.records import TrafficState
from experiments.cosim.road import EgoTask, Road
from planner.numerics.angles import wrapped_all
from planner.reference_path.frenet import MIN_STRETCH
from planner.reference_path.path import ReferencePath
from planner.scene import RoadBounds, RoadUsers
from planner.states import CartesianState, FloatArray


@dataclass(frozen=True, slots=True)
class ScriptedVehicle:
    """A vehicle that follows the reference path at a constant offset and speed."""

    id: str
    s: float  # centre at the start [m]
    l: float  # centre, positive to the left [m]
    speed: float  # along its own way; negative drives against the path [m/s]
    length: float = 4.8  # [m]
    width: float = 1.9  # [m]


def constant_bounds(path: ReferencePath, half_width: float) -> RoadBounds:
    """Return bounds of the same half width [m] on both sides of the path."""
    ends = np.array([0.0, path.length])
    half = np.full(2, half_width)
    return RoadBounds(ends, half, -half)


class KinematicWorld:
    """A road with scripted vehicles; implements `World`.

    Args:
        road: With its static bodies.
        task: Where the ego starts, at its target speed unless another one is given.
        vehicles: The others.
        step: Time step [s].
    """

    def __init__(
        self,
        road: Road,
        task: EgoTask,
        vehicles: Sequence[ScriptedVehicle] = (),
        step: float = 0.1,
    ) -> None:
        self._road = road
        self._task = task
        self._step = step
        self._steps = 0
        self._ids = tuple(vehicle.id for vehicle in vehicles)
        self._s = np.array([vehicle.s for vehicle in vehicles])
        self._l = np.array([vehicle.l for vehicle in vehicles])
        self._length = np.array([vehicle.length for vehicle in vehicles])
        self._width = np.array([vehicle.width for vehicle in vehicles])
        self._speed = np.array([vehicle.speed for vehicle in vehicles])

    @property
    def step(self) -> float:
        """Time step [s]."""
        return self._step

    @property
    def road(self) -> Road:
        """The ego's road."""
        return self._road

    def enter(self) -> CartesianState:
        """Put the ego's rear axle at its start."""
        wanted = self._task.start.speed
        speed = self._task.target_speed if wanted is None else wanted
        return self._task.state_at_start(self._road.path, speed)

    def observe(self) -> TrafficState:
        """Return all vehicles as they are now; speeds are never negative."""
        point = self._road.path.at(self._s)
        turned = point.heading + np.where(self._speed < 0.0, math.pi, 0.0)
        none = np.zeros_like(self._speed)
        table = (
            point.x - self._l * point.sin_heading,
            point.y + self._l * point.cos_heading,
            wrapped_all(turned),
            np.abs(self._speed),
            none,
            none,
            self._length,
            self._width,
        )
        users = RoadUsers.from_table(self._ids, np.array(table))
        return TrafficState(self._steps * self._step, users)

    def advance(self, ego: CartesianState) -> CartesianState:
        """Move all vehicles one step on; none reacts to the ego."""
        begin = self._steps * self._step
        end = (self._steps + 1) * self._step
        driven = self._speed * (end - begin)
        middle = self._s + 0.5 * driven / self._stretch(self._s)
        self._s = self._s + driven / self._stretch(middle)
        self._steps += 1
        return ego

    def close(self) -> None:
        """Do nothing: there is nothing to end."""

    def _stretch(self, s: FloatArray) -> FloatArray:
        """Return the length of each vehicle's own way per metre of path."""
        stretch = 1.0 - self._road.path.at(s).curvature * self._l
        kept: FloatArray = np.maximum(stretch, MIN_STRETCH)
        return kept
