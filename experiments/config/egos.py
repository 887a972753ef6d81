"""Many egos: which vehicles of the traffic a planner drives, and how."""

from collections.abc import Iterable, Sequence
from typing import Annotated, Any, Literal, Self

from pydantic import BeforeValidator, Field, model_validator

from experiments.config.base import Position, Share, Strict, as_section, mismatch
from experiments.config.planner_choice import PlannerChoice
from experiments.config.self_driven import SELF_DRIVEN, SUMO

MOST_EGOS = 500


def _one_name(value: Any) -> Any:
    """Let a bare name stand for a list of one."""
    return (value,) if isinstance(value, str) else value


class EgoGroup(Strict):
    """Vehicles of the traffic that one planner drives."""

    penetration: Share | None = Field(
        default=None,
        description="share of the vehicles, chosen from the seed by their ids: those "
        "of a smaller share are among those of a larger one",
    )
    count: Annotated[int, Field(ge=0, le=MOST_EGOS)] | None = Field(
        default=None, description="instead: the first so many that enter"
    )
    of: Annotated[
        tuple[str, ...] | None,
        Field(min_length=1),
        BeforeValidator(_one_name, json_schema_input_type=str | tuple[str, ...] | None),
    ] = Field(
        default=None,
        description="vehicle types, flows or vehicles of which they are; default: any",
    )
    planner: (
        Annotated[
            PlannerChoice,
            BeforeValidator(
                as_section("name"), json_schema_input_type=str | PlannerChoice
            ),
        ]
        | None
    ) = Field(
        default=None,
        description="default: the scenario's; sumo: SUMO's driver goes on, and the "
        "vehicles are counted apart",
    )
    target_speed_mps: Annotated[float, Field(gt=0.0, le=70.0)] | None = Field(
        default=None, description="default: what limits and vehicle allow"
    )
    speed_factor: Annotated[float, Field(gt=0.0, le=2.0)] = Field(
        default=1.0, description="wished speed over the speed limit"
    )
    on_failure: Literal["hand_back", "end"] = Field(
        default="hand_back",
        description="an ego that collides, leaves the road or has no plan is handed "
        "to SUMO's driver, or ends the run",
    )

    @model_validator(mode="after")
    def _said_once(self) -> Self:
        """Reject a share beside a number, neither, and drivers that are for one ego."""
        if (self.penetration is None) == (self.count is None):
            if self.count is not None:
                raise mismatch("count", "is beside penetration; allowed: one of them")
            raise mismatch("penetration", "is missing; allowed: penetration, or count")
        name = None if self.planner is None else self.planner.name
        if name in SELF_DRIVEN and name != SUMO:
            raise mismatch("planner", f"is {name}; allowed: a planner, or {SUMO}")
        return self


class Detector(Strict):
    """A place where vehicles are counted."""

    edge: str = Field(min_length=1)
    at_m: Position = Field(description="from the begin of the edge")


class Measurement(Strict):
    """Where and when the traffic of many egos is measured."""

    detectors: tuple[Detector, ...] = Field(
        default=(),
        description="default: one in the middle of the network's longest edge",
    )
    from_s: Annotated[float, Field(ge=0.0, le=3600.0)] = Field(
        default=0.0, description="time after the warm-up that is left out"
    )


def read_groups(value: Any) -> Any:
    """Let one section stand for a list of one."""
    return (value,) if isinstance(value, dict) else value


def largest_share(groups: Sequence[EgoGroup]) -> tuple[float, str]:
    """Return the largest sum of penetrations of the same vehicles, and of which.

    Types and flows may overlap, which only the traffic shows: names count apart.
    """
    names = dict.fromkeys(name for group in groups for name in group.of or ())
    sums = {"any vehicle": _sum(group for group in groups if group.of is None)}
    for name in names:
        sums[name] = _sum(g for g in groups if g.of is None or name in g.of)
    most = max(sums, key=sums.__getitem__)
    return sums[most], most


def _sum(groups: Iterable[EgoGroup]) -> float:
    """Add up penetrations; 0.1 + 0.2 + 0.7 is 1."""
    return round(sum(group.penetration or 0.0 for group in groups), 9)
