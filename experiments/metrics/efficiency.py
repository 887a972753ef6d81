"""Efficiency: travel time, distance, mean speed."""

from typing import Final

import numpy as np

from experiments.trace.schema import Trace

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
