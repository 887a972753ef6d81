"""All edges of a layered graph and the cheapest chain of them; [Thesis] 5.5.

A *path* of [Thesis] table 5.2 is an edge here: 15 + 6 · 15² = 1365 for the
conventional method.
"""

import math
from dataclasses import dataclass

import numpy as np

from planner.dense.field import Cover, ObstacleField
from planner.dense.lattice.coarse_path import CoarsePath, PathStart
from planner.dense.lattice.edge_check import (
    FREE,
    edge_verdict,
    obstacle_windows,
    road_table,
)
from planner.dense.lattice.edges import (
    blend_price,
    blend_span,
    blend_table,
    fill_blend,
    fill_quintic,
    printed_safety,
    quintic_price,
)
from planner.dense.lattice.waypoints import Waypoints
from planner.dense.settings import EdgeChecks, LatticeSettings, SafetyCost
from planner.numerics.compiled import compiled
from planner.numerics.polynomials import quintic_coefficients
from planner.states import FloatArray, IntArray, freeze


@dataclass(frozen=True, slots=True)
class LatticeSearch:
    """Outcome of one search; the path is None if not even one edge is free.

    `complete` tells whether it reaches the last layer; if not, the path is the
    cheapest one to the farthest layer that can be reached.
    """

    path: CoarsePath | None
    complete: bool
    waypoints: int
    edges: int  # beta of [Thesis] eq. 5.33
    collision_edges: int
    off_road_edges: int  # free of collisions, but not on the road
    sharp_edges: int  # neither of the two, but beyond the curvature bound
    checked_edges: int  # all, unless only needed ones are checked

    @property
    def effectiveness(self) -> float:
        """Share of checked edges free of collisions; [Thesis] eq. 5.33."""
        return 1.0 - self.collision_edges / max(self.checked_edges, 1)


def search_lattice(
    field: ObstacleField,
    cover: Cover,
    start: PathStart,
    waypoints: Waypoints,
    settings: LatticeSettings,
) -> LatticeSearch:
    """Check and price every edge, and find the cheapest chain.

    Args:
        field: Obstacles and road.
        cover: Of the ego.
        start: Where the path begins.
        waypoints: Of any method.
        settings: See there.
    """
    curvature = field.road_at(field.s)[2]
    nodes, costs, counts = dynamic_programming(
        np.array(start),
        waypoints.s,
        waypoints.l,
        waypoints.count,
        np.column_stack([field.s, field.l, field.radius, curvature]),
        np.column_stack([field.road_s, field.left, field.right, field.curvature]),
        np.array(cover.offsets),
        (cover.radius + settings.margin, cover.half_length, cover.half_width),
        settings.sample_step,
        settings.max_curvature,
        (settings.offset_weight, settings.smoothness_weight, settings.safety_weight),
        settings.clearance,
        (
            int(settings.safety_cost is SafetyCost.PRINTED),
            int(settings.edge_checks is EdgeChecks.NEEDED),
        ),
    )
    reached = int(np.argmin(nodes)) if np.any(nodes < 0) else nodes.size
    path = None
    if reached > 0:
        l = waypoints.l[np.arange(reached), nodes[:reached]]
        path = CoarsePath(
            freeze([start[0], *waypoints.s[:reached]]),
            freeze([start[1], *l]),
            start,
            float(costs),
        )
    complete = 0 < reached == nodes.size
    return LatticeSearch(path, complete, waypoints.total, *counts.tolist())


@compiled
def dynamic_programming(
    start: FloatArray,
    layer_s: FloatArray,
    layer_l: FloatArray,
    count: IntArray,
    obstacles: FloatArray,
    roads: FloatArray,
    offsets: FloatArray,
    body: tuple[float, float, float],
    sample_step: float,
    max_curvature: float,
    weights: tuple[float, float, float],
    clearance: float,
    modes: tuple[int, int],
) -> tuple[IntArray, float, IntArray]:
    """Check and price all edges layer by layer; keep the cheapest way to each node.

    Args:
        start: s, l, l', l'' of the ego.
        layer_s: (n_layers,) [m].
        layer_l: (n_layers, n_points) [m].
        count: Valid points of each layer, (n_layers,).
        obstacles: s, l, r_ob, road curvature, (n_obstacles, 4).
        roads: s, left, right, curvature, (m, 4).
        offsets: Of the ego's discs [m].
        body: Disc radius with the margin, half length, half width [m].
        sample_step: Between checked points, at most [m].
        max_curvature: [1/m].
        weights: w3, w4, w5 of eq. 5.19.
        clearance: Gap from which on an obstacle costs nothing [m].
        modes: 1 for eq. 5.22, 0 for the clearance cost; 1 to leave out edges that
            cannot become the cheapest, 0 to check all.

    Returns:
        (Index of the chosen point on each layer, -1 beyond the last that can be
        reached; its cost; number of edges: all, in collision, off the road, too
        sharp, checked.)
    """
    n_layers = layer_s.size
    width = max(layer_l.shape[1], 1)
    best = np.full((n_layers + 1, width), np.inf)
    best[0, 0] = 0.0
    parent = np.full((n_layers, width), -1, dtype=np.int64)
    counts = np.zeros(5, dtype=np.int64)
    for k in range(n_layers):
        before = k - 1
        cross_gap(
            start,
            k,
            (start[0] if k == 0 else layer_s[before], layer_s[k]),
            start[1:2] if k == 0 else layer_l[before, : count[before]],
            layer_l[k, : count[k]],
            best[k],
            best[k + 1],
            parent[k],
            counts,
            obstacles,
            roads,
            offsets,
            body,
            sample_step,
            max_curvature,
            weights,
            clearance,
            modes,
        )
    return _trace_back(best, parent, counts)


@compiled
def cross_gap(
    start: FloatArray,
    layer: int,
    ends: tuple[float, float],
    l_from: FloatArray,
    l_to: FloatArray,
    cost_from: FloatArray,
    cost_to: FloatArray,
    parent: IntArray,
    counts: IntArray,
    obstacles: FloatArray,
    roads: FloatArray,
    offsets: FloatArray,
    body: tuple[float, float, float],
    sample_step: float,
    max_curvature: float,
    weights: tuple[float, float, float],
    clearance: float,
    modes: tuple[int, int],
) -> None:
    """Check and price the edges of one gap; write into cost_to, parent and counts.

    `layer` is the one that the gap leads to, 0 the first after the ego; the other
    arguments are as in `dynamic_programming`, one layer's row each.
    """
    length = ends[1] - ends[0]
    n = max(math.ceil(length / sample_step), 4)
    table, shape = blend_table(n), np.empty((3, n + 1))
    discs = np.empty((2 * offsets.size + 1, n + 1))
    s = ends[0] + length * np.arange(n + 1) / n
    road = road_table(s, roads, offsets)
    windows = obstacle_windows(s, road[0], obstacles, offsets, body[0] + clearance)
    # On a bent road discs swing out further than along a straight edge.
    unbounded = layer == 0 or np.any(road[0] != 0.0)
    reach = max(abs(offsets[0]), abs(offsets[-1]))
    span = -np.inf, np.inf
    for i in np.argsort(cost_from[: l_from.size]):  # the cheapest first: fewer checks
        for j in range(l_to.size):
            counts[0] += 1
            l0, l1 = l_from[i], l_to[j]
            if layer == 0:
                offset, smooth = lay_first(shape, start, l1, length)
            else:
                offset, smooth = blend_price(l0, l1, length)
            price = weights[0] * offset + weights[1] * smooth
            if modes[1] == 1 and not cost_from[i] + price < cost_to[j]:
                continue
            if layer > 0:
                fill_blend(shape, table, l0, l1, length)
            if not unbounded:
                span = blend_span(l0, l1, length, reach)
            verdict, nearness = edge_verdict(
                shape,
                s,
                road,
                obstacles,
                windows,
                offsets,
                body,
                clearance,
                max_curvature,
                span,
                discs,
            )
            counts[4] += 1
            if verdict != FREE:
                counts[verdict] += 1
                continue
            if modes[0] == 1:
                nearness = printed_safety(shape, length, obstacles)
            cost = cost_from[i] + (price + weights[2] * nearness)
            if cost < cost_to[j]:
                cost_to[j] = cost
                parent[j] = i


@compiled
def lay_first(
    shape: FloatArray, start: FloatArray, l1: float, length: float
) -> tuple[float, float]:
    """Lay the edge that begins with the ego's l, l', l''; fill and price it."""
    c = quintic_coefficients(start[1], start[2], start[3], l1, 0.0, 0.0, length)
    fill_quintic(shape, c, length)
    return quintic_price(c, length)


@compiled
def _trace_back(
    best: FloatArray, parent: IntArray, counts: IntArray
) -> tuple[IntArray, float, IntArray]:
    """Follow the parents from the cheapest node of the farthest layer reached."""
    n_layers = parent.shape[0]
    chosen = np.full(n_layers, -1, dtype=np.int64)
    last = n_layers
    while last > 0 and not np.isfinite(best[last].min()):
        last -= 1
    if last == 0:
        return chosen, np.inf, counts
    node = int(best[last].argmin())
    cost = best[last, node]
    for k in range(last - 1, -1, -1):
        chosen[k] = node
        node = parent[k, node]
    return chosen, cost, counts
