"""Contacts of a trajectory with other bodies, between exact rectangles."""

import math
from typing import NamedTuple

import numpy as np

from planner.bodies import Bodies
from planner.numerics.compiled import compiled
from planner.shapes.rectangles import swept_contact
from planner.states import BoolArray, FloatArray, IntArray, Trajectory
from planner.vehicle import Vehicle


class Contact(NamedTuple):
    """The first contact of a trajectory with one body."""

    id: str
    time: float  # [s]
    closing_speed: float  # of the two bodies, relative to each other [m/s]


def contacts_of(
    trajectory: Trajectory,
    vehicle: Vehicle,
    bodies: Bodies,
    ignored: BoolArray,
    margin: float,
) -> tuple[Contact, ...]:
    """Find the bodies that a trajectory touches, as if it went on through them.

    Unlike three discs, which reach beyond the sides, the rectangle tells whether there
    is room beside a body. A body that the ego has left wholly behind does not count
    from then on: it sees the ego brake.

    Args:
        trajectory: Of the ego, at its own times.
        vehicle: The ego's dimensions.
        bodies: The column nearest in time counts; what lies beyond the last is not
            looked at.
        ignored: Bodies that do not count, (n,).
        margin: Kept around the ego [m].

    Returns:
        The first contact with each, in the order of time.
    """
    poses = bodies.table.poses
    column = np.rint(trajectory.t / bodies.step).astype(np.int64)
    n = int(np.count_nonzero(column < poses.shape[2]))
    if n < 2 or ignored.all():
        return ()
    offset = vehicle.centre_offset
    rows = np.empty((n, 6))
    rows[:, 0] = trajectory.x[:n] + offset * np.cos(trajectory.heading[:n])
    rows[:, 1] = trajectory.y[:n] + offset * np.sin(trajectory.heading[:n])
    rows[:, 2] = trajectory.heading[:n]
    rows[:, 3:] = 0.5 * vehicle.length, 0.5 * vehicle.width, margin
    touched = _first_steps(rows, poses, column[:n], bodies.table.extents, ignored)
    found = []
    for b in np.flatnonzero(touched).tolist():
        k = int(touched[b])
        way = rows[k, :2] - rows[k - 1, :2]
        way = way - (poses[b, :2, column[k]] - poses[b, :2, column[k - 1]])
        speed = float(np.hypot(*way)) / float(trajectory.t[k] - trajectory.t[k - 1])
        found.append(Contact(bodies.ids[b], float(trajectory.t[k]), speed))
    return tuple(sorted(found, key=lambda contact: contact.time))


@compiled
def _first_steps(
    rows: FloatArray,
    poses: FloatArray,
    column: IntArray,
    extents: FloatArray,
    ignored: BoolArray,
) -> IntArray:
    """Return the end of the step in which each body is touched, (n_bodies,), or 0.

    Args:
        rows: The ego, (n_steps, 6), see `planner.shapes.rectangles`.
        poses: Of the bodies, (n_bodies, 4, >= columns).
        column: Of the poses at each step, (n_steps,).
        extents: (n_bodies, 3): half length, half width, radius [m].
        ignored: (n_bodies,).
    """
    n_steps = rows.shape[0]
    touched = np.zeros(poses.shape[0], np.int64)
    before, after = np.empty(6), np.empty(6)
    own = math.hypot(rows[0, 3], rows[0, 4]) + rows[0, 5]
    for b in range(poses.shape[0]):
        if ignored[b]:
            continue
        around = own + math.hypot(extents[b, 0], extents[b, 1]) + extents[b, 2]
        for k in range(1, n_steps):
            i, j = column[k - 1], column[k]
            dx, dy = poses[b, 0, i] - rows[k - 1, 0], poses[b, 1, i] - rows[k - 1, 1]
            cos, sin = math.cos(rows[k - 1, 2]), math.sin(rows[k - 1, 2])
            # half of the body along the ego's heading
            turn_cos = abs(cos * poses[b, 2, i] + sin * poses[b, 3, i])
            turn_sin = abs(cos * poses[b, 3, i] - sin * poses[b, 2, i])
            half = extents[b, 0] * turn_cos + extents[b, 1] * turn_sin + extents[b, 2]
            if dx * cos + dy * sin + half < -rows[k, 3]:
                break
            way = abs(rows[k, 0] - rows[k - 1, 0]) + abs(rows[k, 1] - rows[k - 1, 1])
            way += abs(poses[b, 0, j] - poses[b, 0, i])
            way += abs(poses[b, 1, j] - poses[b, 1, i])
            reach = around + way
            if dx * dx + dy * dy > reach * reach:
                continue
            before[:3] = poses[b, 0, i], poses[b, 1, i], _angle(poses, b, i)
            after[:3] = poses[b, 0, j], poses[b, 1, j], _angle(poses, b, j)
            before[3:] = extents[b]
            after[3:] = extents[b]
            if swept_contact(rows[k - 1], rows[k], before, after):
                touched[b] = k
                break
    return touched


@compiled
def _angle(poses: FloatArray, b: int, k: int) -> float:
    """Return the heading of a body [rad]."""
    return math.atan2(poses[b, 3, k], poses[b, 2, k])
