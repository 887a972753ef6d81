"""Who else drives."""

from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Annotated, Any, Literal, Self

from pydantic import BeforeValidator, Field, model_validator

from experiments.config.base import (
    Flow,
    Offset,
    Position,
    Share,
    Size,
    Strict,
    mismatch,
)
from experiments.config.drivers import Drivers

# What `density` means, in each lane that is fed [vehicles/h].
DENSITIES: Mapping[str, float] = MappingProxyType(
    {"light": 350.0, "medium": 700.0, "dense": 1200.0}
)
USUAL_FLOW = 900.0  # [vehicles/h]
DEFAULT_REACTION = 0.5  # [s]

# What `temper` means: shares of cautious and of aggressive drivers.
TEMPERS: Mapping[str, tuple[float, float]] = MappingProxyType(
    {
        "cautious": (1.0, 0.0),
        "normal": (0.0, 0.0),
        "aggressive": (0.0, 1.0),
        "mixed": (0.25, 0.2),
    }
)
USUAL_TEMPER = "mixed"


CarModel = Literal["Krauss", "IDM", "EIDM", "ACC"]


class SlowLeaderConfig(Strict):
    """A vehicle ahead in the ego's lane that enters together with the ego."""

    gap_m: Annotated[float, Field(ge=5.0, le=500.0)] = Field(
        default=60.0,
        description="gap from the ego's front to the leader's rear at entry",
    )
    speed_mps: Annotated[float, Field(gt=0.0, le=70.0)] = Field(
        description="maximum speed of the leader"
    )
    kind: Literal["car", "van", "truck"] = "truck"


def _flow(data: dict[str, Any]) -> float | None:
    """Return the default flow: none beside a density."""
    return USUAL_FLOW if data["density"] is None else None


def _share(place: int) -> Callable[[dict[str, Any]], float]:
    """Build the default of a share of drivers, which follows from their temper."""
    return lambda data: TEMPERS[data["temper"] or USUAL_TEMPER][place]


class Traffic(Strict):
    """Background traffic: vehicles per hour and their mix."""

    density: Literal["light", "medium", "dense"] | None = Field(
        default=None,
        description="replaces own_veh_per_h: 350, 700 or 1200 vehicles per hour and "
        "fed lane",
    )
    own_veh_per_h: Flow | None = Field(
        default_factory=_flow,
        description="on the ego's carriageway; 900 unless density is given",
    )
    ego_lane_veh_per_h: Flow = Field(
        default=0.0, description="additional flow in the ego's lane"
    )
    slow_leader: SlowLeaderConfig | None = None
    oncoming_veh_per_h: Flow = 600.0
    cross_veh_per_h: Flow = Field(
        default=300.0, description="on each other road into the junctions of the route"
    )
    van_share: Share = 0.1
    truck_share: Share = 0.08
    temper: Literal["cautious", "normal", "aggressive", "mixed"] | None = Field(
        default=None,
        description="temper of the drivers, or a mix; replaces the two shares below",
    )
    cautious_share: Share = Field(
        default_factory=_share(0), description="0.25 unless temper is given"
    )
    aggressive_share: Share = Field(
        default_factory=_share(1), description="0.2 unless temper is given"
    )
    reaction_s: Annotated[float, Field(ge=0.0, le=3.0)] = Field(
        default=DEFAULT_REACTION,
        description="drivers decide this often, so that they react after half of it on "
        "average; 0: in every step",
    )
    own_lane: Annotated[int, Field(ge=0, le=20)] | None = Field(
        default=None, description="lane that feeds the ego's carriageway; default: any"
    )
    keep_right: bool = Field(
        default=True, description="drivers return to the right lane when possible"
    )
    models: dict[CarModel, Annotated[float, Field(gt=0.0, le=1000.0)]] | None = Field(
        default=None,
        min_length=1,
        description="car-following models and their relative shares",
    )
    drivers: Annotated[
        Drivers | None,
        BeforeValidator(Drivers.read, json_schema_input_type=Drivers | str | None),
    ] = Field(
        default=None,
        description="a population, in which no two drivers are alike; replaces "
        "temper, the shares of tempers, and models",
    )
    relaxation_s: Annotated[float, Field(ge=0.0, le=60.0)] = Field(
        default=0.0,
        description="drivers whom the ego cuts in open their time gap over so long; "
        "0: at once, as SUMO's do",
    )

    @property
    def has_flow(self) -> bool:
        """Whether any vehicle enters."""
        flows = (self.own_veh_per_h, self.ego_lane_veh_per_h)
        others = (self.oncoming_veh_per_h, self.cross_veh_per_h)
        return self.density is not None or any(flows) or any(others)

    @model_validator(mode="after")
    def _shares_fit(self) -> Self:
        """Reject shares that exceed 1 in total."""
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

    @model_validator(mode="after")
    def _one_kind_of_drivers(self) -> Self:
        """Reject tempers or models beside a population."""
        if self.drivers is None:
            return self
        if not self.has_flow and self.slow_leader is None:
            problem = f"{self.drivers.population}: of no vehicles; allowed: with a flow"
            raise mismatch("drivers", problem)
        usual = dict(
            zip(
                ("cautious_share", "aggressive_share"),
                TEMPERS[USUAL_TEMPER],
                strict=True,
            )
        )
        for key in ("temper", "cautious_share", "aggressive_share", "models"):
            if getattr(self, key) != usual.get(key):
                problem = f"is given beside {key}; allowed: one of them"
                raise mismatch("drivers", problem)
        return self

    @model_validator(mode="after")
    def _said_once(self) -> Self:
        """Reject a preset beside numbers, or neither of them."""
        flow = self.own_veh_per_h
        if self.density is None and flow is None:
            raise mismatch("own_veh_per_h", "is null; allowed: a number, or density")
        if self.density is not None and flow is not None:
            problem = f"is {flow:g} beside density = {self.density}; allowed: one"
            raise mismatch("own_veh_per_h", problem)
        if self.temper is not None:
            shares = zip(
                ("cautious_share", "aggressive_share"),
                TEMPERS[self.temper],
                strict=True,
            )
            for key, expected in shares:
                if getattr(self, key) != expected:
                    problem = (
                        f"is {getattr(self, key):g} beside temper = {self.temper}, "
                        f"which makes it {expected:g}; allowed: one of them"
                    )
                    raise mismatch(key, problem)
        return self


FILES = ("sumocfg", "route_files", "additional_files")


class SumoTraffic(Strict):
    """Traffic of SUMO's own files, as they are: types, buses, bicycles, pedestrians."""

    sumocfg: str | None = Field(
        default=None,
        description=".sumocfg with the demand and its options, relative to this file",
    )
    route_files: tuple[str, ...] | None = Field(
        default=None, min_length=1, description="route files, relative to this file"
    )
    additional_files: tuple[str, ...] | None = Field(
        default=None,
        min_length=1,
        description="bus stops, signal programs, types; relative to this file",
    )
    begin_s: Annotated[float, Field(ge=0.0, le=1e6)] | None = Field(
        default=None,
        description="when the simulation begins; by default as in the sumocfg, or 0",
    )

    @model_validator(mode="after")
    def _has_demand(self) -> Self:
        """Reject files without demand, and files beside a configuration."""
        if self.sumocfg is None and self.route_files is None:
            raise mismatch(
                "route_files", "is missing; allowed: sumocfg, or route_files"
            )
        if self.sumocfg is not None:
            for key in FILES[1:]:
                if getattr(self, key) is not None:
                    raise mismatch(key, "is beside sumocfg; allowed: one of them")
        return self


def read_traffic(value: Any) -> Any:
    """Let `none` stand for no section."""
    return None if value == "none" else value


def traffic_kind(value: Any) -> str:
    """Tell whether a traffic section names files of SUMO."""
    if isinstance(value, dict):
        return "files" if set(value) & {*FILES, "begin_s"} else "flows"
    return "files" if isinstance(value, SumoTraffic) else "flows"


class ScriptedVehicleConfig(Strict):
    """A vehicle of the kinematic world: constant speed along the reference path."""

    s_m: Position = Field(description="centre at the start")
    l_m: Offset = 0.0
    speed_mps: Annotated[float, Field(ge=-70.0, le=70.0)] = Field(
        description="negative: oncoming"
    )
    length_m: Size = 4.8
    width_m: Size = 1.9
