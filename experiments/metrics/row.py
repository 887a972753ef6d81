"""The results row: every column, in its order."""

from experiments.metrics import (
    columns,
    comfort,
    computation,
    efficiency,
    lane_change,
    safety,
)
from experiments.metrics import followers as traffic_impact
from experiments.metrics import without_ego as counterfactual
from experiments.trace.schema import Table, Trace

Cell = str | int | float | bool | None


def metric_row(trace: Trace, without_ego: Table | None = None) -> dict[str, Cell]:
    """Measure an episode.

    Args:
        trace: What was recorded; at least one step.
        without_ego: The vehicles of the same seed without the ego, if that was run.

    Returns:
        Column name to value, in the order of the results; None where a metric does
        not apply.
    """
    return {
        columns.SCENARIO: str(trace.fact("scenario")),
        columns.PLANNER: str(trace.fact("planner")),
        columns.SEED: int(trace.fact("seed")),
        columns.STATUS: str(trace.fact("status")),
        columns.ARRIVED: efficiency.arrived(trace),
        **_safety(trace),
        columns.TRAVEL_TIME: efficiency.travel_time(trace),
        columns.DISTANCE: efficiency.distance(trace),
        columns.MEAN_SPEED: efficiency.mean_speed(trace),
        **_comfort(trace),
        **_computation(trace),
        columns.REAR_MAX_DECELERATION: traffic_impact.rear_max_deceleration(trace),
        columns.REAR_SPEED_LOSS: traffic_impact.rear_speed_loss(trace),
        columns.LANE_CHANGE_TIME: lane_change.lane_change_time(trace),
        columns.LANE_CHANGE_DONE: lane_change.lane_change_done(trace),
        columns.BEFORE_BLOCKAGE: lane_change.changed_before_blockage(trace),
        **_costs(trace, without_ego),
    }


def _safety(trace: Trace) -> dict[str, Cell]:
    """Measure safety."""
    touched = safety.contacts(trace)
    return {
        columns.COLLISIONS: len(touched),
        columns.FIRST_COLLISION_WITH: touched[0] if touched else None,
        columns.MIN_CLEARANCE: safety.min_clearance(trace),
        columns.MIN_TTC: safety.min_time_to_collision(trace),
        columns.MIN_TIME_HEADWAY: safety.min_time_headway(trace),
        columns.OFF_ROAD_STEPS: safety.off_road_steps(trace),
    }


def _comfort(trace: Trace) -> dict[str, Cell]:
    """Measure comfort."""
    return {
        columns.MEAN_J_JERK: comfort.mean_cost(trace, comfort.JERK_COST),
        columns.MEAN_J_OFFSET: comfort.mean_cost(trace, comfort.OFFSET_COST),
        columns.RMS_JERK: comfort.rms_jerk(trace),
        columns.MAX_ACCELERATION: comfort.max_abs_acceleration(trace),
        columns.MAX_LATERAL_ACCELERATION: comfort.max_abs_lateral_acceleration(trace),
        columns.MAX_CURVATURE: comfort.max_abs_curvature(trace),
        columns.MAX_HEADING: comfort.max_heading(trace),
    }


def _computation(trace: Trace) -> dict[str, Cell]:
    """Measure computation."""
    p50, p95, p99, largest = computation.planning_percentiles(trace, (50, 95, 99, 100))
    return {
        columns.FALLBACK_CYCLES: computation.fallback_cycles(trace),
        columns.CANDIDATES_MEAN: computation.mean_count(trace, "candidates"),
        columns.SURVIVORS_MEAN: computation.mean_count(trace, "survivors"),
        columns.PLANNING_P50: p50,
        columns.PLANNING_P95: p95,
        columns.PLANNING_P99: p99,
        columns.PLANNING_MAX: largest,
        columns.DEADLINE_MISSES: computation.deadline_misses(trace),
        columns.STEPS_PER_SECOND: computation.steps_per_second(trace),
    }


def _costs(trace: Trace, without_ego: Table | None) -> dict[str, Cell]:
    """Measure what the ego cost those behind; None without anyone to compare."""
    found = None if without_ego is None else counterfactual.costs(trace, without_ego)
    if not found:
        return {
            columns.BEHIND_COMPARED: None if found is None else 0,
            columns.BEHIND_DELAY_MEAN: None,
            columns.BEHIND_DELAY_MAX: None,
            columns.BEHIND_SPEED_LOSS: None,
            columns.BEHIND_DECELERATION: None,
        }
    return {
        columns.BEHIND_COMPARED: len(found),
        columns.BEHIND_DELAY_MEAN: sum(cost.delay for cost in found) / len(found),
        columns.BEHIND_DELAY_MAX: max(cost.delay for cost in found),
        columns.BEHIND_SPEED_LOSS: max(cost.speed_loss for cost in found),
        columns.BEHIND_DECELERATION: max(cost.added_deceleration for cost in found),
    }


def row_without_episode(
    scenario: str, planner: str, seed: int, status: str
) -> dict[str, Cell]:
    """Give the row of a run whose process was lost: nothing was measured.

    Args:
        scenario: Name.
        planner: Name.
        seed: Of the run.
        status: How it ended.

    Returns:
        All columns; null where nothing is known.
    """
    known: dict[str, Cell] = {
        columns.SCENARIO: scenario,
        columns.PLANNER: planner,
        columns.SEED: seed,
        columns.STATUS: status,
        columns.ARRIVED: False,
    }
    return {column: known.get(column) for column in columns.ALL_COLUMNS}
