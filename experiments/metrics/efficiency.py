"""Efficiency: how far and how fast the ego came."""

import numpy as np

from experiments.cosim.records import EpisodeStatus
from experiments.trace import Trace

CHANGED = 2.5  # three quarters of a lane of 10/3 m [m]
SETTLED = 0.1  # [m]
LEFT = 0.1  # [m]
HELD = 2.0  # [s]


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


def lane_change_time(trace: Trace) -> float | None:
    """Duration of the first lane change [s]; None without one.

    It is over when the offset is `CHANGED` or more from that at the start and stays
    within `SETTLED` for `HELD`; it began when the offset last was within `LEFT` of
    that at the start.
    """
    time, l = (np.ma.getdata(trace.steps[name]) for name in ("time_s", "l_m"))
    if time.size == 0 or np.ma.getmaskarray(trace.steps["l_m"]).any():
        return None
    away = np.abs(l - l[0])
    for end in np.flatnonzero(away >= CHANGED):
        after = (time >= time[end]) & (time <= time[end] + HELD)
        if time[-1] >= time[end] + HELD and np.ptp(l[after]) <= SETTLED:
            begin = np.flatnonzero(away[:end] <= LEFT)[-1]
            return float(time[end] - time[begin])
    return None


def mean_speed(trace: Trace) -> float | None:
    """Distance over duration [m/s]; None for an episode of one step."""
    lasted = duration(trace)
    return distance(trace) / lasted if lasted > 0.0 else None
