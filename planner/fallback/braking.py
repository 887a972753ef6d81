"""Motions that brake to a stand: the law of the brake, on the path, on a plan's line.

A brake is applied with a finite jerk.
"""

import math
from typing import NamedTuple

import numpy as np

from planner.fallback.last_plan import SAME_PLACE
from planner.numerics import polynomials
from planner.reference_path.frenet import frenet_trajectory
from planner.scene import Scene
from planner.states import CartesianState, FloatArray, FrenetStates, Trajectory

MIN_PATH_LENGTH = 10.0  # over which a stopping path settles on its offset [m]
STOP_JERK = 10.0  # with which a full stop begins [m/s³]
EMERGENCY_JERK = 40.0  # the same of emergency braking: brakes bite after 0.2 s [m/s³]
NO_SPEED = 1e-6  # a vehicle this slow does not move off by its brake [m/s]


class Brake(NamedTuple):
    """How the brake is applied."""

    acceleration: float  # at the start [m/s²]
    deceleration: float  # then, positive; 0 for none [m/s²]
    jerk: float  # from one to the other, positive [m/s³]


def brake_down(
    speed: float, brake: Brake, t: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Brake to a stand with a deceleration that is reached with bounded jerk.

    Args:
        speed: At the start [m/s].
        brake: How it is applied.
        t: Times, (n,) [s].

    Returns:
        (way driven [m], speed [m/s], acceleration [m/s²]) at these times, (n,).
    """
    if speed < NO_SPEED:
        return np.zeros_like(t), np.zeros_like(t), np.zeros_like(t)
    first, last = brake.acceleration, -brake.deceleration
    ramp = abs(last - first) / brake.jerk
    jerk = math.copysign(brake.jerk, last - first)
    reached = speed + ramp * (first + 0.5 * ramp * jerk)
    if reached < 0.0:  # it stands before
        root = math.sqrt(max(first * first - 2.0 * jerk * speed, 0.0))
        stop = -(first + root) / jerk
    elif brake.deceleration > 0.0:
        stop = ramp + reached / brake.deceleration
    else:
        stop = math.inf
    moving = np.minimum(t, stop)
    rising = np.minimum(moving, ramp)
    even = moving - rising
    v = speed + rising * (first + 0.5 * rising * jerk)
    way = rising * (speed + rising * (first / 2.0 + rising * jerk / 6.0))
    way = way + even * (v + 0.5 * last * even)
    v = np.where(t < stop, np.maximum(v + last * even, 0.0), 0.0)
    a = np.where(t < stop, np.where(t < ramp, first + jerk * t, last), 0.0)
    return way, v, a


def stopping_trajectory(
    scene: Scene, offset: float, deceleration: float, horizon: float
) -> Trajectory | None:
    """Brake to a stand on a path that settles on `offset`.

    Evenly, once the pedal is down.

    Args:
        scene: Of this cycle.
        offset: Lateral offset that the path settles on [m].
        deceleration: Along the path [m/s²].
        horizon: Length of the trajectory [s].

    Returns:
        The trajectory; None where the Frenet frame does not reach.
    """
    length = max(MIN_PATH_LENGTH, 2.0 * max(scene.ego_frenet.s_dot, 0.0))
    return motion_along(scene, offset, (0.0, deceleration), length, horizon)


def braking_on_line(
    plan: Trajectory, deceleration: float, jerk: float, step: float, horizon: float
) -> Trajectory | None:
    """Brake to a stand on the line of a plan; None if the line is too short for it.

    Args:
        plan: From now on.
        deceleration: Along the line [m/s²].
        jerk: With which it begins [m/s³].
        step: Between the points [s].
        horizon: Of the trajectory [s].
    """
    along = np.append(0.0, np.cumsum(np.hypot(np.diff(plan.x), np.diff(plan.y))))
    brake = Brake(float(plan.acceleration[0]), deceleration, jerk)
    t = step * np.arange(round(horizon / step) + 1, dtype=np.float64)
    driven, speed, acceleration = brake_down(float(plan.speed[0]), brake, t)
    if speed[-1] > NO_SPEED or driven[-1] > along[-1] + SAME_PLACE:
        return None
    x, y, heading, curvature, s, l = (
        np.interp(driven, along, column)
        for column in (
            plan.x,
            plan.y,
            np.unwrap(plan.heading),
            plan.curvature,
            plan.s,
            plan.l,
        )
    )
    return Trajectory(t, x, y, heading, curvature, speed, acceleration, s, l)


def braking_on_arc(
    ego: CartesianState, deceleration: float, step: float, horizon: float
) -> Trajectory:
    """Brake with the steering held: the fallback that needs no path."""
    t = step * np.arange(round(horizon / step) + 1, dtype=np.float64)
    brake = Brake(ego.acceleration, deceleration, EMERGENCY_JERK)
    driven, speed, acceleration = brake_down(ego.speed, brake, t)
    heading = ego.heading + ego.curvature * driven
    mean = ego.heading + 0.5 * ego.curvature * driven  # chord of an arc
    chord = driven * np.sinc(0.5 * ego.curvature * driven / np.pi)
    return Trajectory(
        t,
        ego.x + chord * np.cos(mean),
        ego.y + chord * np.sin(mean),
        heading,
        np.full_like(t, ego.curvature),
        speed,
        acceleration,
        driven,
        np.zeros_like(t),
    )


def motion_along(
    scene: Scene,
    offset: float,
    braking: tuple[float, float],
    length: float,
    horizon: float,
) -> Trajectory | None:
    """Hold the speed, then brake to a stand, settling on an offset.

    Args:
        scene: Of this cycle.
        offset: Lateral offset that the path settles on [m].
        braking: When it begins [s], and the deceleration along the path [m/s²].
        length: Of the path up to where it has settled [m].
        horizon: Length of the trajectory [s].

    Returns:
        The trajectory; None where the Frenet frame does not reach.
    """
    ego, (hold, deceleration) = scene.ego_frenet, braking
    t = scene.step * np.arange(round(horizon / scene.step) + 1, dtype=np.float64)
    start = max(ego.s_dot, 0.0)
    share = start / max(scene.ego.speed, 1e-6)  # of the speed that is along the road
    limits = scene.vehicle.limits
    hard = deceleration > limits.max_deceleration
    brake = Brake(
        0.0 if hold > 0.0 else ego.s_ddot,
        share * deceleration,
        max(share, 1e-6) * (EMERGENCY_JERK if hard else STOP_JERK),
    )
    braked, s_dot, s_ddot = brake_down(start, brake, np.maximum(t - hold, 0.0))
    s = ego.s + start * np.minimum(t, hold) + braked
    s_ddot = np.where(t < hold, 0.0, s_ddot)
    l, l_prime, l_second = _settling_path(scene, offset, length, s - ego.s)
    states = FrenetStates(
        s,
        s_dot,
        s_ddot,
        l,
        l_prime * s_dot,
        l_second * s_dot**2 + l_prime * s_ddot,
        l_prime,
        l_second,
    )
    return frenet_trajectory(scene.path, t, states)


def _settling_path(
    scene: Scene, offset: float, length: float, driven: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return (l, l', l'') of a quintic over s, parallel to the path at `offset`."""
    ego = scene.ego_frenet
    start = (ego.l, ego.l_prime, ego.l_second)
    c = polynomials.quintic(start, (offset, 0.0, 0.0), length)
    inside = np.minimum(driven, length)
    l, l_prime, l_second = (polynomials.evaluate(c, inside, k) for k in range(3))
    past = driven > length
    return l, np.where(past, 0.0, l_prime), np.where(past, 0.0, l_second)
