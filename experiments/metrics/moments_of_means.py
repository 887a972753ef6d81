"""Where a mean, a share or a percentile is made: the step that says most about it.

A mean has no step of its own. Its moment is the step that moves it most towards the
worse; that of a share or a count, the first step that counts; that of a percentile,
the cycle whose time is nearest to it.
"""

import json
from collections.abc import Callable, Mapping
from typing import Final

import numpy as np
from numpy.typing import NDArray

from experiments.metrics import columns, comfort, computation, efficiency
from experiments.metrics.tracking import NEAR, nearest_errors, tracked, unseen
from experiments.trace.schema import Trace
from planner.interface import PlanStatus
from planner.states import FloatArray

Finder = Callable[[Trace], int | None]  # row of the steps


def largest(values: object) -> int | None:
    """Return the row of the largest value, masked and NaN aside; None without any."""
    masked = np.ma.asarray(values).astype(np.float64)
    numbers: FloatArray = np.ma.filled(masked, np.nan)
    return None if np.isnan(numbers).all() else int(np.nanargmax(numbers))


def first(marks: object) -> int | None:
    """Return the first marked row, masked ones aside; None without any."""
    found = np.flatnonzero(np.ma.filled(np.ma.asarray(marks), fill_value=0))
    return int(found[0]) if found.size else None


def without_first_cycle(
    trace: Trace, clock: computation.PlanningClock
) -> NDArray[np.float64]:
    """Return the planning times, NaN in the first cycle and without one, (n_steps,)."""
    times: FloatArray = np.ma.filled(trace.timing[clock].astype(np.float64), np.nan)
    there = np.flatnonzero(np.isfinite(times))
    times[there[:1]] = np.nan
    return times


def _jerk(trace: Trace) -> int | None:
    """Find the step before the largest jerk of `rms_jerk_mps3`."""
    along = np.diff(trace.steps["acceleration_mps2"])
    sideways = np.diff(comfort.lateral_acceleration(trace.steps))
    return largest(np.ma.hypot(along, sideways) / np.diff(trace.steps["time_s"]))


def _window_jerk(of: Callable[[Trace], object]) -> Finder:
    """Return a function that finds the begin of the window of the largest jerk."""

    def find(trace: Trace) -> int | None:
        change = comfort.changes_in_window(trace, np.ma.asarray(of(trace)))
        return None if change is None else largest(np.ma.abs(change))

    return find


def _cost(term: str) -> Finder:
    """Return a function that finds the cycle that selects at the highest cost."""

    def find(trace: Trace) -> int | None:
        cells = trace.steps["costs"]
        costs = [json.loads(cell) for cell in np.ma.filled(cells, "{}")]
        values = np.array([cost.get(term, np.nan) for cost in costs], dtype=np.float64)
        return largest(np.where(np.isfinite(values), values, np.nan))

    return find


def _percentile(percentile: float, clock: computation.PlanningClock) -> Finder:
    """Return a function that finds the cycle nearest to a percentile."""

    def find(trace: Trace) -> int | None:
        value = computation.planning_percentile(trace, percentile, clock)
        if value is None:
            return None
        return largest(-np.abs(without_first_cycle(trace, clock) - value))

    return find


def _reversal(trace: Trace) -> int | None:
    """Find the first step in which the lateral acceleration has changed its side."""
    sideways = np.ma.getdata(comfort.lateral_acceleration(trace.steps))
    felt = np.flatnonzero(np.abs(sideways) > comfort.FELT)
    turned = np.flatnonzero(np.diff(np.sign(sideways[felt])))
    return int(felt[turned[0] + 1]) if turned.size else None


def _speeding(trace: Trace) -> int | None:
    """Find the first step that counts for `speeding_s`."""
    excess = efficiency.over_the_limit(trace)
    return None if excess is None else first(excess > efficiency.SPEEDING)


def _unseen(trace: Trace) -> int | None:
    """Find the first step in which a vehicle near the ego was not believed in."""
    missed = unseen(trace, NEAR).values()
    return min((rows[0] for rows in missed), default=None)


def _least(name: str) -> Finder:
    """Return a function that finds the step with the least value of a column."""
    return lambda trace: largest(-trace.steps[name].astype(np.float64))


def _tracking_error(key: str) -> Finder:
    """Return a function that finds the largest magnitude of a tracking error."""
    return lambda trace: largest(np.abs(tracked(trace, key)))


def _command_jerk(trace: Trace) -> int | None:
    """Find the step before the largest change of the drive command."""
    return largest(np.abs(np.diff(tracked(trace, "drive_command_mps2"))))


def _emergency(trace: Trace) -> int | None:
    """Find the first cycle that brakes in an emergency."""
    return first(trace.steps["plan_status"] == PlanStatus.EMERGENCY_BRAKING)


_CPU, _WALL = computation.PlanningClock.CPU, computation.PlanningClock.WALL

MOMENTS_OF_MEANS: Final[Mapping[str, Finder]] = {
    columns.MEAN_SPEED: _least("speed_mps"),
    columns.SPEEDING: _speeding,
    columns.MEAN_J_JERK: _cost(comfort.JERK_COST),
    columns.MEAN_J_OFFSET: _cost(comfort.OFFSET_COST),
    columns.RMS_JERK: _jerk,
    columns.LATERAL_DISCOMFORT: lambda trace: first(
        comfort.uncomfortable_sideways(trace)
    ),
    columns.BRAKING_DISCOMFORT: lambda trace: first(
        comfort.uncomfortable_braking(trace)
    ),
    columns.MAX_LATERAL_JERK: _window_jerk(
        lambda trace: comfort.lateral_acceleration(trace.steps)
    ),
    columns.MAX_TANGENTIAL_JERK: _window_jerk(
        lambda trace: trace.steps["acceleration_mps2"]
    ),
    columns.LATERAL_REVERSALS: _reversal,
    columns.EMERGENCY_CYCLES: _emergency,
    columns.CANDIDATES_MEAN: _least("candidates"),
    columns.FEASIBLE_MEAN: _least("survivors"),
    columns.PLANNING_CPU_P50: _percentile(50.0, _CPU),
    columns.PLANNING_CPU_P95: _percentile(95.0, _CPU),
    columns.PLANNING_CPU_P99: _percentile(99.0, _CPU),
    columns.PLANNING_P50: _percentile(50.0, _WALL),
    columns.PLANNING_P95: _percentile(95.0, _WALL),
    columns.PLANNING_P99: _percentile(99.0, _WALL),
    columns.TRACKING_LATERAL_RMS: _tracking_error("lateral_error_m"),
    columns.TRACKING_LONGITUDINAL_RMS: _tracking_error("behind_m"),
    columns.COMMAND_JERK: _command_jerk,
    columns.NEAREST_ERROR: lambda trace: largest(nearest_errors(trace)),
    columns.UNSEEN_NEAR: _unseen,
}
