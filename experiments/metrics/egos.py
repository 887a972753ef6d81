"""Columns that runs with many egos share with those of one: over all egos together."""

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
    egos = [one for _, one in trace.egos]
    pairs = {frozenset((one.id, other)) for one in egos for other in one.contacts}
    clearance = min((one.clearance for one in egos), default=np.inf)
    planned = np.array([one.planning_ms for one in egos])
    planned = planned[np.isfinite(planned)]
    values: dict[str, Cell] = {
        columns.COLLISIONS: len(pairs),
        columns.MIN_CLEARANCE: float(clearance) if np.isfinite(clearance) else None,
        columns.OFF_ROAD_STEPS: sum(x.off_road > OFF_ROAD_TOLERANCE for x in egos),
        columns.FALLBACK_CYCLES: sum(x.status not in ("", PlanStatus.OK) for x in egos),
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
