"""The first lane change: duration, end, and whether it preceded the blockage."""

import numpy as np

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
    """Check whether the ego was in another lane when its front reached the blockage.

    Another lane is `CHANGED` or more from the initial offset. None if nothing closes
    the initial lane; False if the ego never reached the blockage.
    """
    wall = blockage(trace)
    if wall is None:
        return None
    front = trace.steps["centre_s_m"] + float(trace.fact("length_m")) / 2.0
    there = np.flatnonzero(np.ma.filled(front >= wall, False))  # noqa: FBT003
    if there.size == 0:
        return False
    l = trace.steps["l_m"]
    return bool(abs(l[there[0]] - l[0]) >= CHANGED)


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
    ends = np.ma.filled(trace.steps["l_m"][:1], np.nan)
    if trace.obstacles["x_m"].size == 0 or not np.isfinite(ends).any():
        return None
    half = float(trace.fact("width_m")) / 2.0
    s, l, along, across = _on_road(trace)
    closes = (l - across <= ends[0] - half) & (l + across >= ends[0] + half)
    ahead = closes & (s - along > float(trace.steps["centre_s_m"][0]))
    return float((s - along)[ahead].min()) if ahead.any() else None


def _on_road(trace: Trace) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Return (s, l) of each obstacle and its half extents along and across the path."""
    road, bodies = trace.road, trace.obstacles
    dx = bodies["x_m"][:, None] - road["x_m"]
    dy = bodies["y_m"][:, None] - road["y_m"]
    near = np.argmin(np.hypot(dx, dy), axis=1)
    rows = np.arange(near.size)
    heading = road["heading_rad"][near]
    cos, sin = np.cos(heading), np.sin(heading)
    dx, dy = dx[rows, near], dy[rows, near]
    turned = bodies["heading_rad"] - heading
    length, width = bodies["length_m"] / 2.0, bodies["width_m"] / 2.0
    cos_turned, sin_turned = np.abs(np.cos(turned)), np.abs(np.sin(turned))
    return (
        road["s_m"][near] + dx * cos + dy * sin,
        dy * cos - dx * sin,
        length * cos_turned + width * sin_turned + bodies["radius_m"],
        length * sin_turned + width * cos_turned + bodies["radius_m"],
    )
