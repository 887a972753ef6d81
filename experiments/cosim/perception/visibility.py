"""Which vehicles can be seen from a point, by their shadows."""

import math

import numpy as np

from planner.numerics.compiled import compiled, inlined
from planner.states import BoolArray, FloatArray, IntArray

# rows of the table of road users that make their rectangles
X, Y, HEADING, LENGTH, WIDTH = 0, 1, 2, 6, 7
CORNERS = 4
RAYS = 5  # over the angular width: one of them is 20 %
N_POINTS = CORNERS + RAYS
INSET = 0.999  # corners are looked at this far out: a body beside does not hide them
TINY = 1e-12


@compiled
def visible(
    users: FloatArray,
    sensor: tuple[float, float, float],
    limits: tuple[float, float],
    static: FloatArray,
    walls: FloatArray,
    occlusion: bool,  # noqa: FBT001 - compiled
) -> BoolArray:
    """Find the vehicles of which a corner or a fifth of the angular width is seen.

    Args:
        users: Rows as in `planner.scene.COLUMNS`, (8, n).
        sensor: x, y [m] and heading [rad].
        limits: Range [m] and field of view [rad].
        static: Bodies that hide and do not move, rectangles with half extents:
            x, y, heading, half length, half width, (m, 5).
        walls: Sides of buildings, x and y of both ends, (k, 4).
        occlusion: Whether anything hides anything.

    Returns:
        (n,).
    """
    n = users.shape[1]
    seen = np.zeros(n, np.bool_)
    bodies = _bodies_of(users, static)
    near = _polar(bodies, sensor)
    points = np.empty((N_POINTS, 2))
    hiders = np.empty(bodies.shape[0], np.int64)
    for i in range(n):
        distance, angle, half_angle, _ = near[i]
        if distance > limits[0]:
            continue
        off = angle - sensor[2]
        off -= 2.0 * math.pi * np.rint(off / (2.0 * math.pi))
        if abs(off) > 0.5 * limits[1] + TINY:
            continue
        if not occlusion:
            seen[i] = True
            continue
        _fill_points(bodies[i], sensor, points)
        n_hiders = 0
        for j in range(bodies.shape[0]):
            apart = near[j, 1] - angle
            apart -= 2.0 * math.pi * np.rint(apart / (2.0 * math.pi))
            between = near[j, 0] - near[j, 3] < distance + near[i, 3]
            if j != i and between and abs(apart) < half_angle + near[j, 2]:
                hiders[n_hiders] = j
                n_hiders += 1
        for k in range(N_POINTS):
            point = (points[k, 0], points[k, 1])
            if not _is_hidden(point, sensor, bodies, hiders[:n_hiders], walls):
                seen[i] = True
                break
    return seen


@inlined
def _bodies_of(users: FloatArray, static: FloatArray) -> FloatArray:
    """Collect all rectangles, vehicles first, (n + m, 5)."""
    n = users.shape[1]
    bodies = np.empty((n + static.shape[0], 5))
    for i in range(n):
        bodies[i, 0], bodies[i, 1] = users[X, i], users[Y, i]
        bodies[i, 2] = users[HEADING, i]
        bodies[i, 3], bodies[i, 4] = 0.5 * users[LENGTH, i], 0.5 * users[WIDTH, i]
    bodies[n:] = static
    return bodies


@inlined
def _polar(bodies: FloatArray, sensor: tuple[float, float, float]) -> FloatArray:
    """Return distance [m], direction, half its angle [rad] and radius [m], (n, 4)."""
    polar = np.empty((bodies.shape[0], 4))
    for i in range(bodies.shape[0]):
        dx, dy = bodies[i, 0] - sensor[0], bodies[i, 1] - sensor[1]
        distance = math.hypot(dx, dy)
        radius = math.hypot(bodies[i, 3], bodies[i, 4])
        polar[i, 0], polar[i, 1] = distance, math.atan2(dy, dx)
        inside = distance <= radius
        polar[i, 2] = math.pi if inside else math.asin(radius / distance)
        polar[i, 3] = radius
    return polar


@inlined
def _fill_points(
    body: FloatArray, sensor: tuple[float, float, float], points: FloatArray
) -> None:
    """Fill corners, and points across the width as seen from the sensor, (9, 2)."""
    cos, sin = math.cos(body[2]), math.sin(body[2])
    to_x, to_y = body[0] - sensor[0], body[1] - sensor[1]
    distance = max(math.hypot(to_x, to_y), TINY)
    left = -to_y / distance, to_x / distance
    widest = 0.0
    for k in range(CORNERS):
        along = INSET * body[3] * (1.0 if k in (0, 3) else -1.0)
        across = INSET * body[4] * (1.0 if k < 2 else -1.0)  # noqa: PLR2004
        dx, dy = along * cos - across * sin, along * sin + across * cos
        points[k, 0], points[k, 1] = body[0] + dx, body[1] + dy
        widest = max(widest, abs(dx * left[0] + dy * left[1]))
    for k in range(RAYS):
        out = widest * ((2.0 * k + 1.0) / RAYS - 1.0)
        points[CORNERS + k, 0] = body[0] + out * left[0]
        points[CORNERS + k, 1] = body[1] + out * left[1]


@inlined
def _is_hidden(
    point: tuple[float, float],
    sensor: tuple[float, float, float],
    bodies: FloatArray,
    hiders: IntArray,
    walls: FloatArray,
) -> bool:
    """Check whether a body or a wall is between a point and the sensor."""
    for j in hiders:
        if _crosses_rectangle(sensor, point, bodies[j]):
            return True
    for wall in walls:  # noqa: SIM110 - compiled
        if _crosses_wall(sensor, point, wall):
            return True
    return False


@inlined
def _crosses_rectangle(
    sensor: tuple[float, float, float], point: tuple[float, float], body: FloatArray
) -> bool:
    """Check whether the segment to a point meets a rectangle, by its slabs."""
    cos, sin = math.cos(body[2]), math.sin(body[2])
    ax, ay = sensor[0] - body[0], sensor[1] - body[1]
    bx, by = point[0] - body[0], point[1] - body[1]
    first, last = 0.0, 1.0
    for axis in range(2):
        if axis == 0:
            a, b, half = ax * cos + ay * sin, bx * cos + by * sin, body[3]
        else:
            a, b, half = ay * cos - ax * sin, by * cos - bx * sin, body[4]
        if abs(b - a) < TINY:
            if abs(a) > half:
                return False
            continue
        low, high = (-half - a) / (b - a), (half - a) / (b - a)
        first = max(first, min(low, high))
        last = min(last, max(low, high))
    return bool(first < last)


@inlined
def _crosses_wall(
    sensor: tuple[float, float, float], point: tuple[float, float], wall: FloatArray
) -> bool:
    """Check whether the segment to a point crosses another segment."""
    dx, dy = point[0] - sensor[0], point[1] - sensor[1]
    wx, wy = wall[2] - wall[0], wall[3] - wall[1]
    across = dx * wy - dy * wx
    if abs(across) < TINY:
        return False
    fx, fy = wall[0] - sensor[0], wall[1] - sensor[1]
    along = (fx * wy - fy * wx) / across
    on_wall = (fx * dy - fy * dx) / across
    return bool(0.0 < along < 1.0 and 0.0 <= on_wall <= 1.0)
