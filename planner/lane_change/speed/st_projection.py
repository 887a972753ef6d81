"""Projection of moving rectangles onto a path, in compiled code.

A path is the table of its points, (4, n_points): x, y, cosine and sine of the heading.
A pose is (x, y, cos, sin); `own` is the ego's (offset of the centre before the rear
axle, half length, half width), margins included.
"""

import math

import numpy as np

from planner.numerics.compiled import compiled
from planner.states import BoolArray, FloatArray, IntArray

BISECTIONS = 5  # of a path step: 3 cm of 1 m

Pose = tuple[float, float, float, float]
Own = tuple[float, float, float]


@compiled
def predicted_poses(
    x: FloatArray, y: FloatArray, heading: FloatArray, times: FloatArray, step: float
) -> FloatArray:
    """Read predictions at other times; beyond their end the last motion goes on.

    Args:
        x: Predicted every `step`, (n, n_steps) [m].
        y: As `x`.
        heading: As `x` [rad]; the nearest one is taken.
        times: (n_knots,) [s].
        step: [s].

    Returns:
        x, y, cosine and sine of the heading, (n, n_knots, 4).
    """
    poses = np.empty((x.shape[0], times.size, 4))
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
    return poses


@compiled
def project(
    distance: FloatArray,
    path: FloatArray,
    poses: FloatArray,
    considered: BoolArray,
    half_length: FloatArray,
    half_width: FloatArray,
    own: Own,
) -> tuple[IntArray, BoolArray, FloatArray, FloatArray]:
    """Give (who is on the path, hit, low, high), the last three (n_on, n_knots).

    Between two knots neighbours are joined: a vehicle that enters the path between
    them is there from the knot before on, one that leaves to the knot after.
    """
    n, n_knots = poses.shape[0], poses.shape[1]
    hit = np.zeros((n, n_knots), np.bool_)
    low, high = np.zeros((n, n_knots)), np.zeros((n, n_knots))
    own_reach = own[0] + math.hypot(own[1], own[2])
    box = _box(path)
    on, count = np.empty(n, np.int64), 0
    for v in range(n):
        if not considered[v]:
            continue
        half = (half_length[v], half_width[v])
        reach = own_reach + math.hypot(half[0], half[1])
        near, there = -1, False
        for k in range(n_knots):
            pose = (poses[v, k, 0], poses[v, k, 1], poses[v, k, 2], poses[v, k, 3])
            if _is_outside(box, pose, reach):
                near = -1
                continue
            # the point nearest to the vehicle moves little from knot to knot
            if near < 0:
                near = _nearest(path, pose[0], pose[1])
            else:
                near = _downhill(path, pose[0], pose[1], near)
            begin = _out_of_reach(path, pose, own[0], reach, near, -1)
            end = _out_of_reach(path, pose, own[0], reach, near, 1)
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
def _box(path: FloatArray) -> Pose:
    """Give the least and greatest x and y of a path."""
    return path[0].min(), path[0].max(), path[1].min(), path[1].max()


@compiled
def _is_outside(box: Pose, pose: Pose, reach: float) -> bool:
    """Tell whether a vehicle is farther than `reach` from all of a path's box."""
    return (
        pose[0] < box[0] - reach
        or pose[0] > box[1] + reach
        or pose[1] < box[2] - reach
        or pose[1] > box[3] + reach
    )


@compiled
def _overlap(
    dx: float,
    dy: float,
    cos_a: float,
    sin_a: float,
    half_length_a: float,
    half_width_a: float,
    cos_b: float,
    sin_b: float,
    half_length_b: float,
    half_width_b: float,
) -> bool:
    """Separating axes of two rectangles, (dx, dy) from a's centre to b's."""
    cos = abs(cos_a * cos_b + sin_a * sin_b)
    sin = abs(cos_a * sin_b - sin_a * cos_b)
    if abs(dx * cos_a + dy * sin_a) > (
        half_length_a + half_length_b * cos + half_width_b * sin
    ):
        return False
    if abs(dy * cos_a - dx * sin_a) > (
        half_width_a + half_length_b * sin + half_width_b * cos
    ):
        return False
    if abs(dx * cos_b + dy * sin_b) > (
        half_length_b + half_length_a * cos + half_width_a * sin
    ):
        return False
    return abs(dy * cos_b - dx * sin_b) <= (
        half_width_b + half_length_a * sin + half_width_a * cos
    )


@compiled
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
        dx, dy = pose[0] - path[0, i], pose[1] - path[1, i]
        if dx * dx + dy * dy > reach * reach:
            dx -= centre_offset * path[2, i]
            dy -= centre_offset * path[3, i]
            if dx * dx + dy * dy > reach * reach:
                break
        i += way
    return i


@compiled
def _first_touching(
    path: FloatArray,
    pose: Pose,
    half_extents: tuple[float, float],
    own: Own,
    begin: int,
    end: int,
    way: int,
) -> int:
    """Find the first point where the ego would touch, going one way; -1 if none."""
    x, y, cos, sin = pose
    for i in range(begin, end, way):
        dx = x - path[0, i] - own[0] * path[2, i]
        dy = y - path[1, i] - own[0] * path[3, i]
        if _overlap(
            dx,
            dy,
            path[2, i],
            path[3, i],
            own[1],
            own[2],
            cos,
            sin,
            half_extents[0],
            half_extents[1],
        ):
            return i
    return -1


@compiled
def _contact(
    distance: FloatArray,
    path: FloatArray,
    inside: int,
    beyond: int,
    pose: Pose,
    half_extents: tuple[float, float],
    own: Own,
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
        c = rest * path[2, inside] + middle * path[2, beyond]
        w = rest * path[3, inside] + middle * path[3, beyond]
        dx = x - rest * path[0, inside] - middle * path[0, beyond] - own[0] * c
        dy = y - rest * path[1, inside] - middle * path[1, beyond] - own[0] * w
        if _overlap(
            dx,
            dy,
            c,
            w,
            own[1],
            own[2],
            cos,
            sin,
            half_extents[0],
            half_extents[1],
        ):
            touching = middle
        else:
            free = middle
    return float((1.0 - free) * distance[inside] + free * distance[beyond])


@compiled
def _nearest(path: FloatArray, x: float, y: float) -> int:
    """Find the point nearest to (x, y) among all."""
    best, least = 0, np.inf
    for i in range(path.shape[1]):
        square = (path[0, i] - x) ** 2 + (path[1, i] - y) ** 2
        if square < least:
            best, least = i, square
    return best


@compiled
def _downhill(path: FloatArray, x: float, y: float, guess: int) -> int:
    """Find the point nearest to (x, y), going downhill from `guess`."""
    n = path.shape[1]
    here = (path[0, guess] - x) ** 2 + (path[1, guess] - y) ** 2
    moved = True
    while moved:
        moved = False
        for step in (1, -1):
            other = guess + step
            if 0 <= other < n:
                square = (path[0, other] - x) ** 2 + (path[1, other] - y) ** 2
                if square < here:
                    guess, here, moved = other, square, True
                    break
    return guess


@compiled
def _join_neighbours(hit: BoolArray, low: FloatArray, high: FloatArray) -> None:
    """Let every stay on the path begin a knot earlier and end a knot later."""
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
