"""The whole scenario: its sections, and what must agree between them."""

from collections.abc import Mapping
from typing import Annotated, Any, Literal, Self

from pydantic import (
    BeforeValidator,
    ConfigDict,
    Discriminator,
    Field,
    PrivateAttr,
    Tag,
    model_validator,
)

from experiments.config.base import Strict, as_section, mismatch
from experiments.config.conflict import N_LANES, STEP_S, Conflict
from experiments.config.ego import Ego
from experiments.config.egos import (
    EgoGroup,
    Measurement,
    largest_share,
    read_groups,
)
from experiments.config.obstacles import (
    ClosureSection,
    DrawnSection,
    Obstacle,
    ObstaclesConfig,
    read_obstacles,
)
from experiments.config.planner_choice import PlannerChoice as PlannerChoice
from experiments.config.road import KinematicRoad, NetworkConfig
from experiments.config.self_driven import SELF_DRIVEN, SUMO
from experiments.config.traffic import (
    ScriptedVehicleConfig,
    SumoTraffic,
    Traffic,
    read_traffic,
    traffic_kind,
)
from experiments.config.vehicle_model import (
    ControllerConfig,
    check_delays,
    is_multiple,
)
from experiments.config.yaml_reader import Document, KeyPath, dotted
from experiments.errors import ConfigError

DEFAULT_PLANNER = "cruise"
NETWORK_PLANNER = "route"  # the default on networks of users

AnyTraffic = Annotated[
    Annotated[Traffic, Tag("flows")] | Annotated[SumoTraffic, Tag("files")],
    Discriminator(traffic_kind),
]


def default_planner(data: Mapping[str, Any]) -> str:
    """Return the planner of a scenario that names none.

    Args:
        data: The scenario as it is written.
    """
    network, world = data.get("network"), data.get("world", "sumo")
    of_user = isinstance(network, Mapping) and network.get("file") is not None
    if world == "sumo" and of_user and data.get("egos") is None:
        return NETWORK_PLANNER
    return DEFAULT_PLANNER


class Simulation(Strict):
    """Time, and when to give up."""

    step_s: Annotated[float, Field(ge=0.01, le=1.0)] = 0.1
    warmup_s: Annotated[float, Field(ge=0.0, le=3600.0)] = Field(
        default=60.0, description="duration of traffic before the ego enters"
    )
    duration_s: Annotated[float, Field(gt=0.0, le=3600.0)] = 90.0
    horizon_s: Annotated[float, Field(gt=0.0, le=20.0)] = Field(
        default=5.0, description="prediction horizon of vehicles"
    )
    seed: Annotated[int, Field(ge=0, le=2**31 - 1)] = 0
    blocked_after_s: Annotated[float, Field(gt=0.0, le=3600.0)] = Field(
        default=20.0,
        description="the episode ends after standing this long without a way on",
    )
    predictor: Literal["constant_speed", "held_braking", "recorded"] = Field(
        default="constant_speed",
        description="constant_speed: vehicles keep their speed; held_braking: braking "
        "vehicles are predicted to brake to a stop; recorded: in world commonroad, the "
        "file's own future",
    )
    ghost: bool = Field(
        default=True,
        description="world sumo: followers see an ego that reaches over a lane line",
    )
    lane_change_guard: bool = Field(
        default=True,
        description="world sumo: vehicles abreast of the ego begin no lane change",
    )
    planning_period_s: Annotated[float, Field(gt=0.0, le=5.0)] | None = Field(
        default=None,
        description="time between planning cycles, a multiple of step_s; default: "
        "step_s",
    )
    planning_delay_s: (
        Annotated[float, Field(ge=0.0, le=5.0)] | Literal["measured"] | None
    ) = Field(
        default=None,
        description="time after which a plan takes effect, a multiple of step_s; "
        "measured: the time that planning took, so that runs differ; default: 0",
    )
    without_ego: bool = Field(
        default=False,
        description="world sumo: also drive the same seed without the ego, to measure "
        "its cost to the vehicles behind",
    )
    placebo: bool = Field(
        default=False,
        description="with without_ego: run that twice more, each with other random "
        "numbers of SUMO from the ego's entry on, to see what is chance",
    )
    repetition: Annotated[int, Field(ge=0, le=1_000_000)] = Field(
        default=0,
        description="world sumo: the same demand and obstacles with other random "
        "numbers of SUMO; 0: those of the seed",
    )


class Scenario(Strict):
    """One episode: a road, an ego, what is in its way, and a planner."""

    model_config = ConfigDict(title="rearview scenario")
    _document: Document | None = PrivateAttr(None)

    name: str = Field(pattern=r"^[A-Za-z0-9_]+$")
    purpose: str = Field("", description="one sentence, shown by `rearview list`")
    world: Literal["sumo", "kinematic", "commonroad"] = "sumo"
    network: (
        Annotated[
            NetworkConfig,
            BeforeValidator(
                as_section("name"), json_schema_input_type=str | NetworkConfig
            ),
        ]
        | None
    ) = Field(
        default=None,
        description="world sumo: a network of the catalogue or a file; world "
        "commonroad: a scenario's file",
    )
    road: KinematicRoad | None = Field(default=None, description="world kinematic")
    single_ego: Ego | None = Field(
        default=None, alias="ego", description="needed unless there are `egos`"
    )
    egos: Annotated[
        tuple[EgoGroup, ...] | None,
        Field(min_length=1),
        BeforeValidator(
            read_groups, json_schema_input_type=EgoGroup | tuple[EgoGroup, ...]
        ),
    ] = Field(
        default=None,
        description="world sumo: vehicles of the traffic driven by planners, instead "
        "of one ego",
    )
    measurement: Measurement | None = Field(default=None, description="with egos")
    obstacles: Annotated[
        ObstaclesConfig,
        BeforeValidator(
            read_obstacles,
            json_schema_input_type=Literal["none"]
            | tuple[Obstacle, ...]
            | DrawnSection
            | ClosureSection,
        ),
    ] = ObstaclesConfig()
    traffic: Annotated[
        AnyTraffic | None,
        BeforeValidator(
            read_traffic, json_schema_input_type=Literal["none"] | AnyTraffic
        ),
    ] = Field(default=None, description="world sumo")
    vehicles: tuple[ScriptedVehicleConfig, ...] = Field(
        default=(), description="world kinematic"
    )
    conflict: Conflict | None = Field(
        default=None,
        description="world kinematic: on a straight road of three lanes; world sumo: "
        "among traffic, which reacts to its vehicles",
    )
    planner: Annotated[
        PlannerChoice,
        BeforeValidator(as_section("name"), json_schema_input_type=str | PlannerChoice),
    ] = Field(
        default=PlannerChoice(name=DEFAULT_PLANNER),
        description=f"default: {NETWORK_PLANNER} on the network of a file, else "
        f"{DEFAULT_PLANNER}",
    )
    simulation: Simulation = Simulation()

    @property
    def ego(self) -> Ego:
        """The ego's section.

        Raises:
            ConfigError: If the scenario has many egos.
        """
        if self.single_ego is None:
            problem = "is missing: this is for one ego; allowed: ego instead of egos"
            raise self.error(("ego",), problem, ("egos",))
        return self.single_ego

    @model_validator(mode="before")
    @classmethod
    def _planner_of_the_network(cls, data: Any) -> Any:
        """Choose the planner where none is named."""
        if isinstance(data, Mapping) and "planner" not in data:
            return {**data, "planner": default_planner(data)}
        return data

    @model_validator(mode="after")
    def _one_or_many(self) -> Self:
        """Reject both kinds of egos, none, and what is of a single one."""
        if self.egos is None:
            if self.single_ego is None:
                keys = ", ".join(Ego.model_fields)
                raise mismatch("ego", f"is missing; allowed: a section with {keys}")
            if self.measurement is not None:
                raise mismatch("measurement", "is of many egos; allowed with egos")
            return self
        if self.single_ego is not None:
            raise mismatch("egos", "is beside ego; allowed: one of them")
        if self.world != "sumo":
            raise mismatch("egos", "is for world sumo; allowed there: ego")
        if self.traffic is None:
            raise mismatch("egos", "needs vehicles; allowed: with a traffic section")
        if isinstance(self.traffic, Traffic) and not self.traffic.has_flow:
            raise mismatch("egos", "needs vehicles; allowed: with a flow in traffic")
        driver = self.planner.name
        if driver in SELF_DRIVEN and driver != SUMO:
            raise mismatch("planner", f"is {driver}; allowed with egos: others, {SUMO}")
        self._without_single_ego()
        self._measures_something()
        total, of = largest_share(self.egos)
        if total > 1.0:
            problem = f"have penetrations of {of} that are {total:g} in sum"
            raise mismatch("egos", f"{problem}; allowed: at most 1")
        return self

    def _measures_something(self) -> None:
        """Reject a measurement that begins when the run has ended."""
        begin = 0.0 if self.measurement is None else self.measurement.from_s
        duration = self.simulation.duration_s
        if begin >= duration:
            problem = f"is {begin:g}; allowed: below simulation.duration_s = "
            raise mismatch("measurement.from_s", f"{problem}{duration:g}")

    def _without_single_ego(self) -> None:
        """Reject keys that are about a single ego."""
        if self.conflict is not None:
            raise mismatch("conflict", "is of a single ego; allowed with ego")
        if self.obstacles != ObstaclesConfig():
            raise mismatch("obstacles", "are of a single ego; allowed: none")
        if isinstance(self.traffic, Traffic):
            for key in ("slow_leader", "ego_lane_veh_per_h"):
                if getattr(self.traffic, key):
                    problem = "is of a single ego; allowed with ego"
                    raise mismatch(f"traffic.{key}", problem)
        if self.network is not None and self.network.vehicle is not None:
            raise mismatch("network.vehicle", "is of a single ego; allowed with ego")
        if self.network is not None and self.network.is_drawn:
            problem = "is missing; allowed with egos: a network with a route"
            raise mismatch("network.route", problem)
        for key in ("without_ego", "placebo"):
            if getattr(self.simulation, key):
                problem = "is of a single ego; allowed: false"
                raise mismatch(f"simulation.{key}", problem)
        self._without_delays_and_errors()

    def _without_delays_and_errors(self) -> None:
        """Reject what is not done with many egos, rather than to say nothing."""
        usual = Simulation()
        for key in ("planning_period_s", "planning_delay_s"):
            if getattr(self.simulation, key) != getattr(usual, key):
                problem = "is of a single ego; allowed: without it"
                raise mismatch(f"simulation.{key}", problem)
        if not isinstance(self.traffic, Traffic):
            return
        if self.traffic.relaxation_s > 0.0:
            raise mismatch("traffic.relaxation_s", "is of a single ego; allowed: 0")
        drivers = self.traffic.drivers
        if drivers is not None and drivers.err:
            problem = "err, which is of a single ego; allowed: distraction: 0 and no "
            problem += "other errors"
            raise mismatch("traffic.drivers", problem)
        if drivers is not None and drivers.cooperation > 0.0:
            raise mismatch(
                "traffic.drivers.cooperation", "is of a single ego; allowed: 0"
            )

    @model_validator(mode="after")
    def _fits_world(self) -> Self:
        """Reject keys of the other worlds, and objects beyond the road."""
        if self.world == "commonroad":
            self._fits_commonroad()
        else:
            self._is_without_recording()
            self._fits_sumo_or_kinematic()
        return self

    def _fits_sumo_or_kinematic(self) -> None:
        """Reject keys of one of the two worlds in the other."""
        sumo = self.world == "sumo"
        needed, foreign = ("network", "road") if sumo else ("road", "network")
        if getattr(self, needed) is None:
            raise mismatch(needed, f"is missing; world {self.world} needs it")
        if getattr(self, foreign) is not None:
            raise mismatch(foreign, f"is not for world {self.world}; allowed: {needed}")
        if sumo and self.vehicles:
            raise mismatch("vehicles", "is not for world sumo; allowed: traffic")
        if not sumo and self.traffic is not None:
            raise mismatch("traffic", "is not for world kinematic; allowed: vehicles")
        if not sumo and self.obstacles.closure is not None:
            problem = "is of SUMO's traffic; allowed in world kinematic: a list"
            raise mismatch("obstacles.closure", problem)
        vehicle = self.network is not None and self.network.vehicle is not None
        if vehicle and not isinstance(self.traffic, SumoTraffic):
            problem = "is of a route file; allowed with traffic.sumocfg or route_files"
            raise mismatch("network.vehicle", problem)
        if not sumo and self.simulation.without_ego:
            problem = "is for world sumo, where vehicles react; allowed: false"
            raise mismatch("simulation.without_ego", problem)
        if self.simulation.placebo and not self.simulation.without_ego:
            problem = "needs without_ego; allowed: false, or without_ego = true"
            raise mismatch("simulation.placebo", problem)
        beyond = self.beyond(self.road.length) if self.road else None
        if beyond is not None:
            raise mismatch(dotted(beyond[0]), beyond[1])

    def _is_without_recording(self) -> None:
        """Reject what only a CommonRoad file gives, and what only that leaves out."""
        if self.single_ego is not None and self.single_ego.goal_m is None:
            raise mismatch("ego.goal_m", f"is missing; world {self.world} needs it")
        if self.simulation.predictor == "recorded":
            problem = "is for world commonroad; allowed: constant_speed, held_braking"
            raise mismatch("simulation.predictor", f"is recorded, which {problem}")
        if self.network is not None and self.network.planning_problem is not None:
            problem = "is for world commonroad; allowed: name, or file and route"
            raise mismatch("network.planning_problem", problem)

    def _fits_commonroad(self) -> None:
        """Reject what a CommonRoad file gives, or cannot be with."""
        if self.network is None or self.network.file is None:
            raise mismatch("network", "allowed in world commonroad: file: scenario.xml")
        if not self.network.is_drawn or self.network.lane is not None:
            problem = "allowed in world commonroad: file, planning_problem"
            raise mismatch("network", problem)
        for key in ("road", "traffic", "conflict"):
            if getattr(self, key) is not None:
                problem = "is not for world commonroad, whose file has the traffic"
                raise mismatch(key, f"{problem}; allowed: obstacles")
        if self.vehicles:
            raise mismatch(
                "vehicles", "is not for world commonroad; allowed: obstacles"
            )
        ego = self.ego
        placed = ego.start_m or ego.start_offset_m or ego.depart_speed_mps != "max"
        if placed or ego.goal_m is not None:
            key = "ego.start_m" if placed else "ego.goal_m"
            problem = "is the planning problem's; allowed: network.planning_problem"
            raise mismatch(key, problem)
        if self.obstacles.closure is not None or self.obstacles.field is not None:
            problem = "allowed in world commonroad: a list, or random"
            raise mismatch("obstacles", problem)
        if self.simulation.predictor == "recorded" and ego.perception is not None:
            problem = "is beside ego.perception; allowed: constant_speed, held_braking"
            raise mismatch("simulation.predictor", problem)
        if self.simulation.without_ego:
            problem = "is for world sumo, where vehicles react; allowed: false"
            raise mismatch("simulation.without_ego", problem)

    @model_validator(mode="after")
    def _fits_time(self) -> Self:
        """Reject periods and delays that are no multiples, or end too late."""
        simulation, ego = self.simulation, self.single_ego
        for key in ("planning_period_s", "planning_delay_s"):
            value, step = getattr(simulation, key), simulation.step_s
            if isinstance(value, float) and not is_multiple(value, step):
                problem = f"is {value:g}; allowed: a multiple of step_s = {step:g}"
                raise mismatch(f"simulation.{key}", problem)
        period = simulation.planning_period_s
        if period is not None and period >= simulation.horizon_s:
            problem = f"is {period:g}; allowed: less than the horizon"
            raise mismatch("simulation.planning_period_s", problem)
        delay = simulation.planning_delay_s
        if isinstance(delay, float) and delay >= simulation.horizon_s:
            problem = f"is {delay:g}; allowed: less than the horizon"
            raise mismatch("simulation.planning_delay_s", problem)
        if ego is not None and ego.plant is not None:
            controller = ego.controller or ControllerConfig()
            check_delays(
                ego.actuators, controller, simulation.step_s, simulation.horizon_s
            )
        return self

    @model_validator(mode="after")
    def _fits_conflict(self) -> Self:
        """Reject a conflict beside other vehicles, or on another road."""
        if self.conflict is None:
            return self
        if self.road is None:
            self._fits_conflict_in_traffic(self.conflict)
        elif any(segment[0] != "line" for segment in self.road.segments):
            raise mismatch("road.segments", "allowed with a conflict: lines")
        elif self.road.lanes is None or self.road.lanes.count != N_LANES:
            problem = f"allowed with a conflict: {{count: {N_LANES}}}"
            raise mismatch("road.lanes", problem)
        if self.vehicles:
            raise mismatch("vehicles", "is beside conflict; allowed: one of them")
        if self.ego.start_offset_m != 0.0:
            raise mismatch("ego.start_offset_m", "allowed with a conflict: 0")
        if self.simulation.step_s != STEP_S:
            raise mismatch("simulation.step_s", f"allowed with a conflict: {STEP_S}")
        return self

    def _fits_conflict_in_traffic(self, conflict: Conflict) -> None:
        """Reject what a conflict in world sumo cannot be with."""
        if conflict.follower:
            problem = "is for world kinematic; traffic follows in world sumo"
            raise mismatch("conflict.follower", problem)
        if self.ego.depart_speed_mps == "max":
            problem = "allowed with a conflict in world sumo: a number"
            raise mismatch("ego.depart_speed_mps", problem)
        if isinstance(self.traffic, Traffic) and self.traffic.slow_leader is not None:
            problem = "is beside conflict; allowed: one of them"
            raise mismatch("traffic.slow_leader", problem)
        if self.network is not None and self.network.vehicle is not None:
            problem = "is beside conflict; allowed: one of them"
            raise mismatch("network.vehicle", problem)
        if self.simulation.without_ego:
            problem = "allowed with a conflict: false"
            raise mismatch("simulation.without_ego", problem)

    @property
    def driven_by(self) -> str:
        """Name what drives: the planner of the ego, or those of the groups of egos.

        A group without a share or number of vehicles drives nothing; without any group
        that does, SUMO's driver drives all.
        """
        if self.egos is None:
            return self.planner.name
        groups = [group for group in self.egos if group.penetration or group.count]
        names = [(group.planner or self.planner).name for group in groups]
        return "+".join(dict.fromkeys(names)) or SUMO

    def planner_choices(self) -> list[tuple[KeyPath, PlannerChoice]]:
        """List all planners that the scenario names, and the keys that name them."""
        found: list[tuple[KeyPath, PlannerChoice]] = [
            (("planner", "name"), self.planner)
        ]
        for number, group in enumerate(self.egos or ()):
            if group.planner is not None:
                one = len(self.egos or ()) == 1
                place: KeyPath = ("egos",) if one else ("egos", number)
                found.append(((*place, "planner", "name"), group.planner))
        return found

    def beyond(self, length: float) -> tuple[KeyPath, str] | None:
        """Find a goal, obstacle or vehicle that is not on the road.

        Args:
            length: Of the road [m].

        Returns:
            The key and what is wrong with it, None if all is on the road.
        """
        places: dict[KeyPath, float] = {}
        if self.single_ego is not None:
            places["ego", "goal_m"] = self.single_ego.goal
        for index, obstacle in enumerate(self.obstacles.listed):
            key: KeyPath = ("obstacles", *self.obstacles.listed_key, index, "s_m")
            places[key] = obstacle.s_m
        for index, vehicle in enumerate(self.vehicles):
            places["vehicles", index, "s_m"] = vehicle.s_m
        if self.obstacles.random:
            places["obstacles", "random", "first_m"] = self.obstacles.random.first_m
        if self.obstacles.field:
            places["obstacles", "field", "last_m"] = self.obstacles.field.last_m
        for key, place in places.items():
            if place > length:
                problem = f"is {place:g}; allowed: 0 to {length:.1f}, the road's end"
                return key, problem
        return None

    def from_document(self, document: Document) -> Self:
        """Remember where the keys were written, for messages that come later."""
        self._document = document
        return self

    def error(
        self, path: KeyPath, problem: str, written: KeyPath | None = None
    ) -> ConfigError:
        """Build the error about a key, naming the place where it was written.

        Args:
            path: The key.
            problem: What is wrong with it, and what is allowed.
            written: Another key whose place is named instead.
        """
        place = path if written is None else written
        document = self._document
        where, clash = (
            (document.where(place), document.beside(place))
            if document
            else (self.name, "")
        )
        return ConfigError(f"{where}{clash}: {dotted(path)}: {problem}")

    def resolved(self) -> dict[str, Any]:
        """Return the whole configuration as plain data that reads back the same."""
        data: dict[str, Any] = self.model_dump(
            mode="json", exclude_none=True, by_alias=True
        )
        if self.network is not None and self.network.name is not None:
            data["network"] = self.network.name
        if self.egos is not None and len(self.egos) == 1:
            data["egos"] = data["egos"][0]
        if self.obstacles.closure is None:
            listed = data["obstacles"].pop("listed")
            data["obstacles"] = data["obstacles"] or listed
        if self.world == "sumo":
            data.setdefault("traffic", "none")
        if self.world == "commonroad" and self.ego.plant is None:
            data["ego"]["plant"] = "perfect"  # silence would mean a kinematic one
        return data
