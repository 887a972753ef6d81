"""A way out by arcs: what a driver finds who turns the wheel at walking speed.

Places are the rear axle's, driven on arcs of a few curvatures; of those with nearly the
same s, l, heading and curvature one is kept. The cheapest is followed first (A*): it
costs its length, more in bends, and what is left to drive.
"""

import heapq
import math
from typing import NamedTuple

import numpy as np

from planner.numerics.compiled import compiled, inlined
from planner.states import BoolArray, FloatArray, IntArray

ARC = 0.8  # driven between two places [m]
BENDS = 7  # curvatures, evenly spaced over what the vehicle has
MIDDLE = (BENDS - 1) // 2  # straight on
TURNED = 3  # by at most so many of them the wheel turns from arc to arc
ROUND_S, ROUND_L, ROUND_HEADING = 0.8, 0.15, 0.05  # nearer places are one [m, m, rad]
SIDE = 12.0  # places farther from the path are left out [m]
ASKEW = 1.2  # headings farther off the path's too [rad]
HASTE = 1.5  # price of what is left to drive: more is sooner found and dearer [-]
LEVEL = 0.12  # a way ends with less than this [rad]
BEND_PRICE = 0.5  # of a metre at the sharpest curvature, on top of its length [m]
TURN_PRICE = 0.15  # of the wheel's turn from lock to lock [m]
CLOSE_PRICE = 0.8  # of a metre that touches what is near, on top [m]
NEAR = 0.5  # nearer than this is near [m]


class Ground(NamedTuple):
    """What is in the way, and where the path is."""

    points: FloatArray  # (n, 3): x, y, radius [m]
    path: FloatArray  # (m, 4), evenly spaced: s, x, y, heading
    margin: float  # kept to the points [m]


class ArcBody(NamedTuple):
    """The body about its rear axle, and its sharpest curvature."""

    rear: float  # [m]
    front: float  # [m]
    half_width: float  # [m]
    curvature: float  # [1/m]


@inlined
def gap_to_points(
    place: tuple[float, float, float], body: ArcBody, points: FloatArray
) -> float:
    """Return the least distance of the body from all points [m]; negative inside."""
    x, y, heading = place
    cos, sin = math.cos(heading), math.sin(heading)
    middle = 0.5 * (body.front - body.rear)
    half = 0.5 * (body.front + body.rear)
    least = np.inf
    for k in range(points.shape[0]):
        dx, dy = points[k, 0] - x, points[k, 1] - y
        along = abs(dx * cos + dy * sin - middle) - half
        across = abs(dy * cos - dx * sin) - body.half_width
        outside = math.hypot(max(along, 0.0), max(across, 0.0))
        apart = outside + min(max(along, across), 0.0) - points[k, 2]
        least = min(least, apart)
    return least


@inlined
def driven(
    place: tuple[float, float, float], curvature: float, way: float
) -> tuple[float, float, float]:
    """Drive an arc."""
    x, y, heading = place
    turned = curvature * way
    middle = heading + 0.5 * turned
    half = 0.5 * turned
    chord = way if abs(half) < 1e-9 else way * math.sin(half) / half
    return x + chord * math.cos(middle), y + chord * math.sin(middle), heading + turned


class Tree(NamedTuple):
    """Places that were reached, the first `taken[0]` of each array."""

    places: FloatArray  # (n, 4): x, y, heading, price of the way there
    number: IntArray  # (n, 3): the place before, number of the curvature, path's row
    seen: BoolArray  # cells
    taken: IntArray  # (1,)


@compiled
def find_way(
    start: tuple[float, float, float, float],
    body: ArcBody,
    ground: Ground,
    reach: float,
    most: int,
) -> tuple[FloatArray, float]:
    """Find arcs from a place past what is in the way.

    Args:
        start: x, y, heading and curvature of the ego.
        body: See there.
        ground: See there.
        reach: How far along the path they lead [m].
        most: Places looked at.

    Returns:
        (curvatures of the arcs, (n,) [1/m]; how far along the path they lead [m]). The
        way that leads farthest where none leads as far as `reach`.
    """
    tree = planted(start, body, ground.path, most)
    here, s, _ = path_place(ground.path, -1, start[0], start[1])
    tree.number[0, 2] = here
    goal, best, farthest = s + reach, 0, s
    queue = [(reach, 0)]
    while len(queue) > 0:
        here = heapq.heappop(queue)[1]
        at, row = tree.places[here], tree.number[here, 2]
        _, s, _ = path_place(ground.path, row, at[0], at[1])
        if s > farthest and abs(askew_at(ground.path, row, at[2])) < LEVEL:
            best, farthest = here, s
        if farthest >= goal or tree.taken[0] + BENDS > most:
            break
        for bend in range(BENDS):
            new = grown(tree, here, bend, body, ground)
            if new >= 0:
                at, row = tree.places[new], tree.number[new, 2]
                _, s, _ = path_place(ground.path, row, at[0], at[1])
                heapq.heappush(queue, (at[3] + HASTE * max(goal - s, 0.0), new))
    return way_to(tree, best, body.curvature), farthest - (goal - reach)


@inlined
def askew_at(path: FloatArray, row: int, heading: float) -> float:
    """Return a heading off the path's [rad]."""
    off = heading - path[row, 3]
    return float(off - 2.0 * math.pi * math.floor(off / (2.0 * math.pi) + 0.5))


@inlined
def planted(
    start: tuple[float, float, float, float], body: ArcBody, path: FloatArray, most: int
) -> Tree:
    """Make the tree of a place alone."""
    n_s = int((path[-1, 0] - path[0, 0]) / ROUND_S) + 2
    n_l, n_h = int(2.0 * SIDE / ROUND_L) + 2, int(2.0 * ASKEW / ROUND_HEADING) + 2
    seen = np.zeros(n_s * n_l * n_h * BENDS, np.bool_)
    places, number = np.empty((most, 4)), np.empty((most, 3), np.int64)
    places[0] = start[0], start[1], start[2], 0.0
    steer = MIDDLE + int(np.rint(start[3] / body.curvature * MIDDLE))
    number[0] = -1, min(max(steer, 0), BENDS - 1), 0
    return Tree(places, number, seen, np.ones(1, np.int64))


@inlined
def grown(tree: Tree, here: int, bend: int, body: ArcBody, ground: Ground) -> int:
    """Add the place at the end of an arc; return its number, -1 if it is none."""
    places, number, path = tree.places, tree.number, ground.path
    turned = abs(bend - number[here, 1])
    if turned > TURNED:
        return -1
    at = (places[here, 0], places[here, 1], places[here, 2])
    curvature = body.curvature * (bend - MIDDLE) / MIDDLE
    ahead = driven(at, curvature, ARC)
    row, s, l = path_place(path, number[here, 2], ahead[0], ahead[1])
    askew = askew_at(path, row, ahead[2])
    inside = path[0, 0] < s < path[-1, 0]
    if not inside or abs(l) >= SIDE or abs(askew) >= ASKEW:
        return -1
    n_l, n_h = int(2.0 * SIDE / ROUND_L) + 2, int(2.0 * ASKEW / ROUND_HEADING) + 2
    cell = int((s - path[0, 0]) / ROUND_S) * n_l + int((l + SIDE) / ROUND_L)
    cell = (cell * n_h + int((askew + ASKEW) / ROUND_HEADING)) * BENDS + bend
    if tree.seen[cell]:
        return -1
    tree.seen[cell] = True
    gap = gap_to_points(ahead, body, ground.points)
    if gap >= ground.margin:  # a corner that swings may come nearer on the way
        between = driven(at, curvature, 0.5 * ARC)
        gap = min(gap, gap_to_points(between, body, ground.points))
    if gap < ground.margin:
        return -1
    price = ARC * (1.0 + BEND_PRICE * abs(bend - MIDDLE) / MIDDLE)
    price += TURN_PRICE * turned / (BENDS - 1)
    price += CLOSE_PRICE * ARC * max(1.0 - gap / NEAR, 0.0)
    new = tree.taken[0]
    tree.taken[0] += 1
    places[new] = ahead[0], ahead[1], ahead[2], places[here, 3] + price
    number[new] = here, bend, row
    return int(new)


@inlined
def way_to(tree: Tree, place: int, curvature: float) -> FloatArray:
    """Return the curvatures of the arcs that lead to a place, (n,) [1/m]."""
    n, here = 0, place
    while tree.number[here, 0] >= 0:
        n, here = n + 1, tree.number[here, 0]
    arcs, here = np.empty(n), place
    for k in range(n - 1, -1, -1):
        arcs[k] = curvature * (tree.number[here, 1] - MIDDLE) / MIDDLE
        here = tree.number[here, 0]
    return arcs


@inlined
def path_place(
    path: FloatArray, near: int, x: float, y: float
) -> tuple[int, float, float]:
    """Return (row of the path, s, l) of a point, near a row unless that is below 0."""
    first, last = max(near - 3, 0), min(near + 8, path.shape[0])
    if near < 0:
        last = path.shape[0]
    best, least = first, np.inf
    for k in range(first, last):
        apart = (x - path[k, 1]) ** 2 + (y - path[k, 2]) ** 2
        if apart < least:
            best, least = k, apart
    cos, sin = math.cos(path[best, 3]), math.sin(path[best, 3])
    dx, dy = x - path[best, 1], y - path[best, 2]
    return best, path[best, 0] + dx * cos + dy * sin, dy * cos - dx * sin
