"""Projection of moving rectangles onto a path, in compiled code.

All margins are included in the ego's own rectangle.
"""

import math
from typing import NamedTuple

import numpy as np

from planner.numerics.compiled import compiled, inlined
from planner.states import BoolArray, FloatArray, IntArray

BISECTIONS = 5  # of a path step: 3 cm of 1 m
# Rows of a path, (4, n_points): places [m], and the direction of the heading. One
# array, not a record of four: the references of each would be counted at every call.
X, Y, COS, SIN = range(4)


class Pose(NamedTuple):
    """Where a rectangle is, and its direction."""

    x: float  # [m]
    y: float  # [m]
    cos: float
    sin: float


class OwnRectangle(NamedTuple):
    """The ego's rectangle."""

    centre_offset: float  # ahead of the rear axle [m]
    half_length: float  # [m]
    half_width: float  # [m]


class HalfExtents(NamedTuple):
    """Of a rectangle [m]."""

    length: float
    width: float


class BoundingBox(NamedTuple):
    """Least and greatest coordinates [m]."""

    x_low: float
    x_high: float
    y_low: float
    y_high: float


@compiled
def users_at(
    motion: tuple[FloatArray, FloatArray, FloatArray],
    moving: tuple[FloatArray, FloatArray, FloatArray],
    fixed: tuple[FloatArray, ...],
    times: FloatArray,
    step: float,
) -> tuple[FloatArray, FloatArray]:
    """Return where road users are at some times, and their sizes, static ones first.

    Args:
        motion: x, y and heading predicted every `step`, (n_moving, n_steps).
        moving: Length, width and speed, (n_moving,).
        fixed: x, y, cosine and sine of the heading, length, width and radius,
            (n_fixed,).
        times: (n_knots,) [s].
        step: [s].

    Returns:
        x, y, cosine and sine of the heading, (n, n_knots, 4); half length, half width
        and speed, (3, n).
    """
    x, y, cos, sin, length, width, radius = fixed
    n = x.size
    poses = np.empty((n + moving[0].size, times.size, 4))
    rows = np.zeros((3, poses.shape[0]))
    for b in range(n):
        rows[0, b] = 0.5 * length[b] + radius[b]
        rows[1, b] = 0.5 * width[b] + radius[b]
        for k in range(times.size):
            poses[b, k, 0], poses[b, k, 1] = x[b], y[b]
            poses[b, k, 2], poses[b, k, 3] = cos[b], sin[b]
    for v in range(moving[0].size):
        rows[0, n + v], rows[1, n + v] = 0.5 * moving[0][v], 0.5 * moving[1][v]
        rows[2, n + v] = moving[2][v]
    _predicted(motion, times, step, poses[n:])
    return poses, rows


@inlined
def _predicted(
    motion: tuple[FloatArray, FloatArray, FloatArray],
    times: FloatArray,
    step: float,
    poses: FloatArray,
) -> None:
    """Read predictions at other times; beyond their end the last motion goes on.

    Args:
        motion: x, y and heading, (n, n_steps); of these the nearest one is taken.
        times: (n_knots,) [s].
        step: Between predictions [s].
        poses: Filled with x, y, cosine and sine of the heading, (n, n_knots, 4).
    """
    x, y, heading = motion
    last = x.shape[1] - 1
    for k in range(times.size):
        place = times[k] / step
        before = min(math.floor(place + 1e-9), max(last - 1, 0))
        share = place - before if last > 0 else 0.0
        after = min(before + 1, last)
        nearest = int(np.rint(before + min(share, 1.0)))
        for v in range(x.shape[0]):
            poses[v, k, 0] = x[v, before] + share * (x[v, after] - x[v, before])
            poses[v, k, 1] = y[v, before] + share * (y[v, after] - y[v, before])
            turned = heading[v, nearest]
            if k > 0 and turned == heading[v, 0]:  # most go straight on
                poses[v, k, 2], poses[v, k, 3] = poses[v, 0, 2], poses[v, 0, 3]
            else:
                poses[v, k, 2], poses[v, k, 3] = math.cos(turned), math.sin(turned)


@compiled
def project(
    distance: FloatArray,
    path: FloatArray,
    poses: FloatArray,
    considered: BoolArray,
    half_length: FloatArray,
    half_width: FloatArray,
    own: OwnRectangle,
) -> tuple[IntArray, BoolArray, FloatArray, FloatArray]:
    """Return (vehicles on the path, hit, low, high), the last three (n_on, n_knots).

    Between two knots neighbours are joined: a vehicle that enters the path between
    them is there from the knot before on, one that leaves to the knot after.
    """
    n, n_knots = poses.shape[0], poses.shape[1]
    hit = np.zeros((n, n_knots), np.bool_)
    low, high = np.zeros((n, n_knots)), np.zeros((n, n_knots))
    own_reach = own.centre_offset + math.hypot(own.half_length, own.half_width)
    box = _box(path)
    on, count = np.empty(n, np.int64), 0
    for v in range(n):
        if not considered[v]:
            continue
        half = HalfExtents(half_length[v], half_width[v])
        reach = own_reach + math.hypot(half.length, half.width)
        near, there = -1, False
        for k in range(n_knots):
            pose = Pose(poses[v, k, 0], poses[v, k, 1], poses[v, k, 2], poses[v, k, 3])
            if _is_outside(box, pose, reach):
                near = -1
                continue
            # the point nearest to the vehicle moves little from knot to knot
            if near < 0:
                near = _nearest(path, pose.x, pose.y)
            else:
                near = _downhill(path, pose.x, pose.y, near)
            begin = _out_of_reach(path, pose, own.centre_offset, reach, near, -1)
            end = _out_of_reach(path, pose, own.centre_offset, reach, near, 1)
            first = _first_touching(path, pose, half, own, begin + 1, end, 1)
            if first < 0:
                continue
            last = _first_touching(path, pose, half, own, end - 1, begin, -1)
            hit[count, k], there = True, True
            low[count, k] = _contact(distance, path, first, first - 1, pose, half, own)
            high[count, k] = _contact(distance, path, last, last + 1, pose, half, own)
        if there:
            on[count] = v
            count += 1
    hit, low, high = hit[:count], low[:count], high[:count]
    _join_neighbours(hit, low, high)
    return on[:count], hit, low, high


@compiled
def _box(path: FloatArray) -> BoundingBox:
    """Compute the bounding box of a path."""
    return BoundingBox(path[X].min(), path[X].max(), path[Y].min(), path[Y].max())


@inlined
def _is_outside(box: BoundingBox, pose: Pose, reach: float) -> bool:
    """Check whether a vehicle is farther than `reach` from all of a path's box."""
    return (
        pose.x < box.x_low - reach
        or pose.x > box.x_high + reach
        or pose.y < box.y_low - reach
        or pose.y > box.y_high + reach
    )


@inlined
def _overlap(
    apart: tuple[float, float],
    own_direction: tuple[float, float],
    own: OwnRectangle,
    direction: tuple[float, float],
    half: HalfExtents,
) -> bool:
    """Check separating axes of two rectangles.

    Args:
        apart: From the ego's centre to the other's (x, y) [m].
        own_direction: (cos, sin) of the ego's heading.
        own: The ego's rectangle.
        direction: (cos, sin) of the other's heading.
        half: The other's extents.
    """
    dx, dy = apart
    cos_a, sin_a = own_direction
    cos_b, sin_b = direction
    cos = abs(cos_a * cos_b + sin_a * sin_b)
    sin = abs(cos_a * sin_b - sin_a * cos_b)
    if abs(dx * cos_a + dy * sin_a) > (
        own.half_length + half.length * cos + half.width * sin
    ):
        return False
    if abs(dy * cos_a - dx * sin_a) > (
        own.half_width + half.length * sin + half.width * cos
    ):
        return False
    if abs(dx * cos_b + dy * sin_b) > (
        half.length + own.half_length * cos + own.half_width * sin
    ):
        return False
    return abs(dy * cos_b - dx * sin_b) <= (
        half.width + own.half_length * sin + own.half_width * cos
    )


@inlined
def _out_of_reach(
    path: FloatArray,
    pose: Pose,
    centre_offset: float,
    reach: float,
    near: int,
    way: int,
) -> int:
    """Find the first point from `near` on, one way, from which nothing touches."""
    i = near
    while 0 <= i < path.shape[1]:
        dx, dy = pose.x - path[X, i], pose.y - path[Y, i]
        if dx * dx + dy * dy > reach * reach:
            dx -= centre_offset * path[COS, i]
            dy -= centre_offset * path[SIN, i]
            if dx * dx + dy * dy > reach * reach:
                break
        i += way
    return i


@inlined
def _first_touching(
    path: FloatArray,
    pose: Pose,
    half: HalfExtents,
    own: OwnRectangle,
    begin: int,
    end: int,
    way: int,
) -> int:
    """Find the first point where the ego would touch, going one way; -1 if none."""
    x, y, cos, sin = pose
    for i in range(begin, end, way):
        dx = x - path[X, i] - own.centre_offset * path[COS, i]
        dy = y - path[Y, i] - own.centre_offset * path[SIN, i]
        turned = path[COS, i], path[SIN, i]
        if _overlap((dx, dy), turned, own, (cos, sin), half):
            return i
    return -1


@inlined
def _contact(
    distance: FloatArray,
    path: FloatArray,
    inside: int,
    beyond: int,
    pose: Pose,
    half: HalfExtents,
    own: OwnRectangle,
) -> float:
    """Bisect between a touching point and its free neighbour, ending on the free side.

    At the ends of the path there is no neighbour: the contact is where it ends.
    """
    if not 0 <= beyond < distance.size:
        return float(distance[inside])
    x, y, cos, sin = pose
    free, touching = 1.0, 0.0  # shares of the way to the neighbour
    for _ in range(BISECTIONS):
        middle = 0.5 * (free + touching)
        rest = 1.0 - middle
        c = rest * path[COS, inside] + middle * path[COS, beyond]
        w = rest * path[SIN, inside] + middle * path[SIN, beyond]
        dx = x - rest * path[X, inside] - middle * path[X, beyond]
        dy = y - rest * path[Y, inside] - middle * path[Y, beyond]
        dx -= own.centre_offset * c
        dy -= own.centre_offset * w
        if _overlap((dx, dy), (c, w), own, (cos, sin), half):
            touching = middle
        else:
            free = middle
    return float((1.0 - free) * distance[inside] + free * distance[beyond])


@compiled
def _nearest(path: FloatArray, x: float, y: float) -> int:
    """Find the point nearest to (x, y) among all."""
    best, least = 0, np.inf
    for i in range(path.shape[1]):
        square = (path[X, i] - x) ** 2 + (path[Y, i] - y) ** 2
        if square < least:
            best, least = i, square
    return best


@inlined
def _downhill(path: FloatArray, x: float, y: float, guess: int) -> int:
    """Find the point nearest to (x, y), going downhill from `guess`."""
    n = path.shape[1]
    here = (path[X, guess] - x) ** 2 + (path[Y, guess] - y) ** 2
    moved = True
    while moved:
        moved = False
        for step in (1, -1):
            other = guess + step
            if 0 <= other < n:
                square = (path[X, other] - x) ** 2 + (path[Y, other] - y) ** 2
                if square < here:
                    guess, here, moved = other, square, True
                    break
    return guess


@compiled
def _join_neighbours(hit: BoolArray, low: FloatArray, high: FloatArray) -> None:
    """Extend every stay on the path by a knot at both ends."""
    n, n_knots = hit.shape
    for v in range(n):
        before = False
        for k in range(n_knots):
            now = hit[v, k]
            if now and not before and k > 0:
                hit[v, k - 1] = True
                low[v, k - 1], high[v, k - 1] = low[v, k], high[v, k]
            before = now
        before = False
        for k in range(n_knots - 1, -1, -1):
            now = hit[v, k]
            if now and not before and k < n_knots - 1:
                hit[v, k + 1] = True
                low[v, k + 1], high[v, k + 1] = low[v, k], high[v, k]
            before = now
