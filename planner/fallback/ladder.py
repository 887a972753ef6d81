"""The trajectory of a cycle that finds none: fallbacks in order.

The last plan shifted by one step, as long as its line has room for a stop, or else a
stop on it; a full stop within the limits; emergency braking, both with the pedal moved
at a finite rate; the last plan without its margins; an evasion within the lane; a
swerve out of it. If none of them is free, the one with the least impact.
"""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from planner.contact_check import Contact
from planner.fallback.braking import (
    EMERGENCY_JERK,
    MIN_PATH_LENGTH,
    STOP_JERK,
    braking_on_arc,
    braking_on_line,
    stopping_trajectory,
)
from planner.fallback.evasions import evasions, swerving
from planner.fallback.last_plan import STATE_COLUMNS, after_a_step, shifted_plan
from planner.interface import PlanStatus
from planner.scene import Scene
from planner.states import Trajectory

STANDING = 0.1  # slower, there is nothing left to brake [m/s]
HARD_GAP = 0.05  # least distance to a body that a fallback may leave [m]
EASY_GAP = 0.3  # and that an evasion leaves where it can [m]

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
    if then is None or blocker(after_a_step(shifted, then, step)) is not None:
        return stopping
    return PlanStatus.LAST_PLAN_SHIFTED, shifted


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


def _stopping_offsets(scene: Scene, last: Trajectory | None) -> tuple[float, ...]:
    """Return offsets that a stopping path may settle on, in order of preference."""
    here = scene.ego_frenet
    if last is None:
        return (here.l,)
    ahead = here.s + MIN_PATH_LENGTH + here.s_dot
    return (float(np.interp(ahead, last.s, last.l)), here.l)
