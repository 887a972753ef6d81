"""One published sweep in numbers: what was run, the tables of its claim, all lines."""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

from experiments.comparison.compare import PENALISED, Line, compare, named
from experiments.comparison.question import claimed
from experiments.comparison.results import LABEL, Row, rows
from experiments.comparison.table import cells, header
from experiments.config.sweep import Sweep
from experiments.errors import ResultsError
from experiments.evidence.published_sweeps import PublishedSweep
from experiments.metrics import columns
from experiments.metrics.catalogue import METRICS, RATES
from experiments.metrics.metric import Better
from experiments.sweep.folder import code_of, load_sweep_copy

Data = dict[str, Any]
_LEFT_OUT = ("metric", "effect", "seeds")  # of the tables of the document
LEVEL = 0.05  # of a finding, after correction


def claim_data(published: PublishedSweep, folder: Path) -> Data:
    """Compare the planners of a sweep as its claim asks.

    Args:
        published: The sweep as it was run.
        folder: Of the sweep; runs beyond those asked for are left out.

    Raises:
        ResultsError: If the folder holds no run of the sweep.
    """
    sweep = published.sweep
    found = _asked_for(rows(folder), sweep)
    claim = load_sweep_copy(folder).claim
    if not found or claim is None:
        raise ResultsError(f"{folder}: has no run of the sweep {sweep.name}")
    lines = compare(found, claimed(claim, claim.baseline))
    primary = [*claim.primary, PENALISED]
    seeds = sweep.all_seeds
    return {
        "name": sweep.name,
        "purpose": sweep.purpose,
        "baseline": claim.baseline,
        "primary": list(claim.primary),
        "seeds": {"first": seeds[0], "last": seeds[-1], "count": len(seeds)},
        "seeds_of_the_file": published.asked_seeds,
        "runs": len(found),
        "runs_of_the_file": published.asked_runs,
        "code": code_of(folder),
        "statuses": _statuses(found),
        "outcomes": {
            label: dict(
                Counter(
                    str(row[columns.STATUS]) for row in found if row[LABEL] == label
                )
            )
            for label in dict.fromkeys(str(row[LABEL]) for row in found)
        },
        "level": LEVEL,
        "tests": sum(line.p_holm is not None for line in lines),
        "findings": [
            finding
            for label in dict.fromkeys(line.label for line in lines)
            for metric in primary
            if (finding := _finding(label, metric, lines)) is not None
        ],
        "tables": [
            _table([line for line in lines if line.metric == metric])
            for metric in primary
            if any(line.metric == metric for line in lines)
        ],
        "lines": [_plain(line) for line in lines],
    }


def _statuses(found: Sequence[Row]) -> dict[str, int]:
    """Count how runs ended."""
    return dict(Counter(str(row[columns.STATUS]) for row in found))


def _asked_for(found: Sequence[Row], sweep: Sweep) -> list[Row]:
    """Leave out the runs of an earlier call with other seeds or planners."""
    seeds = set(sweep.all_seeds)
    labels = {planner.shown for planner in sweep.planners}
    return [
        row
        for row in found
        if row[columns.SEED] in seeds
        and row[LABEL] in labels
        and row[columns.SCENARIO] in sweep.scenarios
        and all(row[key] in values for key, values in sweep.axes.grid.items())
    ]


def _finding(label: str, metric: str, lines: Sequence[Line]) -> Data | None:
    """Count the cells in which a planner is better or worse than the baseline.

    Returns:
        None where the claim has no test.
    """
    own = [x for x in lines if (x.label, x.metric) == (label, metric)]
    tested = [line for line in own if line.p_holm is not None]
    if not tested or better(metric) is Better.NEITHER:
        return None
    sign = -1.0 if better(metric) is Better.LOWER else 1.0
    decided = [
        sign * line.difference.value
        for line in tested
        if line.difference is not None and (line.p_holm or 0.0) <= LEVEL
    ]
    won = sum(value > 0.0 for value in decided)
    lost = sum(value < 0.0 for value in decided)
    return {
        "planner": label,
        "metric": metric,
        "better": won,
        "worse": lost,
        "undecided": len(tested) - won - lost,
        "tested": len(tested),
    }


def better(metric: str) -> Better:
    """Return the direction in which a rate or column improves."""
    column = RATES.get(metric, metric).partition(",")[0]
    return METRICS[column].better


def _table(lines: Sequence[Line]) -> Data:
    """Format the lines of one metric; the metric is the title."""
    names = header(lines)
    kept = [number for number, name in enumerate(names) if name not in _LEFT_OUT]
    return {
        "title": named(lines[0].metric),
        "header": [names[number] for number in kept],
        "rows": [[row[number] for number in kept] for row in cells(lines)],
    }


def _plain(line: Line) -> Data:
    """Convert a line to JSON; an end without bounds is null."""
    return {key: _finite(value) for key, value in asdict(line).items()}


def _finite(value: Any) -> Any:
    """Replace infinite ends, which JSON cannot hold."""
    if isinstance(value, Mapping):
        return {key: _finite(inner) for key, inner in value.items()}
    if isinstance(value, float) and abs(value) == float("inf"):
        return None
    return value
