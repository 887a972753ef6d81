"""Results of a sweep against earlier results of the same sweep: what got worse."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path

import duckdb

from experiments.comparison.compare import Line, Question, compare
from experiments.comparison.location import LEAST_VALUES
from experiments.comparison.results import LABEL, Row, axis_columns
from experiments.config.counted import counted
from experiments.errors import ConfigError, ResultsError
from experiments.metrics import columns
from experiments.metrics.catalogue import ALL_COLUMNS, METRICS, RATES
from experiments.metrics.metric import Better
from experiments.storage import parquet_database
from experiments.storage.parquet_source import parquet_source

NOW, BEFORE = "now", "before"  # labels of the comparison
OF = "of planner"  # column with the planner's label, which makes cells
ROUNDING = 1e-9  # of a mean, relative; less is no difference
LEVEL = 0.05  # of p (Holm) from which on a difference is no chance


class RegressionRule(StrEnum):
    """Which differences count as a regression."""

    SIGNIFICANT = "significant"  # worse, and p (Holm) at most 0.05
    WORSE = "worse"  # worse by anything


@dataclass(frozen=True, slots=True)
class Regression:
    """A metric that got worse."""

    line: Line
    better: Better

    def __str__(self) -> str:
        """Describe it in one line."""
        line = self.line
        assert line.value is not None  # noqa: S101 - there are pairs
        assert line.difference is not None  # noqa: S101 - as above
        by, p = line.difference.value, line.p_holm
        chance = "" if p is None else f", p (Holm) {p:.3g}"
        return (
            f"worse: {line.where or 'all runs'}: {line.metric} {line.value.value:.4g}, "
            f"{by:+.4g} on {line.pairs} common seeds{chance}"
        )


def read_results(file: Path) -> list[Row]:
    """Read the results of a sweep from a Parquet file, as `results.parquet` is.

    Raises:
        ResultsError: If it is missing, or does not hold results of a sweep.
    """
    if file.is_dir():
        raise ResultsError(
            f"{file}: is a folder; allowed: a copy of the results.parquet of a sweep"
        )
    if not file.is_file():
        raise ResultsError(f"{file}: cannot be read: No such file")
    try:
        with parquet_database.reading() as database:
            relation = database.sql(f"SELECT * FROM {parquet_source(file)}")
            names, values = relation.columns, relation.fetchall()
    except (duckdb.Error, ValueError, RuntimeError) as error:
        line = (str(error).splitlines() or ["damaged"])[0][:200]
        raise ResultsError(f"{file}: cannot be read: {line}") from error
    missing = {columns.SCENARIO, columns.SEED, columns.ARRIVED, LABEL} - set(names)
    if missing or not values:
        lacks = f"lacks {sorted(missing)[0]}" if missing else "holds no runs"
        raise ResultsError(
            f"{file}: {lacks}; allowed: a copy of the results.parquet of a sweep"
        )
    return [dict(zip(names, row, strict=True)) for row in values]


def compare_with_earlier(
    now: Sequence[Row], before: Sequence[Row], metrics: Sequence[str] | None = None
) -> list[Line]:
    """Compare every planner with itself, on common seeds.

    Args:
        now: Results.
        before: Earlier results of the same scenarios, planners and axes.
        metrics: See `Question`.

    Returns:
        Lines with the label `now`, by metric and cell.

    Raises:
        ConfigError: If earlier runs have no counterpart, or there is no such metric.
    """
    _require_counterparts(now, before)
    axes = _axes(before)
    rows = [
        *(_as(row, BEFORE, axes) for row in before),
        *(_as(row, NOW, axes) for row in now),
    ]
    cells = (OF, columns.SCENARIO, *axes)
    lines = compare(rows, Question(BEFORE, metrics, by=cells))
    return [line for line in lines if line.label == NOW]


def require_tested(lines: Sequence[Line], fail_on: RegressionRule) -> None:
    """Raise if no line can tell a difference from chance: nothing could ever fail.

    Raises:
        ConfigError: If there are too few common seeds everywhere, and only significant
            differences are to count.
    """
    most = max((line.pairs for line in lines), default=0)
    if fail_on is RegressionRule.SIGNIFICANT and most < LEAST_VALUES:
        seeds = counted(most, "common seed")
        raise ConfigError(
            f"--against: {seeds}, of which nothing can be tested; allowed: at least "
            f"{LEAST_VALUES}, or --fail-on worse"
        )


def untested(lines: Sequence[Line]) -> int:
    """Count the lines in which a difference could not be told from chance."""
    return sum(
        line.pairs < LEAST_VALUES and _direction(line.metric) is not Better.NEITHER
        for line in lines
    )


def regressions(lines: Sequence[Line], fail_on: RegressionRule) -> list[Regression]:
    """Pick the lines in which a metric got worse."""
    found = []
    for line in lines:
        better = _direction(line.metric)
        apart = line.difference.value if line.difference is not None else 0.0
        loss = {Better.LOWER: apart, Better.HIGHER: -apart}.get(better, 0.0)
        sure = line.p_holm is not None and line.p_holm <= LEVEL
        size = abs(line.value.value) if line.value is not None else 0.0
        if loss > ROUNDING * max(size, 1.0) and (
            sure or fail_on is RegressionRule.WORSE
        ):
            found.append(Regression(line, better))
    return found


def _direction(metric: str) -> Better:
    """Return in which direction a metric or rate improves; timings in none."""
    column = RATES.get(metric, metric).partition(", ")[0]
    known = METRICS.get(column)
    return Better.NEITHER if known is None or known.timing else known.better


def _axes(rows: Sequence[Row]) -> list[str]:
    """Return the axes of the sweep that the rows are of."""
    return axis_columns(list(rows[0]))


def _as(row: Row, label: str, axes: Sequence[str]) -> Row:
    """Relabel a row; its planner becomes an axis. Metrics that it lacks are None."""
    known: Mapping[str, object] = {name: row.get(name) for name in ALL_COLUMNS}
    places = {name: row.get(name) for name in axes}
    return {OF: row[LABEL], **places, **known, LABEL: label}


def _require_counterparts(now: Sequence[Row], before: Sequence[Row]) -> None:
    """Raise unless every scenario, planner and point was run on a common seed."""
    axes = _axes(before)

    def place(row: Row) -> tuple[str, ...]:
        return tuple(str(row.get(key)) for key in (columns.SCENARIO, LABEL, *axes))

    seeds = {(place(row), row[columns.SEED]) for row in now}
    there = {where for where, seed in seeds}
    common = {place(row) for row in before if (place(row), row[columns.SEED]) in seeds}
    for row in before:
        if place(row) not in common:
            why = "has no seed in common" if place(row) in there else "was not run"
            words = ", ".join(place(row))
            raise ConfigError(
                f"--against: {words}: {why}; allowed: earlier results of this sweep"
            )
