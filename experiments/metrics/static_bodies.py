"""Time to collision with what stands on the road."""

import math

import numpy as np

from experiments.metrics.pairs import Neighbours, static_neighbours
from experiments.metrics.safety import TTC_HORIZON, overlap_times, time_to_contact
from experiments.trace.schema import Trace
from planner.states import FloatArray

STILL = 1e-9  # bodies approaching more slowly never meet [m/s]


def min_static_time_to_collision(trace: Trace) -> float | None:
    """Return the smallest time to collision with an obstacle [s].

    In the Frenet plane of the ego's path, the ego keeping (s_dot, l_dot) and heading,
    as for vehicles; discs are discs. None without one within 10 s.
    """
    found = least_static_time_to_collision(trace)
    return None if found is None else found[0]


def least_static_time_to_collision(trace: Trace) -> tuple[float, int] | None:
    """Return `min_static_time_to_collision` [s] and the index of its step."""
    pairs, radius = static_neighbours(trace)
    if not pairs.ds.size:
        return None
    boxes = time_to_contact(pairs)
    times = np.where(radius > 0.0, time_to_disc(pairs, radius), boxes)
    least = int(times.argmin())
    if not times[least] <= TTC_HORIZON:
        return None
    return float(times[least]), int(pairs.index[least])


def time_to_disc(pairs: Neighbours, radius: FloatArray) -> FloatArray:
    """Compute the first time at which the ego's rectangle touches discs, (n,) [s].

    Seen from the ego, the centre of a disc reaches its rectangle grown by the radius:
    two rectangles and four discs at its corners. 0 if they overlap now, inf if they
    never will.

    Args:
        pairs: Ego and centres of the discs.
        radius: Of the discs, (n,) [m].
    """
    cos, sin = np.cos(pairs.ego_heading), np.sin(pairs.ego_heading)
    x, y = pairs.ds * cos + pairs.dl * sin, pairs.dl * cos - pairs.ds * sin
    vx = pairs.ds_dot * cos + pairs.dl_dot * sin
    vy = pairs.dl_dot * cos - pairs.ds_dot * sin
    half_length, half_width = pairs.ego_length / 2.0, pairs.ego_width / 2.0
    first = np.full(x.size, np.inf)
    none = np.zeros_like(radius)
    for grown_x, grown_y in ((radius, none), (none, radius)):
        enter_x, leave_x = overlap_times(x, vx, half_length + grown_x)
        enter_y, leave_y = overlap_times(y, vy, half_width + grown_y)
        enter = np.maximum(np.maximum(enter_x, enter_y), 0.0)
        inside = enter <= np.minimum(leave_x, leave_y)
        first = np.where(inside, np.minimum(first, enter), first)
    for side_x in (-half_length, half_length):
        for side_y in (-half_width, half_width):
            reached = _ray_to_circle(x - side_x, y - side_y, vx, vy, radius)
            first = np.minimum(first, reached)
    return first


def _ray_to_circle(
    x: FloatArray, y: FloatArray, vx: FloatArray, vy: FloatArray, radius: FloatArray
) -> FloatArray:
    """Return when moving points enter circles about the origin; inf if never [s]."""
    square = vx * vx + vy * vy
    moving = square > STILL**2
    safe = np.where(moving, square, 1.0)
    along = x * vx + y * vy
    excess = x * x + y * y - radius * radius
    under = along * along - safe * excess
    time = (-along - np.sqrt(np.maximum(under, 0.0))) / safe
    hits = moving & (under >= 0.0) & (time >= 0.0)
    return np.where(excess <= 0.0, 0.0, np.where(hits, time, math.inf))
