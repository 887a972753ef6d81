"""Runs of a sweep in cells, by planner and seed; a seed is one observation.

A cell is one place of a claim: a scenario at one point of the axes. Inside a cell all
that shares a seed (repetitions, or the cells that were pooled) shares its random
numbers, so it is averaged first and counts once.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from experiments.comparison.results import LABEL, Row, axis_columns
from experiments.config.validation_errors import unknown_name
from experiments.errors import ConfigError
from experiments.metrics import columns
from planner.states import FloatArray

REPETITION = "simulation.repetition"  # axis of repeated runs of one seed
MOST_VALUES = 12  # of an axis that splits into cells; more are a sample

SeedKey = str
RunKey = tuple[str, ...]
RunsOfSeeds = Mapping[SeedKey, Mapping[RunKey, Row]]
Value = Callable[[Row], Any]  # of a metric, None where it does not apply


@dataclass(frozen=True, slots=True)
class Cell:
    """Runs that are compared with each other: label -> seed -> run."""

    name: str  # "curved, density dense"; empty for all runs
    groups: Mapping[str, RunsOfSeeds]


@dataclass(frozen=True, slots=True)
class SeedMeans:
    """Values of one metric, one a seed."""

    values: FloatArray  # means of a seed's runs (n,)
    flags: bool  # each seed has one run with a yes or no

    @property
    def count(self) -> int:
        """Number of seeds."""
        return int(self.values.size)


def cells(rows: Sequence[Row], by: Sequence[str] | None = None) -> list[Cell]:
    """Split runs into cells.

    Args:
        rows: At least one.
        by: Columns whose values make cells; those of `splitting_columns` if None.

    Raises:
        ConfigError: If there is no such column.
    """
    known = [columns.SCENARIO, *axis_columns(list(rows[0]))]
    by = splitting_columns(rows) if by is None else by
    for name in by:
        if name not in known:
            raise ConfigError(f"--by {name}: no such axis; {unknown_name(name, known)}")
    split: dict[tuple[Any, ...], list[Row]] = {}
    for row in rows:
        split.setdefault(tuple(row[name] for name in by), []).append(row)
    return [Cell(_named(by, at), _groups(split[at])) for at in sorted(split, key=_size)]


def splitting_columns(rows: Sequence[Row]) -> list[str]:
    """Return the scenario and the axes that vary, without repetitions and samples."""
    found = []
    for name in (columns.SCENARIO, *axis_columns(list(rows[0]))):
        values = {str(row[name]) for row in rows}
        if 1 < len(values) <= MOST_VALUES and name != REPETITION:
            found.append(name)
    return found


def seed_means(runs: RunsOfSeeds, value: Value) -> SeedMeans:
    """Average a metric over the runs of each seed; seeds without a value are out."""
    found = []
    for of_seed in runs.values():
        known = [v for v in map(value, of_seed.values()) if v is not None]
        if known:
            found.append(known)
    return _sample(found)


def paired(
    first: RunsOfSeeds, second: RunsOfSeeds, value: Value
) -> tuple[SeedMeans, SeedMeans]:
    """Return a metric of two planners on the seeds, and runs of them, of both."""
    ones, others = [], []
    for seed, runs in second.items():
        there = first.get(seed, {})
        values = [
            (value(there[key]), value(row)) for key, row in runs.items() if key in there
        ]
        both = [(a, b) for a, b in values if a is not None and b is not None]
        if both:
            ones.append([a for a, _ in both])
            others.append([b for _, b in both])
    return _sample(ones), _sample(others)


def arrivals(first: RunsOfSeeds, second: RunsOfSeeds) -> tuple[int, int, int]:
    """Count the arrivals of two planners and their common runs."""
    pairs = list(_common(first, second))
    return (
        sum(bool(a[columns.ARRIVED]) for a, _ in pairs),
        sum(bool(b[columns.ARRIVED]) for _, b in pairs),
        len(pairs),
    )


def _common(first: RunsOfSeeds, second: RunsOfSeeds) -> Iterator[tuple[Row, Row]]:
    """Yield the runs that both planners drove."""
    for seed, runs in second.items():
        there = first.get(seed, {})
        yield from ((there[key], row) for key, row in runs.items() if key in there)


def _sample(found: Sequence[Sequence[Any]]) -> SeedMeans:
    """Average the values of each seed."""
    flags = all(len(of) == 1 and isinstance(of[0], bool) for of in found)
    means = [float(np.mean(of)) for of in found]
    return SeedMeans(np.asarray(means, dtype=np.float64), flags and bool(found))


def _groups(rows: Sequence[Row]) -> dict[str, dict[SeedKey, dict[RunKey, Row]]]:
    """Group rows by planner, seed, and the rest of a pair's key."""
    axes = axis_columns(list(rows[0]))
    groups: dict[str, dict[SeedKey, dict[RunKey, Row]]] = {}
    for row in rows:
        key = tuple(str(row[name]) for name in (columns.SCENARIO, *axes))
        of_label = groups.setdefault(str(row[LABEL] or row[columns.PLANNER]), {})
        of_label.setdefault(str(row[columns.SEED]), {})[key] = row
    return groups


def _named(by: Sequence[str], at: Sequence[Any]) -> str:
    """Name a cell: the scenario as it is, axes with the end of their key."""
    return ", ".join(
        str(value)
        if name == columns.SCENARIO
        else f"{name.rpartition('.')[2]} {_text(value)}"
        for name, value in zip(by, at, strict=True)
    )


def _text(value: Any) -> str:
    """Format the value of an axis."""
    return f"{value:g}" if isinstance(value, float) else str(value)


def _size(at: Sequence[Any]) -> tuple[Any, ...]:
    """Return the sort key of a cell: numbers before text."""
    return tuple(
        (0, value, "") if isinstance(value, int | float) else (1, 0, str(value))
        for value in at
    )
