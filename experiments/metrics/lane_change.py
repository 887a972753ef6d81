"""The first lane change: duration, end, and whether it preceded the blockage."""

import numpy as np

from experiments.metrics.pairs import obstacle_places
from experiments.trace.schema import Trace
from planner.states import FloatArray

CHANGED = 2.5  # three quarters of a lane of 10/3 m [m]
SETTLED = 0.1  # range of the offset after a change [m]
LEFT = 0.1  # farther from the initial offset a change has begun [m]
HELD = 2.0  # time for which it stays there [s]


def lane_change_time(trace: Trace) -> float | None:
    """Return the duration of the first lane change [s]; None without one."""
    found = first_change(trace)
    if found is None:
        return None
    time = trace.steps["time_s"]
    return float(time[found[1]] - time[found[0]])


def lane_change_done(trace: Trace) -> float | None:
    """Return the time from entry to the end of that change [s]; None without one."""
    found = first_change(trace)
    if found is None:
        return None
    time = trace.steps["time_s"]
    return float(time[found[1]] - time[0])


def changed_before_blockage(trace: Trace) -> bool | None:
    """Check whether the ego's body was aside when its front reached the blockage.

    Aside means that the point of its rectangle nearest to the blocking body is beyond
    that body's side. None if nothing closes the initial lane; False if the ego never
    reached the blockage.
    """
    found = _blocking_body(trace)
    if found is None:
        return None
    wall, centre, reach = found
    length, width = (float(trace.fact(name)) for name in ("length_m", "width_m"))
    steps = trace.steps
    turned = np.ma.filled(steps["heading_error_rad"], 0.0)
    along = (length * np.abs(np.cos(turned)) + width * np.abs(np.sin(turned))) / 2.0
    front = steps["centre_s_m"] + along
    there = np.flatnonzero(np.ma.filled(front >= wall, False))  # noqa: FBT003
    if there.size == 0:
        return False
    k = int(there[0])
    across = (length * abs(np.sin(turned[k])) + width * abs(np.cos(turned[k]))) / 2.0
    return bool(abs(steps["centre_l_m"][k] - centre) - across >= reach)


def first_change(trace: Trace) -> tuple[int, int] | None:
    """Find the steps in which the first lane change begins and ends.

    It ends when the offset is `CHANGED` or more from the initial one and stays within
    `SETTLED` for `HELD`; it began when the offset was last within `LEFT` of the
    initial one.
    """
    time, l = (np.ma.getdata(trace.steps[name]) for name in ("time_s", "l_m"))
    if time.size == 0 or np.ma.getmaskarray(trace.steps["l_m"]).any():
        return None
    away = np.abs(l - l[0])
    for end in np.flatnonzero(away >= CHANGED):
        after = (time >= time[end]) & (time <= time[end] + HELD)
        if time[-1] >= time[end] + HELD and np.ptp(l[after]) <= SETTLED:
            return int(np.flatnonzero(away[:end] <= LEFT)[-1]), int(end)
    return None


def blockage(trace: Trace) -> float | None:
    """Find where the ego's initial lane is closed [m]; None if nowhere.

    That is the near end of the first obstacle ahead that covers the ego's full width
    at the initial offset.
    """
    found = _blocking_body(trace)
    return None if found is None else found[0]


def _blocking_body(trace: Trace) -> tuple[float, float, float] | None:
    """Return (near end, offset, half extent across) of what closes the lane [m]."""
    ends = np.ma.filled(trace.steps["l_m"][:1], np.nan)
    if trace.obstacles["x_m"].size == 0 or not np.isfinite(ends).any():
        return None
    half = float(trace.fact("width_m")) / 2.0
    s, l, along, across = _on_road(trace)
    closes = (l - across <= ends[0] - half) & (l + across >= ends[0] + half)
    ahead = closes & (s - along > float(trace.steps["centre_s_m"][0]))
    if not ahead.any():
        return None
    first = int(np.argmin(np.where(ahead, s - along, np.inf)))
    return float((s - along)[first]), float(l[first]), float(across[first])


def _on_road(trace: Trace) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Return (s, l) of each obstacle and its half extents along and across the path."""
    bodies = trace.obstacles
    s, l, turned = obstacle_places(trace)
    length, width = bodies["length_m"] / 2.0, bodies["width_m"] / 2.0
    cos, sin = np.abs(np.cos(turned)), np.abs(np.sin(turned))
    return (
        s,
        l,
        length * cos + width * sin + bodies["radius_m"],
        length * sin + width * cos + bodies["radius_m"],
    )
