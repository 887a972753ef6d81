"""A run for figures: its trace, its map, and a few moments."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from experiments.errors import ResultsError
from experiments.metrics.moments import moments
from experiments.storage.atomic_folder import require_there
from experiments.trace.files import read_trace, require_single_ego
from experiments.trace.road_map import RoadMap, read_map
from experiments.trace.schema import Column, Table, Trace
from planner.states import BoolArray, FloatArray

# Where along the driven distance the scene is shown; the end itself has no plan.
SHOWN_AT = (0.0, 0.3, 0.6, 0.9)


@dataclass(frozen=True, slots=True, eq=False)
class RunRecord:
    """Contents of a run folder, and the steps at which the scene is shown."""

    trace: Trace
    road_map: RoadMap
    moments: tuple[int, ...]  # indices of steps, growing

    @property
    def time(self) -> FloatArray:
        """Time of each step since the ego entered, (n_steps,) [s]."""
        return numbers(self.trace.steps["time_s"])

    def at(self, table: Table, step: int) -> BoolArray:
        """Mark the rows of `vehicles`, `plans` or `signals` that belong to a step."""
        return np.asarray(table["index"] == self.trace.steps["index"][step])


def read_run(folder: Path) -> RunRecord:
    """Read a run folder.

    Raises:
        ResultsError: If it is not a run folder, is damaged, or holds no steps.
    """
    require_there(folder)
    require_single_ego(folder)
    trace = read_trace(folder)
    if len(trace.steps["index"]) == 0:
        raise ResultsError(
            f"{folder}: holds no steps; the run ended before the first one: "
            f"{trace.fact('reason')}"
        )
    return RunRecord(trace, read_map(folder), _moments(trace))


def numbers(column: Column) -> FloatArray:
    """Convert a column to plain float64, NaN where masked."""
    filled: FloatArray = np.ma.filled(column.astype(np.float64), np.nan)
    return filled


def metric_times(trace: Trace, manifest: Mapping[str, Any]) -> dict[str, float]:
    """Return when each metric that has a moment took its value [s].

    Args:
        trace: With at least one step.
        manifest: Of its run.
    """
    time = numbers(trace.steps["time_s"])
    found = {**moments(trace), **(manifest.get("moments") or {})}
    return {k: float(time[row]) for k, row in found.items() if 0 <= row < time.size}


def _moments(trace: Trace) -> tuple[int, ...]:
    """Spread moments over the driven distance, or over time if the ego never moved."""
    x, y = numbers(trace.steps["x_m"]), numbers(trace.steps["y_m"])
    driven = np.concatenate(([0.0], np.cumsum(np.hypot(np.diff(x), np.diff(y)))))
    if driven[-1] < 1.0:
        driven = np.linspace(0.0, 1.0, driven.size)
    found = np.searchsorted(driven, np.array(SHOWN_AT) * driven[-1])
    return tuple(sorted({int(step) for step in found}))
