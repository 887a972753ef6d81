"""How far the ego's body reaches beyond the road's edges on a path."""

import math

import numpy as np

from planner.numerics.compiled import compiled
from planner.numerics.interpolation import interpolated
from planner.reference_path.linear_curvature import point_at
from planner.reference_path.path import PathTable
from planner.scene import OFF_ROAD_TOLERANCE, Scene
from planner.states import FloatArray, Path

ROUNDS = 2  # of Newton's method for the foot point of a corner


def stays_on_road(scene: Scene, path: Path, until: float = math.inf) -> bool:
    """Check that no point of a path takes the body farther off the road than it is now.

    Args:
        scene: Of this cycle.
        path: Of the rear axle, from where the ego is.
        until: Distance along the path up to which it is checked [m].
    """
    return worst_reach(scene, path, until) <= OFF_ROAD_TOLERANCE


def worst_reach(scene: Scene, path: Path, until: float = math.inf) -> float:
    """Return how far beyond the edges a path takes the body, <= 0 inside [m].

    Where the body is over an edge already, as far as it is now does not count.
    """
    n = int(np.searchsorted(path.distance, until, side="right"))
    reach = reach_beyond_edges(scene, path, max(n, 1))
    return float(reach.max()) - max(float(reach[0]), 0.0)


def reach_beyond_edges(scene: Scene, path: Path, n: int) -> FloatArray:
    """Return how far the body is beyond the road's edges, negative inside, (n,) [m].

    Corners and the middles of the sides count, projected onto the reference path.

    Args:
        scene: Of this cycle.
        path: Of the rear axle.
        n: Number of points of the path that are looked at.
    """
    vehicle, road = scene.vehicle, scene.road
    return _beyond(
        scene.path.table,
        (path.x[:n], path.y[:n], path.heading[:n], path.s[:n]),
        (-vehicle.rear_overhang, vehicle.front_reach, 0.5 * vehicle.width),
        (road.s, road.left, road.right),
    )


@compiled
def _beyond(
    reference: PathTable,
    poses: tuple[FloatArray, FloatArray, FloatArray, FloatArray],
    body: tuple[float, float, float],
    edges: tuple[FloatArray, FloatArray, FloatArray],
) -> FloatArray:
    """Compute what `reach_beyond_edges` returns.

    Args:
        reference: Tables of the reference path.
        poses: x, y, heading and s of the rear axle, (n,) each.
        body: Ends of the rectangle from the rear axle, and its half width [m].
        edges: s, left and right of the road.
    """
    x, y, heading, s = poses
    rear, front, half = body
    n = x.size
    at, offset = np.empty(6 * n), np.empty(6 * n)
    for i in range(n):
        cos, sin = math.cos(heading[i]), math.sin(heading[i])
        for k in range(6):
            along = rear + 0.5 * (front - rear) * (k // 2)
            across = half if k % 2 else -half
            corner_x = x[i] + along * cos - across * sin
            corner_y = y[i] + along * sin + across * cos
            place, l = s[i] + along, 0.0
            for _ in range(ROUNDS):
                px, py, c, w, kappa, _, _ = point_at(
                    reference.knots, reference.bins, place
                )
                dx, dy = corner_x - px, corner_y - py
                ahead, l = dx * c + dy * w, dy * c - dx * w
                place += ahead / max(1.0 - kappa * l, 0.1)
            at[k * n + i], offset[k * n + i] = place, l
    left = interpolated(at, edges[0], edges[1])
    right = interpolated(at, edges[0], edges[2])
    reach = np.full(n, -np.inf)
    for k in range(6 * n):
        beyond = max(offset[k] - left[k], right[k] - offset[k])
        reach[k % n] = max(reach[k % n], beyond)
    return reach
