"""The results row: every column of the catalogue, in its order."""

from experiments.metrics import columns
from experiments.metrics.catalogue import ALL_COLUMNS, METRICS
from experiments.metrics.columns import Cell as Cell  # part of the signatures below
from experiments.metrics.metric import MeasuredEpisode
from experiments.trace.schema import Table, Trace


def metric_row(trace: Trace, without_ego: Table | None = None) -> dict[str, Cell]:
    """Compute all metrics of an episode.

    Args:
        trace: The recorded episode, with any number of steps.
        without_ego: The vehicles of the same seed without the ego, if that was run.

    Returns:
        Column name to value, in the order of the results; None where a metric does
        not apply.
    """
    episode = MeasuredEpisode(trace, without_ego)
    return {column: metric.compute(episode) for column, metric in METRICS.items()}


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
