"""The plan as controllers read it, and where the ego is against it."""

import math

import numpy as np

from planner.numerics.compiled import compiled
from planner.states import FloatArray, Trajectory

# rows of the table of a plan, (8, n)
T, X, Y, HEADING, CURVATURE, SPEED, ACCELERATION, ALONG = range(8)
N_ROWS = 8


def plan_table(trajectory: Trajectory) -> FloatArray:
    """Return a plan as one table, (8, n).

    The heading is without full turns; the last row is the arc length of the polyline
    through the points, from 0 on [m].
    """
    return _tabulate(
        trajectory.t,
        trajectory.x,
        trajectory.y,
        trajectory.heading,
        trajectory.curvature,
        trajectory.speed,
        trajectory.acceleration,
    )


@compiled
def _tabulate(
    t: FloatArray,
    x: FloatArray,
    y: FloatArray,
    heading: FloatArray,
    curvature: FloatArray,
    speed: FloatArray,
    acceleration: FloatArray,
) -> FloatArray:
    """Fill the table of a plan."""
    n = t.size
    table = np.empty((N_ROWS, n))
    table[T], table[X], table[Y] = t, x, y
    table[CURVATURE], table[SPEED] = curvature, speed
    table[ACCELERATION] = acceleration
    table[HEADING, 0], table[ALONG, 0] = heading[0], 0.0
    for i in range(1, n):
        turn = heading[i] - heading[i - 1]
        turn -= 2.0 * math.pi * np.rint(turn / (2.0 * math.pi))
        table[HEADING, i] = table[HEADING, i - 1] + turn
        chord = math.hypot(x[i] - x[i - 1], y[i] - y[i - 1])
        table[ALONG, i] = table[ALONG, i - 1] + chord
    return table


@compiled
def value_at(plan: FloatArray, key: int, row: int, at: float) -> float:
    """Interpolate a row of a plan over another one, which never falls; held outside.

    Args:
        plan: Its table, (8, n).
        key: Row that is given, `T` or `ALONG`.
        row: Row that is wanted.
        at: Value of `key`.
    """
    n = plan.shape[1]
    if at <= plan[key, 0]:
        return float(plan[row, 0])
    if at >= plan[key, n - 1]:
        return float(plan[row, n - 1])
    low, high = 0, n - 1
    while high - low > 1:
        middle = (low + high) // 2
        if plan[key, middle] <= at:
            low = middle
        else:
            high = middle
    span = plan[key, high] - plan[key, low]
    share = (at - plan[key, low]) / span if span > 0.0 else 0.0
    return float(plan[row, low] + share * (plan[row, high] - plan[row, low]))


@compiled
def errors_against(
    plan: FloatArray, time: float, pose: tuple[float, float, float]
) -> tuple[float, float, float, float]:
    """Compute where the ego is against a plan.

    The foot is the nearest point of the polyline through the plan's points; before its
    first and beyond its last one the plan goes straight on.

    Args:
        plan: Its table, (8, n).
        time: Since the plan's first point [s].
        pose: x, y [m] and heading [rad] of the rear axle.

    Returns:
        Lateral error, positive to the left [m]; how far the ego is behind the point of
        this time [m]; heading error within half a turn [rad]; arc length of the foot
        on the plan [m].
    """
    x, y, heading = pose
    n = plan.shape[1]
    best, place, direction = np.inf, 0.0, plan[HEADING, 0]
    foot_x, foot_y = plan[X, 0], plan[Y, 0]
    for i in range(n - 1):
        dx, dy = plan[X, i + 1] - plan[X, i], plan[Y, i + 1] - plan[Y, i]
        squared = dx * dx + dy * dy
        share = 0.0
        if squared > 1e-12:
            share = ((x - plan[X, i]) * dx + (y - plan[Y, i]) * dy) / squared
            share = min(max(share, 0.0), 1.0)
        px, py = plan[X, i] + share * dx, plan[Y, i] + share * dy
        apart = (x - px) ** 2 + (y - py) ** 2
        if apart < best:
            best, foot_x, foot_y = apart, px, py
            place = plan[ALONG, i] + share * math.sqrt(squared)
            turn = plan[HEADING, i + 1] - plan[HEADING, i]
            direction = plan[HEADING, i] + share * turn
    cos, sin = math.cos(direction), math.sin(direction)
    lateral = -(x - foot_x) * sin + (y - foot_y) * cos
    place += (x - foot_x) * cos + (y - foot_y) * sin  # straight on beyond the ends
    behind = value_at(plan, T, ALONG, time) - place
    error = heading - direction
    error -= 2.0 * math.pi * np.rint(error / (2.0 * math.pi))
    return lateral, behind, error, place
