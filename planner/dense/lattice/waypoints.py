"""Where the lattices have their waypoints; [Thesis] 5.4 and the conventional [104]."""

from dataclasses import dataclass

import numpy as np

from planner.dense.field import Cover, ObstacleField
from planner.dense.lattice.gates import (
    closed_intervals,
    gate_radius,
    gate_row,
    strip_points,
)
from planner.dense.lattice.layers import layers
from planner.dense.lattice.profile_map import obstacle_influence, profile
from planner.dense.settings import LatticeSettings
from planner.numerics.compiled import compiled, inlined
from planner.states import FloatArray, IntArray


@dataclass(frozen=True, slots=True, eq=False)
class Waypoints:
    """Layers ahead of the ego by s; points from `count` on are padding."""

    s: FloatArray  # (n_layers,) [m]
    l: FloatArray  # (n_layers, n_points), growing in each row [m]
    count: IntArray  # (n_layers,)

    @property
    def total(self) -> int:
        """Number of waypoints, the ego left out."""
        return int(self.count.sum())


def uniform_waypoints(
    field: ObstacleField,
    cover: Cover,
    s_start: float,
    s_end: float,
    settings: LatticeSettings,
) -> Waypoints:
    """Spread waypoints evenly, whatever stands there; 15 x 7 in the method [104].

    Args:
        field: Gives the road.
        cover: Gives the body's width.
        s_start: Where the ego is [m].
        s_end: Where the last layer is [m].
        settings: Numbers of layers and points.
    """
    n = settings.uniform_layers
    s = s_start + (s_end - s_start) * np.arange(1, n + 1) / n
    left, right, _ = field.road_at(s)
    low, high = right + cover.half_width, left - cover.half_width
    share = np.linspace(0.0, 1.0, settings.free_points)
    l = low[:, None] + (high - low)[:, None] * share
    return Waypoints(s, l, np.where(high >= low, settings.free_points, 0))


def adaptive_waypoints(
    field: ObstacleField,
    cover: Cover,
    ego: tuple[float, float],
    s_end: float,
    settings: LatticeSettings,
) -> Waypoints:
    """Place layers and waypoints by the obstacles; [Thesis] 5.4.

    Args:
        field: Obstacles and road.
        cover: Of the ego.
        ego: (s, l) [m].
        s_end: Where the last layer is [m].
        settings: See there.
    """
    s, at_obstacle = layers(field.s - np.mean(cover.offsets), ego[0], s_end, settings)
    left, right, _ = field.road_at(s)
    low, high = right + cover.half_width, left - cover.half_width
    l, count = fill_layers(
        s,
        at_obstacle,
        low,
        high,
        (field.s, field.l, field.radius),
        gate_radius(field.radius, cover, settings),
        np.array(cover.offsets),
        ego,
        cover.radius,
        settings.free_points,
        settings.regions,
        settings.resolution,
        (settings.position_weight, settings.size_weight, settings.distance_weight),
        1 if settings.narrow_strips else 0,
    )
    return Waypoints(s, l, count)


@inlined
def waypoint_counts(cost: FloatArray, gate: FloatArray, resolution: int) -> FloatArray:
    """One row of N: waypoints in each region; [Thesis] eq. 5.11, 5.12.

    Args:
        cost: v_ij of the regions, (m,).
        gate: b_ij, (m,).
        resolution: U.

    Returns:
        Whole numbers, (m,).
    """
    highest = max(cost.max(), 1e-300)
    share = np.floor(resolution * (1.0 - cost / highest) + 0.5)
    return np.asarray(gate * share)


@compiled
def fill_layers(
    s: FloatArray,
    at_obstacle: IntArray,
    low: FloatArray,
    high: FloatArray,
    obstacles: tuple[FloatArray, FloatArray, FloatArray],
    reach: FloatArray,
    offsets: FloatArray,
    ego: tuple[float, float],
    ego_radius: float,
    free_points: int,
    regions: int,
    resolution: int,
    weights: tuple[float, float, float],
    narrow_strips: int,
) -> tuple[FloatArray, IntArray]:
    """Fill each layer: by the map beside obstacles, evenly elsewhere.

    Args:
        s: Layers, (n_layers,) [m].
        at_obstacle: 1 where obstacles set the layer, (n_layers,).
        low: Right end of each layer, (n_layers,) [m].
        high: Left end of each layer, (n_layers,) [m].
        obstacles: s, l, r_ob, (n,) each [m].
        reach: Radius that closes regions, (n,) [m].
        offsets: Of the ego's discs [m].
        ego: (s, l) [m].
        ego_radius: r_ev [m].
        free_points: On a free layer.
        regions: m.
        resolution: U.
        weights: w0 [1/m], w1, w2.
        narrow_strips: 1 if strips without an open region get a waypoint too.

    Returns:
        (l of the waypoints, (n_layers, n_points) [m]; their number, (n_layers,)).
    """
    influence = np.empty(obstacles[0].size)
    for i in range(influence.size):
        obstacle = obstacles[0][i], obstacles[1][i], obstacles[2][i]
        influence[i] = obstacle_influence(
            obstacle, ego, ego_radius, weights[1], weights[2]
        )
    most = max(free_points, regions * resolution + influence.size + 1)
    l = np.zeros((s.size, most))
    count = np.zeros(s.size, dtype=np.int64)
    for k in range(s.size):
        if high[k] < low[k]:
            continue
        if at_obstacle[k] == 0:
            points = even_points(low[k], high[k], free_points)
        else:
            edges = low[k] + (high[k] - low[k]) * np.arange(regions + 1) / regions
            cuts = closed_intervals(s[k], obstacles[0], obstacles[1], reach, offsets)
            cost = region_costs(
                s[k] + offsets.mean(), edges, obstacles, influence, weights[0]
            )
            numbers = waypoint_counts(cost, gate_row(edges, cuts), resolution)
            points = region_points(edges, numbers)
            if narrow_strips == 1:
                added = strip_points(points, low[k], high[k], cuts)
                points = np.sort(np.concatenate((points, added)))
        count[k] = points.size
        l[k, : points.size] = points
    return l, count


@inlined
def even_points(low: float, high: float, n: int) -> FloatArray:
    """Spread n points from `low` to `high`, ends included, (n,) [m]."""
    points = np.empty(n)
    for j in range(n):
        points[j] = low + (high - low) * j / max(n - 1, 1)
    return points


@inlined
def region_costs(
    s: float,
    edges: FloatArray,
    obstacles: tuple[FloatArray, FloatArray, FloatArray],
    influence: FloatArray,
    position_weight: float,
) -> FloatArray:
    """One row of V: the map over each region; [Thesis] eq. 5.7, 5.8, midpoint rule.

    Args:
        s: Where the map is cut [m].
        edges: Of the regions, growing, (m + 1,) [m].
        obstacles: s, l, r_ob, (n,) each [m].
        influence: h_i, (n,) [m].
        position_weight: w0 [1/m].

    Returns:
        v_ij, (m,) [m²].
    """
    cost = np.empty(edges.size - 1)
    for j in range(cost.size):
        middle = 0.5 * (edges[j] + edges[j + 1])
        value = profile(
            s, middle, obstacles[0], obstacles[1], influence, position_weight
        )
        cost[j] = (edges[j + 1] - edges[j]) * value
    return cost


@inlined
def region_points(edges: FloatArray, numbers: FloatArray) -> FloatArray:
    """Spread the given numbers of points evenly inside their regions [m]."""
    points = np.empty(int(numbers.sum()))
    k = 0
    for j in range(numbers.size):
        n = int(numbers[j])
        for i in range(n):
            points[k] = edges[j] + (edges[j + 1] - edges[j]) * (i + 0.5) / n
            k += 1
    return points
