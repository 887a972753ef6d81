"""Metrics in words: what a column is called on a page, its unit and its digits."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from experiments.metrics import columns

# column -> (words, unit, digits); in the order shown
SHOWN = {
    columns.TRAVEL_TIME: ("travel time", "s", 1),
    columns.DISTANCE: ("distance", "m", 1),
    columns.MEAN_SPEED: ("mean speed", "m/s", 1),
    columns.COLLISIONS: ("collisions", "", 0),
    columns.OFF_ROAD_STEPS: ("steps off the road", "", 0),
    columns.MIN_CLEARANCE: ("least clearance", "m", 2),
    columns.MIN_TTC: ("least time to collision", "s", 1),
    columns.MIN_TIME_HEADWAY: ("least time headway", "s", 2),
    columns.RMS_JERK: ("RMS jerk", "m/s³", 2),
    columns.MAX_ACCELERATION: ("hardest speeding or braking", "m/s²", 2),
    columns.MAX_LATERAL_ACCELERATION: ("hardest turning", "m/s²", 2),
    columns.REAR_MAX_DECELERATION: ("hardest braking behind the ego", "m/s²", 2),
    columns.FALLBACK_CYCLES: ("fallback cycles", "", 0),
    columns.CANDIDATES_MEAN: ("candidates a cycle", "", 0),
    columns.SURVIVORS_MEAN: ("of these allowed", "", 0),
    columns.PLANNING_P50: ("planning, median", "ms", 2),
    columns.PLANNING_P99: ("planning, 99 %", "ms", 2),
    columns.STEPS_PER_SECOND: ("speed of the loop", "steps/s", 0),
}

_MORE = {
    columns.MEAN_J_JERK: ("mean jerk cost", "m²/s⁵", 3),
    columns.MEAN_J_OFFSET: ("mean offset cost", "m²", 3),
    columns.MAX_CURVATURE: ("largest curvature", "1/m", 4),
    columns.MAX_HEADING: ("largest angle to the path", "rad", 3),
    columns.PLANNING_P95: ("planning, 95 %", "ms", 2),
    columns.PLANNING_MAX: ("planning, longest", "ms", 2),
    columns.DEADLINE_MISSES: ("cycles longer than a step", "", 0),
    columns.REAR_SPEED_LOSS: ("speed loss behind the ego", "m/s", 2),
    columns.LANE_CHANGE_TIME: ("lane change takes", "s", 1),
    columns.LANE_CHANGE_DONE: ("lane change done", "s", 1),
    columns.BEFORE_BLOCKAGE: ("changed before the blockage", "", 0),
    columns.FIRST_COLLISION_WITH: ("first collision with", "", 0),
    columns.BEHIND_COMPARED: ("vehicles behind compared", "", 0),
    columns.BEHIND_DELAY_MEAN: ("delay behind, mean", "s", 2),
    columns.BEHIND_DELAY_MAX: ("delay behind, largest", "s", 2),
    columns.BEHIND_SPEED_LOSS: ("speed loss behind, compared", "m/s", 2),
    columns.BEHIND_DECELERATION: ("added braking behind", "m/s²", 2),
}
_IDENTITY = (columns.SCENARIO, columns.PLANNER, columns.SEED, columns.STATUS)


@dataclass(frozen=True, slots=True)
class Metric:
    """One metric of one run as text."""

    column: str
    words: str
    value: str
    unit: str


def words_of(column: str) -> tuple[str, str, int]:
    """Give (words, unit, digits) of a column; an unknown one stands for itself."""
    return SHOWN.get(column) or _MORE.get(column) or (column, "", 3)


def metric_table(row: Mapping[str, Any]) -> list[Metric]:
    """Write the metrics of a results row, the usual ones first.

    Metrics that do not apply are left out.
    """
    order = [*SHOWN, *(key for key in row if key not in SHOWN)]
    return [
        _metric(key, row[key])
        for key in order
        if key not in (*_IDENTITY, columns.ARRIVED) and row.get(key) is not None
    ]


def _metric(column: str, value: Any) -> Metric:
    """Write one."""
    words, unit, digits = words_of(column)
    if isinstance(value, bool):
        return Metric(column, words, "yes" if value else "no", unit)
    if isinstance(value, int | float):
        return Metric(column, words, f"{value:.{digits}f}", unit)
    return Metric(column, words, str(value), unit)
