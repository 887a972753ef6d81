"""The sweep schema: which scenarios, planners, changes and seeds make the runs."""

from collections.abc import Mapping
from copy import deepcopy
from enum import StrEnum
from functools import cached_property
from typing import Annotated, Any, Self

from pydantic import BeforeValidator, ConfigDict, Field, model_validator

from experiments.config.axes import MAX_SEED, Axes, Value, axis_points
from experiments.config.base import LONGEST_NAME, Name, Strict, as_section, mismatch

MOST_VARIANTS = 256  # of one planner: each is a planner of its own in every table
DEVELOPMENT_SEEDS = range(1000)  # planners are tuned on these
PUBLISHED_SEEDS = range(100_000, 200_000)  # of the shipped sweeps that are published


class KeepTraces(StrEnum):
    """Which runs keep their trace."""

    ALL = "all"
    FAILURES = "failures"  # everything but arrived
    NONE = "none"


class SweptPlanner(Strict):
    """A planner, settings laid over those of the scenario, and a name for tables.

    With `axes` it is as many planners as these have points, each with its own label.
    """

    name: str = Field(min_length=1)
    settings: dict[str, Any] = Field(default_factory=dict)
    axes: Axes = Field(
        default=Axes(),
        description="settings that are varied, of this planner alone: speed.headway",
    )
    set: dict[str, Value] = Field(
        default_factory=dict,
        description="values of scenario keys in the runs of this planner only",
    )
    label: str | None = Field(
        default=None,
        min_length=1,
        max_length=LONGEST_NAME,
        description="label in tables; default: the planner's name, and what differs",
    )

    @property
    def shown(self) -> str:
        """Label in tables."""
        return self.label or self.name

    @model_validator(mode="after")
    def _few_and_settable(self) -> Self:
        """Reject too many variants, and axes that lead through a plain value."""
        if self.axes.count > MOST_VARIANTS:
            problem = f"makes {self.axes.count} planners; allowed: {MOST_VARIANTS}"
            raise mismatch("axes", problem)
        for key in next(axis_points(self.axes)):
            parts = key.split(".")
            section: Any = self.settings
            for part in parts[:-1]:
                section = section.get(part, {}) if isinstance(section, dict) else None
            if not isinstance(section, dict) or "" in parts:
                raise mismatch("axes", f"{key}: is not a setting; allowed: key.path")
        return self

    def variants(self) -> "list[SweptPlanner]":
        """Return the planners that the axes make; itself without any."""
        points = list(axis_points(self.axes))
        if points == [{}]:
            return [self]
        varied = [k for k in points[0] if len({str(p[k]) for p in points}) > 1]
        short = {key: key.rpartition(".")[2] for key in varied}
        clear = len(set(short.values())) == len(short)
        found = []
        for point in points:
            settings = deepcopy(self.settings)
            for key, value in point.items():
                _set(settings, key.split("."), value)
            words = ", ".join(
                f"{short[key] if clear else key} {_text(point[key])}" for key in varied
            )
            label = f"{self.shown}, {words}" if words else self.shown
            found.append(
                self.model_copy(
                    update={"settings": settings, "label": label, "axes": Axes()}
                )
            )
        return found


class SeedRange(Strict):
    """Seeds first, first + 1, ..."""

    first: Annotated[int, Field(ge=0, le=MAX_SEED)] = 0
    count: Annotated[int, Field(ge=1, le=1_000_000)]


Seed = Annotated[int, Field(ge=0, le=MAX_SEED)]


class SweepClaim(Strict):
    """What a sweep is to decide, written down before it is run."""

    baseline: str = Field(
        min_length=1, description="label of the planner that the others are set against"
    )
    primary: Annotated[tuple[str, ...], Field(min_length=1)] = Field(
        description="rates and columns that the claim is about; their p values are "
        "corrected together, over all scenarios and axes"
    )
    by: tuple[str, ...] | None = Field(
        default=None,
        description="scenario and axes that are told apart; over the others the runs "
        "of a seed are averaged; default: all",
    )
    penalty_s: Annotated[float, Field(gt=0.0, le=86_400.0)] | None = Field(
        default=None,
        description="travel time counted for a run that does not arrive; default: "
        "twice the longest of the cell",
    )
    published: bool = Field(
        default=False,
        description="figures are published: no seed of the development range 0-999",
    )


class Sweep(Strict):
    """Many runs: scenarios x planners x axes x seeds."""

    model_config = ConfigDict(title="rearview sweep")

    name: Name
    purpose: str = ""
    scenarios: Annotated[tuple[str, ...], Field(min_length=1)] = Field(
        description="shipped names, or files relative to this one"
    )
    planners: Annotated[
        tuple[
            Annotated[
                SweptPlanner,
                BeforeValidator(
                    as_section("name"), json_schema_input_type=str | SweptPlanner
                ),
            ],
            ...,
        ],
        Field(min_length=1),
    ]
    set: dict[str, Value] = Field(
        default_factory=dict, description="values of scenario keys in all runs"
    )
    axes: Axes = Axes()
    claim: SweepClaim | None = None
    seeds: SeedRange | Annotated[tuple[Seed, ...], Field(min_length=1)]
    timeout_s: Annotated[float, Field(gt=0.0, le=86_400.0)] = Field(
        default=300.0, description="wall clock of one run"
    )
    memory_mb: Annotated[float, Field(ge=100.0, le=1e6)] = Field(
        default=4000.0, description="resident memory of the process of a run [MB]"
    )
    retries: Annotated[int, Field(ge=0, le=10)] = Field(
        default=1, description="further attempts for a run whose process was lost"
    )
    keep_traces: Annotated[KeepTraces, Field(strict=False)] = KeepTraces.FAILURES

    @model_validator(mode="after")
    def _labels_differ(self) -> Self:
        """Reject two planners with the same label."""
        labels: set[str] = set()
        for index, variants in enumerate(self.labelled):
            for planner in variants:
                if planner.shown in labels:
                    problem = f"is the second {planner.shown}"
                    raise mismatch(
                        f"planners[{index}]",
                        f"{problem}; allowed: a label of its own for each",
                    )
                labels.add(planner.shown)
        return self

    @cached_property
    def variants(self) -> tuple[SweptPlanner, ...]:
        """Every planner, those that axes of a planner make each by itself.

        Labels tell them apart: where several entries are one planner without a label,
        by the settings in which they differ.
        """
        return tuple(one for variants in self.labelled for one in variants)

    @cached_property
    def labelled(self) -> tuple[tuple[SweptPlanner, ...], ...]:
        """The variants of each entry of the file, with labels."""
        names = [planner.name for planner in self.planners if planner.label is None]
        found = []
        for planner in self.planners:
            same = [
                flat(other.settings)
                for other in self.planners
                if other.name == planner.name and other.label is None
            ]
            own = flat(planner.settings)
            words = [
                f"{key.rpartition('.')[2]} {_text(value)}"
                for key, value in own.items()
                if any(other.get(key) != value for other in same)
            ]
            alone = planner.label is not None or names.count(planner.name) < 2  # noqa: PLR2004
            if not alone and words:
                label = f"{planner.name}, {', '.join(words)}"
                planner = planner.model_copy(update={"label": label})  # noqa: PLW2901
            found.append(tuple(planner.variants()))
        return tuple(found)

    @model_validator(mode="after")
    def _planner_keys_are_free(self) -> Self:
        """Reject a key that both a planner and an axis set."""
        axes = self.axes
        ranges = axes.sample.ranges if axes.sample else {}
        for index, planner in enumerate(self.planners):
            for key in planner.set:
                if any(key in of for of in (axes.grid, axes.zip, ranges)):
                    problem = "is on an axis too; allowed: set or axes"
                    raise mismatch(f"planners[{index}].set", f"{key}: {problem}")
        return self

    @model_validator(mode="after")
    def _claim_fits(self) -> Self:
        """Reject a baseline that is no planner, and tuned seeds under a publication."""
        labels = [planner.shown for planner in self.variants]
        if self.claim is None:
            return self
        if self.claim.baseline not in labels:
            raise mismatch(
                "claim.baseline",
                f"is {self.claim.baseline}; allowed: {', '.join(labels)}",
            )
        tuned = [seed for seed in self.all_seeds if seed in DEVELOPMENT_SEEDS]
        if self.claim.published and tuned:
            raise mismatch(
                "seeds",
                f"has {tuned[0]}, of the development range {DEVELOPMENT_SEEDS[0]}-"
                f"{DEVELOPMENT_SEEDS[-1]} that planners are tuned on; allowed in a "
                f"published sweep: others, such as {PUBLISHED_SEEDS[0]}-"
                f"{PUBLISHED_SEEDS[-1]}",
            )
        return self

    @property
    def all_seeds(self) -> range | tuple[int, ...]:
        """Every seed, in order."""
        if isinstance(self.seeds, SeedRange):
            return range(self.seeds.first, self.seeds.first + self.seeds.count)
        return self.seeds

    @property
    def count(self) -> int:
        """Number of runs."""
        planners = sum(planner.axes.count for planner in self.planners)
        per_seed = len(self.scenarios) * planners * self.axes.count
        return per_seed * len(self.all_seeds)


def _set(settings: dict[str, Any], path: list[str], value: Any) -> None:
    """Set a nested setting."""
    for key in path[:-1]:
        settings = settings.setdefault(key, {})
    settings[path[-1]] = value


def flat(settings: Mapping[str, Any], start: str = "") -> dict[str, Any]:
    """Return nested settings with dotted keys."""
    found: dict[str, Any] = {}
    for key, value in settings.items():
        if isinstance(value, Mapping):
            found |= flat(value, f"{start}{key}.")
        else:
            found[f"{start}{key}"] = value
    return found


def _text(value: Any) -> str:
    """Format a setting for a label."""
    return f"{value:.4g}" if isinstance(value, float) else str(value)
