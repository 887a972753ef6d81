"""What the ego sees of other vehicles."""

from typing import Annotated, Literal

from pydantic import Field

from experiments.config.base import Share, Strict

Deviation = Annotated[float, Field(ge=0.0, le=10.0)]
Coordinate = Annotated[float, Field(ge=-1e6, le=1e6)]
Polygon = Annotated[tuple[tuple[Coordinate, Coordinate], ...], Field(min_length=3)]


class PerceptionConfig(Strict):
    """Sensors and tracker of the ego; a number overrides the preset's."""

    preset: Literal["good", "poor"] = "good"
    range_m: Annotated[float, Field(gt=0.0, le=1000.0)] | None = None
    field_of_view_deg: Annotated[float, Field(gt=0.0, le=360.0)] | None = None
    occlusion: bool | None = Field(
        default=None,
        description="vehicles, obstacles and buildings hide what is behind",
    )
    buildings: tuple[Polygon, ...] = Field(
        default=(), description="corners [x, y] in the network's plane, in m"
    )
    latency_s: Annotated[float, Field(ge=0.0, le=5.0)] | None = Field(
        default=None, description="age of what is seen when it is known"
    )
    missed: Share | None = Field(
        default=None, description="share of detections that do not happen"
    )
    position_noise_m: Deviation | None = Field(
        default=None, description="standard deviation, as of all noise"
    )
    heading_noise_rad: Deviation | None = None
    speed_noise_mps: Deviation | None = None
    size_noise_m: Deviation | None = None
    correlation_s: Annotated[float, Field(gt=0.0, le=1000.0)] | None = Field(
        default=None, description="time in which noise changes"
    )
    forget_after_s: Annotated[float, Field(ge=0.0, le=60.0)] | None = Field(
        default=None, description="a vehicle not seen for longer is not believed"
    )
    margin: Annotated[float, Field(ge=0.0, le=10.0)] | None = Field(
        default=None,
        description="standard deviations of the position by which bodies are believed "
        "larger on each side",
    )
