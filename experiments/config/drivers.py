"""The drivers of the background traffic: who they are, and what they do wrong."""

from typing import Annotated, Any, Literal, Self

from pydantic import Field, model_validator

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
    cut_ins_per_h: PerHour = Field(
        default=0.0,
        description="for 3 to 10 s each driver changes lanes for little, into gaps "
        "a quarter as long as usual",
    )
    red_lights_per_h: PerHour = Field(
        default=0.0, description="each driver heeds no red light for 5 to 20 s"
    )
    right_of_way_violations_per_h: PerHour = Field(
        default=0.0, description="each driver gives no way at junctions for 5 to 20 s"
    )
    late_mergers: Share = Field(
        default=0.0,
        description="share of drivers who leave a lane that ends at the last moment",
    )
    cooperation: Share = Field(
        default=0.0,
        description="probability that a driver opens a gap for an ego that indicates "
        "a lane change; only lane_change, its variants and route indicate",
    )
    near_ego_factor: Annotated[float, Field(ge=1.0, le=1000.0)] = Field(
        default=1.0,
        description="errors begin so many times as often within 50 m of the ego; the "
        "run's importance_weight says how much likelier it is without",
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
        rates = (
            self.hard_brakes_per_h,
            self.stalls_per_h,
            self.cut_ins_per_h,
            self.red_lights_per_h,
            self.right_of_way_violations_per_h,
        )
        return distracted or max(rates) > 0.0 or self.late_mergers > 0.0

    @model_validator(mode="after")
    def _has_errors_to_sample(self) -> Self:
        """Reject a factor on errors that never happen."""
        if self.near_ego_factor > 1.0 and not self.err:
            problem = f"is {self.near_ego_factor:g} of no errors; allowed: 1"
            raise mismatch("near_ego_factor", problem)
        return self
