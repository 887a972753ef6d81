"""Obstacles and vehicles as one table of bodies, indexed by time."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from planner.numerics.compiled import compiled, inlined
from planner.reference_path.path import PathTable
from planner.reference_path.projection import EVERYWHERE, NO_DIRECTION, foot
from planner.scene import Prediction, Scene
from planner.shapes.disc_clearance import gaps_to
from planner.states import BoolArray, FloatArray, Trajectory

CORRIDOR_MARGIN = 0.3  # lateral overlap is judged this much wider than the bodies [m]


class BodyTable(NamedTuple):
    """Numbers of all bodies, static ones first; arrays are (n,) or (n, n_steps).

    A body is a rectangle of half extents grown by `radius`. `follower` marks vehicles
    behind the ego in its corridor: they react to the ego, not the ego to them.
    """

    poses: FloatArray  # (n, 4, n_steps): x, y [m], cos and sin of the heading
    s: FloatArray  # (n, n_steps), inf without a Frenet place [m]
    l: FloatArray
    speed: FloatArray  # along its own motion now, (n,) [m/s]
    extents: FloatArray  # (n, 3): half length, half width, radius [m]
    size: FloatArray  # circumscribed circle, r_ob of [Thesis] eq. 4.19, (n,) [m]
    stride: FloatArray  # longest way in one step, (n,) [m]
    spin: FloatArray  # largest turn in one step, (n,) [rad]
    follower: BoolArray  # (n,)
    n_static: int


@dataclass(frozen=True, slots=True, eq=False)
class Bodies:
    """Everything to keep clear of, with names and the step of its columns."""

    ids: tuple[str, ...]
    table: BodyTable
    step: float  # between columns [s]


@dataclass(frozen=True, slots=True)
class Leader:
    """The nearest body ahead in the ego's corridor."""

    id: str
    s: FloatArray  # rearmost point at each step, (n_steps,) [m]
    speed: FloatArray  # (n_steps,) [m/s]
    l: FloatArray  # of its centre, (n_steps,) [m]
    half_width: float  # across itself or along, whichever is less [m]


def bodies_of(scene: Scene, n_steps: int, step: float | None = None) -> Bodies:
    """Collect the scene's bodies on the planner's time grid.

    Args:
        scene: Of this cycle.
        n_steps: Of the planner.
        step: Between them, the scene's if None [s].

    Returns:
        The bodies; a prediction that ends early is held, one without columns stands.
    """
    fixed, moving, ego = scene.obstacles, scene.vehicles, scene.ego_frenet
    ahead = moving.prediction if moving.prediction.x.shape[1] else _standing(scene)
    table = _gather(
        scene.path.table,
        (fixed.x, fixed.y, fixed.heading, fixed.length, fixed.width, fixed.radius),
        (moving.speed, moving.length, moving.width),
        (ahead.x, ahead.y, ahead.heading, ahead.s, ahead.l),
        (step or scene.step) / ahead.step,
        n_steps,
        (ego.s - scene.vehicle.rear_overhang, ego.l, scene.vehicle.width / 2.0),
    )
    return Bodies((*fixed.ids, *moving.ids), table, step or scene.step)


@compiled
def _gather(
    path: PathTable,
    fixed: tuple[FloatArray, ...],
    moving: tuple[FloatArray, ...],
    ahead: tuple[FloatArray, ...],
    ratio: float,
    n_steps: int,
    ego: tuple[float, float, float],
) -> BodyTable:
    """Fill the table from the columns of obstacles and predicted vehicles.

    Args:
        path: Tables of the reference path.
        fixed: x, y, heading, length, width, radius, (n_fixed,).
        moving: Speed, length, width, (n_moving,).
        ahead: x, y, heading, s, l, (n_moving, columns).
        ratio: Columns in one step.
        n_steps: Wanted.
        ego: s of its rear, l, and half its width [m].
    """
    x, y, heading, length, width, radius = fixed
    speed_now, moving_length, moving_width = moving
    n_fixed, n = x.size, x.size + speed_now.size
    poses = np.empty((n, 4, n_steps))
    s, l = np.empty((n, n_steps)), np.empty((n, n_steps))
    speed, stride, spin = np.zeros(n), np.zeros(n), np.zeros(n)
    extents = np.zeros((n, 3))
    for b in range(n_fixed):
        foot_s, foot_l = foot(
            path.knots, path.bins, path.blocks, x[b], y[b], EVERYWHERE, NO_DIRECTION
        )
        cos, sin = math.cos(heading[b]), math.sin(heading[b])
        extents[b, 0] = 0.5 * length[b]
        extents[b, 1] = 0.5 * width[b]
        extents[b, 2] = radius[b]
        for i in range(n_steps):
            poses[b, 0, i], poses[b, 1, i] = x[b], y[b]
            poses[b, 2, i], poses[b, 3, i] = cos, sin
            s[b, i], l[b, i] = foot_s, foot_l
    for v in range(speed_now.size):
        b = n_fixed + v
        speed[b] = speed_now[v]
        extents[b, 0] = 0.5 * moving_length[v]
        extents[b, 1] = 0.5 * moving_width[v]
        stride[b], spin[b] = _copy_prediction(ahead, v, ratio, poses, s, l, b)
    size = np.empty(n)
    for b in range(n):
        size[b] = math.hypot(extents[b, 0], extents[b, 1]) + extents[b, 2]
    follower = _followers(s, l, extents, n_fixed, ego)
    return BodyTable(poses, s, l, speed, extents, size, stride, spin, follower, n_fixed)


@inlined
def _copy_prediction(
    ahead: tuple[FloatArray, ...],
    v: int,
    ratio: float,
    poses: FloatArray,
    s: FloatArray,
    l: FloatArray,
    b: int,
) -> tuple[float, float]:
    """Copy one vehicle's columns; return (longest way [m], largest turn [rad])."""
    x, y, heading, ahead_s, ahead_l = ahead
    last = x.shape[1] - 1
    stride2 = spin = 0.0
    was = math.nan
    cos = sin = 0.0
    for i in range(s.shape[1]):
        k = min(int(np.rint(ratio * i)), last)
        if heading[v, k] != was:
            turned = abs(heading[v, k] - was)
            cos, sin = math.cos(heading[v, k]), math.sin(heading[v, k])
            if i > 0:  # a heading may be given a full turn on
                spin = max(spin, min(turned, 2.0))
            was = heading[v, k]
        poses[b, 0, i], poses[b, 1, i] = x[v, k], y[v, k]
        poses[b, 2, i], poses[b, 3, i] = cos, sin
        s[b, i], l[b, i] = ahead_s[v, k], ahead_l[v, k]
        if i > 0:
            dx, dy = (
                poses[b, 0, i] - poses[b, 0, i - 1],
                poses[b, 1, i] - poses[b, 1, i - 1],
            )
            stride2 = max(stride2, dx * dx + dy * dy)
    return math.sqrt(stride2), spin


@inlined
def _overlaps(
    b: int, l: FloatArray, extents: FloatArray, ego_l: float, half_width: float
) -> bool:
    """Check whether a body shares the ego's corridor now."""
    reach = extents[b, 1] + extents[b, 2] + half_width + CORRIDOR_MARGIN
    return bool(abs(l[b, 0] - ego_l) < reach)


@inlined
def _followers(
    s: FloatArray,
    l: FloatArray,
    extents: FloatArray,
    n_static: int,
    ego: tuple[float, float, float],
) -> BoolArray:
    """Mark the vehicles behind the ego in its corridor."""
    rear, ego_l, half_width = ego
    follower = np.zeros(s.shape[0], np.bool_)
    for b in range(n_static, s.shape[0]):
        behind = s[b, 0] + extents[b, 0] + extents[b, 2] < rear + 0.5
        follower[b] = behind and _overlaps(b, l, extents, ego_l, half_width)
    return follower


def _standing(scene: Scene) -> Prediction:
    """Predict that every vehicle stays where it is."""
    now = scene.vehicles
    s, l = scene.path.project(now.x, now.y)
    columns = (now.x, now.y, now.heading, s, l)
    return Prediction(scene.step, *(values[:, None] for values in columns))


def leader_of(scene: Scene, bodies: Bodies) -> Leader | None:
    """Find the nearest body ahead in the ego's corridor, None if it is free."""
    index, s, speed = _nearest_ahead(
        bodies.table,
        scene.ego_frenet.s,
        scene.ego_frenet.l,
        scene.vehicle.width / 2.0,
        bodies.step,
    )
    if index < 0:
        return None
    *halves, radius = bodies.table.extents[index].tolist()
    l = bodies.table.l[index]
    return Leader(bodies.ids[index], s, speed, l, min(halves) + radius)


@compiled
def _nearest_ahead(
    table: BodyTable,
    ego_s: float,
    ego_l: float,
    half_width: float,
    step: float,
) -> tuple[int, FloatArray, FloatArray]:
    """Return (body, its rearmost point, its speed); body -1 if there is none."""
    s, l, extents = table.s, table.l, table.extents
    nearest, found = np.inf, -1
    for b in range(s.shape[0]):
        ahead = ego_s < s[b, 0] < nearest
        if ahead and _overlaps(b, l, extents, ego_l, half_width):
            nearest, found = s[b, 0], b
    n = s.shape[1] if found >= 0 else 0
    rear, speed = np.empty(n), np.empty(n)
    stays = True
    for i in range(n):
        rear[i] = s[found, i] - extents[found, 0] - extents[found, 2]
        before, after = max(i - 1, 0), min(i + 1, n - 1)
        moved = s[found, after] - s[found, before]
        speed[i] = max(moved / (step * (after - before)), 0.0)
        stays = stays and np.isfinite(rear[i])  # on the ego's road
    return found if stays else -1, rear, speed


def touched_by(
    trajectory: Trajectory,
    bodies: Bodies,
    ignored: BoolArray,
    discs: Sequence[float],
    radius: float,
    least: float | FloatArray,
) -> str | None:
    """Return the id of the body that a trajectory comes nearest to, if too near.

    Args:
        trajectory: Of the ego, at its own times.
        bodies: The column nearest in time counts; what lies beyond the last is not
            looked at.
        ignored: Bodies that do not count, (n,).
        discs: Of the ego, along its heading [m].
        radius: Of the discs [m].
        least: Gap that is too small, one for all or one for each [m].
    """
    column = np.rint(trajectory.t / bodies.step).astype(np.int64)
    column = column[column < bodies.table.poses.shape[2]]
    heading = trajectory.heading
    points = np.stack([trajectory.x, trajectory.y, np.cos(heading), np.sin(heading)])
    gaps = gaps_to(
        np.ascontiguousarray(points[:, : column.size]),
        np.ascontiguousarray(bodies.table.poses[:, :, column]),
        bodies.table.extents,
        np.array(discs),
        radius,
    )
    hits = np.flatnonzero((gaps < least) & ~ignored)
    return bodies.ids[int(hits[np.argmin(gaps[hits])])] if hits.size else None
