"""How far along its path the ego may be at each time because of moving vehicles."""

import numpy as np

from planner.numerics.compiled import compiled
from planner.scene import Scene
from planner.states import BoolArray, FloatArray, IntArray, Path


def bound_by_vehicles(
    path: Path, scene: Scene, times: FloatArray, gap: float
) -> tuple[FloatArray, list[str | None]]:
    """Bound the place along a path by the vehicles that are or will be on it.

    Whoever is behind the ego's rear bumper does not count: it is for them to keep
    clear of what is ahead. Who already touches the ego's place cannot be helped.

    Args:
        path: Of the ego's rear axle.
        scene: Of this cycle.
        times: (n_times,) [s].
        gap: Kept along the path [m].

    Returns:
        (bound, (n_times,) [m], inf where there is none; who sets it at each time).
    """
    vehicles = scene.vehicles
    ahead = vehicles.prediction
    bound = np.full(times.size, np.inf)
    who: list[str | None] = [None] * times.size
    if not vehicles.ids:
        return bound, who
    counted = _ahead_of_rear(scene)
    if ahead.x.shape[1]:
        column = np.rint(times / ahead.step).astype(np.int64)
        column = np.minimum(column, ahead.x.shape[1] - 1)
        poses = np.stack([ahead.x, ahead.y, ahead.heading], axis=1)[:, :, column]
    else:
        now = np.stack([vehicles.x, vehicles.y, vehicles.heading], axis=1)
        poses = np.repeat(now[:, :, None], times.size, axis=2)
    index = np.full(times.size, -1, dtype=np.int64)
    first_contacts(
        np.stack([path.x, path.y, np.cos(path.heading), np.sin(path.heading)]),
        path.distance,
        np.ascontiguousarray(poses),
        np.column_stack([vehicles.length / 2.0, vehicles.width / 2.0]),
        counted,
        np.array(scene.vehicle.disc_offsets),
        scene.vehicle.disc_radius,
        bound,
        index,
    )
    bound -= gap
    names = [vehicles.ids[i] if i >= 0 else None for i in index.tolist()]
    return bound, names


def _ahead_of_rear(scene: Scene) -> BoolArray:
    """Tell which vehicles' centres are not behind the ego's rear bumper, (n,)."""
    ego, vehicles = scene.ego, scene.vehicles
    along = (vehicles.x - ego.x) * np.cos(ego.heading)
    along += (vehicles.y - ego.y) * np.sin(ego.heading)
    return np.asarray(along > -scene.vehicle.rear_overhang)


@compiled
def first_contacts(
    points: FloatArray,
    distance: FloatArray,
    poses: FloatArray,
    extents: FloatArray,
    counted: BoolArray,
    discs: FloatArray,
    radius: float,
    bound: FloatArray,
    index: IntArray,
) -> None:
    """Find the first place on the path that is taken at each time.

    Args:
        points: x, y, cos and sin of the heading, (4, n_points).
        distance: (n_points,) [m].
        poses: x, y, heading of the vehicles, (n, 3, n_times).
        extents: Half length, half width, (n, 2) [m].
        counted: (n,).
        discs: Of the ego, along its heading [m].
        radius: Of the discs [m].
        bound: Output, (n_times,) [m]; lowered where a place is taken.
        index: Output, (n_times,): who sets the bound.
    """
    for i in range(poses.shape[0]):
        if not counted[i]:
            continue
        reach = np.hypot(extents[i, 0], extents[i, 1]) + radius
        for t in range(bound.size):
            x, y = poses[i, 0, t], poses[i, 1, t]
            cos, sin = np.cos(poses[i, 2, t]), np.sin(poses[i, 2, t])
            for j in range(distance.size):
                if distance[j] >= bound[t]:
                    break
                taken = False
                for d in range(discs.size):
                    dx = points[0, j] + discs[d] * points[2, j] - x
                    dy = points[1, j] + discs[d] * points[3, j] - y
                    if dx * dx + dy * dy > reach * reach:
                        continue
                    along = max(abs(dx * cos + dy * sin) - extents[i, 0], 0.0)
                    across = max(abs(dy * cos - dx * sin) - extents[i, 1], 0.0)
                    taken = taken or along**2 + across**2 < radius * radius
                if taken:
                    if j == 0:  # already there: nothing that speed could help
                        break
                    bound[t] = distance[j]
                    index[t] = i
                    break
