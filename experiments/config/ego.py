"""The ego: where it starts, what it wants, what it is."""

from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from experiments.config.base import (
    Offset,
    Position,
    Rate,
    Size,
    Speed,
    Strict,
    mismatch,
)


class Limits(Strict):
    """What the vehicle can do."""

    max_speed_mps: Annotated[float, Field(gt=0.0, le=70.0)] = 20.0
    max_acceleration_mps2: Rate = 3.0
    max_deceleration_mps2: Rate = 4.5
    emergency_deceleration_mps2: Rate = 8.0
    max_lateral_acceleration_mps2: Rate = 4.0
    max_curvature_1pm: Annotated[float, Field(gt=0.0, le=1.0)] = 0.2

    @model_validator(mode="after")
    def _ordered(self) -> Self:
        """Refuse emergency braking that is weaker than service braking."""
        if self.emergency_deceleration_mps2 < self.max_deceleration_mps2:
            raise mismatch(
                "emergency_deceleration_mps2",
                f"is {self.emergency_deceleration_mps2:g}; allowed: at least "
                f"max_deceleration_mps2 = {self.max_deceleration_mps2:g}",
            )
        return self


class EgoVehicle(Strict):
    """Dimensions and limits of the ego."""

    length_m: Size = 4.8
    width_m: Annotated[float, Field(gt=0.0, le=4.0)] = 1.9
    wheelbase_m: Size = 2.8
    rear_overhang_m: Size = Field(default=1.0, description="rear axle to rear bumper")
    limits: Limits = Limits()

    @model_validator(mode="after")
    def _axles_inside(self) -> Self:
        """Refuse axles outside the body."""
        room = self.length_m - self.rear_overhang_m
        if self.wheelbase_m > room:
            raise mismatch(
                "wheelbase_m",
                f"is {self.wheelbase_m:g}; allowed: at most length_m - "
                f"rear_overhang_m = {room:g}",
            )
        return self


class Ego(Strict):
    """Where the ego starts, what it wants, and what it is."""

    start_m: Position = Field(
        default=0.0, description="rear axle on the reference path"
    )
    start_offset_m: Offset = Field(default=0.0, description="positive to the left")
    depart_speed_mps: Speed | Literal["max"] = Field(
        default="max",
        description="max: what road and traffic allow; the target speed in world "
        "kinematic",
    )
    target_speed_mps: Annotated[float, Field(gt=0.0, le=70.0)] = 13.89
    goal_m: Position = Field(description="rear axle has arrived from here on")
    vehicle: EgoVehicle = EgoVehicle()

    @model_validator(mode="after")
    def _goal_ahead(self) -> Self:
        """Refuse a goal behind the start."""
        if self.goal_m <= self.start_m:
            raise mismatch(
                "goal_m",
                f"is {self.goal_m:g}; allowed: more than start_m = {self.start_m:g}",
            )
        fastest = self.vehicle.limits.max_speed_mps
        if self.depart_speed_mps != "max" and self.depart_speed_mps > fastest:
            raise mismatch(
                "depart_speed_mps",
                f"is {self.depart_speed_mps:g}; allowed: at most vehicle.limits."
                f"max_speed_mps = {fastest:g}",
            )
        return self
