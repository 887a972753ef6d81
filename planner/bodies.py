"""Obstacles and vehicles as one table of bodies, indexed by time."""

from dataclasses import dataclass

import numpy as np

from planner.scene import Prediction, Scene
from planner.states import BoolArray, FloatArray

CORRIDOR_MARGIN = 0.3  # lateral overlap is judged this much wider than the bodies [m]


@dataclass(frozen=True, slots=True, eq=False)
class Bodies:
    """Everything to keep clear of; (n,) or (n, n_steps), static bodies first.

    A body is a rectangle of half extents grown by `radius`. `follower` marks vehicles
    behind the ego in its corridor: they react to the ego, not the ego to them.
    """

    ids: tuple[str, ...]
    poses: FloatArray  # (n, 4, n_steps): x, y [m], cos and sin of the heading
    s: FloatArray  # (n, n_steps), inf without a Frenet place [m]
    l: FloatArray
    speed: FloatArray  # along its own motion now, (n,) [m/s]
    extents: FloatArray  # (n, 3): half length, half width, radius [m]
    size: FloatArray  # circumscribed circle, r_ob of [Thesis] eq. 4.19, (n,) [m]
    follower: BoolArray  # (n,)
    n_static: int
    step: float  # between columns [s]


@dataclass(frozen=True, slots=True)
class Leader:
    """The nearest body ahead in the ego's corridor."""

    id: str
    s: FloatArray  # rearmost point at each step, (n_steps,) [m]
    speed: FloatArray  # (n_steps,) [m/s]


def bodies_of(scene: Scene, n_steps: int, step: float | None = None) -> Bodies:
    """Gather the scene's bodies on the planner's time grid.

    Args:
        scene: Of this cycle.
        n_steps: Of the planner.
        step: Between them, the scene's if None [s].

    Returns:
        The bodies; a prediction that ends early is held, one without columns stands.
    """
    fixed, moving = scene.obstacles, scene.vehicles
    n_fixed = len(fixed.ids)
    ahead = moving.prediction if moving.prediction.x.shape[1] else _standing(scene)
    ratio = (step or scene.step) / ahead.step
    column = np.rint(ratio * np.arange(n_steps)).astype(np.int64)
    column = np.minimum(column, ahead.x.shape[1] - 1)
    n = n_fixed + len(moving.ids)
    poses = np.empty((n, 4, n_steps))
    s, l = np.empty((n, n_steps)), np.empty((n, n_steps))
    fixed_s, fixed_l = scene.path.project(fixed.x, fixed.y)
    for table, static, predicted in (
        (poses[:, 0], fixed.x, ahead.x),
        (poses[:, 1], fixed.y, ahead.y),
        (poses[:, 2], np.cos(fixed.heading), np.cos(ahead.heading)),
        (poses[:, 3], np.sin(fixed.heading), np.sin(ahead.heading)),
        (s, fixed_s, ahead.s),
        (l, fixed_l, ahead.l),
    ):
        table[:n_fixed] = static[:, None]
        table[n_fixed:] = predicted[:, column]
    half_length = 0.5 * np.concatenate([fixed.length, moving.length])
    half_width = 0.5 * np.concatenate([fixed.width, moving.width])
    radius = np.concatenate([fixed.radius, np.zeros(len(moving.ids))])
    reach = half_length + radius
    overlaps = _overlaps_ego(scene, l[:, 0], half_width + radius)
    rear = scene.ego_frenet.s - scene.vehicle.rear_overhang
    follower = overlaps & (s[:, 0] + reach < rear + 0.5)
    follower[:n_fixed] = False
    return Bodies(
        (*fixed.ids, *moving.ids),
        poses,
        s,
        l,
        np.concatenate([np.zeros(n_fixed), moving.speed]),
        np.column_stack([half_length, half_width, radius]),
        np.hypot(half_length, half_width) + radius,
        follower,
        n_fixed,
        step or scene.step,
    )


def _standing(scene: Scene) -> Prediction:
    """Predict, for want of anything better, that every vehicle stays where it is."""
    now = scene.vehicles
    s, l = scene.path.project(now.x, now.y)
    columns = (now.x, now.y, now.heading, s, l)
    return Prediction(scene.step, *(values[:, None] for values in columns))


def _overlaps_ego(scene: Scene, l: FloatArray, half_width: FloatArray) -> BoolArray:
    """Tell which bodies share the ego's corridor now."""
    reach = half_width + scene.vehicle.width / 2.0 + CORRIDOR_MARGIN
    return np.abs(l - scene.ego_frenet.l) < reach


def leader_of(scene: Scene, bodies: Bodies) -> Leader | None:
    """Find the nearest body ahead in the ego's corridor, None if it is free."""
    if not bodies.ids:
        return None
    s = bodies.s[:, 0]
    candidates = (
        _overlaps_ego(scene, bodies.l[:, 0], bodies.extents[:, 1:].sum(axis=1))
        & (s > scene.ego_frenet.s)
        & np.isfinite(s)
    )
    if not candidates.any():
        return None
    index = int(np.argmin(np.where(candidates, s, np.inf)))
    reach = bodies.extents[index, 0] + bodies.extents[index, 2]
    along = bodies.s[index]
    if not np.isfinite(along).all():  # it will leave the ego's road
        return None
    speed = np.maximum(np.gradient(along, bodies.step), 0.0)
    return Leader(bodies.ids[index], along - reach, speed)
