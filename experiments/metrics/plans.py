"""Checks of every recorded plan, driven or not."""

import numpy as np
from numpy.typing import NDArray

from experiments.trace.schema import Table, Trace
from planner.reference_path.path import ReferencePath
from planner.scene import OFF_ROAD_TOLERANCE
from planner.states import FloatArray

PATH_COLUMNS = (
    "s_m",
    "x_m",
    "y_m",
    "heading_rad",
    "curvature_1pm",
    "curvature_rate_1pm2",
)


def off_road_plans(trace: Trace) -> int | None:
    """Count the plans in which the body somewhere leaves the road.

    At each point of a plan up to the end of the recorded road, the four corners of the
    ego's rectangle and the middles of its sides are compared with the road's edges;
    more than 1 cm beyond counts, as in the loop's check of what is driven. None
    without plans.
    """
    found = plans_off_the_road(trace)
    return None if found is None else int(found.size)


def plans_off_the_road(trace: Trace) -> NDArray[np.int64] | None:
    """Return the indices of the steps whose plans `off_road_plans` counts."""
    plans = trace.plans
    if not len(plans["index"]) or not len(trace.path["s_m"]):
        return None
    path = ReferencePath(*(_numbers(trace.path, name) for name in PATH_COLUMNS))
    x, y, heading, s = (
        _numbers(plans, name) for name in ("x_m", "y_m", "heading_rad", "s_m")
    )
    edge = _numbers(trace.bounds, "s_m")
    last = min(float(path.s[-1]), _end_of_road(trace))
    known = np.isfinite(s) & (s <= last)
    rear = float(trace.fact("rear_overhang_m"))
    reach = float(trace.fact("length_m")) - rear
    half = float(trace.fact("width_m")) / 2.0
    over = np.zeros(s.size, dtype=bool)
    cos, sin = np.cos(heading), np.sin(heading)
    for along in (-rear, 0.5 * (reach - rear), reach):
        for across in (-half, half):
            at, l = path.project(
                (x + along * cos - across * sin)[known],
                (y + along * sin + across * cos)[known],
                near=s[known],
            )
            left = np.interp(at, edge, _numbers(trace.bounds, "left_m"))
            right = np.interp(at, edge, _numbers(trace.bounds, "right_m"))
            beyond = np.maximum(l - left, right - l)
            over[known] |= (beyond > OFF_ROAD_TOLERANCE) & (at <= last)
    return np.unique(np.ma.getdata(plans["index"])[over])


def _end_of_road(trace: Trace) -> float:
    """Return the last arc length at which the road is recorded [m]."""
    road = _numbers(trace.road, "s_m")
    return float(road[-1]) if road.size else float("inf")


def _numbers(table: Table, name: str) -> FloatArray:
    """Return a column of numbers; null is NaN."""
    numbers: FloatArray = np.ma.filled(table[name], np.nan)
    return numbers
