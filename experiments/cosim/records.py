"""Records of one simulation step (traffic, signals, the ego) and of an ending."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from typing import NamedTuple, Protocol

from planner.interface import PlanResult
from planner.prediction import Predictor
from planner.right_of_way.records import Foe, JunctionAhead
from planner.scene import RoadUsers
from planner.states import CartesianState, FrenetState
from planner.ways import Ways


@dataclass(frozen=True, slots=True)
class Signal:
    """A traffic light on the ego's route."""

    id: str
    stop_s: float  # stop line on the ego's reference path [m]
    state: str  # SUMO's letter: G g y r u o O s M m


class VehicleLook(NamedTuple):
    """What a vehicle shows to others."""

    kind: str  # SUMO's vehicle class, or `pedestrian`
    indicator: str  # left, right, both, or empty


class KnownFuture(Predictor, Protocol):
    """What a world knows of the others' future, at one moment."""

    def later(self, lead: float) -> "KnownFuture":
        """Return what it knows a time [s] later."""
        ...


@dataclass(frozen=True, slots=True, eq=False)
class TrafficState:
    """All vehicles but the ego and its ghost at one moment, and the signals."""

    time: float  # since the ego entered [s]
    vehicles: RoadUsers
    signals: tuple[Signal, ...] = ()
    ghost: CartesianState | None = None  # centre of the ghost, while there is one
    ways: Ways | None = None  # of the vehicles, near junctions
    junctions: tuple[JunctionAhead, ...] = ()  # junctions near the ego
    foes: tuple[Foe, ...] = ()  # at them; `junction` is a place there
    looks: Mapping[str, VehicleLook] = field(default_factory=dict)  # where known
    erring: tuple[tuple[str, str], ...] = ()  # drivers who err, by id, and how
    future: KnownFuture | None = None  # if planners may know it
    log_weight: float | None = None  # of errors drawn more often than asked for


@dataclass(frozen=True, slots=True)
class PlanningTime:
    """How long a planning cycle took."""

    wall_ms: float  # by the clock: includes time spent on other processes
    cpu_ms: float  # of the planning thread: can be compared on a busy machine


class PlanStartKind(StrEnum):
    """Why a plan begins where it does."""

    EGO = "ego"  # where the ego is, which is on its plan
    STITCHED = "stitched"  # on the plan before
    MEASURED = "measured"  # where the ego is, by the scenario's rule
    ANEW = "anew"  # where the ego is: too far from its plan


@dataclass(frozen=True, slots=True)
class PlanStart:
    """Where a plan begins."""

    kind: PlanStartKind
    state: CartesianState
    frenet: FrenetState
    lead: float  # how much later than now [s]


@dataclass(frozen=True, slots=True)
class TrackingReport:
    """How a vehicle followed its plan in one step; errors are those at its end."""

    lateral: float  # positive to the left of the plan [m]
    behind: float  # the plan, along it [m]
    heading: float  # [rad]
    steering_command: float  # [rad]
    steering: float  # [rad]
    drive_command: float  # [m/s²]
    drive: float  # [m/s²]
    limited: float  # share of the step at a limit of steering, drive or grip
    grip: float  # largest share of the friction used


@dataclass(frozen=True, slots=True, eq=False)
class StepRecord:
    """One step of an episode: its state, its plan, and what the monitor found."""

    index: int
    time: float  # since the ego entered [s]
    ego: CartesianState
    ego_frenet: FrenetState | None  # None where the ego has left the path's domain
    traffic: TrafficState
    stop_lines: tuple[float, ...]  # handed to the planner [m]
    plan: PlanResult | None  # None in the last record, where nothing was planned
    planning: PlanningTime | None  # kept apart from everything else
    contacts: tuple[str, ...]  # bodies that the ego overlapped since the step before
    clearance: float  # to the nearest body now [m]; inf without one
    nearest: str | None
    off_road: float  # how far the body reaches over the road's edge [m]; 0 inside
    gives_way_to: str | None = None  # why a line at a junction is closed
    # of vehicles and eyes that are not perfect, else None
    tracking: TrackingReport | None = None  # of the step that led here
    seen: RoadUsers | None = None  # what the ego believes of the others now
    start: PlanStart | None = None  # of the plan

    def with_plan(
        self, plan: PlanResult, timing: PlanningTime, start: PlanStart | None = None
    ) -> "StepRecord":
        """Return the record of the same step with its plan.

        Called in every step: `dataclasses.replace` would take three times as long.
        """
        return StepRecord(
            self.index,
            self.time,
            self.ego,
            self.ego_frenet,
            self.traffic,
            self.stop_lines,
            plan,
            timing,
            self.contacts,
            self.clearance,
            self.nearest,
            self.off_road,
            self.gives_way_to,
            self.tracking,
            self.seen,
            start,
        )


class EpisodeStatus(StrEnum):
    """How an episode ended."""

    ARRIVED = "arrived"
    BLOCKED = "blocked"  # stands safely, there was no way on
    TIMEOUT = "timeout"
    COLLISION = "collision"
    OFF_ROAD = "off_road"
    NO_ROOM = "no_room"  # the ego found no gap to enter the traffic
    PLANNER_FAILED = "planner_failed"
    SIMULATOR_FAILED = "simulator_failed"
    CRASHED = "crashed"


@dataclass(frozen=True, slots=True)
class Ending:
    """The outcome of an episode and one sentence about it."""

    status: EpisodeStatus
    reason: str
