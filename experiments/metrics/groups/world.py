"""What of the world a row must say."""

import math
from typing import Final

from experiments.metrics import columns
from experiments.metrics.metric import CellKind, MeasuredEpisode, Metric


def _importance_weight(episode: MeasuredEpisode) -> float | None:
    """Return the likelihood ratio of a run whose errors were drawn more often."""
    found = episode.trace.weights["log_weight"]
    return math.exp(float(found[-1])) if len(found) else None


WORLD: Final = (
    Metric(
        column=columns.RECORDED_TRAFFIC,
        label="traffic is a recording",
        kind=CellKind.FLAG,
        compute=lambda e: True if e.recorded_traffic else None,
        formula="world commonroad: the others follow a recording and do not react to "
        "the ego; null in other worlds",
    ),
    Metric(
        column=columns.IMPORTANCE_WEIGHT,
        label="importance weight",
        compute=_importance_weight,
        formula="how much likelier the drivers' errors are with the rates asked for "
        "than with those of `traffic.drivers.near_ego_factor`; null without one",
        digits=4,
    ),
)
