"""Says why the ego stands: the room beside what stands ahead, against what it needs."""

import numpy as np

from planner.bodies import Bodies
from planner.scene import Scene

STANDING = 0.1  # a slower vehicle stands [m/s]
LOOKED_AHEAD = 40.0  # from the front bumper [m]


def room_beside(scene: Scene, bodies: Bodies, needed: float) -> str:
    """Return what the nearest body that stands in the ego's way leaves free.

    Args:
        scene: Of this cycle.
        bodies: Of its obstacles and vehicles.
        needed: Width of the ego with its margins [m].

    Returns:
        One clause without full stop; empty where nothing stands ahead in the way.
    """
    table, ego = bodies.table, scene.ego_frenet
    half_length = table.extents[:, 0] + table.extents[:, 2]
    half_width = table.extents[:, 1] + table.extents[:, 2]
    s, l = table.s[:, 0], table.l[:, 0]
    gap = s - half_length - ego.s - scene.vehicle.front_reach
    inside = np.abs(l - ego.l) < half_width + 0.5 * needed
    ahead = inside & (s > ego.s) & (gap < LOOKED_AHEAD) & (table.speed <= STANDING)
    if not ahead.any():
        return ""
    nearest = int(np.argmin(np.where(ahead, gap, np.inf)))
    left, right = scene.road.at(s[nearest : nearest + 1])
    to_left = float(left[0] - l[nearest] - half_width[nearest])
    to_right = float(l[nearest] - half_width[nearest] - right[0])
    beside = f"{max(to_left, 0.0):.1f} m free on its left, "
    beside += f"{max(to_right, 0.0):.1f} m on its right, {needed:.1f} m needed"
    name = bodies.ids[nearest]
    if max(to_left, to_right) < needed:
        return f"no way round {name}: {beside}"
    away = f"{name} stands {max(float(gap[nearest]), 0.0):.1f} m ahead"
    return f"{away}: {beside}, and no motion there is free"
