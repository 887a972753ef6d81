"""What one simulation step says: traffic, signals, the ego, and how an episode ends."""

from dataclasses import dataclass, field
from enum import StrEnum

import numpy as np

from planner.errors import InvalidInputError
from planner.interface import PlanResult
from planner.states import CartesianState, FloatArray, FrenetState, freeze


@dataclass(frozen=True, slots=True)
class Signal:
    """A traffic light on the ego's route."""

    id: str
    stop_s: float  # stop line on the ego's reference path [m]
    state: str  # SUMO's letter: G g y r u o O s M m


@dataclass(frozen=True, slots=True, eq=False)
class TrafficState:
    """All vehicles but the ego and its ghost at one moment; arrays are (n,).

    (x, y) is the centre of each rectangle.
    """

    time: float  # since the ego entered [s]
    ids: tuple[str, ...]
    x: FloatArray  # [m]
    y: FloatArray
    heading: FloatArray  # [rad], counter-clockwise from +x
    speed: FloatArray  # [m/s]
    acceleration: FloatArray  # [m/s²]
    length: FloatArray  # [m]
    width: FloatArray
    signals: tuple[Signal, ...] = ()
    ghost: CartesianState | None = None  # centre of the ghost, while there is one
    # Across the lane, positive to the vehicle's left; none given means none [m/s].
    lateral_speed: FloatArray = field(default_factory=lambda: np.empty(0))

    def __post_init__(self) -> None:
        """Copy, check and freeze the arrays."""
        names = ("x", "y", "heading", "speed", "acceleration", "length", "width")
        if self.lateral_speed.size == 0:
            object.__setattr__(self, "lateral_speed", np.zeros(len(self.ids)))
        for name in (*names, "lateral_speed"):
            array = freeze(getattr(self, name))
            if array.shape != (len(self.ids),):
                raise InvalidInputError(f"{name}: {array.shape}, {len(self.ids)} ids")
            object.__setattr__(self, name, array)


@dataclass(frozen=True, slots=True, eq=False)
class StepRecord:
    """One step of an episode: what was, what was planned, what the truth says."""

    index: int
    time: float  # since the ego entered [s]
    ego: CartesianState
    ego_frenet: FrenetState | None  # None where the ego has left the path's domain
    traffic: TrafficState
    stop_lines: tuple[float, ...]  # handed to the planner [m]
    plan: PlanResult | None  # None in the last record, where nothing was planned
    planning_ms: float | None  # wall clock, kept apart from everything else
    contacts: tuple[str, ...]  # bodies that the ego overlapped since the step before
    clearance: float  # to the nearest body now [m]; inf without one
    nearest: str | None
    off_road: float  # how far the body reaches over the road's edge [m]; 0 inside


class EpisodeStatus(StrEnum):
    """How an episode ended."""

    ARRIVED = "arrived"
    BLOCKED = "blocked"  # stands safely, there was no way on
    TIMEOUT = "timeout"
    COLLISION = "collision"
    OFF_ROAD = "off_road"
    PLANNER_FAILED = "planner_failed"
    SIMULATOR_FAILED = "simulator_failed"
    CRASHED = "crashed"


@dataclass(frozen=True, slots=True)
class Ending:
    """The outcome of an episode and one sentence about it."""

    status: EpisodeStatus
    reason: str
