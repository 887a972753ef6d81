"""The scenario schema: what a YAML file may say, strictly.

Unknown keys, repeated keys, wrong types and numbers out of range are errors. Every key
with a unit carries it in its name. The JSON Schema that editors read is made from the
same classes.
"""

from collections.abc import Callable
from typing import Annotated, Any, Literal, Self

from pydantic import (
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Discriminator,
    Field,
    PrivateAttr,
    Tag,
    model_validator,
)
from pydantic_core import PydanticCustomError

from experiments.errors import ConfigError
from experiments.strict_yaml import Document, KeyPath, dotted

DEFAULT_PLANNER = "cruise"

Speed = Annotated[float, Field(ge=0.0, le=70.0)]
Position = Annotated[float, Field(ge=0.0, le=100_000.0)]
Offset = Annotated[float, Field(ge=-100.0, le=100.0)]
Size = Annotated[float, Field(gt=0.0, le=50.0)]
Heading = Annotated[float, Field(ge=-6.3, le=6.3)]
Curvature = Annotated[float, Field(ge=-1.0, le=1.0)]
Length = Annotated[float, Field(gt=0.0, le=100_000.0)]
Rate = Annotated[float, Field(gt=0.0, le=30.0)]
Flow = Annotated[float, Field(ge=0.0, le=9000.0)]
Share = Annotated[float, Field(ge=0.0, le=1.0)]


class Strict(BaseModel):
    """A section of the file: closed, strictly typed, finite, unchangeable."""

    model_config = ConfigDict(
        extra="forbid", strict=True, frozen=True, allow_inf_nan=False
    )


def _as_section(key: str) -> Callable[[Any], Any]:
    """Make a reader that lets a bare name stand for `{key: name}`."""

    def read(value: Any) -> Any:
        return {key: value} if isinstance(value, str) else value

    return read


def _fail(key: str, problem: str) -> PydanticCustomError:
    """Make an error about `key`, seen from the section that is checked."""
    return PydanticCustomError(
        "inconsistent", "{problem}", {"key": key, "problem": problem}
    )


class Network(Strict):
    """A network of the catalogue, or any SUMO net with a route through it."""

    name: str | None = Field(default=None, description="network of the catalogue")
    file: str | None = Field(
        default=None, description=".net.xml, relative to this file"
    )
    route: tuple[str, ...] | None = Field(
        default=None, description="edges, in driving order"
    )
    lane: Annotated[int, Field(ge=0, le=20)] | None = Field(
        default=None, description="lane of the first edge, 0 is the rightmost"
    )

    @model_validator(mode="after")
    def _one_source(self) -> Self:
        """Refuse a network that is named twice or only half."""
        if (self.name is None) == (self.file is None):
            raise _fail("", "allowed: a name of the catalogue, or file, route and lane")
        if self.file is not None and (self.route is None or self.lane is None):
            raise _fail("file", "needs route and lane beside it")
        if self.name is not None and (self.route or self.lane is not None):
            raise _fail("name", "has its own route and lane; allowed: name alone")
        return self


def _segment_kind(value: Any) -> Any:
    """Give the kind of a segment, None for what is no segment."""
    return value[0] if isinstance(value, list | tuple) and value else None


Segment = Annotated[
    Annotated[tuple[Literal["line"], Length], Tag("line")]
    | Annotated[tuple[Literal["arc"], Length, Curvature], Tag("arc")]
    | Annotated[
        tuple[Literal["clothoid"], Length, Curvature, Curvature], Tag("clothoid")
    ],
    Discriminator(_segment_kind),
]


class Road(Strict):
    """A road made of segments, for the kinematic world."""

    segments: tuple[Segment, ...] = Field(
        min_length=1,
        description="[line, length m], [arc, length m, curvature 1/m] or "
        "[clothoid, length m, curvature at its start, at its end]",
    )
    half_width_m: Size = Field(
        default=5.0, description="road edge from the reference path"
    )

    @property
    def length(self) -> float:
        """Length of all segments [m]."""
        return sum(segment[1] for segment in self.segments)


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
            raise _fail(
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
            raise _fail(
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
        default="max", description="max: the target speed, or what traffic allows"
    )
    target_speed_mps: Annotated[float, Field(gt=0.0, le=70.0)] = 13.89
    goal_m: Position = Field(description="rear axle has arrived from here on")
    vehicle: EgoVehicle = EgoVehicle()

    @model_validator(mode="after")
    def _goal_ahead(self) -> Self:
        """Refuse a goal behind the start."""
        if self.goal_m <= self.start_m:
            raise _fail(
                "goal_m",
                f"is {self.goal_m:g}; allowed: more than start_m = {self.start_m:g}",
            )
        fastest = self.vehicle.limits.max_speed_mps
        if self.depart_speed_mps != "max" and self.depart_speed_mps > fastest:
            raise _fail(
                "depart_speed_mps",
                f"is {self.depart_speed_mps:g}; allowed: at most vehicle.limits."
                f"max_speed_mps = {fastest:g}",
            )
        return self


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
            raise _fail("", "allowed: radius_m, or length_m and width_m")
        return self


class RandomObstacles(Strict):
    """Discs drawn from the seed, one after the other up to the goal."""

    first_m: Position = Field(description="centre of the first one")
    spacing_m: Annotated[
        tuple[Length, Length], Field(description="least and most, centre to centre")
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
                raise _fail(
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


def _read_obstacles(value: Any) -> Any:
    """Let `none` and a list stand for the section."""
    if value == "none":
        return {}
    if isinstance(value, list | tuple):
        return {"listed": value}
    if isinstance(value, dict) and "listed" in value:
        raise _fail("listed", "unknown key; allowed: random, or a list, or none")
    return value


class Traffic(Strict):
    """Background traffic: vehicles per hour and their mix."""

    own_veh_per_h: Flow = Field(default=900.0, description="on the ego's carriageway")
    oncoming_veh_per_h: Flow = 600.0
    cross_veh_per_h: Flow = Field(default=300.0, description="on each crossing arm")
    van_share: Share = 0.1
    truck_share: Share = 0.08
    cautious_share: Share = 0.25
    aggressive_share: Share = 0.2
    models: dict[str, Annotated[float, Field(ge=0.0, le=1000.0)]] | None = Field(
        default=None, description="car-following models and their relative shares"
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
                raise _fail(other, f"{one} + {other} = {total:g}; allowed: at most 1")
        return self


def _read_traffic(value: Any) -> Any:
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


class PlannerChoice(Strict):
    """A planner by name or `module:factory`, and its settings."""

    name: str = Field(min_length=1)
    settings: dict[str, Any] = Field(default_factory=dict)


class Simulation(Strict):
    """Time, and when to give up."""

    step_s: Annotated[float, Field(ge=0.01, le=1.0)] = 0.1
    warmup_s: Annotated[float, Field(ge=0.0, le=3600.0)] = Field(
        default=60.0, description="traffic runs alone before the ego enters"
    )
    duration_s: Annotated[float, Field(gt=0.0, le=3600.0)] = 90.0
    horizon_s: Annotated[float, Field(gt=0.0, le=20.0)] = Field(
        default=5.0, description="how far vehicles are predicted"
    )
    seed: Annotated[int, Field(ge=0, le=2**31 - 1)] = 0
    blocked_after_s: Annotated[float, Field(gt=0.0, le=3600.0)] = Field(
        default=20.0, description="standing this long without a way on ends the episode"
    )


class Scenario(Strict):
    """One episode: a road, an ego, what is in its way, and a planner."""

    model_config = ConfigDict(title="rearview scenario")
    _document: Document | None = PrivateAttr(None)

    name: str = Field(pattern=r"^[A-Za-z0-9_]+$")
    purpose: str = Field("", description="one sentence, shown by `rearview list`")
    world: Literal["sumo", "kinematic"] = "sumo"
    network: (
        Annotated[
            Network,
            BeforeValidator(_as_section("name"), json_schema_input_type=str | Network),
        ]
        | None
    ) = Field(default=None, description="world sumo: a name of the catalogue or a file")
    road: Road | None = Field(default=None, description="world kinematic")
    ego: Ego
    obstacles: Annotated[
        Obstacles,
        BeforeValidator(
            _read_obstacles,
            json_schema_input_type=Literal["none"]
            | tuple[Obstacle, ...]
            | RandomSection,
        ),
    ] = Obstacles()
    traffic: Annotated[
        Traffic | None,
        BeforeValidator(
            _read_traffic, json_schema_input_type=Literal["none"] | Traffic
        ),
    ] = Field(default=None, description="world sumo")
    vehicles: tuple[ScriptedVehicle, ...] = Field(
        default=(), description="world kinematic"
    )
    planner: Annotated[
        PlannerChoice,
        BeforeValidator(
            _as_section("name"), json_schema_input_type=str | PlannerChoice
        ),
    ] = PlannerChoice(name=DEFAULT_PLANNER)
    simulation: Simulation = Simulation()

    @model_validator(mode="after")
    def _fits_world(self) -> Self:
        """Refuse keys of the other world, and things beyond the road."""
        sumo = self.world == "sumo"
        needed, foreign = ("network", "road") if sumo else ("road", "network")
        if getattr(self, needed) is None:
            raise _fail(needed, f"is missing; world {self.world} needs it")
        if getattr(self, foreign) is not None:
            raise _fail(foreign, f"is not for world {self.world}; allowed: {needed}")
        if sumo and self.vehicles:
            raise _fail("vehicles", "is not for world sumo; allowed: traffic")
        if not sumo and self.traffic is not None:
            raise _fail("traffic", "is not for world kinematic; allowed: vehicles")
        beyond = self.beyond(self.road.length) if self.road else None
        if beyond is not None:
            raise _fail(dotted(beyond[0]), beyond[1])
        return self

    def beyond(self, length: float) -> tuple[KeyPath, str] | None:
        """Find a goal, obstacle or vehicle that is not on the road.

        Args:
            length: Of the road [m].

        Returns:
            The key and what is wrong with it, None if all is on the road.
        """
        places: dict[KeyPath, float] = {("ego", "goal_m"): self.ego.goal_m}
        for index, obstacle in enumerate(self.obstacles.listed):
            places["obstacles", index, "s_m"] = obstacle.s_m
        for index, vehicle in enumerate(self.vehicles):
            places["vehicles", index, "s_m"] = vehicle.s_m
        if self.obstacles.random:
            places["obstacles", "random", "first_m"] = self.obstacles.random.first_m
        for key, place in places.items():
            if place > length:
                problem = f"is {place:g}; allowed: 0 to {length:.1f}, the road's end"
                return key, problem
        return None

    def from_document(self, document: Document) -> Self:
        """Remember where the keys were written, for messages that come later."""
        self._document = document
        return self

    def error(self, path: KeyPath, problem: str) -> ConfigError:
        """Make the error about a key, naming the place where it was written."""
        where = self._document.where(path) if self._document else self.name
        return ConfigError(f"{where}: {dotted(path)}: {problem}")

    def resolved(self) -> dict[str, Any]:
        """Give the whole configuration as plain data that reads back the same."""
        data: dict[str, Any] = self.model_dump(mode="json", exclude_none=True)
        if self.network is not None and self.network.name is not None:
            data["network"] = self.network.name
        random = self.obstacles.random
        data["obstacles"] = (
            {"random": data["obstacles"]["random"]}
            if random
            else data["obstacles"]["listed"]
        )
        if self.world == "sumo":
            data.setdefault("traffic", "none")
        return data
