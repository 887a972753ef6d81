"""The last plan as a fallback: without its driven step, and what may follow it."""

import math

import numpy as np

from planner.scene import Scene
from planner.states import Trajectory

SAME_PLACE = 0.05  # the ego may be this far from where the last plan has it [m]
SAME_SPEED = 0.1  # [m/s]
SAME_TIME = 1e-9  # [s]
# of a trajectory, in their order, without the time; those of the place come last
STATE_COLUMNS = ("x", "y", "heading", "curvature", "speed", "acceleration", "s", "l")


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


def after_a_step(plan: Trajectory, then: Trajectory, step: float) -> Trajectory:
    """Return the start of a plan, followed by another trajectory a step later."""
    columns = [
        np.insert(getattr(then, name), 0, getattr(plan, name)[0])
        for name in STATE_COLUMNS
    ]
    return Trajectory(np.insert(then.t + step, 0, plan.t[0]), *columns)
