"""The drivers of the background traffic: who they are, and what they do wrong."""

from typing import Annotated, Any, Literal

from pydantic import Field

from experiments.config.base import Share, Strict, mismatch
from sumo_nets.driver_population import POPULATIONS

PopulationName = Literal[
    "calm", "urban", "motorway", "distracted", "aggressive", "krauss_default"
]
PerHour = Annotated[float, Field(ge=0.0, le=600.0)]


class Drivers(Strict):
    """A population of drivers in place of tempers and models, and their errors."""

    population: PopulationName = Field(
        description="distributions that each driver's parameters are drawn from"
    )
    distraction: Annotated[float, Field(ge=0.0, le=10.0)] = Field(
        default=1.0,
        description="scales how often the distracted population looks away; 0: never",
    )
    awareness: Annotated[Share, Field(gt=0.0)] = Field(
        default=0.2,
        description="of a driver who looks away, as in SUMO's driver state",
    )
    hard_brakes_per_h: PerHour = Field(
        default=0.0, description="for no reason, by each driver, for 0.5 to 2 s"
    )
    hard_brake_mps2: Annotated[float, Field(gt=0.0, le=9.0)] = Field(
        default=4.0, description="deceleration of braking for no reason"
    )
    stalls_per_h: PerHour = Field(
        default=0.0, description="each driver stops in the lane for 10 to 30 s"
    )

    @classmethod
    def read(cls, value: Any) -> Any:
        """Let the name of a population stand for the section."""
        if not isinstance(value, str):
            return value
        if value not in POPULATIONS:
            problem = f"is {value}; allowed: {', '.join(POPULATIONS)}"
            raise mismatch("population", problem)
        return {"population": value}

    @property
    def err(self) -> bool:
        """Whether drivers do anything wrong."""
        away = POPULATIONS[self.population].glances is not None
        distracted = away and self.distraction > 0.0
        return distracted or self.hard_brakes_per_h > 0.0 or self.stalls_per_h > 0.0
