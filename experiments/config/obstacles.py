"""What stands on the road."""

from typing import Annotated, Any, Literal, Self

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
Count = Annotated[int, Field(ge=1, le=1000)]
Margin = Annotated[float, Field(ge=0.0, le=5.0)]

# r_ob of the four sizes of [Thesis] table 5.4
THESIS_RADII: tuple[float, ...] = (2.5, 1.58, 2.7, 0.71)


class Obstacle(Strict):
    """A static body: a disc (radius_m) or a rectangle (length_m, width_m)."""

    s_m: Position = Field(description="centre, along the reference path")
    l_m: Offset = Field(default=0.0, description="centre, positive to the left")
    radius_m: Size | None = None
    length_m: Size | None = None
    width_m: Size | None = None
    heading_rad: Heading = Field(
        default=0.0, description="relative to the reference path"
    )

    @model_validator(mode="after")
    def _one_shape(self) -> Self:
        """Reject a body that has both shapes or neither."""
        rectangle = self.length_m is not None and self.width_m is not None
        either = self.length_m is not None or self.width_m is not None
        if (self.radius_m is None) != rectangle or either != rectangle:
            raise mismatch("", "allowed: radius_m, or length_m and width_m")
        return self


class RandomObstacles(Strict):
    """Discs drawn from the seed, one after the other up to the goal."""

    first_m: Position = Field(description="centre of the first one")
    spacing_m: Annotated[
        tuple[Spacing, Spacing],
        Field(description="minimum and maximum, centre to centre"),
    ] = (28.0, 45.0)
    max_offset_m: Annotated[float, Field(ge=0.0, le=50.0)] = 3.0
    radius_m: tuple[Size, Size] = (0.3, 1.5)
    keep_clear_m: tuple[tuple[Position, Position], ...] = Field(
        default=(), description="stretches [begin, end] without a centre"
    )

    @model_validator(mode="after")
    def _ranges_rise(self) -> Self:
        """Reject a descending range."""
        for key in ("spacing_m", "radius_m"):
            least, most = getattr(self, key)
            if least > most:
                raise mismatch(
                    key, f"is [{least:g}, {most:g}]; allowed: [least, most], rising"
                )
        return self


class ObstacleField(Strict):
    """Discs drawn from the seed that crowd a winding course for the ego."""

    count: Count | tuple[Count, Count] = Field(
        default=(10, 25), description="number of discs, or minimum and maximum"
    )
    first_m: Position = Field(description="smallest s of a centre")
    last_m: Position = Field(description="largest s of a centre")
    radii_m: Annotated[tuple[Size, ...], Field(min_length=1)] = Field(
        default=THESIS_RADII, description="radii, drawn with equal probability"
    )
    passable: bool = Field(
        default=True,
        description="false: a row of discs blocks the road in its last two thirds",
    )
    course_margin_m: Margin = Field(
        default=0.5,
        description="minimum distance of the ego's body to obstacles and road edges "
        "on a feasible course",
    )
    gap_m: Annotated[float, Field(ge=0.0, le=50.0)] = Field(
        default=1.0, description="minimum distance between obstacles, except in the row"
    )

    @model_validator(mode="after")
    def _ranges_rise(self) -> Self:
        """Reject a descending range."""
        least, most = self.counts
        if least > most:
            raise mismatch(
                "count", f"is [{least}, {most}]; allowed: [least, most], rising"
            )
        if self.first_m >= self.last_m:
            raise mismatch(
                "last_m",
                f"is {self.last_m:g}; allowed: more than first_m = {self.first_m:g}",
            )
        return self

    @property
    def counts(self) -> tuple[int, int]:
        """Least and most obstacles."""
        return (self.count, self.count) if isinstance(self.count, int) else self.count


ClosureKind = Literal["stopped_vehicle", "disallowed", "lane_end"]
KnownFrom = Annotated[float, Field(gt=0.0, le=10_000.0)]


class ObstaclesConfig(Strict):
    """Static bodies: listed one by one, or drawn from the seed."""

    listed: tuple[Obstacle, ...] = ()
    random: RandomObstacles | None = None
    field: ObstacleField | None = None
    closure: ClosureKind | None = None
    known_from_m: KnownFrom | None = None

    @property
    def listed_key(self) -> tuple[str, ...]:
        """Key inside the section under which the listed bodies are written."""
        return () if self.closure is None else ("listed",)


class DrawnSection(Strict):
    """How `obstacles` asks for drawn ones."""

    random: RandomObstacles | None = None
    field: ObstacleField | None = None


class ClosureSection(Strict):
    """How `obstacles` closes lanes: where, and what drivers are told of it."""

    listed: Annotated[tuple[Obstacle, ...], Field(min_length=1)] = Field(
        description="bodies that stand in the closed lanes"
    )
    closure: ClosureKind = Field(
        description="what closes the lanes of the bodies for SUMO's traffic: vehicles "
        "that have stopped there; no admittance to these stretches of lane; or the "
        "ends of lanes in the network"
    )
    known_from_m: KnownFrom | None = Field(
        default=None,
        description="distance of the ego's front bumper from the first closed place "
        "at which its driver, planner or SUMO's, is told; default: at the start",
    )


def read_obstacles(value: Any) -> Any:
    """Let `none` and a list stand for the section."""
    if value == "none":
        return {}
    if isinstance(value, list | tuple):
        return {"listed": value}
    if not isinstance(value, dict):
        return value
    if "closure" in value:
        drawn = {"random", "field"} & value.keys()
        if drawn:
            raise mismatch(min(drawn), "is beside closure; allowed: listed")
        if not value.get("listed"):
            raise mismatch("listed", "is missing; allowed: the bodies of the closure")
        return value
    if "known_from_m" in value:
        raise mismatch("known_from_m", "is of a closure; allowed: closure beside it")
    if "listed" in value:
        problem = "unknown key; allowed: random or field, or a list, or none"
        raise mismatch("listed", problem)
    if {"random", "field"} <= value.keys():
        raise mismatch("field", "is beside random; allowed: one of them")
    return value
