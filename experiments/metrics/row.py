"""The results row: every column of the catalogue, in its order."""

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from experiments.config.self_driven import SELF_DRIVEN
from experiments.errors import ResultsError
from experiments.metrics import columns
from experiments.metrics.catalogue import ALL_COLUMNS, METRICS, REACTIONS
from experiments.metrics.columns import Cell as Cell  # part of the signatures below
from experiments.metrics.egos import egos_values
from experiments.metrics.fleet_catalogue import fleet_values
from experiments.metrics.metric import MeasuredEpisode
from experiments.metrics.traffic_flow import FleetMeasurement
from experiments.storage.json_files import read_json, short, short_text
from experiments.storage.run_files import METRICS as METRICS_FILE
from experiments.trace.schema import Table, Trace
from planner.vehicle import VehicleLimits


def metric_row(
    trace: Trace,
    without_ego: Table | None = None,
    placebo: Table | None = None,
    other_placebo: Table | None = None,
    *,
    limits: VehicleLimits | None = None,
    recorded_traffic: bool = False,
) -> dict[str, Cell]:
    """Compute all metrics of an episode.

    Args:
        trace: The recorded episode, with any number of steps.
        without_ego: The vehicles of the same seed without the ego, if that was run.
        placebo: The same with other random numbers.
        other_placebo: And with others again.
        limits: Of the ego, if they are known.
        recorded_traffic: Whether the others follow a recording: what they do is then
            nothing that the ego caused.

    Returns:
        Column name to value, in the order of the results; None where a metric does
        not apply.
    """
    placebos = (placebo, other_placebo)
    episode = MeasuredEpisode(trace, without_ego, limits, placebos, recorded_traffic)
    self_driven = trace.fact("planner") in SELF_DRIVEN
    return {
        column: None
        if (self_driven and metric.of_planner)
        or (recorded_traffic and column in REACTIONS)
        else _finite(metric.compute(episode))
        for column, metric in METRICS.items()
    }


def fleet_row(identity: Mapping[str, Cell], found: FleetMeasurement) -> dict[str, Cell]:
    """Compute all metrics of a run with many egos.

    Args:
        identity: Scenario, planner, seed, status, and whether it went well.
        found: The run.

    Returns:
        As `metric_row`; what is of a single ego is None.
    """
    known = {**identity, **egos_values(found.trace), **fleet_values(found)}
    return {column: _finite(known.get(column)) for column in ALL_COLUMNS}


def read_row(run: Path) -> dict[str, Cell]:
    """Read the results row of a run folder; columns that it lacks are None.

    Raises:
        ResultsError: If its file is missing or damaged, or has columns that are not in
            the catalogue.
    """
    file = run / METRICS_FILE
    content = read_json(file)
    check_row(content, file)
    return {column: content.get(column) for column in ALL_COLUMNS}


def check_row(content: Mapping[str, Any], file: Path) -> None:
    """Raise a ResultsError unless a mapping is a row of the results."""
    unknown = next((key for key in content if key not in METRICS), None)
    if unknown is not None:
        raise ResultsError(
            f"{file}: {short_text(unknown)} is not a metric of this version"
        )
    for column, metric in METRICS.items():
        value = content.get(column)
        if not metric.holds(value):
            raise ResultsError(
                f"{file}: is damaged: {column}: is {short(value)}; "
                f"allowed: {metric.kind}"
            )


def _finite(value: Cell) -> Cell:
    """Return a value, None in the place of NaN and of infinity."""
    return None if isinstance(value, float) and not math.isfinite(value) else value


def row_without_episode(
    scenario: str, planner: str, seed: int, status: str
) -> dict[str, Cell]:
    """Return the row of a run that was lost before anything was measured.

    Args:
        scenario: Name.
        planner: Name.
        seed: Of the run.
        status: How it ended.

    Returns:
        All columns; None where nothing is known.
    """
    known: dict[str, Cell] = {
        columns.SCENARIO: scenario,
        columns.PLANNER: planner,
        columns.SEED: seed,
        columns.STATUS: status,
        columns.ARRIVED: False,
    }
    return {column: known.get(column) for column in ALL_COLUMNS}
