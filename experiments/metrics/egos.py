"""Columns that runs with many egos share with those of one: over all egos together."""

import json

import numpy as np

from experiments.metrics import columns
from experiments.metrics.columns import Cell
from experiments.trace.fleet import FleetTrace
from planner.interface import PlanStatus
from planner.scene import OFF_ROAD_TOLERANCE


def egos_values(trace: FleetTrace) -> dict[str, Cell]:
    """Compute contacts, clearance, fallbacks and planning times of all egos.

    Args:
        trace: Of a run with many egos.

    Returns:
        Column to value; two egos that touch are one collision.
    """
    egos = trace.egos
    pairs = {
        frozenset((name, other))
        for name, contacts in zip(egos["id"], egos["contacts"], strict=True)
        for other in json.loads(contacts)
    }
    clearance = np.ma.filled(egos["clearance_m"], np.inf).min(initial=np.inf)
    planned = trace.planning[np.isfinite(trace.planning)]
    statuses = np.ma.filled(egos["plan_status"], PlanStatus.OK).tolist()
    values: dict[str, Cell] = {
        columns.COLLISIONS: len(pairs),
        columns.MIN_CLEARANCE: float(clearance) if np.isfinite(clearance) else None,
        columns.OFF_ROAD_STEPS: int((egos["off_road_m"] > OFF_ROAD_TOLERANCE).sum()),
        columns.FALLBACK_CYCLES: sum(status != PlanStatus.OK for status in statuses),
    }
    percentiles = {
        columns.PLANNING_CPU_P50: 50,
        columns.PLANNING_CPU_P95: 95,
        columns.PLANNING_CPU_P99: 99,
        columns.PLANNING_CPU_MAX: 100,
    }
    for column, percentile in percentiles.items():
        times = float(np.percentile(planned, percentile)) if planned.size else None
        values[column] = times
    return values
