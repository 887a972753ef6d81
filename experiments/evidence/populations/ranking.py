"""Whether the order of planners depends on who else drives.

A run that does not arrive has the penalised travel time of `rearview compare`: without
it the planner that gives up where it is difficult would look fast.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from experiments.comparison.compare import PENALTY_FACTOR
from experiments.comparison.inference import holm
from experiments.comparison.location import CONFIDENCE, Interval, mean
from experiments.comparison.results import LABEL, Row
from experiments.metrics import columns
from experiments.metrics.catalogue import METRICS
from experiments.metrics.metric import Better

POPULATION = "traffic.drivers.population"
RELAXATION = "traffic.relaxation_s"
RANKED = (
    columns.TRAVEL_TIME,
    columns.CUT_IN_DECELERATION,
    columns.REAR_MAX_DECELERATION,
    columns.BEHIND_DELAY_MEAN,
)


@dataclass(frozen=True, slots=True)
class CellOfRanking:
    """The planners in one population: best first, with means and intervals."""

    population: str
    relaxation: float
    order: tuple[str, ...]
    means: tuple[Interval, ...]  # in that order
    seeds: int  # of which every planner has a value


@dataclass(frozen=True, slots=True)
class Flip:
    """Two planners whose difference has another sign in another population."""

    first: str
    second: str
    better: str  # population in which the first is better
    worse: str  # in which it is worse
    relaxation: float


def rankings(rows: Sequence[Row], metric: str) -> list[CellOfRanking]:
    """Rank the planners of each population, on the seeds that all of them have."""
    cells = sorted({(float(r[RELAXATION]), str(r[POPULATION])) for r in rows})
    found = []
    for relaxation, population in cells:
        values = _values(rows, metric, population, relaxation)
        seeds = _common(values)
        if not seeds:
            continue
        means = {
            label: mean([of[seed] for seed in seeds]).interval
            for label, of in values.items()
        }
        sign = 1.0 if METRICS[metric].better is Better.LOWER else -1.0
        order = sorted(means, key=lambda label: (sign * means[label].value, label))
        found.append(
            CellOfRanking(
                population,
                relaxation,
                tuple(order),
                tuple(means[label] for label in order),
                len(seeds),
            )
        )
    return found


def flips(rows: Sequence[Row], metric: str) -> list[Flip]:
    """Find pairs that change places, with differences that are no chance on both sides.

    The p values of all pairs, populations and relaxations are corrected together
    (Holm).
    """
    sign = 1.0 if METRICS[metric].better is Better.LOWER else -1.0
    cells = sorted({(float(r[RELAXATION]), str(r[POPULATION])) for r in rows})
    asked: list[tuple[tuple[str, str, float], str, float]] = []
    p_values: list[float] = []
    for relaxation, population in cells:
        values = _values(rows, metric, population, relaxation)
        for one, other in combinations(sorted(values), 2):
            seeds = sorted(values[one].keys() & values[other].keys())
            apart = [sign * (values[one][s] - values[other][s]) for s in seeds]
            if not apart:
                continue
            located = mean(apart)
            if located.p_value is not None:
                pair = (one, other, relaxation)
                asked.append((pair, population, located.interval.value))
                p_values.append(located.p_value)
    surely: dict[tuple[str, str, float], dict[str, float]] = {}
    for (pair, population, value), p_value in zip(asked, holm(p_values), strict=True):
        if p_value <= 1.0 - CONFIDENCE:
            surely.setdefault(pair, {})[population] = value
    return [
        Flip(one, other, better, worse, relaxation)
        for (one, other, relaxation), found in surely.items()
        for better in sorted(p for p, apart in found.items() if apart < 0.0)
        for worse in sorted(p for p, apart in found.items() if apart > 0.0)
    ]


def share_of(
    rows: Sequence[Row], population: str, label: str, column: str, *, value: object
) -> tuple[int, int]:
    """Count the runs of a planner in a population with a value, and all of them."""
    mine = [r for r in rows if r[POPULATION] == population and _label(r) == label]
    return sum(r.get(column) == value for r in mine), len(mine)


def _values(
    rows: Sequence[Row], metric: str, population: str, relaxation: float
) -> dict[str, dict[int, float]]:
    """Return planner -> seed -> value, penalised where the ego has not arrived."""
    here = [
        row
        for row in rows
        if row[POPULATION] == population and float(row[RELAXATION]) == relaxation
    ]
    penalty = None
    if metric == columns.TRAVEL_TIME:
        longest = max((float(row.get(metric) or 0.0) for row in here), default=0.0)
        penalty = PENALTY_FACTOR * longest or None
    found: dict[str, dict[int, float]] = {}
    for row in here:
        value = penalty if row.get(metric) is None else row[metric]
        if value is not None and np.isfinite(float(value)):
            found.setdefault(_label(row), {})[int(row[columns.SEED])] = float(value)
    return found


def _common(values: dict[str, dict[int, float]]) -> list[int]:
    """Return the seeds of which every planner has a value."""
    seeds = [set(of) for of in values.values()]
    return sorted(set.intersection(*seeds)) if seeds else []


def _label(row: Row) -> str:
    """Return the planner's label."""
    return str(row[LABEL] or row[columns.PLANNER])
