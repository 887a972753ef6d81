"""The road of an episode and the ego's task on it: what does not change in between."""

import math
from dataclasses import dataclass, field

from experiments.cosim.goal import GoalRegion
from experiments.cosim.junctions import RoadJunction
from planner.reference_path.frenet import state_on_path
from planner.reference_path.path import ReferencePath
from planner.scene import Lanes, Obstacles, RoadBounds, SpeedLimits
from planner.states import CartesianState
from planner.vehicle import Vehicle
from sumo_nets.route_path import StopLine

LIMIT_BRAKING = 1.5  # before a lower speed limit, as drivers do [m/s²]
LIMIT_LEAD = 1.0  # by which speed limits are obeyed ahead of time [s]


NOTHING = Obstacles.none()  # one object: planners may keep what they made of it


@dataclass(frozen=True, slots=True)
class Closure:
    """Where lanes are closed by the obstacles, and when the ego's driver is told."""

    begin: float  # near end of the first obstacle on the path [m]
    known_from: float = math.inf  # distance of the front bumper from it then [m]

    def is_known(self, front: float) -> bool:
        """Tell whether it is known with the front bumper at an arc length [m]."""
        return front >= self.begin - self.known_from


@dataclass(frozen=True, slots=True, eq=False)
class Road:
    """The ego's road, with the static bodies on it."""

    path: ReferencePath  # of the ego's route
    bounds: RoadBounds  # lateral room along the path
    lanes: Lanes = field(default_factory=Lanes.none)
    stop_lines: tuple[StopLine, ...] = ()  # of the traffic lights on the route
    obstacles: Obstacles = field(default_factory=Obstacles.none)
    speed_limits: SpeedLimits = field(default_factory=SpeedLimits.none)
    junctions: tuple[RoadJunction, ...] = ()  # where the route meets others
    closure: Closure | None = None  # what the obstacles are, if lanes are closed

    def known_obstacles(self, front: float) -> Obstacles:
        """Return the obstacles that the ego's driver knows of.

        Args:
            front: Arc length of the ego's front bumper [m].
        """
        if self.closure is None or self.closure.is_known(front):
            return self.obstacles
        return NOTHING

    def allowed_speed(self, front: float, speed: float) -> float:
        """Return the speed that the limits here and ahead allow [m/s].

        Args:
            front: Arc length of the ego's front bumper [m].
            speed: Its speed now; limits bind a moment ahead, since a planner needs
                time to follow [m/s].
        """
        ahead = front + LIMIT_LEAD * max(speed, 0.0)
        limits = self.speed_limits
        return min(limits.at_one(front), limits.allowed(ahead, LIMIT_BRAKING))


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
    region: GoalRegion | None = None  # that ends the episode instead of `goal`

    def wanted_speed(self, s: float, time: float, speed: float) -> float:
        """Return how fast the ego wants to be now [m/s].

        Args:
            s: Of the rear axle on the path [m].
            time: Since the ego entered [s].
            speed: Of the ego [m/s].
        """
        if self.region is None:
            return self.target_speed
        return self.region.wanted_speed(self.target_speed, s, time, speed)

    def state_at_start(self, path: ReferencePath, speed: float) -> CartesianState:
        """Return the state of the rear axle at the start, with a speed [m/s]."""
        return state_on_path(path, self.start.s, self.start.l, speed)
