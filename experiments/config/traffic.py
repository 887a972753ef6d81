"""Who else drives."""

from typing import Annotated, Any, Self

from pydantic import Field, model_validator

from experiments.config.base import (
    Flow,
    Offset,
    Position,
    Share,
    Size,
    Strict,
    mismatch,
)


class Traffic(Strict):
    """Background traffic: vehicles per hour and their mix."""

    own_veh_per_h: Flow = Field(default=900.0, description="on the ego's carriageway")
    oncoming_veh_per_h: Flow = 600.0
    cross_veh_per_h: Flow = Field(default=300.0, description="on each crossing arm")
    van_share: Share = 0.1
    truck_share: Share = 0.08
    cautious_share: Share = 0.25
    aggressive_share: Share = 0.2
    own_lane: Annotated[int, Field(ge=0, le=20)] | None = Field(
        default=None, description="lane that feeds the ego's carriageway; any if none"
    )
    keep_right: bool = Field(
        default=True, description="drivers go back to the right lane when they can"
    )
    models: dict[str, Annotated[float, Field(gt=0.0, le=1000.0)]] | None = Field(
        default=None,
        min_length=1,
        description="car-following models and their relative shares",
    )

    @model_validator(mode="after")
    def _shares_fit(self) -> Self:
        """Refuse shares of more than everything."""
        for one, other in (
            ("van_share", "truck_share"),
            ("cautious_share", "aggressive_share"),
        ):
            total = getattr(self, one) + getattr(self, other)
            if total > 1.0:
                raise mismatch(
                    other, f"{one} + {other} = {total:g}; allowed: at most 1"
                )
        return self


def read_traffic(value: Any) -> Any:
    """Let `none` stand for no section."""
    return None if value == "none" else value


class ScriptedVehicle(Strict):
    """A vehicle of the kinematic world: constant speed along the reference path."""

    s_m: Position = Field(description="centre at the start")
    l_m: Offset = 0.0
    speed_mps: Annotated[float, Field(ge=-70.0, le=70.0)] = Field(
        description="negative: oncoming"
    )
    length_m: Size = 4.8
    width_m: Size = 1.9
