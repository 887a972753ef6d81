"""The search schema: where to look for what breaks a planner, and what breaking is."""

from typing import Annotated, Any, Literal, Self

from pydantic import BeforeValidator, ConfigDict, Field, model_validator

from experiments.config.axes import MAX_SEED, Number, Value
from experiments.config.base import Name, Strict, as_section, mismatch
from experiments.config.sweep import KeepTraces, SweptPlanner

# objectives that are no columns: after a contact they go on as the impact speed
CLEARANCE = "clearance"
NEAR_MISS = "near_miss"
Method = Literal["random", "sobol", "directed", "tpe", "cma_es", "subset"]
SUBSET: Method = "subset"  # estimates a probability; the others look for failures
Direction = Literal["minimise", "maximise"]


def _read_range(value: Any) -> Any:
    """Let `[1, 2]` stand for `{range: [1, 2]}`."""
    return {"range": value} if isinstance(value, tuple | list) else value


class SearchRange(Strict):
    """Values of one key: a range of numbers, or some values to choose from."""

    range: tuple[Number, Number] | None = Field(
        default=None, description="[least, most]; whole numbers if both are"
    )
    choice: Annotated[tuple[Value, ...], Field(min_length=2)] | None = Field(
        default=None, description="instead of a range: values without an order"
    )
    log: bool = Field(default=False, description="range: spread over its logarithm")
    mild: Value = Field(
        default=None,
        description="toward which a failure is reduced; default: the scenario's own "
        "value, or the middle of the range",
    )

    @model_validator(mode="after")
    def _is_a_range(self) -> Self:
        """Reject both kinds, none, and ranges that hold one point or fewer."""
        if (self.range is None) == (self.choice is None):
            raise mismatch("range", "is one of two; allowed: range or choice")
        if self.range is None:
            self._check_choice()
            return self
        least, most = self.range
        if not least < most:
            problem = f"is [{least}, {most}]; allowed: [least, most], rising"
            raise mismatch("range", problem)
        if self.log and least <= 0:
            problem = f"is [{least}, {most}]; allowed with log: above 0"
            raise mismatch("range", problem)
        number = isinstance(self.mild, int | float) and not isinstance(self.mild, bool)
        if self.mild is not None and not number:
            raise mismatch("mild", f"is {self.mild}; allowed: a number of the range")
        if isinstance(self.mild, int | float) and not least <= self.mild <= most:
            problem = f"is {self.mild}; allowed: from {least} to {most}"
            raise mismatch("mild", problem)
        return self

    def _check_choice(self) -> None:
        """Reject a choice whose values repeat, or that is spread over a logarithm."""
        values = self.choice or ()
        if any(value in values[:k] for k, value in enumerate(values)):
            raise mismatch("choice", "has a value twice; allowed: once")
        if self.log:
            raise mismatch("log", "is of a range; allowed with choice: false")
        if self.mild is not None and self.mild not in values:
            listed = ", ".join(str(value) for value in values)
            raise mismatch("mild", f"is {self.mild}; allowed: {listed}")


class SearchObjective(Strict):
    """What is made as bad as it gets, and from where on that is a failure."""

    metric: str = Field(
        default=CLEARANCE,
        min_length=1,
        description="clearance: the least one minus margin_m; near_miss: how close it "
        "came by clearance, time and braking together; both after a contact minus the "
        "impact speed [m/s]; or a column of the results",
    )
    margin_m: Annotated[float, Field(ge=0.0, le=100.0)] = Field(
        default=0.0, description="clearance: less of it is a failure"
    )
    direction: Direction | None = Field(
        default=None, description="of a column: where it gets worse"
    )
    fails_beyond: Annotated[float, Field(ge=-1e9, le=1e9)] | None = Field(
        default=None,
        description="of a column: a worse value is a failure; default: only how an "
        "episode ends is",
    )
    blame: Literal["anyone", "ego"] = Field(
        default="anyone",
        description="of near_miss; ego: a contact that is not the ego's fault, or "
        "shared, is no failure",
    )

    @model_validator(mode="after")
    def _fits_metric(self) -> Self:
        """Reject keys of the other kind of objective."""
        if self.metric != CLEARANCE and self.margin_m:
            problem = f"is of clearance; allowed with {self.metric}: 0"
            raise mismatch("margin_m", problem)
        if self.metric != NEAR_MISS and self.blame != "anyone":
            problem = f"is of near_miss; allowed with {self.metric}: anyone"
            raise mismatch("blame", problem)
        if self.metric in (CLEARANCE, NEAR_MISS):
            for key in ("direction", "fails_beyond"):
                if getattr(self, key) is not None:
                    problem = f"is of a column; allowed with {self.metric}: none"
                    raise mismatch(key, problem)
        return self

    @property
    def has_threshold(self) -> bool:
        """Whether it says by itself from where on it is a failure."""
        return self.metric in (CLEARANCE, NEAR_MISS) or self.fails_beyond is not None


class Search(Strict):
    """Runs of one scenario and planner, placed where failures are expected."""

    model_config = ConfigDict(title="rearview search")

    name: Name
    purpose: str = ""
    scenario: str = Field(description="shipped name, or a file relative to this one")
    planner: Annotated[
        SweptPlanner,
        BeforeValidator(as_section("name"), json_schema_input_type=str | SweptPlanner),
    ]
    set: dict[str, Value] = Field(
        default_factory=dict, description="values of scenario keys in all runs"
    )
    space: Annotated[
        dict[
            str,
            Annotated[
                SearchRange,
                BeforeValidator(
                    _read_range,
                    json_schema_input_type=tuple[Number, Number] | SearchRange,
                ),
            ],
        ],
        Field(min_length=1, max_length=64),
    ] = Field(description="scenario key: [least, most], or a section")
    objective: Annotated[
        SearchObjective,
        BeforeValidator(
            as_section("metric"), json_schema_input_type=str | SearchObjective
        ),
    ] = SearchObjective()
    method: Method = Field(
        default="random",
        description="tpe and cma_es need the extra `search`; subset estimates how "
        "probable a failure is, every key uniform over its range",
    )
    level_trials: Annotated[int, Field(ge=20, le=100_000)] = Field(
        default=200, description="subset: trials of one level"
    )
    budget: Annotated[int, Field(ge=1, le=100_000)] = Field(
        default=200, description="trials, before failures are reduced"
    )
    batch: Annotated[int, Field(ge=1, le=1000)] = Field(
        default=8, description="trials proposed at a time, before their results"
    )
    stop_after_failures: Annotated[int, Field(ge=1, le=100_000)] | None = Field(
        default=None, description="end after the batch with this many failures"
    )
    seed: Annotated[int, Field(ge=0, le=MAX_SEED)] = Field(
        default=0, description="of the method; the scenario has its own"
    )
    scenario_seed: Annotated[int, Field(ge=0, le=MAX_SEED)] | None = Field(
        default=None, description="of all runs; default: that of the scenario"
    )
    against: Literal["random"] | None = Field(
        default=None, description="search once more at random, to compare with"
    )
    reduce: Annotated[int, Field(ge=0, le=100)] = Field(
        default=5, description="kinds of failures of which one is made milder"
    )
    reduction_runs: Annotated[int, Field(ge=1, le=1000)] = Field(
        default=24, description="most runs to make one failure milder"
    )
    timeout_s: Annotated[float, Field(gt=0.0, le=86_400.0)] = Field(
        default=300.0, description="wall clock of one run"
    )
    memory_mb: Annotated[float, Field(ge=100.0, le=1e6)] = Field(
        default=4000.0, description="resident memory of the process of a run [MB]"
    )
    keep_traces: Annotated[KeepTraces, Field(strict=False)] = KeepTraces.FAILURES

    @model_validator(mode="after")
    def _keys_once(self) -> Self:
        """Reject a key that is set and searched, and planners that are several."""
        if self.against == self.method:
            problem = f"is {self.method} as the method is; allowed: another method"
            raise mismatch("against", problem)
        if self.method == SUBSET:
            self._check_subset()
        if self.planner.axes.count > 1:
            raise mismatch("planner.axes", "make several; allowed: one planner")
        for section, keys in (("set", self.set), ("planner.set", self.planner.set)):
            for key in keys:
                if key in self.space:
                    raise mismatch(section, f"{key}: is in space too; allowed: one")
        return self

    def _check_subset(self) -> None:
        """Reject what makes no estimate."""
        if not self.objective.has_threshold:
            problem = "is missing; allowed with method subset: a number"
            raise mismatch("objective.fails_beyond", problem)
        if self.stop_after_failures is not None:
            problem = "would end an estimate early; allowed with method subset: none"
            raise mismatch("stop_after_failures", problem)
        if self.budget < self.level_trials:
            least = f"at least level_trials, {self.level_trials}"
            raise mismatch("budget", f"is {self.budget}; allowed: {least}")

    @property
    def most_runs(self) -> int:
        """Largest number of runs."""
        trials = self.budget * (1 if self.against is None else 2)
        return trials + 1 + self.reduce * self.reduction_runs
