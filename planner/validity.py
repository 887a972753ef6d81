"""What makes a scene unusable for any planner."""

import math
from dataclasses import fields

import numpy as np

from planner.scene import Scene


def invalid(scene: Scene) -> str | None:
    """Say what makes a scene unusable, None if nothing does."""
    for state in (scene.ego, scene.ego_frenet):
        for field in fields(state):
            value = getattr(state, field.name)
            if not math.isfinite(value):
                return f"the ego's {field.name} is {value}"
    if not (math.isfinite(scene.target_speed) and scene.target_speed >= 0.0):
        return f"the target speed is {scene.target_speed}"
    if not scene.step > 0.0:
        return f"the time step is {scene.step}"
    if any(math.isnan(line) for line in scene.stop_lines):
        return "a stop line is nowhere (nan)"
    return _odd_array(scene)


def _odd_array(scene: Scene) -> str | None:
    """Name an array that is not finite; a prediction may be out of reach."""
    ahead = scene.vehicles.prediction
    pose = ("x", "y", "heading")
    for record, names in (
        (scene.obstacles, (*pose, "length", "width", "radius")),
        (scene.vehicles, (*pose, "speed", "acceleration", "length", "width")),
        (ahead, pose),
        (scene.road, ("left", "right")),
    ):
        for name in names:
            if not math.isfinite(float(getattr(record, name).sum())):
                return f"{name} of {type(record).__name__} is not finite"
    if np.isnan(ahead.s).any() or np.isnan(ahead.l).any():
        return "a predicted place on the path is nan"
    return None
