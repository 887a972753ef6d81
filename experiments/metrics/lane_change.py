"""The first lane change: how long it took, when it was over, and whether in time."""

import numpy as np

from experiments.trace.schema import Trace
from planner.states import FloatArray

CHANGED = 2.5  # three quarters of a lane of 10/3 m [m]
SETTLED = 0.1  # [m]
LEFT = 0.1  # [m]
HELD = 2.0  # [s]


def lane_change_time(trace: Trace) -> float | None:
    """Duration of the first lane change [s]; None without one."""
    found = first_change(trace)
    if found is None:
        return None
    time = trace.steps["time_s"]
    return float(time[found[1]] - time[found[0]])


def lane_change_done(trace: Trace) -> float | None:
    """Time from entering to the end of the first lane change [s]; None without one."""
    found = first_change(trace)
    if found is None:
        return None
    time = trace.steps["time_s"]
    return float(time[found[1]] - time[0])


def changed_before_blockage(trace: Trace) -> bool | None:
    """Tell whether the ego was in another lane when its front came to the blockage.

    Another lane is `CHANGED` or more from the offset at the start. None if nothing
    closes the lane in which it starts; False if it never came there.
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
    """Find the steps in which the first lane change begins and is over.

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
            return int(np.flatnonzero(away[:end] <= LEFT)[-1]), int(end)
    return None


def blockage(trace: Trace) -> float | None:
    """Find where the lane in which the ego starts is closed [m]; None if nowhere.

    That is the near end of the first obstacle ahead that is as wide as the ego and
    stands right in its way at the offset of the start.
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
    """Give (s, l) of each obstacle and its half extents along and across the path."""
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
