"""Last plans, and the scene a step after them."""

import numpy as np

from planner.states import Trajectory
from tests.planner.scenes import STEP, ego_on, make_scene

COLUMNS = ("x", "y", "heading", "curvature", "speed", "acceleration", "s", "l")


def plan_along(path, s, speed, l=0.0):
    """An even drive along the path, as a last plan."""
    t = STEP * np.arange(51)
    states = [ego_on(path, s + speed * time, l, speed) for time in t]
    names = ("x", "y", "heading", "curvature", "speed", "acceleration")
    columns = [np.array([getattr(state, name) for state in states]) for name in names]
    return Trajectory(t, *columns, s + speed * t, np.full_like(t, l))


def scene_after(path, last):
    """The scene one step after `last` was made, driven perfectly."""
    return make_scene(path, last.at(STEP), near=float(last.s[1]))
