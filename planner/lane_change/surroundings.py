"""Obstacles and vehicles as one set of rectangles, and who only follows the ego."""

from dataclasses import replace

import numpy as np

from planner.lane_change.lane_choice import BodiesAhead
from planner.scene import Prediction, Scene, Vehicles
from planner.states import BoolArray

BEHIND = 0.5  # a front bumper this far ahead of the ego's rear is beside it [m]


def road_users(scene: Scene) -> Vehicles:
    """Put the obstacles, as vehicles that stand, before the vehicles.

    A disc becomes the square about it, a rectangle with a radius the larger rectangle:
    nothing gets smaller.
    """
    fixed, moving = scene.obstacles, scene.vehicles
    ahead = moving.prediction
    if ahead.x.shape[1] == 0:
        ahead = _standing(scene)
        moving = replace(moving, prediction=ahead)
    n_fixed, n_steps = len(fixed.ids), ahead.x.shape[1]
    if n_fixed == 0:
        return moving
    s, l = scene.path.project(fixed.x, fixed.y)
    held = (
        np.broadcast_to(column[:, None], (n_fixed, n_steps))
        for column in (fixed.x, fixed.y, fixed.heading, s, l)
    )
    moved = (ahead.x, ahead.y, ahead.heading, ahead.s, ahead.l)
    still = np.zeros(n_fixed)
    return Vehicles(
        (*fixed.ids, *moving.ids),
        np.concatenate([fixed.x, moving.x]),
        np.concatenate([fixed.y, moving.y]),
        np.concatenate([fixed.heading, moving.heading]),
        np.concatenate([still, moving.speed]),
        np.concatenate([still, moving.acceleration]),
        np.concatenate([fixed.length + 2.0 * fixed.radius, moving.length]),
        np.concatenate([fixed.width + 2.0 * fixed.radius, moving.width]),
        Prediction(
            ahead.step,
            *(np.concatenate(pair) for pair in zip(held, moved, strict=True)),
        ),
    )


def _standing(scene: Scene) -> Prediction:
    """Predict, for want of anything better, that every vehicle stays where it is."""
    now = scene.vehicles
    s, l = scene.path.project(now.x, now.y)
    columns = (now.x, now.y, now.heading, s, l)
    return Prediction(scene.step, *(values[:, None] for values in columns))


def behind_ego(scene: Scene, bodies: BodiesAhead) -> BoolArray:
    """Tell which bodies are wholly behind the ego's rear bumper, (n,)."""
    rear = scene.ego_frenet.s - scene.vehicle.rear_overhang
    return bodies.s + bodies.half_length < rear + BEHIND


def in_lane(
    scene: Scene, bodies: BodiesAhead, users: Vehicles, index: int
) -> BoolArray:
    """Tell which bodies are in a lane and will be when their lateral motion is over.

    Args:
        scene: Of this cycle, with lanes.
        bodies: On the road, in the order of `users`.
        users: With their predictions.
        index: Of the lane.

    Returns:
        (n,).
    """
    lanes = scene.lanes
    centre = np.interp(bodies.s, lanes.s, lanes.centre[index])
    half = 0.5 * np.interp(bodies.s, lanes.s, lanes.width[index])
    ahead = users.prediction
    later = np.where(np.isfinite(ahead.s[:, -1]), ahead.l[:, -1], bodies.l)
    now = np.abs(bodies.l - centre) < half
    return np.asarray(now & (np.abs(later - centre) < half))
