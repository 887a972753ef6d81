"""Where the ego drives: a SUMO network, or a road of segments."""

from typing import Annotated, Any, Literal, Self

from pydantic import BeforeValidator, Discriminator, Field, Tag, model_validator

from experiments.config.base import Curvature, Length, Size, Strict, mismatch


def _edge_id(value: Any) -> Any:
    """Take a whole number for text: edges of OpenStreetMap are numbered."""
    whole = isinstance(value, int) and not isinstance(value, bool)
    return str(value) if whole else value


# What YAML reads as a number is the id as it stands: 283921463, -4713.
EdgeId = Annotated[str, BeforeValidator(_edge_id, json_schema_input_type=str | int)]

# what is wrong with the key vehicle where the traffic names no files
VEHICLE_OF_FILES = "is of a route file; allowed with traffic.sumocfg or route_files"


class NetworkConfig(Strict):
    """A network of the catalogue, or any SUMO net with a route through it."""

    name: str | None = Field(default=None, description="network of the catalogue")
    file: str | None = Field(
        default=None,
        description=".net.xml, or a map to be converted (.xodr, .osm); world "
        "commonroad: a scenario's .xml; relative to this file",
    )
    route: tuple[EdgeId, ...] | None = Field(
        default=None, description="edges, in driving order; without it by from and to"
    )
    from_: EdgeId | None = Field(
        default=None, alias="from", description="edge where the fastest route begins"
    )
    via: tuple[EdgeId, ...] | None = Field(
        default=None, description="edges on the way, in driving order"
    )
    to: EdgeId | None = Field(
        default=None, description="edge where the fastest route ends"
    )
    vehicle: EdgeId | None = Field(
        default=None,
        description="vehicle of the traffic's route files whose route and place the "
        "ego takes",
    )
    lane: Annotated[int, Field(ge=0, le=20)] | None = Field(
        default=None,
        description="lane of the first edge, 0 is at the kerb; by default the first "
        "one for cars",
    )

    planning_problem: int | None = Field(
        default=None,
        description="world commonroad: which one of the file; default: the first",
    )

    @property
    def is_drawn(self) -> bool:
        """Whether the route is drawn from the seed."""
        chosen = (self.name, self.route, self.from_, self.vehicle)
        return all(value is None for value in chosen)

    @model_validator(mode="after")
    def _one_source(self) -> Self:
        """Reject a network given by both name and file, or incompletely."""
        if (self.name is None) == (self.file is None):
            given = "both name and file" if self.file is not None else "neither"
            words = f"has {given}; allowed: one of name (of the catalogue) and file"
            raise mismatch("", words)
        places = self.from_ is not None or self.to is not None or self.via is not None
        if self.name is not None and (self.route or places or self.lane is not None):
            raise mismatch("name", "has its own route and lane; allowed: name alone")
        if self.route is not None and places:
            raise mismatch("route", "allowed: route, or from, via and to")
        if self.vehicle is not None and (self.file is None or self.route or places):
            problem = "has its own route; allowed beside file and lane alone"
            raise mismatch("vehicle", problem)
        if places and (self.from_ is None or self.to is None):
            missing = "from" if self.from_ is None else "to"
            words = "is missing; allowed: from and to, with or without via, or none"
            raise mismatch(missing, words)
        fixed = self.route is not None or places or self.vehicle is not None
        if self.lane is not None and not fixed:
            raise mismatch("lane", "needs a route, from and to, or a vehicle")
        return self


def _segment_kind(value: Any) -> Any:
    """Return the kind of a segment, None if it is not a segment."""
    return value[0] if isinstance(value, list | tuple) and value else None


Segment = Annotated[
    Annotated[tuple[Literal["line"], Length], Tag("line")]
    | Annotated[tuple[Literal["arc"], Length, Curvature], Tag("arc")]
    | Annotated[
        tuple[Literal["clothoid"], Length, Curvature, Curvature], Tag("clothoid")
    ],
    Discriminator(_segment_kind),
]


class RoadLanes(Strict):
    """Lanes of the same width, side by side about the reference path."""

    count: Annotated[int, Field(ge=1, le=20)]
    width_m: Size = 3.5


class KinematicRoad(Strict):
    """A road made of segments, for the kinematic world."""

    segments: tuple[Segment, ...] = Field(
        min_length=1,
        description="[line, length m], [arc, length m, curvature 1/m] or "
        "[clothoid, length m, curvature at its start, at its end]",
    )
    half_width_m: Size = Field(
        default=5.0, description="road edge from the reference path"
    )
    lanes: RoadLanes | None = Field(
        default=None, description="marked lanes, their middle on the reference path"
    )

    @model_validator(mode="after")
    def _lanes_on_the_road(self) -> Self:
        """Reject lanes that are wider than the road."""
        if self.lanes is not None:
            widest = 2.0 * self.half_width_m / self.lanes.count
            if self.lanes.width_m > widest:
                raise mismatch(
                    "lanes.width_m",
                    f"is {self.lanes.width_m:g}; allowed: at most {widest:g}, "
                    f"2 half_width_m / count",
                )
        return self

    @model_validator(mode="after")
    def _edges_inside_bends(self) -> Self:
        """Reject a road whose half width exceeds the radius of a bend."""
        bends = (abs(bend) for segment in self.segments for bend in segment[2:])
        sharpest = max(bends, default=0.0)
        if self.half_width_m * sharpest >= 1.0:
            raise mismatch(
                "half_width_m",
                f"is {self.half_width_m:g}; allowed: less than the smallest radius of "
                f"the segments, {1.0 / sharpest:g} m",
            )
        return self

    @property
    def length(self) -> float:
        """Length of all segments [m]."""
        return sum(segment[1] for segment in self.segments)
