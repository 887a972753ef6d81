"""Curves over time of a run page."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from experiments.metrics.comfort import (
    front_wheel_angle,
    lateral_acceleration,
)
from experiments.metrics.computation import TO_MS, deadline_misses
from experiments.metrics.pairs import neighbours
from experiments.metrics.safety import TTC_HORIZON, time_to_contact
from experiments.metrics.tracking import nearest_errors, tracked
from experiments.report.run_reader import numbers
from experiments.trace.schema import Trace
from planner.states import FloatArray

MAX_SHOWN_CLEARANCE = 15.0  # farther bodies do not matter to the ego [m]
# Axes end at multiples of quantiles where single values lie far outside: a cycle that
# compiles takes a thousand times longer than others, and an ego that comes to a stand,
# or brakes in an emergency, changes its acceleration within one step.
SHOWN_PLANNING = 1.3
SHOWN_JERK = 1.5
FAR_OUT = 3.0  # times the 98 % quantile


@dataclass(frozen=True, slots=True, eq=False)
class TimeSeries:
    """One line of a chart; NaN where undefined."""

    name: str
    values: FloatArray  # (n_steps,)
    style: str = "main"  # main, second, limit


@dataclass(frozen=True, slots=True, eq=False)
class TimeCurve:
    """One chart over time; the summary describes the first series."""

    title: str
    unit: str
    digits: int
    series: tuple[TimeSeries, ...]
    note: str = ""  # beside the title
    low: float | None = None  # ends of the axis, where it should not fit the values
    high: float | None = None

    def words(self, time: FloatArray) -> str:
        """Summarise the chart in a sentence for screen readers."""
        values = self.series[0].values
        there = np.isfinite(values)
        if not there.any():
            return "no value in this run"
        least = int(np.nanargmin(values))
        most = int(np.nanargmax(values))
        unit = f" {self.unit}" if self.unit else ""
        return (
            f"least {values[least]:.{self.digits}f}{unit} at {time[least]:.1f} s, "
            f"largest {values[most]:.{self.digits}f}{unit} at {time[most]:.1f} s, "
            f"mean {values[there].mean():.{self.digits}f}{unit}"
        )


def curves(trace: Trace) -> list[TimeCurve]:
    """Return all curves of a run in display order.

    Args:
        trace: With at least one step.

    Returns:
        Curves with values for each step.
    """
    found = [make(trace) for make in _CURVES]
    if len(trace.tracking["index"]):
        found += [make(trace) for make in _TRACKING_CURVES]
    if len(trace.perceived["index"]):
        found.append(_perception(trace))
    return found


def time_to_collision(trace: Trace) -> FloatArray:
    """Compute the smallest time to collision in each step, (n_steps,) [s].

    As `min_ttc_s` of the results row; NaN where it is above 10 s.
    """
    pairs = neighbours(trace)
    least = np.full(len(trace.steps["index"]), np.inf)
    row = np.searchsorted(trace.steps["index"], pairs.index)
    np.minimum.at(least, row, time_to_contact(pairs))
    return np.where(least <= TTC_HORIZON, least, np.nan)


def jerk(trace: Trace) -> tuple[FloatArray, FloatArray]:
    """Return (tangential, lateral) jerk from each step to the next, (n_steps,) [m/s³].

    As `rms_jerk_mps3` of the results row; NaN in the last step.
    """
    if len(trace.steps["index"]) < 2:  # noqa: PLR2004, a difference takes two
        nothing = np.full(len(trace.steps["index"]), np.nan)
        return nothing, nothing
    step = np.diff(numbers(trace.steps["time_s"]))
    rates = [
        np.append(np.diff(numbers(values)) / step, np.nan)
        for values in (
            trace.steps["acceleration_mps2"],
            lateral_acceleration(trace.steps),
        )
    ]
    return rates[0], rates[1]


def _speed(trace: Trace) -> TimeCurve:
    """Build the chart of speed and target speed."""
    speed = numbers(trace.steps["speed_mps"])
    target = np.full(speed.size, float(trace.fact("target_speed_mps")))
    series = TimeSeries("speed", speed), TimeSeries("target", target, "limit")
    return TimeCurve("speed", "m/s", 2, series, "dashed: target", low=0.0)


def _acceleration(trace: Trace) -> TimeCurve:
    """Build the chart of tangential and lateral acceleration."""
    series = (
        TimeSeries("along", numbers(trace.steps["acceleration_mps2"])),
        TimeSeries("lateral", numbers(lateral_acceleration(trace.steps)), "second"),
    )
    return TimeCurve("acceleration", "m/s²", 2, series, "dotted: lateral")


def _jerk(trace: Trace) -> TimeCurve:
    """Build the chart of tangential and lateral jerk."""
    along, lateral = jerk(trace)
    series = TimeSeries("along", along), TimeSeries("lateral", lateral, "second")
    high = _robust_top(np.abs(np.concatenate((along, lateral))), SHOWN_JERK)
    low = None if high is None else -high
    note = "dotted: lateral"
    return TimeCurve("jerk", "m/s³", 2, series, note, low=low, high=high)


def _offset(trace: Trace) -> TimeCurve:
    """Build the chart of the lateral offset between the road edges."""
    steps, road = trace.steps, trace.road
    s = numbers(steps["s_m"])
    edges = [
        TimeSeries(
            key.removesuffix("_m"),
            np.interp(s, numbers(road["s_m"]), numbers(road[key])),
            "limit",
        )
        for key in ("left_m", "right_m")
    ]
    own = TimeSeries("offset", numbers(steps["l_m"]))
    return TimeCurve("lateral offset", "m", 2, (own, *edges), "dashed: edges")


def _curvature(trace: Trace) -> TimeCurve:
    """Build the chart of the curvature of driven path and reference path."""
    steps, road = trace.steps, trace.road
    s = numbers(steps["s_m"])
    path = np.interp(s, numbers(road["s_m"]), numbers(road["curvature_1pm"]))
    series = (
        TimeSeries("driven", numbers(steps["curvature_1pm"])),
        TimeSeries("path", path, "limit"),
    )
    return TimeCurve("curvature", "1/m", 4, series, "dashed: path")


def _front_wheel(trace: Trace) -> TimeCurve:
    """Build the chart of the front wheel's angle that drives the curvature."""
    series = (TimeSeries("angle", np.degrees(front_wheel_angle(trace))),)
    return TimeCurve("front wheel", "°", 2, series)


def _clearance(trace: Trace) -> TimeCurve:
    """Build the chart of the distance to the nearest body."""
    own = TimeSeries("clearance", numbers(trace.steps["clearance_m"]))
    high = _top(own.values, MAX_SHOWN_CLEARANCE)
    return TimeCurve("clearance", "m", 2, (own,), "to any body", low=0.0, high=high)


def _ttc(trace: Trace) -> TimeCurve:
    """Build the chart of the time to collision."""
    own = TimeSeries("TTC", time_to_collision(trace))
    note = f"below {TTC_HORIZON:g} s"
    return TimeCurve(
        "time to collision", "s", 2, (own,), note, low=0.0, high=_top(own.values, 10.0)
    )


def _planning(trace: Trace) -> TimeCurve:
    """Build the chart of the planning time, with the step as its deadline."""
    times = numbers(trace.timing["planning_ms"])
    deadline = float(trace.fact("step_s")) * TO_MS
    series = [TimeSeries("planning", times)]
    there = times[np.isfinite(times)]
    usual = there[1:] if there.size > 1 else there  # the first cycle compiles
    note = f"deadline misses: {deadline_misses(trace)}"
    high = _robust_top(usual, SHOWN_PLANNING)
    if high is None and usual.size:
        high = float(SHOWN_PLANNING * usual.max())
    if high is not None and high > deadline / 2.0:
        series.append(TimeSeries("step", np.full(times.size, deadline), "limit"))
        high = max(high, 1.1 * deadline)
    return TimeCurve("planning time", "ms", 2, tuple(series), note, low=0.0, high=high)


def _tracking(trace: Trace) -> TimeCurve:
    """Build the chart of the distance from the plan."""
    series = (
        TimeSeries("lateral", tracked(trace, "lateral_error_m")),
        TimeSeries("along", -tracked(trace, "behind_m"), "second"),
    )
    return TimeCurve("off the plan", "m", 3, series, "dotted: along")


def _command_jerk(trace: Trace) -> TimeCurve:
    """Build the chart of driven and commanded jerk along the path."""
    driven, _ = jerk(trace)
    commands = tracked(trace, "drive_command_mps2")
    commanded = np.append(np.diff(commands) / float(trace.fact("step_s")), np.nan)
    series = (
        TimeSeries("driven", driven),
        TimeSeries("commanded", commanded, "second"),
    )
    high = _robust_top(np.abs(np.concatenate((driven, commanded))), SHOWN_JERK)
    low = None if high is None else -high
    note = "dotted: commanded"
    return TimeCurve("drive jerk", "m/s³", 2, series, note, low=low, high=high)


def _steering(trace: Trace) -> TimeCurve:
    """Build the chart of the steering angle and its command."""
    series = (
        TimeSeries("steering", np.degrees(tracked(trace, "steering_rad"))),
        TimeSeries(
            "command", np.degrees(tracked(trace, "steering_command_rad")), "second"
        ),
    )
    return TimeCurve("steering", "°", 2, series, "dotted: commanded")


def _limits(trace: Trace) -> TimeCurve:
    """Build the chart of friction used and time at a limit."""
    series = (
        TimeSeries("grip", 100.0 * tracked(trace, "grip")),
        TimeSeries("at a limit", 100.0 * tracked(trace, "limited"), "second"),
    )
    note = "dotted: of the step at a limit"
    return TimeCurve("friction used", "%", 0, series, note, low=0.0)


def _perception(trace: Trace) -> TimeCurve:
    """Build the chart of the position error of the nearest vehicle believed in."""
    own = TimeSeries("error", nearest_errors(trace))
    note = "position of the nearest vehicle"
    return TimeCurve("perception error", "m", 2, (own,), note, low=0.0)


def _robust_top(values: FloatArray, room: float) -> float | None:
    """Choose where an axis ends if single values lie far outside; None if none do."""
    there = values[np.isfinite(values)]
    most = float(np.percentile(there, 98)) if there.size else 0.0
    far_out = most > 0.0 and float(there.max()) > FAR_OUT * most
    return room * most if far_out else None


def _top(values: FloatArray, most: float) -> float:
    """Choose the upper end of an axis: the maximum, limited to what matters."""
    there = values[np.isfinite(values)]
    return min(max(float(there.max()), 1.0), most) if there.size else most


_CURVES: tuple[Callable[[Trace], TimeCurve], ...] = (
    _speed,
    _acceleration,
    _jerk,
    _offset,
    _curvature,
    _front_wheel,
    _clearance,
    _ttc,
    _planning,
)
_TRACKING_CURVES: tuple[Callable[[Trace], TimeCurve], ...] = (
    _tracking,
    _command_jerk,
    _steering,
    _limits,
)
