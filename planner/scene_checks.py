"""What makes a scene unusable for any planner."""

import math

import numpy as np

from planner.numerics.compiled import compiled
from planner.scene import COLUMNS, Scene
from planner.states import CartesianState, FloatArray, FrenetState

POSE = ("x", "y", "heading")
N_POSE = 3  # layers of a prediction's table before the places on the path


def invalid(scene: Scene) -> str | None:
    """Return what makes a scene unusable, None if nothing does."""
    if not math.isfinite(_sum_of_numbers(scene.ego, scene.ego_frenet)):
        for state in (scene.ego, scene.ego_frenet):
            for name in state.__slots__:
                value = getattr(state, name)
                if not math.isfinite(value):
                    return f"the ego's {name} is {value}"
    if not (math.isfinite(scene.target_speed) and scene.target_speed >= 0.0):
        return f"the target speed is {scene.target_speed}"
    if not scene.step > 0.0:
        return f"the time step is {scene.step}"
    if any(math.isnan(line) for line in scene.stop_lines):
        return "a stop line is nowhere (nan)"
    return None if _all_usable(scene) else _odd_array(scene)


def _sum_of_numbers(ego: CartesianState, frenet: FrenetState) -> float:
    """Add up all numbers of the ego: finite only if every one of them is."""
    return (
        (ego.x + ego.y + ego.heading + ego.curvature + ego.speed + ego.acceleration)
        + (frenet.s + frenet.s_dot + frenet.s_ddot + frenet.l + frenet.l_dot)
        + (frenet.l_ddot + frenet.l_prime + frenet.l_second)
    )


def _all_usable(scene: Scene) -> bool:
    """Check all arrays at once; `_odd_array` names the one that is odd."""
    moving = scene.vehicles
    known = scene.obstacles.is_finite and scene.road.is_finite
    return known and _usable(moving.table, moving.prediction.table)


@compiled
def _usable(moving: FloatArray, ahead: FloatArray) -> bool:
    """Check that all are finite; predicted places may be inf, but not nan."""
    wrong = 0.0  # x - x is 0 unless x is inf or nan, and nan stays
    for value in moving.flat:
        wrong += value - value
    for value in ahead[:N_POSE].flat:
        wrong += value - value
    nowhere = 0
    for value in ahead[N_POSE:].flat:
        nowhere += 1 if np.isnan(value) else 0
    return bool(nowhere == 0 and wrong == 0.0)


def _odd_array(scene: Scene) -> str | None:
    """Return the name of an array that is not finite; places may be inf."""
    ahead = scene.vehicles.prediction
    for record, names in (
        (scene.obstacles, (*POSE, "length", "width", "radius")),
        (scene.vehicles, COLUMNS),
        (ahead, POSE),
        (scene.road, ("left", "right")),
    ):
        for name in names:
            if not np.isfinite(getattr(record, name)).all():
                return f"{name} of {type(record).__name__} is not finite"
    if np.isnan(ahead.s).any() or np.isnan(ahead.l).any():
        return "a predicted place on the path is nan"
    return None
