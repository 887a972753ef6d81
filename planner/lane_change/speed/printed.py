"""The speed planning of [Thesis] ch. 6 as printed, with its faults.

Three pieces, each of which can be switched on alone: vehicles are on the path only
while all four corners are near it (6.4.1), the regions A and B bound the program before
the first contact too (6.13, 6.14, 6.16, 6.17), and the objective is that of eq. 6.20.
What differs from print: the solver fixes the acceleration at the start, which 6.20
leaves free.
"""

import numpy as np

from planner.lane_change.speed.passing_orders import DriveLimits, Order, Side
from planner.lane_change.speed.st_graph import StGraph, UsersInTime
from planner.states import BoolArray, FloatArray, Path

CORNERS = np.array([(1.0, 1.0), (1.0, -1.0), (-1.0, -1.0), (-1.0, 1.0)])


def corner_graph(
    path: Path, users: UsersInTime, considered: BoolArray, threshold: float
) -> StGraph:
    """Project vehicles whose four corners are all near the path; [Thesis] 6.4.1.

    The ego has no size: a vehicle is on the path from the foot of its rearmost corner
    to that of its foremost one.

    Args:
        path: Of the ego's rear axle.
        users: At the knots.
        considered: Which of them count, (n_users,).
        threshold: omega, largest distance of a corner from the path [m].
    """
    n_knots = users.poses.shape[1]
    on, hits, lows, highs = [], [], [], []
    for k in np.flatnonzero(considered):
        x, y, cos, sin = users.poses[k].T
        along = CORNERS[:, :1] * users.half_length[k]
        across = CORNERS[:, 1:] * users.half_width[k]
        off, foot = _to_path(
            path,
            x + along * cos - across * sin,
            y + along * sin + across * cos,
        )  # (4, n_knots) each
        hit = np.all(off <= threshold, axis=0)
        if hit.any():
            on.append(int(k))
            hits.append(hit)
            lows.append(foot.min(axis=0))
            highs.append(foot.max(axis=0))
    empty = np.zeros((0, n_knots))
    return StGraph(
        tuple(users.ids[k] for k in on),
        tuple(on),
        np.array(hits) if on else empty.astype(np.bool_),
        np.array(lows) if on else empty,
        np.array(highs) if on else empty,
        users.speed[on] if on else np.zeros(0),
    )


def printed_order(
    graph: StGraph,
    sides: tuple[Side, ...],
    speed: float,
    limits: DriveLimits,
    end: float,
    times: FloatArray,
) -> Order:
    """Return the corridor of eq. 6.13, 6.14, 6.16 and 6.17 for chosen regions.

    Args:
        graph: Of this cycle.
        sides: Region of each vehicle: before it (A) or after it (B).
        speed: Of the ego now, v0 [m/s].
        limits: Of its acceleration.
        end: Length of the path, S_L [m].
        times: Of the knots [s].
    """
    fastest = np.minimum(speed * times + 0.5 * limits.acceleration * times**2, end)
    moving = np.minimum(times, -speed / limits.braking)
    slowest = speed * moving + 0.5 * limits.braking * moving**2
    lower, upper = np.zeros(times.size), np.full(times.size, end)
    for v, side in enumerate(sides):
        first = int(np.argmax(graph.hit[v]))
        t0, early = float(times[first]), np.arange(times.size) < first
        bound = graph.upper[v] if side is Side.BEFORE else graph.lower[v]
        # before t0 a parabola that leads from v0 to the contact
        bend = (float(bound[first]) - speed * t0) / max(t0, 1e-9) ** 2
        parabola = speed * times + bend * times**2
        contact = np.where(early, parabola, bound)
        counts = early | graph.hit[v]
        if side is Side.BEFORE:
            lower = np.where(counts, np.maximum(lower, contact), lower)
            upper = np.minimum(upper, fastest)
        else:
            upper = np.where(counts, np.minimum(upper, contact), upper)
            lower = np.maximum(lower, slowest)
    return Order(sides, lower, upper, np.full(times.size, np.inf))


def _to_path(path: Path, x: FloatArray, y: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return distance from a path and place of the foot on it, shapes of x [m]."""
    dx = x[..., None] - path.x
    dy = y[..., None] - path.y
    nearest = np.argmin(dx * dx + dy * dy, axis=-1)
    cos, sin = np.cos(path.heading)[nearest], np.sin(path.heading)[nearest]
    ex, ey = x - path.x[nearest], y - path.y[nearest]
    last = path.distance.size - 1
    reach = ex * cos + ey * sin
    beyond = ((nearest == 0) & (reach < 0.0)) | ((nearest == last) & (reach > 0.0))
    off = np.where(beyond, np.hypot(ex, ey), np.abs(ey * cos - ex * sin))
    foot = path.distance[nearest] + np.where(beyond, 0.0, reach)
    return off, foot
