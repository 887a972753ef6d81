"""Comparison of planners with a baseline on common seeds, cell by cell."""

from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from typing import Any, Final

import numpy as np

from experiments.comparison import inference as st
from experiments.comparison import location
from experiments.comparison.location import Interval
from experiments.comparison.pairing import (
    Cell,
    RunsOfSeeds,
    SeedMeans,
    Value,
    arrivals,
    cells,
    paired,
    seed_means,
)
from experiments.comparison.results import Row
from experiments.config.validation_errors import unknown_name
from experiments.errors import ConfigError
from experiments.metrics import columns
from experiments.metrics.catalogue import (
    ALL_COLUMNS,
    MEANS,
    METRICS,
    RATES,
    TIMING_COLUMNS,
)
from experiments.metrics.metric import CellKind

PENALISED: Final = f"{columns.TRAVEL_TIME}, penalised"
PENALTY_FACTOR = 2.0  # of the longest travel time of a cell, without a given penalty
CAUSAL: Final = ("behind_", "cut_in_")  # columns of the cost to others
PLACEBO: Final = "placebo_"  # the same of two runs without the ego
AHEAD: Final = "ahead_"  # the same of vehicles far ahead, which the ego cannot reach


class Center(StrEnum):
    """What a quantity is summarised by."""

    MEAN = "mean"
    MEDIAN = "median"


_LOCATE = {Center.MEAN: location.mean, Center.MEDIAN: location.median}

ROUNDING = 1e-9  # of the compared values: less than this is none [-]


@dataclass(frozen=True, slots=True)
class Line:
    """One metric of one planner in one cell, compared with the baseline."""

    metric: str
    label: str
    runs: int  # seeds in which the metric applies
    value: Interval | None  # None if it applies to no run
    where: str = ""  # the cell
    events: int | None = None  # seeds with the event of a rate
    pairs: int = 0  # seeds in common with the baseline
    difference: Interval | None = None  # from the baseline
    placebo: Interval | None = None  # the same figure of two runs without an ego
    ahead: Interval | None = None  # the same figure of vehicles far ahead
    effect: float | None = None
    test: str = ""
    p_value: float | None = None
    p_holm: float | None = None  # None if the metric is not in the family
    seeds_needed: int | None = None  # for a power of 0.8
    rate: bool = False  # a share of runs, not a mean
    note: str = ""


def named(metric: str, unit_of_rates: str = "") -> str:
    """Return the label of a rate or column, with its unit."""
    column, _, more = metric.partition(", ")
    label = METRICS[column].label_with_unit if column in METRICS else column
    label += unit_of_rates if column in RATES else ""
    return f"{label}, {more}" if more else label


@dataclass(frozen=True, slots=True)
class Question:
    """What is compared, and how."""

    baseline: str
    metrics: Sequence[str] | None = None  # rates or columns; the usual ones if None
    family: Collection[str] | None = None  # metrics corrected together; all if None
    by: Sequence[str] | None = None  # columns that make cells; () pools all runs
    center: Center = Center.MEAN
    penalty: float | None = None  # travel time of a run that does not arrive [s]


def compare(rows: Sequence[Row], question: Question) -> list[Line]:
    """Compare every planner with the baseline.

    Args:
        rows: Of a sweep's results.
        question: What is compared.

    Returns:
        Lines by metric, then by cell, the baseline's first. The p values of the family
        are corrected together, over all cells. Wall-clock columns, and pairs without
        any difference, are in no family.

    Raises:
        ConfigError: If there is no such planner, metric or axis.
    """
    if not rows:
        raise ConfigError("there are no runs to compare")
    found = cells(rows, question.by)
    labels = sorted({label for cell in found for label in cell.groups})
    baseline = question.baseline
    if baseline not in labels:
        raise ConfigError(
            f"--baseline {baseline}: no such planner; {unknown_name(baseline, labels)}"
        )
    lines: list[Line] = []
    for metric in question.metrics or (*RATES, *MEANS):
        _check_metric(metric, rows)
        for cell in found:
            for label in [baseline, *(name for name in labels if name != baseline)]:
                lines += _lines(metric, label, cell, question)
    applies = {line.metric for line in lines if line.value is not None}
    family = question.family
    asked = question.metrics if family is None else family
    kept = [x for x in lines if x.metric in applies or x.metric in (asked or ())]
    return _corrected(kept, None if family is None else {*family, *_penalised(family)})


def _penalised(family: Collection[str]) -> tuple[str, ...]:
    """Return what stands for the travel time where not all arrive."""
    return (PENALISED,) if columns.TRAVEL_TIME in family else ()


def _lines(metric: str, label: str, cell: Cell, question: Question) -> Iterator[Line]:
    """Compare one planner in one metric and cell."""
    line = _line(metric, label, cell, question, lambda row: _value(metric, row))
    if metric != columns.TRAVEL_TIME or not _some_lost(label, cell, question):
        yield line
        return
    # on the pairs in which both arrived the planner that gives up looks fast: the
    # penalised travel time takes its place in the family
    yield replace(line, p_value=None, test="")
    penalty = question.penalty or _longest(cell) * PENALTY_FACTOR
    if penalty > 0.0:
        instead = _line(
            PENALISED, label, cell, question, lambda row: _value(metric, row) or penalty
        )
        words = f"{penalty:.4g} s where the ego did not arrive"
        yield replace(instead, note=_joined(instead.note, words))


def _some_lost(label: str, cell: Cell, question: Question) -> bool:
    """Check whether an ego of either planner did not arrive."""
    own = cell.groups.get(label, {})
    other = cell.groups.get(question.baseline, {})
    return any(
        not row[columns.ARRIVED]
        for runs in (own, other)
        for of_seed in runs.values()
        for row in of_seed.values()
    )


def _longest(cell: Cell) -> float:
    """Return the longest travel time of any planner in a cell [s]; 0 without one."""
    times = [
        float(row[columns.TRAVEL_TIME] or 0.0)
        for runs in cell.groups.values()
        for of_seed in runs.values()
        for row in of_seed.values()
    ]
    return max(times, default=0.0)


def _line(
    metric: str, label: str, cell: Cell, question: Question, value: Value
) -> Line:
    """Compare one planner in one metric and cell; says why where it cannot."""
    own = cell.groups.get(label, {})
    found = seed_means(own, value)
    line = _alone(Line(metric, label, found.count, None, cell.name), found, question)
    line = replace(
        line,
        placebo=_placebo(PLACEBO, metric, own, question),
        ahead=_placebo(AHEAD, metric, own, question),
    )
    if label == question.baseline:
        return line
    baseline = cell.groups.get(question.baseline, {})
    lost = _arrival_note(question.baseline, arrivals(baseline, own))
    first, second = paired(baseline, own, value)
    if not first.count:
        why = f"no pairs with {question.baseline}"
        return replace(line, note=_joined(line.note, lost or why))
    line = replace(line, note=_joined(line.note, lost), pairs=first.count)
    if first.flags and second.flags:
        line = _with_rates(line, first, second)
    else:
        line = _with_difference(line, first, second, question.center)
    if metric in TIMING_COLUMNS:
        words = "measures the machine: not tested"
        line = replace(line, p_value=None, test="", note=_joined(line.note, words))
    return line


def _alone(line: Line, found: SeedMeans, question: Question) -> Line:
    """Add the value of a planner itself."""
    if not found.count:
        return replace(line, note="applies to no run")
    if not found.flags:
        value = _LOCATE[question.center](found.values).interval
        return replace(line, value=value, rate=_is_rate(line.metric))
    events = int(found.values.sum())
    value = st.wilson(events, found.count)
    return replace(line, value=value, events=events, rate=True)


def _is_rate(metric: str) -> bool:
    """Check whether a metric is a share of runs."""
    kind = METRICS[metric].kind if metric in METRICS else None
    return metric in RATES or kind is CellKind.FLAG


def _placebo(
    prefix: str, metric: str, own: RunsOfSeeds, question: Question
) -> Interval | None:
    """Return the same figure where the ego can have no effect, if it was measured."""
    bare = next((metric.removeprefix(p) for p in CAUSAL if metric.startswith(p)), "")
    column = prefix + bare
    if not bare or column not in METRICS:
        return None
    found = seed_means(own, lambda row: row.get(column))
    if not found.count:
        return None
    return _LOCATE[question.center](found.values).interval


def _arrival_note(baseline: str, counts: tuple[int, int, int]) -> str:
    """Say whether a planner, or the baseline, arrives less often than the other."""
    there, here, runs = counts
    if runs and not there:
        return f"{baseline} never arrives ({there} of {runs})"
    if runs and not here:
        return f"never arrives ({here} of {runs})"
    if here < there:
        return f"arrives less often: {here} of {runs}, {baseline} {there}"
    if there < here:
        return f"{baseline} arrives less often: {there} of {runs}, here {here}"
    return ""


def _with_rates(line: Line, first: SeedMeans, second: SeedMeans) -> Line:
    """Add the paired comparison of a rate."""
    found = st.paired_rates(
        [bool(v) for v in first.values], [bool(v) for v in second.values]
    )
    gained, lost = found.only_second / found.pairs, found.only_first / found.pairs
    needed = st.seeds_for_rates(gained, lost) if gained != lost else None
    same = "no pair differs: not tested" if found.p_value is None else ""
    return replace(
        line,
        difference=found.difference,
        test="" if found.p_value is None else "score and McNemar",
        p_value=found.p_value,
        seeds_needed=needed,
        note=_joined(line.note, same),
    )


def _with_difference(
    line: Line, first: SeedMeans, second: SeedMeans, center: Center
) -> Line:
    """Add the paired comparison of a quantity."""
    apart = second.values - first.values
    found = _LOCATE[center](apart)
    spread = float(apart.std(ddof=1)) if apart.size > 1 else 0.0
    # differences that are equal but for rounding have no spread
    scale = float(np.abs([first.values, second.values]).max(initial=0.0))
    is_spread = spread > ROUNDING * scale
    effect = float(apart.mean()) / spread if is_spread else None
    words = ""
    if found.p_value is None:
        few = apart.size < location.LEAST_VALUES
        words = (
            f"fewer than {location.LEAST_VALUES} seeds" if few else "all pairs equal"
        )
        words += ": not tested"
    name = "t and bootstrap" if center is Center.MEAN else "sign"
    return replace(
        line,
        difference=found.interval,
        effect=effect,
        test=name if found.p_value is not None else "",
        p_value=found.p_value,
        seeds_needed=st.seeds_for_difference(effect) if effect else None,
        note=_joined(line.note, words),
    )


def _joined(*words: str) -> str:
    """Join the notes of a line."""
    return "; ".join(word for word in words if word)


def _corrected(lines: Sequence[Line], family: Collection[str] | None) -> list[Line]:
    """Correct the p values of a family together (Holm)."""
    inside = [
        line.p_value is not None and (family is None or line.metric in family)
        for line in lines
    ]
    tested = [
        float(line.p_value or 0.0)
        for line, one in zip(lines, inside, strict=True)
        if one
    ]
    corrected = iter(st.holm(tested))
    return [
        replace(line, p_holm=next(corrected)) if one else line
        for line, one in zip(lines, inside, strict=True)
    ]


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
    known = METRICS.get(metric)  # it may apply to none of these runs
    if metric not in numbers and (known is None or known.kind is CellKind.TEXT):
        hint = unknown_name(metric, [*RATES, *numbers])
        raise ConfigError(f"--metric {metric}: no such metric; {hint}")


def _value(metric: str, row: Row) -> Any:
    """Look up a column, or whether that of a rate is above zero; None if unknown."""
    if metric not in RATES:
        return row[metric]
    count = row[RATES[metric]]
    return None if count is None else count > 0
