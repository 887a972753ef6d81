"""Data of the scripts of a sweep page: one value per run in each column."""

from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import Any

import numpy as np

from experiments.comparison.results import LABEL, RUN_ID, Row
from experiments.metrics import columns
from experiments.metrics.catalogue import METRICS
from experiments.report.run.packing import pack_counts, pack_exact

_NO_METRIC = {columns.SCENARIO, columns.PLANNER, columns.SEED, columns.STATUS}


def sweep_data(
    rows: Sequence[Row],
    axes: Sequence[str],
    places: Sequence[str],
    deadlines: Sequence[float],
    planners: Sequence[str] = (),
    settings: Mapping[str, Mapping[str, Any]] = MappingProxyType({}),
) -> dict[str, Any]:
    """Collect the columns of all runs.

    Args:
        rows: Of the results, at least one.
        axes: Names of the sweep's axes.
        places: Of each row, what is to be opened.
        deadlines: Of each row, how long a step lasts [ms].
        planners: Labels in the order in which they are shown; others follow.
        settings: Of planners, in which those of one kind differ: key -> label -> value.

    Returns:
        Plain data for JSON.
    """
    labels = [str(row[LABEL] or row[columns.PLANNER]) for row in rows]
    return {
        "ids": [str(row[RUN_ID]) for row in rows],
        "places": list(places),
        "status": _texts([str(row[columns.STATUS]) for row in rows]),
        "reason": _texts([str(row.get("reason") or "") for row in rows]),
        "label": _texts(labels, planners),
        "axes": [
            _axis("scenario", [str(row[columns.SCENARIO]) for row in rows]),
            {"name": "planner", **_texts(labels, planners)},
            *(_axis(name, [row[name] for row in rows]) for name in axes),
            *(
                {**_axis(key, [values.get(label) for label in labels]), "own": True}
                for key, values in settings.items()
            ),
            _axis("seed", [row[columns.SEED] for row in rows]),
        ],
        "metrics": _metrics(rows),
        "deadline": pack_exact(np.array(deadlines, dtype=np.float64)),
    }


def _metrics(rows: Sequence[Row]) -> list[dict[str, Any]]:
    """Return every numeric column in the order of the catalogue."""
    found = []
    for name, metric in METRICS.items():
        values = [row.get(name) for row in rows]
        numeric = any(isinstance(value, int | float) for value in values)
        if name in _NO_METRIC or not numeric:
            continue
        column = [np.nan if value is None else float(value) for value in values]
        found.append(
            {
                "name": name,
                "label": metric.label,
                "unit": metric.unit,
                "digits": metric.digits,
                "rate": all(isinstance(v, bool) or v is None for v in values),
                "values": pack_exact(np.array(column)),
            }
        )
    return found


def _axis(name: str, values: Sequence[Any]) -> dict[str, Any]:
    """Pack one axis: numbers as numbers, everything else as text."""
    numeric = all(
        isinstance(value, int | float) and not isinstance(value, bool)
        for value in values
    )
    if numeric:
        return {"name": name, "values": pack_exact(np.array(values, dtype=np.float64))}
    return {"name": name, **_texts(["none" if v is None else str(v) for v in values])}


def _texts(values: Sequence[str], first: Sequence[str] = ()) -> dict[str, Any]:
    """Encode texts as indices into the distinct ones: those in `first`, then others."""
    there = set(values)
    known = [text for text in first if text in there]
    numbers = {text: number for number, text in enumerate(known)}
    codes = [numbers.setdefault(value, len(numbers)) for value in values]
    return {"texts": list(numbers), "codes": pack_counts(codes)}
