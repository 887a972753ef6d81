"""Interface of a world to the loop; SUMO and the kinematic world implement it."""

from typing import Protocol, runtime_checkable

from experiments.cosim.records import TrafficState
from experiments.cosim.road import Road
from planner.interface import Indicator
from planner.states import CartesianState, Trajectory


class World(Protocol):
    """A road with traffic through which the ego is moved step by step."""

    @property
    def step(self) -> float:
        """Time step [s]."""
        ...

    @property
    def road(self) -> Road:
        """The ego's road; its obstacles as they are, not as a simulator sees them."""
        ...

    def enter(self) -> CartesianState:
        """Start the traffic, put the ego on the road, and return its state."""
        ...

    def observe(self) -> TrafficState:
        """Read every vehicle once."""
        ...

    def advance(self, ego: CartesianState) -> CartesianState:
        """Put the ego at `ego`, move all others one step on, return the ego's state.

        The state is `ego`, unless the world has a driver of its own.
        """
        ...

    def close(self) -> None:
        """Remove the ego and end the simulation; allowed at any time."""
        ...


@runtime_checkable
class SeesIndicator(Protocol):
    """A world whose drivers react to the ego's indicator."""

    def indicate(self, indicator: Indicator) -> None:
        """Show what the ego indicates from now on."""
        ...


@runtime_checkable
class PlanDisplay(Protocol):
    """A world with a window in which the ego's plan can be drawn."""

    def show_plan(self, plan: Trajectory) -> None:
        """Draw a plan, replacing the one before."""
        ...
