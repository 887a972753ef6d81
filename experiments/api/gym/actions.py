"""What a policy does: an action becomes the trajectory that is driven for one step.

The same function serves the environments and a policy that drives as a planner.
"""

import math
from enum import StrEnum
from typing import Any

import numpy as np
from numpy.typing import NDArray

from experiments.api.gym.observation import lane_centres
from planner.numerics.polynomials import evaluate, quintic
from planner.reference_path.frenet import frenet_trajectory
from planner.scene import Scene
from planner.states import FloatArray, FrenetStates, Trajectory

LANE_CHOICES = 3  # right, keep, left
SPEED_CHOICES = 5  # of the target speed: 0, 1/4, 1/2, 3/4, 1
DURATIONS = (1.0, 5.0)  # of a Frenet end state [s]
CHANGE_TIME = 4.0  # to the target lane [s]
SPEED_TIME = 3.0  # to the target speed [s]
ARC_POINTS = 11  # of the trajectory of an acceleration and curvature

# largest second derivative of the smoothest quintic from 0 to 1 in 1, and largest slope
# of the cubic
QUINTIC_PEAK = 10.0 / math.sqrt(3.0)
CUBIC_PEAK = 1.5
SLOW = 1.0  # below it the lateral acceleration limits no curvature [m/s]

Action = NDArray[Any]


class ActionKind(StrEnum):
    """What the numbers of an action are."""

    CONTROL = "control"  # acceleration, curvature
    LANE_AND_SPEED = "lane_and_speed"  # right, keep, left; share of the target speed
    FRENET = "frenet"  # end state: lateral offset, speed, duration


def drive(kind: ActionKind, action: Action, scene: Scene) -> Trajectory | None:
    """Turn an action into a trajectory.

    Args:
        kind: Of the action.
        action: `control`: acceleration and curvature as shares in [-1, 1] of what the
            vehicle can do at its speed. `lane_and_speed`: 0, 1, 2 for the lane to the
            right, the own one, that to the left, and 0 to 4 quarters of the target
            speed. `frenet`: three numbers in [-1, 1], from the right end of the room to
            the left one, from standing to the target speed, from 1 s to 5 s.
        scene: Now.

    Returns:
        The trajectory from the ego's state on; None if it leaves the frame of the
        reference path.
    """
    if kind is ActionKind.CONTROL:
        acceleration, curvature = np.clip(action, -1.0, 1.0).tolist()
        return _arc(scene, acceleration, curvature)
    if kind is ActionKind.LANE_AND_SPEED:
        lane, quarters = (int(number) for number in action)
        offset = _target_lane(scene, lane - 1)
        speed = scene.target_speed * quarters / (SPEED_CHOICES - 1)
        return _to_end_state(scene, offset, speed, (CHANGE_TIME, SPEED_TIME))
    shares = (np.clip(np.asarray(action, dtype=np.float64), -1.0, 1.0) + 1.0) / 2.0
    across, fast, long = shares.tolist()
    left, right = (float(x) for x in scene.road.at(np.array(scene.ego_frenet.s)))
    half = min(scene.vehicle.width, left - right) / 2.0
    offset = right + half + across * (left - right - 2.0 * half)
    duration = DURATIONS[0] + long * (DURATIONS[1] - DURATIONS[0])
    return _to_end_state(scene, offset, fast * scene.target_speed, (duration, duration))


def _target_lane(scene: Scene, step: int) -> float:
    """Return the offset of the ego's lane or of one beside it; kept where none is."""
    centres = lane_centres(scene)
    if not centres.size:
        return scene.ego_frenet.l
    own = int(np.abs(centres - scene.ego_frenet.l).argmin())
    return float(centres[min(max(own + step, 0), centres.size - 1)])


def _arc(scene: Scene, acceleration: float, curvature: float) -> Trajectory:
    """Drive with a constant acceleration along an arc, until it stands."""
    ego, limits = scene.ego, scene.vehicle.limits
    most = limits.max_acceleration if acceleration > 0.0 else limits.max_deceleration
    rate = acceleration * most
    steepest = limits.max_lateral_acceleration / max(ego.speed, SLOW) ** 2
    bent = curvature * min(limits.max_curvature, steepest)
    if math.isfinite(limits.max_curvature_rate):
        reach = limits.max_curvature_rate * scene.step
        bent = min(max(bent, ego.curvature - reach), ego.curvature + reach)
    t = scene.step * np.arange(ARC_POINTS, dtype=np.float64)
    speed = np.clip(ego.speed + rate * t, 0.0, max(limits.max_speed, ego.speed))
    driven = _integral(speed, scene.step)
    heading = ego.heading + bent * driven
    # chord of an arc: its length times the sinc of half the turn
    chord = driven * np.sinc(bent * driven / math.tau)
    middle = ego.heading + 0.5 * bent * driven
    x, y = ego.x + chord * np.cos(middle), ego.y + chord * np.sin(middle)
    s, l = scene.path.project(x, y, near=scene.ego_frenet.s)
    moving = (speed > 0.0) | (rate > 0.0)
    return Trajectory(
        t,
        x,
        y,
        heading,
        np.full_like(t, bent),
        speed,
        np.where(moving, rate, 0.0),
        s,
        l,
    )


def _to_end_state(
    scene: Scene, offset: float, speed: float, times: tuple[float, float]
) -> Trajectory | None:
    """Drive to a lateral offset and a speed, smoothly and within the limits.

    The offset is a quintic over the way, so that a standing vehicle does not move
    aside; the speed is a cubic over time.

    Args:
        scene: Now.
        offset: At the end [m].
        speed: At the end [m/s].
        times: Of the change of offset and of that of speed, or longer where the limits
            of the vehicle ask for it [s].
    """
    frenet, limits = scene.ego_frenet, scene.vehicle.limits
    speed = min(speed, limits.max_speed)
    apart = speed - scene.ego.speed
    most = limits.max_acceleration if apart > 0.0 else limits.max_deceleration
    duration = max(times[1], CUBIC_PEAK * abs(apart) / most)
    aside = QUINTIC_PEAK * abs(offset - frenet.l)
    across = max(times[0], math.sqrt(aside / limits.max_lateral_acceleration))
    n_steps = max(round(duration / scene.step), 1) + 1
    t = scene.step * np.arange(n_steps, dtype=np.float64)
    s_dot, s_ddot = _speeds(frenet.s_dot, frenet.s_ddot, speed, duration, t)
    along = _integral(s_dot, scene.step)
    mean = 0.5 * (max(frenet.s_dot, 0.0) + speed)
    way = max(across * mean, math.sqrt(aside / limits.max_curvature), 1.0)
    start = (frenet.l, frenet.l_prime, frenet.l_second)
    polynomial = quintic(start, (offset, 0.0, 0.0), way)
    inside = np.minimum(along, way)
    l, slope, bend = (evaluate(polynomial, inside, order) for order in range(3))
    l_dot = slope * s_dot
    states = FrenetStates(
        frenet.s + along,
        s_dot,
        s_ddot,
        l,
        l_dot,
        bend * s_dot**2 + slope * s_ddot,
        slope,
        bend,
    )
    return frenet_trajectory(scene.path, t, states)


def _speeds(
    speed: float, acceleration: float, end: float, duration: float, t: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return speeds and accelerations of the cubic to an end speed; never negative."""
    missing = end - speed - acceleration * duration
    cubic = -2.0 * (missing + 0.5 * acceleration * duration) / duration**3
    square = (-acceleration - 3.0 * cubic * duration**2) / (2.0 * duration)
    u = np.minimum(t, duration)
    found = speed + acceleration * u + square * u**2 + cubic * u**3
    rate = acceleration + 2.0 * square * u + 3.0 * cubic * u**2
    moving = found > 0.0
    moving[0] = True
    return np.maximum(found, 0.0), np.where(moving & (t < duration), rate, 0.0)


def _integral(speed: FloatArray, step: float) -> FloatArray:
    """Return the way at each time, by the trapezoidal rule."""
    way = np.zeros_like(speed)
    np.cumsum(0.5 * step * (speed[1:] + speed[:-1]), out=way[1:])
    return way
