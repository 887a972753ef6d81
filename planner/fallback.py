"""The trajectory of a cycle that finds none: fallbacks in order.

The last plan shifted by one step, as long as its line has room for a stop, or else a
stop on it; a full stop within the limits; emergency braking, both with the pedal moved
at a finite rate; the last plan without its margins; an evasion within the lane; a
swerve out of it. If none of them is free, the one with the least impact.
"""

import math
from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from planner.contact_check import Contact
from planner.interface import PlanStatus
from planner.numerics import polynomials
from planner.reference_path.frenet import frenet_trajectory
from planner.scene import Scene
from planner.states import CartesianState, FloatArray, FrenetStates, Trajectory
from planner.swerve import has_room_behind, keeps_to_the_road, swerves

SAME_PLACE = 0.05  # the ego may be this far from where the last plan has it [m]
SAME_SPEED = 0.1  # [m/s]
SAME_TIME = 1e-9  # [s]
MIN_PATH_LENGTH = 10.0  # over which a stopping path settles on its offset [m]
STOP_JERK = 10.0  # with which a full stop begins [m/s³]
EMERGENCY_JERK = 40.0  # the same of emergency braking: brakes bite after 0.2 s [m/s³]
NO_SPEED = 1e-6  # a vehicle this slow does not move off by its brake [m/s]
STANDING = 0.1  # slower, there is nothing left to brake [m/s]
HARD_GAP = 0.05  # least distance to a body that a fallback may leave [m]
EASY_GAP = 0.3  # and that an evasion leaves where it can [m]
HOLD_TIME = 2.0  # for which an evasion holds the speed before it brakes [s]
EVASION_TIME = 1.2  # in which an evasion reaches its offset [s]
LINE_GAP = 0.05  # that an evading body keeps from the lines of its lane [m]
# of a trajectory, in their order, without the time; those of the place come last
STATE_COLUMNS = ("x", "y", "heading", "curvature", "speed", "acceleration", "s", "l")

Blocker = Callable[[Trajectory], str | None]
# the bodies that a trajectory touches with a margin around the ego [m], in time
ContactCheck = Callable[[Trajectory, float], tuple[Contact, ...]]


def fallback(
    scene: Scene,
    last: Trajectory | None,
    blocker: Blocker,
    horizon: float,
    contacts: ContactCheck | None = None,
) -> tuple[PlanStatus, Trajectory]:
    """Return the first fallback that is free.

    Args:
        scene: Of this cycle.
        last: The trajectory driven in the last cycle.
        blocker: Returns the id of what a trajectory would hit or cross, or None.
        horizon: Length of the stopping trajectories [s].
        contacts: Returns what a trajectory touches. Without it emergency braking is
            never rejected.

    Returns:
        Its status and trajectory. Where nothing is free, the one with the least sum
        of squared speeds at which it hits, and of these the one that does so last.
    """
    shifted = None if last is None else shifted_plan(scene, last)
    if shifted is not None:
        kept = keep_to_line(scene, shifted, blocker, horizon)
        if kept is not None:
            return kept
    limits = scene.vehicle.limits
    for offset in _stopping_offsets(scene, last):
        stop = stopping_trajectory(scene, offset, limits.max_deceleration, horizon)
        if stop is not None and (scene.ego.speed < STANDING or blocker(stop) is None):
            return PlanStatus.FULL_STOP, stop
    if shifted is not None:
        stop = braking_on_line(
            shifted,
            limits.emergency_deceleration,
            EMERGENCY_JERK,
            scene.step,
            horizon,
        )
        if stop is not None and blocker(stop) is None:
            return PlanStatus.EMERGENCY_BRAKING, stop
        whole = _to_a_stand(scene, shifted, horizon)
        if blocker(whole) is None:
            return PlanStatus.LAST_PLAN_SHIFTED, whole
    return _emergency(scene, last, shifted, horizon, contacts)


def _emergency(
    scene: Scene,
    last: Trajectory | None,
    shifted: Trajectory | None,
    horizon: float,
    contacts: ContactCheck | None,
) -> tuple[PlanStatus, Trajectory]:
    """Return what is free without the margins, braking first, else the least harm.

    A long body that turns moves its corners out of the way of others, or stops with
    them in it: to drive on may be free where to brake is not.
    """
    deceleration = scene.vehicle.limits.emergency_deceleration
    braking = [
        stop
        for offset in _stopping_offsets(scene, last)
        if (stop := stopping_trajectory(scene, offset, deceleration, horizon))
    ]
    if not braking:
        braking = [braking_on_arc(scene.ego, deceleration, scene.step, horizon)]
    ways = [(PlanStatus.EMERGENCY_BRAKING, stop) for stop in braking]
    if contacts is None:
        return ways[0]
    if shifted is not None:
        ways.append(
            (PlanStatus.LAST_PLAN_SHIFTED, _to_a_stand(scene, shifted, horizon))
        )
    for status, way in ways:
        if not contacts(way, HARD_GAP):
            return status, way
    return _least_harm(scene, ways, contacts, horizon)


def _least_harm(
    scene: Scene,
    ways: list[tuple[PlanStatus, Trajectory]],
    contacts: ContactCheck,
    horizon: float,
) -> tuple[PlanStatus, Trajectory]:
    """Return the first evasion that is free, else what hits with the least harm.

    All that a way would hit counts: one that barely touches another vehicle first may
    go on into what stands ahead.

    Args:
        scene: Of this cycle.
        ways: Others, which are not free.
        contacts: Returns what a trajectory touches.
        horizon: Of the trajectories [s].
    """
    evading = []
    for trajectory in evasions(scene, horizon):
        if not contacts(trajectory, EASY_GAP):
            return PlanStatus.EVASION, trajectory
        evading.append(trajectory)
    for trajectory in evading:
        if not contacts(trajectory, HARD_GAP):
            return PlanStatus.EVASION, trajectory
    for trajectory in swerving(scene, horizon):
        if not contacts(trajectory, EASY_GAP):
            return PlanStatus.EVASION, trajectory
    ways = [*ways, *((PlanStatus.EVASION, trajectory) for trajectory in evading)]

    def harm(way: tuple[PlanStatus, Trajectory]) -> tuple[float, float]:
        hits = contacts(way[1], 0.0)
        squares = sum(hit.closing_speed**2 for hit in hits)
        return (squares, -hits[0].time) if hits else (0.0, 0.0)

    return min(ways, key=harm)


def keep_to_line(
    scene: Scene, shifted: Trajectory, blocker: Blocker, horizon: float
) -> tuple[PlanStatus, Trajectory] | None:
    """Go on with a plan while its line has room for a stop, else stop on the line.

    A plan is free as far as it reaches: at its end the ego may be too near and too
    fast for what is beyond. Its line was free of what stands, which the ways to other
    offsets need not be.

    Args:
        scene: Of this cycle.
        shifted: The plan, from now on.
        blocker: As in `fallback`.
        horizon: Length of the stop [s].

    Returns:
        Status and trajectory. None where neither plan nor service braking on its line
        is free, and where the next cycle could not even brake in an emergency on it.
    """
    limits, step = scene.vehicle.limits, scene.step
    is_free = blocker(shifted) is None
    deceleration, jerk = limits.max_deceleration, STOP_JERK
    stop = braking_on_line(shifted, deceleration, jerk, step, horizon)
    if stop is not None and blocker(stop) is not None:
        stop = None
    stopping = None if stop is None else (PlanStatus.FULL_STOP, stop)
    if not is_free:
        return stopping
    if stopping is None:
        deceleration, jerk = limits.emergency_deceleration, EMERGENCY_JERK
    then = None
    later = shifted_plan(replace(scene, ego=shifted.at(step)), shifted)
    if later is not None:
        then = braking_on_line(later, deceleration, jerk, step, horizon)
    if then is None or blocker(_after_a_step(shifted, then, step)) is not None:
        return stopping
    return PlanStatus.LAST_PLAN_SHIFTED, shifted


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


def _after_a_step(plan: Trajectory, then: Trajectory, step: float) -> Trajectory:
    """Return the start of a plan, followed by another trajectory a step later."""
    columns = [
        np.insert(getattr(then, name), 0, getattr(plan, name)[0])
        for name in STATE_COLUMNS
    ]
    return Trajectory(np.insert(then.t + step, 0, plan.t[0]), *columns)


def _to_a_stand(scene: Scene, plan: Trajectory, horizon: float) -> Trajectory:
    """Return a plan with emergency braking behind its end, the steering held.

    What a plan hits beyond its end counts as what a stop hits does.
    """
    end = plan.at(float(plan.t[-1]))
    deceleration = scene.vehicle.limits.emergency_deceleration
    stop = braking_on_arc(end, deceleration, scene.step, horizon)
    shift = {"s": plan.s[-1], "l": plan.l[-1]}
    columns = [
        np.append(getattr(plan, name), (getattr(stop, name) + shift.get(name, 0.0))[1:])
        for name in STATE_COLUMNS
    ]
    return Trajectory(np.append(plan.t, plan.t[-1] + stop.t[1:]), *columns)


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
    return _motion_along(scene, offset, (0.0, deceleration), length, horizon)


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


def _motion_along(
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


def evasions(scene: Scene, horizon: float) -> Iterator[Trajectory]:
    """Yield manoeuvres that stay in the lane, the mildest first.

    The speed is held for `HOLD_TIME`, or braked down within the limits, or with the
    emergency deceleration; the ego stays at its offset or moves to where its body is
    nearer to, or at, either line of its lane. Speed is not held towards a closed stop
    line or the end of the path.

    Args:
        scene: Of this cycle.
        horizon: Of the trajectories [s].
    """
    speeds = _speeds(scene)
    length = max(MIN_PATH_LENGTH, EVASION_TIME * max(scene.ego_frenet.s_dot, 0.0))
    for offset in _offsets_in_lane(scene):
        yield from _motions_to(scene, offset, length, speeds, horizon)


def swerving(scene: Scene, horizon: float) -> Iterator[Trajectory]:
    """Yield the same out of the lane, on a road with several; see `swerves`.

    Args:
        scene: Of this cycle.
        horizon: Of the trajectories [s].
    """
    if scene.lanes.centre.shape[0] > 1:
        speeds = _speeds(scene)
        for offset, length in swerves(scene):
            free = [one for one in speeds if has_room_behind(scene, offset, one[1])]
            for way in _motions_to(scene, offset, length, free, horizon):
                if keeps_to_the_road(scene, way):
                    yield way


def _speeds(scene: Scene) -> list[tuple[float, float]]:
    """Return for how long speed is held [s], and the braking then [m/s²]."""
    limits, ego = scene.vehicle.limits, scene.ego_frenet
    front = ego.s + scene.vehicle.front_reach
    held = ego.s_dot * HOLD_TIME + ego.s_dot**2 / (2.0 * limits.max_deceleration)
    lines = [line for line in scene.stop_lines if line > front]
    may_hold = front + held < min(lines, default=scene.path.length)
    speeds = [(HOLD_TIME, limits.max_deceleration)] if may_hold else []
    return [
        *speeds,
        (0.0, limits.max_deceleration),
        (0.0, limits.emergency_deceleration),
    ]


def _motions_to(
    scene: Scene,
    offset: float,
    length: float,
    speeds: list[tuple[float, float]],
    horizon: float,
) -> Iterator[Trajectory]:
    """Yield the drivable motions to an offset, one for each way to brake."""
    for braking in speeds:
        way = _motion_along(scene, offset, braking, length, horizon)
        if way is not None and _is_drivable(scene, way):
            yield way


def _is_drivable(scene: Scene, trajectory: Trajectory) -> bool:
    """Check the limits of curvature and of lateral acceleration."""
    limits, curvature = scene.vehicle.limits, np.abs(trajectory.curvature)
    lateral = curvature * trajectory.speed**2
    start = abs(scene.ego.curvature)  # what is driven now is allowed
    sharpest = max(limits.max_curvature, start)
    hardest = max(limits.max_lateral_acceleration, start * scene.ego.speed**2)
    return bool(curvature.max() <= sharpest + 1e-9 and lateral.max() <= hardest + 1e-9)


def _offsets_in_lane(scene: Scene) -> tuple[float, ...]:
    """Return the present offset and those nearer to the lines of the ego's lane."""
    ego, half = scene.ego_frenet, 0.5 * scene.vehicle.width
    ahead = np.array([ego.s, ego.s + MIN_PATH_LENGTH + EVASION_TIME * ego.s_dot])
    left, right = scene.road.at(ahead)
    high, low = float(left.min()), float(right.max())
    lanes = scene.lanes
    for s in ahead.tolist() if lanes.centre.shape[0] else ():
        centres, widths = lanes.at(s)
        there = np.where(widths > 0.0, np.abs(centres - ego.l), np.inf)
        lane = int(np.argmin(there))
        high = min(high, float(centres[lane] + 0.5 * widths[lane]))
        low = max(low, float(centres[lane] - 0.5 * widths[lane]))
    ends = (high - half - LINE_GAP, low + half + LINE_GAP)
    offsets = [ego.l]
    if ends[0] > ends[1]:
        offsets += [
            ego.l + share * (end - ego.l) for share in (0.5, 1.0) for end in ends
        ]
    return tuple(offset for offset in offsets if math.isfinite(offset))


def _stopping_offsets(scene: Scene, last: Trajectory | None) -> tuple[float, ...]:
    """Return offsets that a stopping path may settle on, in order of preference."""
    here = scene.ego_frenet
    if last is None:
        return (here.l,)
    ahead = here.s + MIN_PATH_LENGTH + here.s_dot
    return (float(np.interp(ahead, last.s, last.l)), here.l)


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
