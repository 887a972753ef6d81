"""What stands on the road."""

from typing import Annotated, Any, Self

from pydantic import Field, model_validator

from experiments.config.base import (
    Heading,
    Offset,
    Position,
    Size,
    Strict,
    mismatch,
)

Spacing = Annotated[float, Field(ge=1.0, le=100_000.0)]


class Obstacle(Strict):
    """A static body: a disc (radius_m) or a rectangle (length_m, width_m)."""

    s_m: Position = Field(description="centre, along the reference path")
    l_m: Offset = Field(default=0.0, description="centre, positive to the left")
    radius_m: Size | None = None
    length_m: Size | None = None
    width_m: Size | None = None
    heading_rad: Heading = Field(default=0.0, description="against the reference path")

    @model_validator(mode="after")
    def _one_shape(self) -> Self:
        """Refuse a body that is both shapes or neither."""
        rectangle = self.length_m is not None and self.width_m is not None
        either = self.length_m is not None or self.width_m is not None
        if (self.radius_m is None) != rectangle or either != rectangle:
            raise mismatch("", "allowed: radius_m, or length_m and width_m")
        return self


class RandomObstacles(Strict):
    """Discs drawn from the seed, one after the other up to the goal."""

    first_m: Position = Field(description="centre of the first one")
    spacing_m: Annotated[
        tuple[Spacing, Spacing], Field(description="least and most, centre to centre")
    ] = (28.0, 45.0)
    max_offset_m: Annotated[float, Field(ge=0.0, le=50.0)] = 3.0
    radius_m: tuple[Size, Size] = (0.3, 1.5)
    keep_clear_m: tuple[tuple[Position, Position], ...] = Field(
        default=(), description="stretches [begin, end] without a centre"
    )

    @model_validator(mode="after")
    def _ranges_rise(self) -> Self:
        """Refuse a range that runs downwards."""
        for key in ("spacing_m", "radius_m"):
            least, most = getattr(self, key)
            if least > most:
                raise mismatch(
                    key, f"is [{least:g}, {most:g}]; allowed: [least, most], rising"
                )
        return self


class Obstacles(Strict):
    """Static bodies: listed one by one, or drawn from the seed."""

    listed: tuple[Obstacle, ...] = ()
    random: RandomObstacles | None = None


class RandomSection(Strict):
    """How `obstacles` asks for random ones."""

    random: RandomObstacles


def read_obstacles(value: Any) -> Any:
    """Let `none` and a list stand for the section."""
    if value == "none":
        return {}
    if isinstance(value, list | tuple):
        return {"listed": value}
    if isinstance(value, dict) and "listed" in value:
        raise mismatch("listed", "unknown key; allowed: random, or a list, or none")
    return value
