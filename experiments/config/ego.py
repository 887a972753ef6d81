"""The ego: its start, its goal and its body."""

import re
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Annotated, Literal, Self

from pydantic import BeforeValidator, Field, model_validator

from experiments.config.base import (
    Offset,
    Position,
    Rate,
    Size,
    Speed,
    Strict,
    as_section,
    mismatch,
)
from experiments.config.perception import PerceptionConfig
from experiments.config.vehicle_model import (
    ActuatorsConfig,
    ControllerConfig,
    PlanStartConfig,
    PlantConfig,
    unless_perfect,
)
from planner.vehicle import Vehicle, VehicleError, VehicleLimits

BODY = Vehicle()  # defaults and consistency are those of the planner's vehicle
TUBE_WORDS = ("auto", "none")
_CONFIG_NAMES = {  # of the planner -> of the file
    name: f"{name}{unit}"
    for unit, names in {
        "_m": ("length", "width", "wheelbase", "rear_overhang"),
        "_mps": ("max_speed",),
        "_mps2": (
            "max_acceleration",
            "max_deceleration",
            "emergency_deceleration",
            "max_lateral_acceleration",
        ),
        "_1pm": ("max_curvature",),
    }.items()
    for name in names
}
_NAME = re.compile(r"\b(" + "|".join(_CONFIG_NAMES) + r")\b")


@contextmanager
def _named_as_in_the_file() -> Iterator[None]:
    """Turn an error of the planner's vehicle into one about a key of the file."""
    try:
        yield
    except VehicleError as error:
        allowed = _NAME.sub(lambda found: _CONFIG_NAMES[found[0]], error.allowed)
        problem = f"is {error.value:g}; allowed: {allowed}"
        raise mismatch(_CONFIG_NAMES[error.field], problem) from error


class Limits(Strict):
    """Limits of the vehicle's motion."""

    max_speed_mps: Annotated[float, Field(gt=0.0, le=70.0)] = BODY.limits.max_speed
    max_acceleration_mps2: Rate = BODY.limits.max_acceleration
    max_deceleration_mps2: Rate = BODY.limits.max_deceleration
    emergency_deceleration_mps2: Rate = BODY.limits.emergency_deceleration
    max_lateral_acceleration_mps2: Rate = BODY.limits.max_lateral_acceleration
    max_curvature_1pm: Annotated[float, Field(gt=0.0, le=1.0)] = (
        BODY.limits.max_curvature
    )

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        """Raise unless the planner accepts the limits."""
        with _named_as_in_the_file():
            self.to_planner()
        return self

    def to_planner(self) -> VehicleLimits:
        """Make the planner's limits."""
        return VehicleLimits(
            self.max_speed_mps,
            self.max_acceleration_mps2,
            self.max_deceleration_mps2,
            self.emergency_deceleration_mps2,
            self.max_lateral_acceleration_mps2,
            self.max_curvature_1pm,
        )


class EgoVehicle(Strict):
    """Dimensions and limits of the ego."""

    length_m: Size = BODY.length
    width_m: Annotated[float, Field(gt=0.0, le=4.0)] = BODY.width
    wheelbase_m: Size = BODY.wheelbase
    rear_overhang_m: Size = Field(
        default=BODY.rear_overhang, description="rear axle to rear bumper"
    )
    limits: Limits = Limits()

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        """Raise unless the planner accepts the dimensions."""
        with _named_as_in_the_file():
            self.to_planner()
        return self

    def to_planner(self) -> Vehicle:
        """Make the planner's vehicle."""
        return Vehicle(
            self.length_m,
            self.width_m,
            self.wheelbase_m,
            self.rear_overhang_m,
            self.limits.to_planner(),
        )


class Ego(Strict):
    """Start, goal and body of the ego."""

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
    goal_m: Position | None = Field(
        default=None,
        description="rear axle has arrived from here on; by default the end of a route "
        "that network.from and to, vehicle or route name, 300 m ahead (or less) on a "
        "random one of network.file; world commonroad: the planning problem of the "
        "file has the goal",
    )
    vehicle: EgoVehicle = EgoVehicle()
    plant: Annotated[
        PlantConfig | None,
        BeforeValidator(
            unless_perfect("model"),
            json_schema_input_type=Literal["perfect", "kinematic", "dynamic"]
            | PlantConfig,
        ),
    ] = Field(default=None, description="perfect, the default: the ego is on its plan")
    actuators: Annotated[
        ActuatorsConfig | None,
        BeforeValidator(
            as_section("preset"),
            json_schema_input_type=Literal["ideal", "nuplan", "autoware"]
            | ActuatorsConfig,
        ),
    ] = Field(default=None, description="with a plant that is not perfect")
    controller: Annotated[
        ControllerConfig | None,
        BeforeValidator(
            as_section("name"),
            json_schema_input_type=Literal["lqr", "pure_pursuit", "stanley"]
            | ControllerConfig,
        ),
    ] = Field(default=None, description="with a plant that is not perfect")
    plan_start: Annotated[
        PlanStartConfig | None,
        BeforeValidator(
            as_section("rule"),
            json_schema_input_type=Literal["stitched", "measured"] | PlanStartConfig,
        ),
    ] = Field(default=None, description="with a plant that is not perfect")
    tube: str | None = Field(
        default=None,
        min_length=1,
        description="by what the body grows for the planner: auto, the default: the "
        "plant's measured errors; none; or a file of `rearview tube`",
    )
    perception: Annotated[
        PerceptionConfig | None,
        BeforeValidator(
            unless_perfect("preset"),
            json_schema_input_type=Literal["perfect", "good", "poor"]
            | PerceptionConfig,
        ),
    ] = Field(default=None, description="perfect, the default: all is seen as it is")

    @property
    def goal(self) -> float:
        """Where the ego has arrived; for worlds whose scenarios say it [m]."""
        return self.start_m if self.goal_m is None else self.goal_m

    @model_validator(mode="after")
    def _goal_ahead(self) -> Self:
        """Raise if the goal is behind the start, or the ego starts too fast."""
        if self.goal_m is not None and self.goal_m <= self.start_m:
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
        if self.plant is None:
            for key in ("actuators", "controller", "plan_start", "tube"):
                if getattr(self, key) is not None:
                    problem = "needs a plant; allowed: ego.plant: kinematic or dynamic"
                    raise mismatch(key, problem)
        return self
