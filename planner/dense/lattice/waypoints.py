"""Where the lattices have their waypoints; [Thesis] 5.4 and the conventional [104]."""

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from planner.dense.field import Cover, Discs, FrenetObstacles, ObstacleColumns
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
    field: FrenetObstacles,
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
    field: FrenetObstacles,
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
    spans = LayerSpans(
        s, at_obstacle, right + cover.half_width, left - cover.half_width
    )
    rules = WaypointRules(
        settings.free_points,
        settings.regions,
        settings.resolution,
        settings.position_weight,
        settings.size_weight,
        settings.distance_weight,
        settings.narrow_strips,
    )
    l, count = fill_layers(
        spans,
        field.obstacle_columns(),
        gate_radius(field.radius, cover, settings),
        cover.discs(),
        ego,
        rules,
    )
    return Waypoints(s, l, count)


class LayerSpans(NamedTuple):
    """Layers and the room on each; arrays are (n_layers,)."""

    s: FloatArray  # [m]
    at_obstacle: IntArray  # 1 where obstacles set the layer, else 0
    low: FloatArray  # right end [m]
    high: FloatArray  # left end [m]


class WaypointRules(NamedTuple):
    """How waypoints are spread; letters as in [Thesis] 5.3, 5.4."""

    free_points: int  # on a free layer
    regions: int  # m
    resolution: int  # U
    position_weight: float  # w0 [1/m]
    size_weight: float  # w1
    distance_weight: float  # w2
    narrow_strips: bool  # strips without an open region get a waypoint too


@inlined
def waypoint_counts(cost: FloatArray, gate: FloatArray, resolution: int) -> FloatArray:
    """Compute one row of N: waypoints in each region; [Thesis] eq. 5.11, 5.12.

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
    spans: LayerSpans,
    obstacles: ObstacleColumns,
    reach: FloatArray,
    discs: Discs,
    ego: tuple[float, float],
    rules: WaypointRules,
) -> tuple[FloatArray, IntArray]:
    """Fill each layer: by the map beside obstacles, evenly elsewhere.

    Args:
        spans: The layers.
        obstacles: Of the field.
        reach: Radius about each that closes regions, (n_obstacles,) [m].
        discs: Of the ego.
        ego: (s, l) [m].
        rules: See there.

    Returns:
        (l of the waypoints, (n_layers, n_points) [m]; their number, (n_layers,)).
    """
    influence = influences(obstacles, ego, discs.radius, rules)
    most = max(rules.free_points, rules.regions * rules.resolution + influence.size + 1)
    n_layers, regions = spans.s.size, rules.regions
    l = np.zeros((n_layers, most))
    count = np.zeros(n_layers, dtype=np.int64)
    for k in range(n_layers):
        s, low, high = spans.s[k], spans.low[k], spans.high[k]
        if high < low:
            continue
        if spans.at_obstacle[k] == 0:
            points = even_points(low, high, rules.free_points)
        else:
            edges = low + (high - low) * np.arange(regions + 1) / regions
            cuts = closed_intervals(s, obstacles, reach, discs.offset)
            cost = region_costs(
                s + discs.offset.mean(),
                edges,
                obstacles,
                influence,
                rules.position_weight,
            )
            numbers = waypoint_counts(cost, gate_row(edges, cuts), rules.resolution)
            points = region_points(edges, numbers)
            if rules.narrow_strips:
                added = strip_points(points, low, high, cuts)
                points = np.sort(np.concatenate((points, added)))
        count[k] = points.size
        l[k, : points.size] = points
    return l, count


@inlined
def influences(
    obstacles: ObstacleColumns,
    ego: tuple[float, float],
    ego_radius: float,
    rules: WaypointRules,
) -> FloatArray:
    """Return the weight of each obstacle for the ego, h_i, (n_obstacles,) [m]."""
    ego_s, ego_l = ego
    influence = np.empty(obstacles.s.size)
    for i in range(influence.size):
        away = math.hypot(ego_s - obstacles.s[i], ego_l - obstacles.l[i])
        influence[i] = obstacle_influence(
            away,
            obstacles.radius[i],
            ego_radius,
            rules.size_weight,
            rules.distance_weight,
        )
    return influence


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
    obstacles: ObstacleColumns,
    influence: FloatArray,
    position_weight: float,
) -> FloatArray:
    """Compute one row of V, the map over each region; [Thesis] eq. 5.7, 5.8.

    The integral is by the midpoint rule.

    Args:
        s: Where the map is cut [m].
        edges: Of the regions, growing, (m + 1,) [m].
        obstacles: Of the field.
        influence: h_i, (n,) [m].
        position_weight: w0 [1/m].

    Returns:
        v_ij, (m,) [m²].
    """
    cost = np.empty(edges.size - 1)
    for j in range(cost.size):
        middle = 0.5 * (edges[j] + edges[j + 1])
        value = profile(s, middle, obstacles.s, obstacles.l, influence, position_weight)
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
