"""Comfort: jerk, acceleration, curvature, and the planner's own cost terms."""

import json
import math

import numpy as np

from experiments.trace.schema import Column, Table, Trace
from planner.states import FloatArray

JERK_COST = "jerk_integral"  # key of PlanStats.costs [m²/s⁵]
OFFSET_COST = "mean_offset_squared"  # key of PlanStats.costs [m²]
# What most passengers of a car accept; UN Regulation 79 asks for 3 m/s² and 5 m/s³
# (mean over half a second) of lane keeping at most.
COMFORTABLE_SIDEWAYS = 2.2  # lateral acceleration [m/s²]
COMFORTABLE_BRAKING = 3.5  # deceleration [m/s²]
JERK_WINDOW = 0.5  # over which a jerk is averaged [s]
FELT = 0.3  # a lateral acceleration below it has no side [m/s²]
ROUNDING = 1e-3  # by which a limit may be exceeded [m/s²]


def mean_cost(trace: Trace, term: str) -> float | None:
    """Average a raw cost term of the selected trajectory over the planning cycles.

    `jerk_integral` is the integral of the squared jerk over the trajectory [m²/s⁵],
    `mean_offset_squared` the mean of l² over its points [m²]. None if the planner
    never reports the term as a finite number.
    """
    cells = np.ma.compressed(trace.steps["costs"])
    costs = [json.loads(cell) for cell in cells]
    values = [cost[term] for cost in costs if math.isfinite(cost.get(term, math.inf))]
    return float(np.mean(values)) if values else None


def rms_jerk(trace: Trace) -> float | None:
    """Return the root mean square of the driven jerk [m/s³].

    Jerk is the change of (tangential, lateral) acceleration between steps, as
    experienced by a passenger, over the step: |a_(k+1) - a_k| / dt. None with
    fewer than two steps.
    """
    tangential = trace.steps["acceleration_mps2"]
    if len(tangential) < 2:  # noqa: PLR2004, a difference takes two
        return None
    lateral = lateral_acceleration(trace.steps)
    step = np.diff(trace.steps["time_s"])
    squares = (np.diff(tangential) / step) ** 2 + (np.diff(lateral) / step) ** 2
    return float(np.sqrt(squares.mean()))


def lateral_acceleration(steps: Table) -> FloatArray:
    """Return the lateral acceleration kappa v² at the rear axle, (n_steps,) [m/s²]."""
    lateral: FloatArray = steps["curvature_1pm"] * steps["speed_mps"] ** 2
    return lateral


def max_abs_acceleration(trace: Trace) -> float | None:
    """Return the largest tangential acceleration or deceleration [m/s²]."""
    return _largest(trace.steps["acceleration_mps2"])


def max_abs_lateral_acceleration(trace: Trace) -> float | None:
    """Return the largest |kappa v²| [m/s²]."""
    return _largest(lateral_acceleration(trace.steps))


def lateral_discomfort(trace: Trace) -> float | None:
    """Return the share of steps with |kappa v²| above `COMFORTABLE_SIDEWAYS`."""
    found = uncomfortable_sideways(trace)
    return float(np.mean(found)) if found.size else None


def braking_discomfort(trace: Trace) -> float | None:
    """Return the share of steps that brake harder than `COMFORTABLE_BRAKING`."""
    found = np.ma.compressed(uncomfortable_braking(trace))
    return float(np.mean(found)) if found.size else None


def uncomfortable_sideways(trace: Trace) -> Column:
    """Mark the steps with |kappa v²| above `COMFORTABLE_SIDEWAYS`, (n_steps,)."""
    sideways = np.abs(lateral_acceleration(trace.steps))
    return np.ma.asarray(sideways > COMFORTABLE_SIDEWAYS + ROUNDING)


def uncomfortable_braking(trace: Trace) -> Column:
    """Mark the steps that brake harder than `COMFORTABLE_BRAKING`, (n_steps,)."""
    return np.ma.asarray(
        trace.steps["acceleration_mps2"] < -COMFORTABLE_BRAKING - ROUNDING
    )


def max_lateral_jerk(trace: Trace) -> float | None:
    """Return the largest mean lateral jerk over `JERK_WINDOW` [m/s³]."""
    return _largest_mean_jerk(trace, lateral_acceleration(trace.steps))


def max_tangential_jerk(trace: Trace) -> float | None:
    """Return the largest mean jerk along the path over `JERK_WINDOW` [m/s³]."""
    return _largest_mean_jerk(trace, trace.steps["acceleration_mps2"])


def lateral_reversals(trace: Trace) -> float | None:
    """Count how often the lateral acceleration changes its side, in a minute.

    Below `FELT` it has none. None for an episode of one step or none.
    """
    sideways = lateral_acceleration(trace.steps)
    if len(sideways) < 2:  # noqa: PLR2004, a minute takes two
        return None
    sides = np.sign(sideways[np.abs(sideways) > FELT])
    time = trace.steps["time_s"]
    return float(60.0 * np.count_nonzero(np.diff(sides)) / (time[-1] - time[0]))


def _largest_mean_jerk(trace: Trace, acceleration: Column) -> float | None:
    """Return the largest |change| over `JERK_WINDOW`, over its time [m/s³].

    None for an episode that is shorter.
    """
    change = changes_in_window(trace, acceleration)
    if change is None:
        return None
    return _largest(change / (_window(trace) * float(trace.fact("step_s"))))


def changes_in_window(trace: Trace, acceleration: Column) -> Column | None:
    """Return by how much a value changes over the `JERK_WINDOW` after each step.

    Shape (n_steps - steps of the window,); None for an episode that is shorter.
    """
    apart = _window(trace)
    if len(acceleration) <= apart:
        return None
    change: Column = acceleration[apart:] - acceleration[:-apart]
    return change


def _window(trace: Trace) -> int:
    """Return how many steps `JERK_WINDOW` takes, at least one."""
    return max(round(JERK_WINDOW / float(trace.fact("step_s"))), 1)


def max_abs_curvature(trace: Trace) -> float | None:
    """Return the largest curvature of the driven path [1/m]."""
    return _largest(trace.steps["curvature_1pm"])


def front_wheel_angle(trace: Trace) -> FloatArray:
    """Return the angle of the front wheel that drives the curvature, (n_steps,) [rad].

    Of the kinematic single-track model, [Thesis] eq. 3.8: tan δ = L κ.
    """
    curvature = np.ma.filled(trace.steps["curvature_1pm"], np.nan)
    return np.asarray(np.arctan(float(trace.fact("wheelbase_m")) * curvature))


def front_wheel_rate(trace: Trace) -> FloatArray:
    """Return how fast the front wheel turns between steps, (n_steps - 1,) [rad/s]."""
    steps = np.diff(np.ma.getdata(trace.steps["time_s"]))
    return np.asarray(np.diff(front_wheel_angle(trace)) / steps)


def max_front_wheel_angle(trace: Trace) -> float | None:
    """Return the largest angle of the front wheel [rad]."""
    return _largest(np.ma.masked_invalid(front_wheel_angle(trace)))


def max_front_wheel_rate(trace: Trace) -> float | None:
    """Return the fastest turn of the front wheel [rad/s]; None for a single step."""
    return _largest(np.ma.masked_invalid(front_wheel_rate(trace)))


def max_heading(trace: Trace) -> float | None:
    """Return the largest angle between the ego and the reference path [rad].

    None if the ego was never projected on the path.
    """
    return _largest(trace.steps["heading_error_rad"])


def _largest(values: Column) -> float | None:
    """Return the largest magnitude; None without values."""
    present = np.ma.compressed(values)
    return float(np.abs(present).max()) if present.size else None
