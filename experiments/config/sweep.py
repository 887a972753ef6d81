"""The sweep schema: which scenarios, planners, changes and seeds make the runs."""

from enum import StrEnum
from math import prod
from typing import Annotated, Any, Literal, Self

from pydantic import BeforeValidator, ConfigDict, Field, model_validator

from experiments.config.base import Strict, as_section, mismatch

Value = None | bool | int | float | str | tuple[Any, ...] | dict[str, Any]
Values = Annotated[tuple[Value, ...], Field(min_length=1)]
Number = int | float
MAX_SEED = 2**31 - 1
DEVELOPMENT_SEEDS = range(1000)  # planners are tuned on these
PUBLISHED_SEEDS = range(100_000, 200_000)  # of the shipped sweeps that are published


class KeepTraces(StrEnum):
    """Which runs keep their trace."""

    ALL = "all"
    FAILURES = "failures"  # everything but arrived
    NONE = "none"


class SweptPlanner(Strict):
    """A planner, settings laid over those of the scenario, and a name for tables."""

    name: str = Field(min_length=1)
    settings: dict[str, Any] = Field(default_factory=dict)
    set: dict[str, Value] = Field(
        default_factory=dict,
        description="values of scenario keys in the runs of this planner only",
    )
    label: str | None = Field(
        default=None,
        min_length=1,
        description="label in tables; default: the planner's name",
    )

    @property
    def shown(self) -> str:
        """Label in tables."""
        return self.label or self.name


class Sample(Strict):
    """Points spread over ranges; a range of whole numbers gives whole numbers."""

    method: Literal["sobol", "latin_hypercube"] = "sobol"
    count: Annotated[int, Field(ge=1, le=1_000_000)]
    seed: Annotated[int, Field(ge=0, le=MAX_SEED)] = 0
    ranges: dict[str, tuple[Number, Number]] = Field(
        min_length=1, description="scenario key: [minimum, maximum]"
    )

    @model_validator(mode="after")
    def _fits_method(self) -> Self:
        """Reject ranges that do not ascend, and unbalanced Sobol counts."""
        for key, (least, most) in self.ranges.items():
            if not least < most:
                problem = f"is [{least}, {most}]; allowed: [least, most], rising"
                raise mismatch(f"ranges.{key}", problem)
        if self.method == "sobol" and self.count & (self.count - 1):
            near = 2 ** (self.count.bit_length() - 1)
            raise mismatch(
                "count",
                f"is {self.count}; allowed for sobol: a power of 2: {near}, {2 * near}",
            )
        return self


class Axes(Strict):
    """What is varied, over any key of the scenario."""

    grid: dict[str, Values] = Field(
        default_factory=dict, description="every combination of the values"
    )
    zip: dict[str, Values] = Field(
        default_factory=dict, description="first with first, second with second, ..."
    )
    sample: Sample | None = None

    @model_validator(mode="after")
    def _keys_once(self) -> Self:
        """Reject zipped lists of different lengths, and a key on two axes."""
        lengths = {key: len(values) for key, values in self.zip.items()}
        if len(set(lengths.values())) > 1:
            shown = ", ".join(f"{key} has {n}" for key, n in lengths.items())
            raise mismatch("zip", f"{shown} values; allowed: lists of the same length")
        ranges = self.sample.ranges if self.sample else {}
        for key in (*self.zip, *ranges):
            if key in self.grid or (key in self.zip and key in ranges):
                raise mismatch(key, "is on two axes; allowed: grid, zip or sample")
        return self

    @property
    def count(self) -> int:
        """Number of combinations."""
        zipped = len(next(iter(self.zip.values()))) if self.zip else 1
        sampled = self.sample.count if self.sample else 1
        return prod(len(values) for values in self.grid.values()) * zipped * sampled


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

    name: str = Field(pattern=r"^[A-Za-z0-9_]+$")
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
        labels = [planner.shown for planner in self.planners]
        for index, label in enumerate(labels):
            if label in labels[:index]:
                raise mismatch(
                    f"planners[{index}]",
                    f"is the second {label}; allowed: a label of its own for each",
                )
        return self

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
        labels = [planner.shown for planner in self.planners]
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
        per_seed = len(self.scenarios) * len(self.planners) * self.axes.count
        return per_seed * len(self.all_seeds)
