"""Efficiency: travel time, distance, mean speed."""

from typing import Final

import numpy as np

from experiments.trace.schema import Trace
from planner.states import FloatArray

SPEEDING: Final = 0.5  # over a limit from which on it counts [m/s]

# `EpisodeStatus.ARRIVED`, spelt out: metrics do not import the co-simulation.
ARRIVED: Final = "arrived"


def arrived(trace: Trace) -> bool:
    """Check whether the ego reached its goal."""
    return bool(trace.fact("status") == ARRIVED)


def travel_time(trace: Trace) -> float | None:
    """Return the time from entry to arrival [s]; None unless the ego arrived."""
    return duration(trace) if arrived(trace) else None


def duration(trace: Trace) -> float:
    """Return the time from the first to the last step [s]; 0 without steps."""
    time = trace.steps["time_s"]
    return float(time[-1] - time[0]) if len(time) else 0.0


def distance(trace: Trace) -> float:
    """Return the path length of the rear axle, as straight pieces [m]."""
    dx, dy = np.diff(trace.steps["x_m"]), np.diff(trace.steps["y_m"])
    return float(np.hypot(dx, dy).sum())


def mean_speed(trace: Trace) -> float | None:
    """Return distance over duration [m/s]; None for an episode of one step."""
    lasted = duration(trace)
    return distance(trace) / lasted if lasted > 0.0 else None


def speeding_time(trace: Trace) -> float | None:
    """Return how long a speed limit was exceeded [s]; None without limits."""
    excess = over_the_limit(trace)
    if excess is None:
        return None
    return float(np.count_nonzero(excess > SPEEDING) * trace.fact("step_s"))


def max_speeding(trace: Trace) -> float | None:
    """Return by how much a limit was exceeded at most [m/s]; None without limits."""
    excess = over_the_limit(trace)
    return None if excess is None or not excess.size else max(0.0, float(excess.max()))


def over_the_limit(trace: Trace) -> FloatArray | None:
    """Compare the speed with the limit at the front bumper, (n_steps,) [m/s]."""
    table = trace.speed_limits
    limits = np.ma.filled(table["limit_mps"], np.inf)
    if not np.isfinite(limits).any():
        return None
    reach = float(trace.fact("length_m") - trace.fact("rear_overhang_m"))
    front = np.ma.filled(trace.steps["s_m"], np.nan) + reach
    place = np.searchsorted(np.ma.getdata(table["s_m"]), front, side="right") - 1
    excess = np.ma.getdata(trace.steps["speed_mps"]) - limits[np.maximum(place, 0)]
    return np.asarray(np.where(np.isnan(front), 0.0, excess))
