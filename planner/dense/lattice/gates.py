"""The gate matrix: what obstacles close on a layer, and the strips left; 5.4.2."""

import math

import numpy as np

from planner.dense.field import Cover, ObstacleColumns
from planner.dense.settings import GateReach, LatticeSettings
from planner.numerics.compiled import inlined
from planner.states import FloatArray


def gate_radius(
    radius: FloatArray, cover: Cover, settings: LatticeSettings
) -> FloatArray:
    """Return the radius about each obstacle that closes regions; [Thesis] eq. 5.6."""
    if settings.gate_reach is GateReach.CENTRE:
        return np.zeros_like(radius)
    if settings.gate_reach is GateReach.BODY:
        return radius
    return radius + (cover.radius + settings.margin)


@inlined
def gate_row(edges: FloatArray, cuts: FloatArray) -> FloatArray:
    """Compute one row of the gate matrix B; [Thesis] eq. 5.5, 5.6.

    A region is closed where a grown disc touches it.

    Args:
        edges: Of the regions, growing, (m + 1,) [m].
        cuts: As `closed_intervals` makes them.

    Returns:
        1 for open, 0 for closed, (m,).
    """
    row = np.ones(edges.size - 1)
    for low, high in cuts:
        for j in range(row.size):
            if edges[j] <= high and edges[j + 1] >= low:
                row[j] = 0.0
    return row


@inlined
def closed_intervals(
    s: float,
    obstacles: ObstacleColumns,
    reach: FloatArray,
    offsets: FloatArray,
) -> FloatArray:
    """Cut the grown discs at one s, with any disc of the ego beside them.

    Args:
        s: Of the layer [m].
        obstacles: Of the field.
        reach: Radius that closes, (n_obstacles,) [m].
        offsets: Of the ego's discs [m].

    Returns:
        Lowest and highest l of each that is cut, in the order of the lowest, (k, 2).
    """
    cuts = np.empty((obstacles.s.size, 2))
    k = 0
    for i in range(obstacles.s.size):
        away = np.inf
        for offset in offsets:
            away = min(away, abs(s + offset - obstacles.s[i]))
        if away <= reach[i]:
            half = math.sqrt(reach[i] ** 2 - away**2)
            l = obstacles.l[i]
            cuts[k, 0], cuts[k, 1] = l - half, l + half
            k += 1
    return cuts[:k][np.argsort(cuts[:k, 0])]


@inlined
def strip_points(
    points: FloatArray, low: float, high: float, cuts: FloatArray
) -> FloatArray:
    """Return a point in the middle of each free strip that has no waypoint.

    A strip narrower than two regions may have no open region at all, and with it the
    only way past an obstacle would be lost.

    Args:
        points: Waypoints of the layer, (n,) [m].
        low: Right end of the layer [m].
        high: Left end of the layer [m].
        cuts: As `closed_intervals` makes them.

    Returns:
        The added points, at most one more than there are cuts [m].
    """
    added = np.empty(cuts.shape[0] + 1)
    k, right = 0, low
    for i in range(cuts.shape[0] + 1):
        left = min(cuts[i, 0], high) if i < cuts.shape[0] else high
        if left > right and not np.any((points >= right) & (points <= left)):
            added[k] = 0.5 * (right + left)
            k += 1
        if i < cuts.shape[0]:
            right = max(right, cuts[i, 1])
    return added[:k]
