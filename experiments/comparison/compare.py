"""Comparison of planners with a baseline on common seeds."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from experiments.comparison import inference as st
from experiments.comparison.results import LABEL, Row, axis_columns
from experiments.config.validation_errors import unknown_name
from experiments.errors import ConfigError
from experiments.metrics import columns
from experiments.metrics.catalogue import ALL_COLUMNS, MEANS, RATES

Statistic = Callable[..., float]


@dataclass(frozen=True, slots=True)
class Line:
    """One metric of one planner, compared with the baseline."""

    metric: str
    label: str
    runs: int  # in which the metric applies
    value: st.Interval
    pairs: int = 0  # with the baseline
    difference: st.Interval | None = None  # from the baseline
    effect: float | None = None
    test: str = ""
    p_value: float | None = None
    p_holm: float | None = None
    seeds_needed: int | None = None  # for a power of 0.8
    rate: bool = False  # a share of runs, not a mean


def compare(
    rows: Sequence[Row],
    baseline: str,
    metrics: Sequence[str] | None = None,
    statistic: Statistic = np.mean,
) -> list[Line]:
    """Compare every planner with the baseline.

    Args:
        rows: Of a sweep's results.
        baseline: Label of a planner.
        metrics: Names of rates or columns with numbers; the usual ones if None.
        statistic: `numpy.mean` or `numpy.median`.

    Returns:
        Lines by metric, the baseline's first. The p values of all lines are corrected
        together.

    Raises:
        ConfigError: If there is no such planner or metric.
    """
    if not rows:
        raise ConfigError("there are no runs to compare")
    groups = _by_label(rows)
    if baseline not in groups:
        raise ConfigError(
            f"--baseline {baseline}: no such planner; "
            f"{unknown_name(baseline, sorted(groups))}"
        )
    labels = [baseline, *sorted(label for label in groups if label != baseline)]
    lines: list[Line] = []
    for metric in metrics or (*RATES, *MEANS):
        _check_metric(metric, rows)
        for label in labels:
            other = groups[baseline] if label != baseline else None
            line = _line(metric, label, groups[label], other, statistic)
            lines += [line] if line is not None else []
    return _corrected(lines)


def _line(
    metric: str,
    label: str,
    own: Mapping[tuple[str, ...], Row],
    baseline: Mapping[tuple[str, ...], Row] | None,
    statistic: Statistic,
) -> Line | None:
    """Compare one planner in one metric; None if it applies to no run."""
    values = {key: _value(metric, row) for key, row in own.items()}
    known = {key: value for key, value in values.items() if value is not None}
    if not known:
        return None
    data = list(known.values())
    rate = all(isinstance(value, bool) for value in data)
    value = st.wilson(sum(data), len(data)) if rate else st.bootstrap(data, statistic)
    line = Line(metric, label, len(data), value, rate=rate)
    if baseline is None:
        return line
    there = {key: _value(metric, row) for key, row in baseline.items()}
    common = [key for key in known if there.get(key) is not None]
    if not common:
        return line
    first: list[Any] = [there[key] for key in common]
    second: list[Any] = [known[key] for key in common]
    if rate:
        return _with_rates(line, first, second)
    return _with_difference(line, st.paired_difference(first, second, statistic))


def _with_rates(line: Line, first: list[Any], second: list[Any]) -> Line:
    """Add the paired comparison of a rate."""
    found = st.paired_rates(first, second)
    gained, lost = found.only_second / found.pairs, found.only_first / found.pairs
    needed = st.seeds_for_rates(gained, lost) if gained != lost else None
    return replace(
        line,
        pairs=found.pairs,
        difference=found.difference,
        test="McNemar",
        p_value=found.p_value,
        seeds_needed=needed,
    )


def _with_difference(line: Line, found: st.PairedDifference) -> Line:
    """Add the paired comparison of a quantity."""
    return replace(
        line,
        pairs=found.pairs,
        difference=found.center,
        effect=found.effect,
        test="Wilcoxon",
        p_value=found.p_value,
        seeds_needed=st.seeds_for_difference(found.effect) if found.effect else None,
    )


def _corrected(lines: Sequence[Line]) -> list[Line]:
    """Correct all p values together (Holm)."""
    tested = [line.p_value for line in lines if line.p_value is not None]
    corrected = iter(st.holm(tested))
    return [
        line if line.p_value is None else replace(line, p_holm=next(corrected))
        for line in lines
    ]


def _by_label(rows: Sequence[Row]) -> dict[str, dict[tuple[str, ...], Row]]:
    """Group rows by planner, then by the key of a pair."""
    axes = axis_columns(list(rows[0]))
    groups: dict[str, dict[tuple[str, ...], Row]] = {}
    for row in rows:
        names = (columns.SCENARIO, columns.SEED, *axes)
        key = tuple(str(row[name]) for name in names)
        groups.setdefault(row[LABEL] or row[columns.PLANNER], {})[key] = row
    return groups


def _check_metric(metric: str, rows: Sequence[Row]) -> None:
    """Reject unknown metrics."""
    if metric in RATES:
        return
    numbers = [
        name
        for name in ALL_COLUMNS
        if any(isinstance(row[name], int | float) for row in rows)
        and name not in (columns.SEED, columns.ARRIVED)
    ]
    usual = metric in MEANS  # it may apply to none of these runs
    if metric not in numbers and not usual:
        hint = unknown_name(metric, [*RATES, *numbers])
        raise ConfigError(f"--metric {metric}: no such metric; {hint}")


def _value(metric: str, row: Row) -> Any:
    """Look up a column, or whether that of a rate is above zero; None if unknown."""
    if metric not in RATES:
        return row[metric]
    count = row[RATES[metric]]
    return None if count is None else count > 0
