"""The fastest drive along a path that its curvature, its end and braking allow."""

import numpy as np

from planner.numerics.compiled import compiled
from planner.states import FloatArray, Path
from planner.vehicle import VehicleLimits

STRAIGHT = 1e-6  # curvature that limits nothing [1/m]
STANDING = 1e-3  # a reference this slow stands [m/s]
STEERING_WINDOW = 2.0  # over which the curvature's change is taken [m]
SLOWEST = 0.5  # speed that steering is given time with at least [m/s]


def limit_speeds(
    path: Path,
    limits: VehicleLimits,
    target_speed: float,
    lateral_acceleration: float | FloatArray,
    lateral_jerk: float,
    braking: float,
    end: float,
) -> FloatArray:
    """Bound the speed at each point of a path such that one can always brake.

    Args:
        path: n points.
        limits: Of the vehicle.
        target_speed: Not exceeded [m/s].
        lateral_acceleration: v² |curvature| <= this, everywhere or at each point
            [m/s²].
        lateral_jerk: v³ |d curvature / d distance| <= this [m/s³].
        braking: With which the speed falls towards slower points [m/s²].
        end: Where along the path the speed is zero [m].

    Returns:
        (n,) [m/s].
    """
    curvature = np.maximum(np.abs(path.curvature), STRAIGHT)
    fastest = min(target_speed, limits.max_speed)
    local = np.minimum(np.sqrt(lateral_acceleration / curvature), fastest)
    slope = _curvature_slope(path)
    local = np.minimum(local, np.maximum(np.cbrt(lateral_jerk / slope), SLOWEST))
    if np.isfinite(limits.max_curvature_rate):
        steerable = limits.max_curvature_rate / slope
        local = np.minimum(local, np.maximum(steerable, SLOWEST))
    local[path.distance >= end] = 0.0
    return brake_in_time(path.distance, local, braking)


def _curvature_slope(path: Path) -> FloatArray:
    """Return |d curvature / d distance| over `STEERING_WINDOW`, (n,) [1/m²]."""
    reach = 0.5 * STEERING_WINDOW
    before, after = (
        np.interp(path.distance + shift, path.distance, path.curvature)
        for shift in (-reach, reach)
    )
    slope: FloatArray = np.abs(after - before) / STEERING_WINDOW
    return np.maximum(slope, STRAIGHT)


@compiled
def brake_in_time(
    distance: FloatArray, speed: FloatArray, braking: float
) -> FloatArray:
    """Lower speeds until each can be reached by braking from the one before, (n,)."""
    out = speed.copy()
    for k in range(out.size - 2, -1, -1):
        step = distance[k + 1] - distance[k]
        out[k] = min(out[k], np.sqrt(out[k + 1] ** 2 + 2.0 * braking * step))
    return out


@compiled
def drive_along(
    distance: FloatArray,
    allowed: FloatArray,
    speed: float,
    acceleration: float,
    braking: float,
    times: FloatArray,
) -> tuple[FloatArray, FloatArray]:
    """Drive as fast as allowed from a given speed, with bounded acceleration.

    The place is not bounded by jerk: it is what a smooth program shall follow.

    Args:
        distance: Points of the path, (n,) [m].
        allowed: Speeds there, as `limit_speeds` makes them, (n,) [m/s].
        speed: At the start [m/s].
        acceleration: At most [m/s²].
        braking: Where the speed is too high [m/s²].
        times: Evenly spaced from 0, (n_times,) [s].

    Returns:
        (distance [m], speed [m/s]) at `times`.
    """
    s, v = np.empty(times.size), np.empty(times.size)
    s[0], v[0] = 0.0, speed
    for k in range(1, times.size):
        dt = times[k] - times[k - 1]
        fastest = v[k - 1] + acceleration * dt
        ahead = s[k - 1] + 0.5 * (v[k - 1] + min(fastest, v[k - 1])) * dt
        cap = np.interp(ahead, distance, allowed)
        wanted = min(fastest, cap)
        v[k] = max(wanted, v[k - 1] - braking * dt, 0.0)
        if v[k] < STANDING and cap < STANDING:
            v[k] = 0.0
        s[k] = s[k - 1] + 0.5 * (v[k] + v[k - 1]) * dt
        if s[k] > distance[-1]:
            s[k], v[k] = distance[-1], 0.0
    return s, v
