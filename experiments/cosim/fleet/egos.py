"""The egos of a simulation, and a moment of all of them."""

from dataclasses import dataclass

from experiments.cosim.ego_driver import EgoDriver
from experiments.cosim.fleet.records import FleetSnapshot, Leaving
from experiments.cosim.fleet.sight import FleetSight
from experiments.cosim.fleet.ways import EgoWay
from experiments.cosim.records import Ending, StepRecord
from planner.scene import Scene, Vehicles
from planner.states import CartesianState, FrenetState


@dataclass(slots=True)
class FleetEgo:
    """One ego."""

    id: str
    group: int
    way: EgoWay
    driver: EgoDriver
    state: CartesianState
    place: FrenetState | None = None
    index: int = 0  # steps since it was taken over

    @property
    def s(self) -> float:
        """Arc length that stands for its place [m]."""
        return 0.0 if self.place is None else self.place.s


@dataclass(frozen=True, slots=True, eq=False)
class SeenEgo:
    """One ego at a moment: what it sees, and whether it has ended."""

    ego: FleetEgo
    record: StepRecord
    ending: Ending | None
    sight: FleetSight
    number: int  # in the sight

    def vehicles(self) -> Vehicles | None:
        """Return the others with their predictions; None where each ego makes its own.

        At junctions they are predicted along their ways, which not all egos know.
        """
        known = self.record.traffic.ways is None
        return self.sight.predicted(self.number) if known else None

    def scene(self) -> Scene | None:
        """Return the scene that its planner gets; None off its path."""
        return self.ego.driver.scene(self.record, self.vehicles())


@dataclass(frozen=True, slots=True, eq=False)
class FleetMoment:
    """A moment that was looked at, before anybody moves on."""

    index: int
    snapshot: FleetSnapshot
    gone: list[Leaving]
    egos: list[SeenEgo]  # in the order of their ids
    cpu_s: float  # of looking [s]
