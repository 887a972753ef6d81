"""Whether the driven motion is one that the ego's vehicle can make."""

import numpy as np

from experiments.metrics.comfort import lateral_acceleration
from experiments.trace.schema import Trace
from planner.states import BoolArray
from planner.vehicle import VehicleLimits

ROUNDING = 0.01  # share by which a limit may be exceeded


def steps_over_limits(trace: Trace, limits: VehicleLimits | None) -> int | None:
    """Count the steps in which the driven motion exceeds a limit of the vehicle.

    Speed, acceleration, braking (against emergency braking), lateral acceleration or
    curvature is more than 1 % above its limit. Planners of this project keep to the
    limits; one of a user's may ask for a motion that no vehicle could follow.

    Returns:
        The number; None if the limits are not known or there are no steps.
    """
    over = over_limits(trace, limits)
    return None if over is None else int(over.sum())


def over_limits(trace: Trace, limits: VehicleLimits | None) -> BoolArray | None:
    """Mark the steps that `steps_over_limits` counts, (n_steps,)."""
    steps = trace.steps
    if limits is None or not len(steps["index"]):
        return None
    acceleration = steps["acceleration_mps2"]
    over: BoolArray = np.zeros(len(steps["index"]), dtype=np.bool_)
    for value, limit in (
        (steps["speed_mps"], limits.max_speed),
        (acceleration, limits.max_acceleration),
        (-acceleration, limits.emergency_deceleration),
        (np.abs(lateral_acceleration(steps)), limits.max_lateral_acceleration),
        (np.abs(steps["curvature_1pm"]), limits.max_curvature),
    ):
        over |= np.ma.filled(value, 0.0) > limit * (1.0 + ROUNDING)
    return over
