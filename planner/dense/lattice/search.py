"""All edges of a layered graph and the cheapest chain of them; [Thesis] 5.5.

A *path* of [Thesis] table 5.2 is an edge here: 15 + 6 · 15² = 1365 for the
conventional method.
"""

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from planner.dense.field import (
    Cover,
    Discs,
    FrenetObstacles,
    ObstacleColumns,
    RoadColumns,
)
from planner.dense.lattice.coarse_path import CoarsePath, PathStart
from planner.dense.lattice.edge_check import (
    COLLISION,
    FREE,
    EdgeLimits,
    EdgePoints,
    LateralSpan,
    edge_scratch,
    edge_verdict,
    obstacle_windows,
    road_along,
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
from planner.numerics.compiled import compiled, inlined
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
    checked_edges: int  # all, unless only needed ones are checked

    @property
    def effectiveness(self) -> float:
        """Share of checked edges free of collisions; [Thesis] eq. 5.33."""
        return 1.0 - self.collision_edges / max(self.checked_edges, 1)


class EdgeRules(NamedTuple):
    """How edges are checked and priced."""

    limits: EdgeLimits
    sample_step: float  # between checked points, at most [m]
    offset_weight: float  # w3 of [Thesis] eq. 5.19
    smoothness_weight: float  # w4
    safety_weight: float  # w5
    printed_safety: bool  # eq. 5.22; else the clearance cost
    needed_only: bool  # leave out edges that cannot become the cheapest


class LatticeTask(NamedTuple):
    """Start, obstacles, road and rules of a search."""

    start: PathStart
    obstacles: ObstacleColumns
    road: RoadColumns
    discs: Discs  # with the margin
    rules: EdgeRules


class EdgeCounts(NamedTuple):
    """Numbers of edges."""

    all: int
    collision: int
    checked: int


class Layers(NamedTuple):
    """Waypoints as compiled code takes them; see `Waypoints`."""

    s: FloatArray
    l: FloatArray
    n_points: IntArray


class LayerGap(NamedTuple):
    """From one layer, or the ego, to the next."""

    from_ego: bool
    begin: float  # s [m]
    end: float  # s [m]
    l_from: FloatArray  # nodes before, (n,) [m]
    l_to: FloatArray  # nodes after, (m,) [m]


def search_lattice(
    field: FrenetObstacles,
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
    rules = EdgeRules(
        EdgeLimits(settings.clearance, settings.max_curvature),
        settings.sample_step,
        settings.offset_weight,
        settings.smoothness_weight,
        settings.safety_weight,
        settings.safety_cost is SafetyCost.PRINTED,
        settings.edge_checks is EdgeChecks.NEEDED,
    )
    task = LatticeTask(
        start,
        field.obstacle_columns(),
        field.road_columns(),
        cover.discs(settings.margin),
        rules,
    )
    nodes, cost, counts = dynamic_programming(
        Layers(waypoints.s, waypoints.l, waypoints.count), task
    )
    reached = int(np.argmin(nodes)) if np.any(nodes < 0) else nodes.size
    path = None
    if reached > 0:
        l = waypoints.l[np.arange(reached), nodes[:reached]]
        path = CoarsePath(
            freeze([start.s, *waypoints.s[:reached]]),
            freeze([start.l, *l]),
            start,
            float(cost),
        )
    complete = 0 < reached == nodes.size
    return LatticeSearch(path, complete, waypoints.total, *counts)


@compiled
def dynamic_programming(
    layers: Layers, task: LatticeTask
) -> tuple[IntArray, float, EdgeCounts]:
    """Check and price all edges layer by layer; keep the cheapest way to each node.

    Returns:
        (Index of the chosen point on each layer, -1 beyond the last that can be
        reached; its cost; numbers of edges.)
    """
    n_layers = layers.s.size
    width = max(layers.l.shape[1], 1)
    cost = np.full((n_layers + 1, width), np.inf)
    cost[0, 0] = 0.0
    parent = np.full((n_layers, width), -1, dtype=np.int64)
    edges, collisions, checked = 0, 0, 0
    ego_l = np.array([task.start.l])
    for k in range(n_layers):
        before = k - 1
        gap = LayerGap(
            k == 0,
            task.start.s if k == 0 else layers.s[before],
            layers.s[k],
            ego_l if k == 0 else layers.l[before, : layers.n_points[before]],
            layers.l[k, : layers.n_points[k]],
        )
        more = relax_layer(gap, task, cost[k], cost[k + 1], parent[k])
        edges += more.all
        collisions += more.collision
        checked += more.checked
    nodes, least = _trace_back(cost, parent)
    return nodes, least, EdgeCounts(edges, collisions, checked)


@compiled
def relax_layer(
    gap: LayerGap,
    task: LatticeTask,
    cost_from: FloatArray,
    cost_to: FloatArray,
    parent: IntArray,
) -> EdgeCounts:
    """Check and price the edges of one gap between layers.

    Args:
        gap: To cross.
        task: See there.
        cost_from: Of the nodes before, (>= n,).
        cost_to: Of the nodes after, (>= m,); lowered where an edge is cheaper.
        parent: Node before of each node after, (>= m,); changed with the cost.
    """
    rules, obstacles, discs = task.rules, task.obstacles, task.discs
    length = gap.end - gap.begin
    points, table = gap_points(gap, task)
    edge = edge_scratch(points.s.size, discs.offset.size)
    # On a bent road discs swing out further than along a straight edge.
    unbounded = gap.from_ego or np.any(points.road.reach != 0.0)
    reach = max(abs(discs.offset[0]), abs(discs.offset[-1]))
    span = LateralSpan(-np.inf, np.inf)
    collisions, checked = 0, 0
    # The cheapest first: fewer checks.
    for i in np.argsort(cost_from[: gap.l_from.size]):
        for j in range(gap.l_to.size):
            l0, l1 = gap.l_from[i], gap.l_to[j]
            if gap.from_ego:
                offset, smooth = fill_first_edge(edge.shape, task.start, l1, length)
            else:
                offset, smooth = blend_price(l0, l1, length)
            price = rules.offset_weight * offset + rules.smoothness_weight * smooth
            if rules.needed_only and not cost_from[i] + price < cost_to[j]:
                continue
            if not gap.from_ego:
                fill_blend(edge.shape, table, l0, l1, length)
            if not unbounded:
                low, high = blend_span(l0, l1, length, reach)
                span = LateralSpan(low, high)
            verdict, safety = edge_verdict(
                edge, points, span, obstacles, discs, rules.limits
            )
            checked += 1
            if verdict != FREE:
                collisions += int(verdict == COLLISION)
                continue
            if rules.printed_safety:
                safety = printed_safety(edge.shape, length, obstacles)
            cost = cost_from[i] + (price + rules.safety_weight * safety)
            if cost < cost_to[j]:
                cost_to[j] = cost
                parent[j] = i
    return EdgeCounts(gap.l_from.size * gap.l_to.size, collisions, checked)


@inlined
def gap_points(gap: LayerGap, task: LatticeTask) -> tuple[EdgePoints, FloatArray]:
    """Return what the edges of one gap share: points, and the table of blends."""
    discs, rules = task.discs, task.rules
    length = gap.end - gap.begin
    n = max(math.ceil(length / rules.sample_step), 4)
    s = gap.begin + length * np.arange(n + 1) / n
    road = road_along(s, task.road, discs.offset)
    reach = discs.radius + rules.limits.clearance
    windows = obstacle_windows(s, road.curvature, task.obstacles, discs.offset, reach)
    return EdgePoints(s, road, windows), blend_table(n)


@compiled
def fill_first_edge(
    shape: FloatArray, start: PathStart, l1: float, length: float
) -> tuple[float, float]:
    """Fill and price the edge that begins with the ego's l, l', l''."""
    c = quintic_coefficients(start.l, start.slope, start.second, l1, 0.0, 0.0, length)
    fill_quintic(shape, c, length)
    return quintic_price(c, length)


@compiled
def _trace_back(cost: FloatArray, parent: IntArray) -> tuple[IntArray, float]:
    """Follow the parents from the cheapest node of the farthest layer reached."""
    n_layers = parent.shape[0]
    chosen = np.full(n_layers, -1, dtype=np.int64)
    last = n_layers
    while last > 0 and not np.isfinite(cost[last].min()):
        last -= 1
    if last == 0:
        return chosen, np.inf
    node = int(cost[last].argmin())
    least = cost[last, node]
    for k in range(last - 1, -1, -1):
        chosen[k] = node
        node = parent[k, node]
    return chosen, least
