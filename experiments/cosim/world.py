"""What the loop needs of a world; SUMO and the kinematic world both provide it."""

from typing import Protocol, runtime_checkable

from experiments.cosim.records import TrafficState
from planner.reference_path.path import ReferencePath
from planner.scene import Obstacles, RoadBounds
from planner.states import CartesianState, Trajectory


class World(Protocol):
    """A road with traffic through which the ego is moved step by step."""

    @property
    def step(self) -> float:
        """Time step [s]."""
        ...

    @property
    def path(self) -> ReferencePath:
        """Reference path of the ego's route."""
        ...

    @property
    def road(self) -> RoadBounds:
        """Lateral room along `path`."""
        ...

    @property
    def obstacles(self) -> Obstacles:
        """Static bodies: the truth, whatever the simulator made of them."""
        ...

    def enter(self) -> CartesianState:
        """Bring the traffic up, put the ego on the road, and say where it stands."""
        ...

    def observe(self) -> TrafficState:
        """Read every vehicle once."""
        ...

    def advance(self, ego: CartesianState) -> CartesianState:
        """Put the ego at `ego`, move everyone else one step on, say where the ego is.

        That is `ego`, unless the world has a driver of its own.
        """
        ...

    def close(self) -> None:
        """Take the ego out and end the simulation; allowed at any time."""
        ...


@runtime_checkable
class PlanDisplay(Protocol):
    """A world with a window in which the ego's plan can be drawn."""

    def show_plan(self, plan: Trajectory) -> None:
        """Draw a plan in the place of the one before."""
        ...
