"""Where a body lies in an area: its outline, depths inside polygons, distances.

Distances come with the direction in which they grow, so that programs can be
linearised about a place.
"""

import math

import numpy as np

from planner.numerics.compiled import compiled
from planner.states import FloatArray
from planner.vehicle import Vehicle

OUTLINE_STEP = 2.4  # [m], between points of the body's sides
TINY = 1e-12  # [m]


def body_box(vehicle: Vehicle, margin: float) -> tuple[float, float, float]:
    """Measure the body grown by the margin, rear axle at 0: back, front, half width."""
    return (
        -vehicle.rear_overhang - margin,
        vehicle.front_reach + margin,
        vehicle.width / 2.0 + margin,
    )


def body_outline(vehicle: Vehicle, margin: float) -> FloatArray:
    """Place points on the outline of the body and a margin, (p, 2), rear axle at 0."""
    back, front, half = body_box(vehicle, margin)
    along = np.linspace(back, front, math.ceil((front - back) / OUTLINE_STEP) + 1)
    sides = [np.column_stack([along, np.full(along.size, y)]) for y in (half, -half)]
    ends = np.array([[back, 0.0], [front, 0.0]])
    return np.concatenate([*sides, ends])


def outline_points(
    x: FloatArray, y: FloatArray, heading: FloatArray, outline: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Place the outline at poses of the rear axle, x and y, (n, p) each."""
    cos, sin = np.cos(heading)[:, None], np.sin(heading)[:, None]
    along, across = outline[:, 0], outline[:, 1]
    return (
        x[:, None] + cos * along - sin * across,
        y[:, None] + sin * along + cos * across,
    )


def corner_distances(
    poses: tuple[FloatArray, FloatArray, FloatArray],
    corners: FloatArray,
    box: tuple[float, float, float],
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Measure how far corners of the area are from the body, negative inside it.

    Args:
        poses: Of the rear axle: x, y [m] and heading [rad], (n,) each.
        corners: (k, 2) [m].
        box: The body: back, front and half the width [m].

    Returns:
        (distance [m], x and y of the unit vector out of the body), (n, k) each.
    """
    back, front, half = box
    x, y, heading = poses
    cos, sin = np.cos(heading)[:, None], np.sin(heading)[:, None]
    dx, dy = corners[:, 0] - x[:, None], corners[:, 1] - y[:, None]
    u, v = dx * cos + dy * sin, dy * cos - dx * sin
    u = u - 0.5 * (back + front)
    out_u, out_v = np.abs(u) - 0.5 * (front - back), np.abs(v) - half
    beside = np.hypot(np.maximum(out_u, 0.0), np.maximum(out_v, 0.0))
    inside = np.maximum(out_u, out_v)
    distance = np.where(beside > 0.0, beside, inside)
    # inside, or straight beside a side, the nearest side is the way out
    along = np.where(beside > 0.0, np.maximum(out_u, 0.0), out_u >= out_v)
    across = np.where(beside > 0.0, np.maximum(out_v, 0.0), out_u < out_v)
    length = np.maximum(np.hypot(along, across), TINY)
    along, across = np.sign(u) * along / length, np.sign(v) * across / length
    return distance, along * cos - across * sin, along * sin + across * cos


@compiled
def depths(
    x: FloatArray, y: FloatArray, boundary: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Measure how deep points lie inside polygons, negative outside.

    Args:
        x: (n, p) [m].
        y: (n, p) [m].
        boundary: Sides, (k, 4); which side is inside follows from counting crossings.

    Returns:
        (depth [m], x and y of the unit vector that leads inward), (n, p) each.
    """
    depth = np.empty(x.shape)
    inward_x, inward_y = np.empty(x.shape), np.empty(x.shape)
    for i in range(x.shape[0]):
        for p in range(x.shape[1]):
            px, py = x[i, p], y[i, p]
            best, gx, gy, sx, sy = np.inf, 0.0, 0.0, 1.0, 0.0
            inside = False
            for k in range(boundary.shape[0]):
                ax, ay, bx, by = boundary[k]
                if (ay > py) != (by > py) and px < ax + (py - ay) / (by - ay) * (
                    bx - ax
                ):
                    inside = not inside
                ux, uy = bx - ax, by - ay
                square = ux * ux + uy * uy
                share = 0.0
                if square > 0.0:
                    share = min(
                        max(((px - ax) * ux + (py - ay) * uy) / square, 0.0), 1.0
                    )
                dx, dy = px - ax - share * ux, py - ay - share * uy
                distance = dx * dx + dy * dy
                if distance < best:
                    best, gx, gy, sx, sy = distance, dx, dy, ux, uy
            length = math.sqrt(best)
            if length > 1e-9:
                gx, gy = gx / length, gy / length
            else:
                side = math.hypot(sx, sy)
                gx, gy = -sy / side, sx / side
            depth[i, p] = length if inside else -length
            inward_x[i, p] = gx if inside else -gx
            inward_y[i, p] = gy if inside else -gy
    return depth, inward_x, inward_y


@compiled
def offsets(
    x: FloatArray, y: FloatArray, line: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Measure the distance of points from a polyline and the direction away from it.

    Args:
        x: (n,) [m].
        y: (n,) [m].
        line: (m, 2) [m].

    Returns:
        (distance [m], x and y of the unit vector away from the line), (n,) each.
    """
    distance = np.empty(x.size)
    away_x, away_y = np.zeros(x.size), np.zeros(x.size)
    for i in range(x.size):
        best, gx, gy = np.inf, 0.0, 0.0
        for k in range(line.shape[0] - 1):
            ux, uy = line[k + 1, 0] - line[k, 0], line[k + 1, 1] - line[k, 1]
            square = ux * ux + uy * uy
            share = 0.0
            if square > 0.0:
                along = (x[i] - line[k, 0]) * ux + (y[i] - line[k, 1]) * uy
                share = min(max(along / square, 0.0), 1.0)
            dx = x[i] - line[k, 0] - share * ux
            dy = y[i] - line[k, 1] - share * uy
            if dx * dx + dy * dy < best:
                best, gx, gy = dx * dx + dy * dy, dx, dy
        length = math.sqrt(best)
        distance[i] = length
        if length > 1e-9:
            away_x[i], away_y[i] = gx / length, gy / length
    return distance, away_x, away_y
