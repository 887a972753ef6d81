"""The trajectory of a cycle that finds none: three fallbacks in order.

The last plan shifted by one step; a full stop within the limits on its path; emergency
braking on the path, even if it is blocked.
"""

import math
from collections.abc import Callable

import numpy as np

from planner.errors import OutsidePathDomainError
from planner.interface import PlanStatus
from planner.numerics import polynomials
from planner.reference_path.frenet import frenet_to_cartesian
from planner.scene import Scene
from planner.states import CartesianState, FloatArray, FrenetStates, Trajectory

SAME_PLACE = 0.05  # the ego may be this far from where the last plan has it [m]
SAME_SPEED = 0.1  # [m/s]
SAME_TIME = 1e-9  # [s]
MIN_PATH_LENGTH = 10.0  # over which a stopping path settles on its offset [m]
# of a trajectory, in their order, without the time; those of the place come last
STATE_COLUMNS = ("x", "y", "heading", "curvature", "speed", "acceleration", "s", "l")

Blocker = Callable[[Trajectory], str | None]


def fallback(
    scene: Scene, last: Trajectory | None, blocker: Blocker, horizon: float
) -> tuple[PlanStatus, Trajectory]:
    """Return the first fallback that is free.

    Args:
        scene: Of this cycle.
        last: The trajectory driven in the last cycle.
        blocker: Returns the id of what a trajectory would hit or cross, or None.
        horizon: Length of the stopping trajectories [s].

    Returns:
        Its status and trajectory; emergency braking is never rejected.
    """
    if last is not None:
        shifted = shifted_plan(scene, last)
        if shifted is not None and blocker(shifted) is None:
            return PlanStatus.LAST_PLAN_SHIFTED, shifted
    limits = scene.vehicle.limits
    for offset in _stopping_offsets(scene, last):
        stop = stopping_trajectory(scene, offset, limits.max_deceleration, horizon)
        if stop is not None and blocker(stop) is None:
            return PlanStatus.FULL_STOP, stop
    deceleration = limits.emergency_deceleration
    for offset in _stopping_offsets(scene, last):
        stop = stopping_trajectory(scene, offset, deceleration, horizon)
        if stop is not None:
            return PlanStatus.EMERGENCY_BRAKING, stop
    return (
        PlanStatus.EMERGENCY_BRAKING,
        braking_on_arc(scene.ego, deceleration, scene.step, horizon),
    )


def shifted_plan(scene: Scene, last: Trajectory) -> Trajectory | None:
    """Return the last plan without its driven step; None if the ego is not on it."""
    here = last.at(scene.step)
    off = math.hypot(here.x - scene.ego.x, here.y - scene.ego.y)
    if off > SAME_PLACE or abs(here.speed - scene.ego.speed) > SAME_SPEED:
        return None
    keep = last.t > scene.step - SAME_TIME
    if np.count_nonzero(keep) < 2:
        return None
    columns = [getattr(last, name)[keep] for name in STATE_COLUMNS]
    t = last.t[keep] - scene.step
    if t[0] > SAME_TIME:  # sampled at other times than the loop's
        place = [float(np.interp(scene.step, last.t, at)) for at in (last.s, last.l)]
        state = [getattr(here, name) for name in STATE_COLUMNS[:-2]]
        t = np.insert(t, 0, 0.0)
        columns = [
            np.insert(column, 0, value)
            for column, value in zip(columns, [*state, *place], strict=True)
        ]
    return Trajectory(t, *columns)


def stopping_trajectory(
    scene: Scene, offset: float, deceleration: float, horizon: float
) -> Trajectory | None:
    """Brake evenly to a stand on a path that settles on `offset`.

    Args:
        scene: Of this cycle.
        offset: Lateral offset that the path settles on [m].
        deceleration: Along the path [m/s²].
        horizon: Length of the trajectory [s].

    Returns:
        The trajectory; None where the Frenet frame does not reach.
    """
    ego = scene.ego_frenet
    t = scene.step * np.arange(round(horizon / scene.step) + 1, dtype=np.float64)
    speed = max(scene.ego.speed, 1e-6)
    rate = deceleration * max(ego.s_dot, 0.0) / speed  # the same share of both speeds
    stop_time = max(ego.s_dot, 0.0) / rate if rate > 0.0 else 0.0
    moving = np.minimum(t, stop_time)
    s_dot = np.maximum(ego.s_dot - rate * t, 0.0)
    s = ego.s + ego.s_dot * moving - 0.5 * rate * moving**2
    s_ddot = np.where(t < stop_time, -rate, 0.0)
    l, l_prime, l_second = _settling_path(scene, offset, s - ego.s)
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
    try:
        plane = frenet_to_cartesian(scene.path, states)
    except OutsidePathDomainError:
        return None
    return Trajectory(
        t,
        plane.x,
        plane.y,
        plane.heading,
        plane.curvature,
        plane.speed,
        plane.acceleration,
        s,
        l,
    )


def braking_on_arc(
    ego: CartesianState, deceleration: float, step: float, horizon: float
) -> Trajectory:
    """Brake with the steering held: the fallback that needs no path."""
    t = step * np.arange(round(horizon / step) + 1, dtype=np.float64)
    stop_time = ego.speed / deceleration
    moving = np.minimum(t, stop_time)
    driven = ego.speed * moving - 0.5 * deceleration * moving**2
    heading = ego.heading + ego.curvature * driven
    mean = ego.heading + 0.5 * ego.curvature * driven  # chord of an arc
    chord = driven * np.sinc(0.5 * ego.curvature * driven / np.pi)
    return Trajectory(
        t,
        ego.x + chord * np.cos(mean),
        ego.y + chord * np.sin(mean),
        heading,
        np.full_like(t, ego.curvature),
        np.maximum(ego.speed - deceleration * t, 0.0),
        np.where(t < stop_time, -deceleration, 0.0),
        driven,
        np.zeros_like(t),
    )


def _stopping_offsets(scene: Scene, last: Trajectory | None) -> tuple[float, ...]:
    """Return offsets that a stopping path may settle on, in order of preference."""
    here = scene.ego_frenet
    if last is None:
        return (here.l,)
    ahead = here.s + MIN_PATH_LENGTH + here.s_dot
    return (float(np.interp(ahead, last.s, last.l)), here.l)


def _settling_path(
    scene: Scene, offset: float, driven: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return (l, l', l'') of a quintic over s, parallel to the path at `offset`."""
    ego = scene.ego_frenet
    length = max(MIN_PATH_LENGTH, 2.0 * max(ego.s_dot, 0.0))
    start = (ego.l, ego.l_prime, ego.l_second)
    c = polynomials.quintic(start, (offset, 0.0, 0.0), length)
    inside = np.minimum(driven, length)
    l, l_prime, l_second = (polynomials.evaluate(c, inside, k) for k in range(3))
    past = driven > length
    return l, np.where(past, 0.0, l_prime), np.where(past, 0.0, l_second)
