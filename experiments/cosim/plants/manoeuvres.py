"""Plans on which a vehicle's tracking errors are measured.

Lane changes and bends of several lateral accelerations, and braking and driving on, at
one speed each.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from planner.states import FloatArray, Trajectory

SPACING = 0.1  # of a plan's points [s]
FINE = 0.002  # of the integration of a bend [s]
LEAD_IN = 1.0  # straight on, before anything else [s]
LEAD_OUT = 2.0  # straight on, or round the bend [s]
OFFSET = 3.5  # of a lane change [m]
RAMP = 1.0  # in which the curvature of a bend grows, at least [s]
SHARPENING = 0.11  # fastest growth, as steering wheels are turned [1/m/s]
IN_THE_BEND = 3.0  # [s]
LATERAL = (0.7, 1.4, 2.0)  # largest lateral accelerations [m/s²]
BRAKING = (-1.5, -3.0, -4.5)  # reached at once, as planners do in need [m/s²]
DRIVING = 1.5  # [m/s²]
FASTER = 4.0  # for which it drives on harder [s]
SHARPEST = 0.2  # curvature of a bend [1/m]
QUINTIC_PEAK = 5.7735  # of the second derivative of 10 u³ - 15 u⁴ + 6 u⁵
QUINTIC_JERK = 60.0  # of the third one


@dataclass(frozen=True, slots=True, eq=False)
class Manoeuvre:
    """A plan and what it asks for at most."""

    plan: Trajectory
    speed: float  # at its start [m/s]
    curvature: float  # [1/m]


def manoeuvres(speed: float) -> Iterator[Manoeuvre]:
    """Yield all manoeuvres at a speed [m/s]."""
    for lateral in LATERAL:
        yield lane_change(speed, lateral)
        yield bend(speed, lateral)
    for acceleration in (*BRAKING, DRIVING):
        yield speed_change(speed, acceleration)


def lane_change(speed: float, lateral: float, offset: float = OFFSET) -> Manoeuvre:
    """Change the lane on a quintic, with a largest lateral acceleration [m/s²]."""
    duration = max(
        math.sqrt(QUINTIC_PEAK * offset / lateral),
        math.cbrt(QUINTIC_JERK * offset / (SHARPENING * speed**2)),
    )
    total = LEAD_IN + duration + LEAD_OUT
    t = np.arange(0.0, total + 2.0, FINE)
    u = np.clip((t - LEAD_IN) / duration, 0.0, 1.0)
    y = offset * u**3 * (10.0 - 15.0 * u + 6.0 * u * u)
    return _along(speed * t, y, speed, total)


def bend(speed: float, lateral: float) -> Manoeuvre:
    """Drive into a bend of a lateral acceleration [m/s²], by a clothoid, and stay."""
    curvature = min(lateral / speed**2, SHARPEST)
    ramp = max(RAMP, curvature / SHARPENING)
    total = LEAD_IN + ramp + IN_THE_BEND
    t = np.arange(0.0, total + 2.0, FINE)
    kappa = curvature * np.clip((t - LEAD_IN) / ramp, 0.0, 1.0)
    heading = _integral(kappa, speed * FINE)
    middle = 0.5 * (heading[1:] + heading[:-1])
    x = np.append(0.0, np.cumsum(speed * FINE * np.cos(middle)))
    y = np.append(0.0, np.cumsum(speed * FINE * np.sin(middle)))
    return _along(x, y, speed, total)


def speed_change(speed: float, acceleration: float) -> Manoeuvre:
    """Brake to a stand or drive on, straight ahead; the acceleration jumps."""
    total = LEAD_IN + FASTER + LEAD_OUT
    t = SPACING * np.arange(round(total / SPACING) + 1, dtype=np.float64)
    since = np.maximum(t - LEAD_IN, 0.0)
    if acceleration < 0.0:
        since = np.minimum(since, -speed / acceleration)
        moving = since < -speed / acceleration - 1e-9
    else:
        since = np.minimum(since, FASTER)
        moving = since < FASTER
    moving &= t >= LEAD_IN
    before = speed * np.minimum(t, LEAD_IN)
    x = before + speed * since + 0.5 * acceleration * since**2
    if acceleration > 0.0:
        after = np.maximum(t - LEAD_IN - FASTER, 0.0)
        x += (speed + acceleration * FASTER) * after
    zero = np.zeros_like(t)
    plan = Trajectory(
        t,
        x,
        zero,
        zero,
        zero,
        np.maximum(speed + acceleration * since, 0.0),
        np.where(moving, acceleration, 0.0),
        x,
        zero,
    )
    return Manoeuvre(plan, speed, 0.0)


def _integral(values: FloatArray, step: float) -> FloatArray:
    """Integrate by trapezoids from 0."""
    return np.append(0.0, np.cumsum(0.5 * step * (values[1:] + values[:-1])))


def _along(x: FloatArray, y: FloatArray, speed: float, total: float) -> Manoeuvre:
    """Drive along a line at a steady speed."""
    s = np.append(0.0, np.cumsum(np.hypot(np.diff(x), np.diff(y))))
    heading = np.unwrap(np.arctan2(np.gradient(y, s), np.gradient(x, s)))
    curvature = np.gradient(heading, s)
    t = SPACING * np.arange(round(total / SPACING) + 1, dtype=np.float64)
    place = speed * t
    steady, zero = np.full_like(t, speed), np.zeros_like(t)
    plan = Trajectory(
        t,
        np.interp(place, s, x),
        np.interp(place, s, y),
        np.interp(place, s, heading),
        np.interp(place, s, curvature),
        steady,
        zero,
        place,
        zero,
    )
    return Manoeuvre(plan, speed, float(np.abs(plan.curvature).max()))
