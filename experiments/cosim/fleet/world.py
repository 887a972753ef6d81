"""Interface of a world with many egos to their loop."""

from collections.abc import Mapping, Sequence, Set
from typing import Protocol

from experiments.cosim.fleet.records import EnteredVehicle, FleetSnapshot
from experiments.cosim.records import Signal
from experiments.cosim.right_of_way import JunctionTraffic
from experiments.cosim.road import Road
from planner.states import CartesianState
from planner.vehicle import Vehicle


class FleetWorld(Protocol):
    """A road network whose vehicles enter by themselves; some are moved by us."""

    @property
    def step(self) -> float:
        """Time step [s]."""
        ...

    @property
    def lanes(self) -> Sequence[str]:
        """Names of the lanes by their numbers; grows as lanes are used."""
        ...

    def enter(self) -> None:
        """Start the traffic."""
        ...

    def observe(self) -> FleetSnapshot:
        """Read every vehicle once."""
        ...

    def describe(self, name: str) -> EnteredVehicle:
        """Describe a vehicle on the road."""
        ...

    def take_over(self, name: str, body: Vehicle) -> CartesianState:
        """Switch a vehicle's driver off; return its rear axle."""
        ...

    def hand_back(self, name: str) -> None:
        """Give a vehicle back to its driver."""
        ...

    def take_out(self, name: str) -> None:
        """Remove an ego that has arrived."""
        ...

    def forget(self, name: str) -> None:
        """Note that an ego is gone."""
        ...

    def signals(self, road: Road) -> tuple[Signal, ...]:
        """Read the traffic lights of a road."""
        ...

    def junction_traffic(self, road: Road) -> JunctionTraffic:
        """Return what knows the movements over a road's junctions."""
        ...

    def ghost(self, name: str) -> CartesianState | None:
        """Return the centre of an ego's ghost."""
        ...

    def advance(
        self, egos: Mapping[str, CartesianState], waiting: Set[str] = frozenset()
    ) -> None:
        """Put all egos where they go, and move all others one step on.

        Args:
            egos: Rear axles by id.
            waiting: Those that are before a line of their road.
        """
        ...

    def close(self) -> None:
        """End the simulation; allowed at any time."""
        ...
