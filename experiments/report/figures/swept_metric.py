"""A metric of a sweep with its runs, for the figures that are drawn of it."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from experiments.comparison.inference import wilson
from experiments.comparison.location import Interval, mean
from experiments.comparison.results import LABEL, Row
from experiments.config.validation_errors import unknown_name
from experiments.errors import ConfigError
from experiments.metrics import columns
from experiments.metrics.catalogue import METRICS, RATES
from experiments.metrics.metric import CellKind
from planner.states import FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class SweptMetric:
    """A metric of all runs of a sweep, by planner."""

    name: str
    label: str  # with its unit
    rate: bool
    rows: Sequence[Row]
    planners: tuple[str, ...]  # in the order of the sweep file

    def value(self, row: Row) -> float | None:
        """Return the value of a run, None where the metric does not apply."""
        if self.name in RATES:
            count = row[RATES[self.name]]
            return None if count is None else 100.0 * float(count > 0)
        value = row[self.name]
        return None if value is None else float(value) * (100.0 if self.rate else 1.0)

    def of(self, planner: str) -> list[Row]:
        """Return the runs of a planner in which the metric applies."""
        return [
            row
            for row in self.rows
            if label_of(row) == planner and self.value(row) is not None
        ]

    def values(self, rows: Sequence[Row]) -> FloatArray:
        """Return the values of runs in which the metric applies."""
        return np.array([self.value(row) for row in rows], dtype=np.float64)

    def estimate(self, values: FloatArray) -> Interval:
        """Estimate mean or share with its interval of 95 %."""
        if self.rate:
            found = wilson(int(np.count_nonzero(values)), values.size)
            return Interval(*(100.0 * v for v in (found.value, found.low, found.high)))
        return mean(values).interval


def swept_metric(
    rows: Sequence[Row], metric: str, planners: Sequence[str]
) -> SweptMetric:
    """Choose a metric or rate of the rows of a sweep.

    Args:
        rows: At least one.
        metric: Column with numbers, or a rate.
        planners: Labels in the order of the sweep file.

    Raises:
        ConfigError: If there is no such metric, or it applies to no run.
    """
    numeric = [
        name
        for name, one in METRICS.items()
        if one.kind is not CellKind.TEXT and not (one.identity or one.rate == name)
    ]
    if metric not in (*numeric, *RATES):
        hint = unknown_name(metric, [*RATES, *numeric])
        raise ConfigError(f"--metric {metric}: no such metric; {hint}")
    there = {label_of(row) for row in rows}
    order = [*(p for p in planners if p in there), *sorted(there - set(planners))]
    rate = metric in RATES or METRICS[metric].kind is CellKind.FLAG
    label = f"{metric} [%]" if metric in RATES else METRICS[metric].label_with_unit
    if rate and metric not in RATES:
        label = f"{METRICS[metric].label} [%]"
    found = SweptMetric(metric, label, rate, rows, tuple(order))
    if not any(found.of(planner) for planner in order):
        raise ConfigError(f"--metric {metric}: applies to no run of this sweep")
    return found


def label_of(row: Row) -> str:
    """Return the label of the planner of a row."""
    return str(row[LABEL] or row[columns.PLANNER])
