"""Efficiency: how far and how fast the ego came."""

import numpy as np

from experiments.cosim.records import EpisodeStatus
from experiments.trace.schema import Trace


def arrived(trace: Trace) -> bool:
    """Tell whether the ego reached its goal."""
    return bool(trace.fact("status") == EpisodeStatus.ARRIVED)


def travel_time(trace: Trace) -> float | None:
    """Time from entering to arriving [s]; None unless the ego arrived."""
    return duration(trace) if arrived(trace) else None


def duration(trace: Trace) -> float:
    """Time from the first to the last step [s], 0 without any."""
    time = trace.steps["time_s"]
    return float(time[-1] - time[0]) if len(time) else 0.0


def distance(trace: Trace) -> float:
    """Length of the way that the rear axle took, as straight pieces [m]."""
    dx, dy = np.diff(trace.steps["x_m"]), np.diff(trace.steps["y_m"])
    return float(np.hypot(dx, dy).sum())


def mean_speed(trace: Trace) -> float | None:
    """Distance over duration [m/s]; None for an episode of one step."""
    lasted = duration(trace)
    return distance(trace) / lasted if lasted > 0.0 else None
