"""The s-T graph: when and where each vehicle is on the ego's path; [Thesis] 6.4.1.

A vehicle is on the path at distance d if the ego's footprint there, grown by margins,
overlaps the vehicle's. The thesis projects a vehicle only when all four of its corners
are near the path, and ignores the ego's size: a car that is half on the path is then
not there.
"""

import math
from dataclasses import dataclass

import numpy as np

from planner.compiled import compiled
from planner.scene import Vehicles
from planner.states import BoolArray, FloatArray, IntArray, Path
from planner.vehicle import Vehicle

BISECTIONS = 5  # of a path step: 3 cm of 1 m


@dataclass(frozen=True, slots=True, eq=False)
class StGraph:
    """What is on the path; arrays are (n, n_knots), for the vehicles that hit it.

    `lower` and `upper` bound the distances of the ego's rear axle at which it would
    touch the vehicle; they mean something only where `hit` is true.
    """

    ids: tuple[str, ...]
    index: tuple[int, ...]  # of each vehicle among all
    hit: BoolArray
    lower: FloatArray  # [m]
    upper: FloatArray  # [m]
    speed: FloatArray  # of the vehicle, (n,) [m/s]


def st_graph(
    path: Path,
    vehicle: Vehicle,
    users: Vehicles,
    considered: BoolArray,
    times: FloatArray,
    along_margin: float,
    across_margin: float,
) -> StGraph:
    """Project vehicles onto the path.

    Args:
        path: Of the ego's rear axle.
        vehicle: The ego's dimensions.
        users: With predictions; one that ends early goes on at its last speed.
        considered: Which of them count, (n_users,).
        times: Of the knots, (n_knots,) [s].
        along_margin: Added before and behind [m].
        across_margin: Added on both sides [m].

    Returns:
        The graph of those that are on the path at some knot.
    """
    chosen = np.flatnonzero(considered)
    n_knots = times.size
    low = np.zeros((chosen.size, n_knots))
    high = np.zeros((chosen.size, n_knots))
    hit = np.zeros((chosen.size, n_knots), np.bool_)
    if chosen.size:
        x, y, heading = predicted_at(users, chosen, times)
        _project(
            path.distance,
            path.x,
            path.y,
            np.cos(path.heading),
            np.sin(path.heading),
            x,
            y,
            np.cos(heading),
            np.sin(heading),
            0.5 * users.length[chosen],
            0.5 * users.width[chosen],
            vehicle.centre_offset,
            0.5 * vehicle.length + along_margin,
            0.5 * vehicle.width + across_margin,
            hit,
            low,
            high,
        )
    on = np.flatnonzero(hit.any(axis=1))
    return StGraph(
        tuple(users.ids[chosen[k]] for k in on),
        tuple(int(chosen[k]) for k in on),
        hit[on],
        low[on],
        high[on],
        users.speed[chosen[on]],
    )


def predicted_at(
    users: Vehicles, chosen: IntArray, times: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Give (x, y, heading), (n, n_knots), of the predictions at `times`."""
    ahead = users.prediction
    last = ahead.x.shape[1] - 1
    place = times / ahead.step
    before = np.minimum(np.floor(place + 1e-9).astype(np.int64), max(last - 1, 0))
    share = place - before  # beyond the end the last motion goes on
    if last == 0:
        share = np.zeros_like(share)
    after = np.minimum(before + 1, last)
    pick = np.ix_(chosen, before)
    then = np.ix_(chosen, after)
    x = ahead.x[pick] + share * (ahead.x[then] - ahead.x[pick])
    y = ahead.y[pick] + share * (ahead.y[then] - ahead.y[pick])
    return (
        x,
        y,
        ahead.heading[
            np.ix_(chosen, np.rint(before + np.minimum(share, 1.0)).astype(np.int64))
        ],
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
def _project(
    distance: FloatArray,
    path_x: FloatArray,
    path_y: FloatArray,
    path_cos: FloatArray,
    path_sin: FloatArray,
    x: FloatArray,
    y: FloatArray,
    cos: FloatArray,
    sin: FloatArray,
    half_length: FloatArray,
    half_width: FloatArray,
    centre_offset: float,
    own_half_length: float,
    own_half_width: float,
    hit: BoolArray,
    low: FloatArray,
    high: FloatArray,
) -> None:
    """Fill hit, low, high.

    Between two knots neighbours are joined: a vehicle that enters the path between
    them is there from the knot before on, one that leaves to the knot after.
    """
    n, n_knots = x.shape
    n_points = distance.size
    own_reach = math.hypot(own_half_length, own_half_width)
    for v in range(n):
        reach = own_reach + math.hypot(half_length[v], half_width[v])
        near = 0  # the point nearest to the vehicle moves little from knot to knot
        for k in range(n_knots):
            if k == 0:
                near = _nearest(path_x, path_y, x[v, k], y[v, k])
            else:
                near = _downhill(path_x, path_y, x[v, k], y[v, k], near)
            hit[v, k] = False
            first, last = -1, -1
            for way in range(2):
                step = 1 if way else -1
                i = near if way else near - 1
                while 0 <= i < n_points:
                    centre_x = path_x[i] + centre_offset * path_cos[i]
                    centre_y = path_y[i] + centre_offset * path_sin[i]
                    dx, dy = x[v, k] - centre_x, y[v, k] - centre_y
                    if dx * dx + dy * dy > (reach + centre_offset) ** 2 and (
                        (path_x[i] - x[v, k]) ** 2 + (path_y[i] - y[v, k]) ** 2
                        > (reach + centre_offset) ** 2
                    ):
                        break
                    if _overlap(
                        dx,
                        dy,
                        path_cos[i],
                        path_sin[i],
                        own_half_length,
                        own_half_width,
                        cos[v, k],
                        sin[v, k],
                        half_length[v],
                        half_width[v],
                    ):
                        first = i if first < 0 else min(first, i)
                        last = max(last, i)
                    i += step
            if first >= 0:
                hit[v, k] = True
                low[v, k] = _contact(
                    distance,
                    path_x,
                    path_y,
                    path_cos,
                    path_sin,
                    first,
                    first - 1,
                    (x[v, k], y[v, k], cos[v, k], sin[v, k]),
                    (half_length[v], half_width[v]),
                    (centre_offset, own_half_length, own_half_width),
                )
                high[v, k] = _contact(
                    distance,
                    path_x,
                    path_y,
                    path_cos,
                    path_sin,
                    last,
                    last + 1,
                    (x[v, k], y[v, k], cos[v, k], sin[v, k]),
                    (half_length[v], half_width[v]),
                    (centre_offset, own_half_length, own_half_width),
                )
    _join_neighbours(hit, low, high)


@compiled
def _contact(
    distance: FloatArray,
    path_x: FloatArray,
    path_y: FloatArray,
    path_cos: FloatArray,
    path_sin: FloatArray,
    inside: int,
    beyond: int,
    pose: tuple[float, float, float, float],
    half_extents: tuple[float, float],
    own: tuple[float, float, float],
) -> float:
    """Bisect between a touching point and its free neighbour, ending on the free side.

    At the ends of the path there is no neighbour: the contact is where it ends.
    """
    if not 0 <= beyond < distance.size:
        return float(distance[inside])
    x, y, cos, sin = pose
    centre_offset, own_half_length, own_half_width = own
    free, touching = 1.0, 0.0  # shares of the way to the neighbour
    for _ in range(BISECTIONS):
        middle = 0.5 * (free + touching)
        rest = 1.0 - middle
        c = rest * path_cos[inside] + middle * path_cos[beyond]
        w = rest * path_sin[inside] + middle * path_sin[beyond]
        dx = x - rest * path_x[inside] - middle * path_x[beyond] - centre_offset * c
        dy = y - rest * path_y[inside] - middle * path_y[beyond] - centre_offset * w
        if _overlap(
            dx,
            dy,
            c,
            w,
            own_half_length,
            own_half_width,
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
def _nearest(path_x: FloatArray, path_y: FloatArray, x: float, y: float) -> int:
    """Find the point nearest to (x, y) among all."""
    best, least = 0, np.inf
    for i in range(path_x.size):
        square = (path_x[i] - x) ** 2 + (path_y[i] - y) ** 2
        if square < least:
            best, least = i, square
    return best


@compiled
def _downhill(
    path_x: FloatArray, path_y: FloatArray, x: float, y: float, guess: int
) -> int:
    """Find the point nearest to (x, y), going downhill from `guess`."""
    n = path_x.size
    here = (path_x[guess] - x) ** 2 + (path_y[guess] - y) ** 2
    moved = True
    while moved:
        moved = False
        for step in (1, -1):
            other = guess + step
            if 0 <= other < n:
                square = (path_x[other] - x) ** 2 + (path_y[other] - y) ** 2
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
