"""Records of a simulation with many egos: what it holds at one moment."""

from dataclasses import dataclass

from planner.scene import RoadUsers
from planner.states import CartesianState, FloatArray, IntArray

HUMAN = -1  # group of a vehicle that SUMO drives


@dataclass(frozen=True, slots=True, eq=False)
class FleetSnapshot:
    """All vehicles at one moment, egos too; arrays are (n,), in the order of the ids.

    Persons on foot are among `users`, behind all vehicles; of them there is no lane.
    """

    time: float  # since the warm-up [s]
    users: RoadUsers
    lane: IntArray  # number of the lane, see `FleetWorld.lanes`; -1 off the lanes
    position: FloatArray  # of the front bumper on the lane [m]
    wished_speed: FloatArray  # that limit, driver and vehicle allow [m/s]
    fuel: FloatArray  # [mg/s]
    co2: FloatArray  # [mg/s]
    pending: int  # vehicles that wait for room to enter


@dataclass(frozen=True, slots=True)
class EnteredVehicle:
    """A vehicle that SUMO has put on the road."""

    id: str
    type: str
    route: tuple[str, ...]  # edges
    edge: int  # place in the route
    lane: int  # index on that edge, 0 at the kerb
    length: float  # [m]
    width: float  # [m]
    max_speed: float  # [m/s]
    acceleration: float  # the highest [m/s²]


@dataclass(frozen=True, slots=True)
class Leaving:
    """How an ego ceased to be one."""

    index: int  # of the step
    id: str
    how: str  # arrived, collision, off_road, blocked, planner_failed, gone
    reason: str


@dataclass(frozen=True, slots=True, eq=False)
class EgoStep:
    """One ego in one step."""

    id: str
    group: int
    ego: CartesianState
    status: str  # of the plan; "" without one
    clearance: float  # [m]; inf without a body near
    off_road: float  # [m]
    contacts: tuple[str, ...]
    planning_ms: float  # CPU time of planning
    ahead: tuple[float, ...] = ()  # x, y of its plan after 1, 2 and 3 s [m]


@dataclass(frozen=True, slots=True, eq=False)
class FleetStep:
    """One step of a simulation with many egos."""

    index: int
    snapshot: FleetSnapshot
    group: IntArray  # of each vehicle of the snapshot, or HUMAN, (n,)
    egos: tuple[EgoStep, ...]  # by id
    leavings: tuple[Leaving, ...]
    cpu_s: float  # of the whole step, on the thread that drives it [s]

    @property
    def time(self) -> float:
        """Time since the warm-up [s]."""
        return self.snapshot.time
