"""The bound that moving vehicles set on the ego's place along its path."""

from typing import NamedTuple

import numpy as np

from planner.dense.field import Cover
from planner.numerics.compiled import compiled
from planner.scene import Scene
from planner.states import BoolArray, FloatArray, IntArray, Path


def bound_by_vehicles(
    path: Path,
    scene: Scene,
    times: FloatArray,
    gap: float,
    yield_to: BoolArray | None = None,
) -> tuple[FloatArray, list[str | None]]:
    """Bound the place along a path by the vehicles that are or will be on it.

    Vehicles behind the ego's rear bumper do not count, but for those that it yields to:
    they have to keep clear of what is ahead. A vehicle that already touches the ego's
    place sets no bound.

    Args:
        path: Of the ego's rear axle.
        scene: Of this cycle.
        times: (n_times,) [s].
        gap: Kept along the path [m].
        yield_to: Vehicles behind that are let by, (n,); none if None.

    Returns:
        (bound, (n_times,) [m], inf where there is none; the vehicle that sets it at
        each time).
    """
    vehicles = scene.vehicles
    ahead = vehicles.prediction
    bound = np.full(times.size, np.inf)
    blockers: list[str | None] = [None] * times.size
    if not vehicles.ids:
        return bound, blockers
    counted = _ahead_of_rear(scene)
    if yield_to is not None:
        counted |= yield_to
    if ahead.x.shape[1]:
        column = np.rint(times / ahead.step).astype(np.int64)
        column = np.minimum(column, ahead.x.shape[1] - 1)
        poses = np.stack([ahead.x, ahead.y, ahead.heading], axis=1)[:, :, column]
    else:
        now = np.stack([vehicles.x, vehicles.y, vehicles.heading], axis=1)
        poses = np.repeat(now[:, :, None], times.size, axis=2)
    index = np.full(times.size, -1, dtype=np.int64)
    points = EgoPoints(
        path.x, path.y, np.cos(path.heading), np.sin(path.heading), path.distance
    )
    others = MovingRectangles(
        np.ascontiguousarray(poses), vehicles.length / 2.0, vehicles.width / 2.0
    )
    cover = Cover.of(scene.vehicle)
    offsets = np.array(cover.offsets)
    first_contacts(points, others, counted, offsets, cover.radius, bound, index)
    bound -= gap
    names = [vehicles.ids[i] if i >= 0 else None for i in index.tolist()]
    return bound, names


def _ahead_of_rear(scene: Scene) -> BoolArray:
    """Return which vehicles' centres are not behind the ego's rear bumper, (n,)."""
    ego, vehicles = scene.ego, scene.vehicles
    along = (vehicles.x - ego.x) * np.cos(ego.heading)
    along += (vehicles.y - ego.y) * np.sin(ego.heading)
    return np.asarray(along > -scene.vehicle.rear_overhang)


class EgoPoints(NamedTuple):
    """Points of the ego's path; arrays are (n_points,)."""

    x: FloatArray  # [m]
    y: FloatArray  # [m]
    cos: FloatArray  # of the heading
    sin: FloatArray
    distance: FloatArray  # [m]


class MovingRectangles(NamedTuple):
    """Vehicles over time."""

    poses: FloatArray  # x, y, heading, (n, 3, n_times)
    half_length: FloatArray  # (n,) [m]
    half_width: FloatArray  # (n,) [m]


@compiled
def first_contacts(
    path: EgoPoints,
    others: MovingRectangles,
    counted: BoolArray,
    offsets: FloatArray,
    radius: float,
    bound: FloatArray,
    index: IntArray,
) -> None:
    """Find the first place on the path that is taken at each time.

    Args:
        path: Of the ego.
        others: Vehicles.
        counted: Those that count, (n,).
        offsets: Of the ego's discs, along its heading [m].
        radius: Of the discs [m].
        bound: Output, (n_times,) [m]; lowered where a place is taken.
        index: Output, (n_times,): the vehicle that sets the bound.
    """
    poses = others.poses
    for i in range(poses.shape[0]):
        if not counted[i]:
            continue
        half_length, half_width = others.half_length[i], others.half_width[i]
        reach = np.hypot(half_length, half_width) + radius
        for t in range(bound.size):
            x, y = poses[i, 0, t], poses[i, 1, t]
            cos, sin = np.cos(poses[i, 2, t]), np.sin(poses[i, 2, t])
            for j in range(path.distance.size):
                if path.distance[j] >= bound[t]:
                    break
                taken = False
                for offset in offsets:
                    dx = path.x[j] + offset * path.cos[j] - x
                    dy = path.y[j] + offset * path.sin[j] - y
                    if dx * dx + dy * dy > reach * reach:
                        continue
                    along = max(abs(dx * cos + dy * sin) - half_length, 0.0)
                    across = max(abs(dy * cos - dx * sin) - half_width, 0.0)
                    taken = taken or along**2 + across**2 < radius * radius
                if taken:
                    if j == 0:  # already there: nothing that speed could help
                        break
                    bound[t] = path.distance[j]
                    index[t] = i
                    break
