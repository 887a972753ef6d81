"""Obstacles and vehicles as one table of bodies, indexed by time."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from planner.compiled import compiled
from planner.geometry.clearance import span_clearance
from planner.scene import Scene
from planner.states import FloatArray

CORRIDOR_MARGIN = 0.3  # lateral overlap is judged this much wider than the bodies [m]


@dataclass(frozen=True, slots=True, eq=False)
class Bodies:
    """Everything to keep clear of; (n,) or (n, n_steps), static bodies first.

    A body is a rectangle of half extents grown by `radius`. `follower` marks vehicles
    behind the ego in its corridor: they react to the ego, not the ego to them.
    """

    ids: tuple[str, ...]
    x: FloatArray  # (n, n_steps) [m]
    y: FloatArray
    cos_heading: FloatArray
    sin_heading: FloatArray
    s: FloatArray  # (n, n_steps), inf without a Frenet place [m]
    l: FloatArray
    speed: FloatArray  # along its own motion now, (n,) [m/s]
    half_length: FloatArray  # (n,) [m]
    half_width: FloatArray
    radius: FloatArray
    size: FloatArray  # circumscribed circle, r_ob of [Thesis] eq. 4.19, (n,) [m]
    follower: NDArray[np.bool_]  # (n,)
    n_static: int


@dataclass(frozen=True, slots=True)
class Leader:
    """The nearest body ahead in the ego's corridor."""

    id: str
    s: FloatArray  # rearmost point at each step, (n_steps,) [m]
    speed: FloatArray  # (n_steps,) [m/s]


def bodies_of(scene: Scene, n_steps: int) -> Bodies:
    """Gather the scene's bodies on the planner's time grid."""
    fixed, moving = scene.obstacles, scene.vehicles
    n_fixed = len(fixed.ids)
    ahead = moving.prediction
    column = np.minimum(np.arange(n_steps), ahead.x.shape[1] - 1)
    shape = (n_fixed + len(moving.ids), n_steps)
    x, y, cos_heading, sin_heading, s, l = (np.empty(shape) for _ in range(6))
    fixed_s, fixed_l = scene.path.project(fixed.x, fixed.y)
    for table, static, predicted in (
        (x, fixed.x, ahead.x),
        (y, fixed.y, ahead.y),
        (cos_heading, np.cos(fixed.heading), np.cos(ahead.heading)),
        (sin_heading, np.sin(fixed.heading), np.sin(ahead.heading)),
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
        x,
        y,
        cos_heading,
        sin_heading,
        s,
        l,
        np.concatenate([np.zeros(n_fixed), moving.speed]),
        half_length,
        half_width,
        radius,
        np.hypot(half_length, half_width) + radius,
        follower,
        n_fixed,
    )


def _overlaps_ego(scene: Scene, l: FloatArray, half_width: FloatArray) -> NDArray[np.bool_]:
    """Tell which bodies share the ego's corridor now."""
    reach = half_width + scene.vehicle.width / 2.0 + CORRIDOR_MARGIN
    return np.abs(l - scene.ego_frenet.l) < reach


def leader_of(scene: Scene, bodies: Bodies) -> Leader | None:
    """Find the nearest body ahead in the ego's corridor, None if it is free."""
    if not bodies.ids:
        return None
    s = bodies.s[:, 0]
    candidates = (
        _overlaps_ego(scene, bodies.l[:, 0], bodies.half_width + bodies.radius)
        & (s > scene.ego_frenet.s)
        & np.isfinite(s)
    )
    if not candidates.any():
        return None
    index = int(np.argmin(np.where(candidates, s, np.inf)))
    reach = bodies.half_length[index] + bodies.radius[index]
    along = bodies.s[index]
    if not np.isfinite(along).all():  # it will leave the ego's road
        return None
    speed = np.maximum(np.gradient(along, scene.step), 0.0)
    return Leader(bodies.ids[index], along - reach, speed)


@compiled
def gaps_to(
    points: FloatArray,
    x: FloatArray,
    y: FloatArray,
    cos_heading: FloatArray,
    sin_heading: FloatArray,
    half_length: FloatArray,
    half_width: FloatArray,
    radius: FloatArray,
    discs: FloatArray,
    disc_radius: float,
) -> FloatArray:
    """Smallest gap of one motion to each body, swept from step to step.

    Args:
        points: (4, n_steps): x, y, cos and sin of the heading of the rear axle; with
            one column the gaps at that moment.
        x: Body centres, (n_bodies, >= n_steps) [m].
        y: As `x`.
        cos_heading: As `x`.
        sin_heading: As `x`.
        half_length: (n_bodies,) [m].
        half_width: (n_bodies,) [m].
        radius: (n_bodies,) [m].
        discs: Disc centres along the ego's heading from the rear axle [m].
        disc_radius: [m].

    Returns:
        (n_bodies,) [m], negative on overlap.
    """
    gaps = np.full(x.shape[0], np.inf)
    for b in range(x.shape[0]):
        gaps[b], _ = span_clearance(
            points,
            x[b],
            y[b],
            cos_heading[b],
            sin_heading[b],
            0,
            points.shape[1] - 1,
            (half_length[b], half_width[b], radius[b]),
            discs,
            disc_radius,
            np.inf,
            -np.inf,
        )
    return gaps
