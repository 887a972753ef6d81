"""Axes of a sweep: which values are combined, and the points they make."""

from collections.abc import Iterator
from itertools import product
from math import prod
from typing import Annotated, Any, Literal, Self

from pydantic import Field, model_validator

from experiments.config.base import Strict, mismatch
from experiments.config.yaml_reader import Plain

Value = None | bool | int | float | str | tuple[Any, ...] | dict[str, Any]
Values = Annotated[tuple[Value, ...], Field(min_length=1)]
Number = int | float
MAX_SEED = 2**31 - 1
Point = dict[str, Plain]  # key -> value


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
    def names(self) -> list[str]:
        """Keys that are varied."""
        return [*self.grid, *self.zip, *(self.sample.ranges if self.sample else ())]

    @property
    def count(self) -> int:
        """Number of combinations."""
        zipped = len(next(iter(self.zip.values()))) if self.zip else 1
        sampled = self.sample.count if self.sample else 1
        return prod(len(values) for values in self.grid.values()) * zipped * sampled


def axis_points(axes: Axes) -> Iterator[Point]:
    """Yield every combination of the axes; the sample varies fastest."""
    grid = product(*axes.grid.values())
    zipped = list(zip(*axes.zip.values(), strict=True)) or [()]
    sampled = list(_sample(axes.sample)) if axes.sample else [{}]
    for values, tied, drawn in product(grid, zipped, sampled):
        yield {
            **dict(zip(axes.grid, values, strict=True)),
            **dict(zip(axes.zip, tied, strict=True)),
            **drawn,
        }


def _sample(sample: Sample) -> Iterator[Point]:
    """Sample points over the ranges."""
    from scipy.stats import qmc  # takes half a second to load

    dimensions = len(sample.ranges)
    if sample.method == "sobol":
        drawn = qmc.Sobol(dimensions, rng=sample.seed).random(sample.count)
    else:
        drawn = qmc.LatinHypercube(dimensions, rng=sample.seed).random(sample.count)
    for row in drawn:
        yield {
            key: _in_range(float(at), *ends)
            for at, (key, ends) in zip(row, sample.ranges.items(), strict=True)
        }


def _in_range(at: float, least: float, most: float) -> float | int:
    """Scale a number in [0, 1) to a range; an integer if both ends are integers."""
    if isinstance(least, int) and isinstance(most, int):
        return least + int(at * (most - least + 1))
    return least + at * (most - least)
