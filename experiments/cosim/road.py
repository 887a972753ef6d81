"""The road of an episode and the ego's task on it: what does not change in between."""

from dataclasses import dataclass, field

from planner.reference_path.frenet import state_on_path
from planner.reference_path.path import ReferencePath
from planner.scene import Lanes, Obstacles, RoadBounds
from planner.states import CartesianState
from planner.vehicle import Vehicle
from sumo_nets.route_path import StopLine


@dataclass(frozen=True, slots=True, eq=False)
class Road:
    """The ego's road, with the static bodies on it."""

    path: ReferencePath  # of the ego's route
    bounds: RoadBounds  # lateral room along the path
    lanes: Lanes = field(default_factory=Lanes.none)
    stop_lines: tuple[StopLine, ...] = ()  # of the traffic lights on the route
    obstacles: Obstacles = field(default_factory=Obstacles.none)


@dataclass(frozen=True, slots=True)
class Start:
    """Where the ego enters, and how fast."""

    s: float = 0.0  # of the rear axle on the path [m]
    l: float = 0.0  # of it, positive to the left [m]
    speed: float | None = None  # None: as fast as the traffic allows [m/s]


@dataclass(frozen=True, slots=True)
class EgoTask:
    """The ego's body, where it starts, where it goes and how fast it wants to be."""

    vehicle: Vehicle
    goal: float  # the ego has arrived when its rear axle is at this s [m]
    target_speed: float  # [m/s]
    start: Start = field(default_factory=Start)

    def state_at_start(self, path: ReferencePath, speed: float) -> CartesianState:
        """Return the state of the rear axle at the start, with a speed [m/s]."""
        return state_on_path(path, self.start.s, self.start.l, speed)
