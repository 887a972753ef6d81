"""The quadratic programs of a steerable path, linearised anew in each round.

They are sparse: each row has few of the unknowns.
"""

from collections.abc import Sequence

import numpy as np
import qpsolvers
from scipy import sparse

from planner.reference_path.body_in_area import (
    corner_distances,
    depths,
    offsets,
    outline_points,
)
from planner.reference_path.steered_motion import (
    Iterate,
    SteeringTask,
    integrate,
    missed_end,
)
from planner.states import FloatArray

RATE_WEIGHT = 20.0  # of (dκ/ds)² [m³]
CURVATURE_WEIGHT = 1.0  # of κ² [m]
GUIDE_WEIGHT = 0.02  # of the squared distance from the guide [1/m³]
END_WEIGHT = 1e3  # of the squared error of the end pose
OUTSIDE_PENALTY = 50.0  # of the farthest reach beyond the area [1/m]
REGULARISATION = 1e-6  # keeps the Hessian definite
ROUNDS = 40
LOOSE_ROUNDS = 10  # in which the end pose weighs a tenth
STRETCH = 0.05  # share by which the spacing may change in one round
FIRST_STEP = 0.05  # trust region of the curvature [1/m]
SHRINK = 0.92  # of the trust region from round to round
SETTLED = 2e-4  # changes of the curvature below this end the rounds [1/m]
NEAR = 0.6  # outline points nearer to the boundary than this are constrained [m]

X, Y, HEADING, CURVATURE, SPACING = range(5)  # the unknowns of a program, in order

_Entry = tuple[int, int, FloatArray | float]  # see `_rows`


def improve(
    task: SteeringTask, curvature: FloatArray, spacing: float
) -> tuple[FloatArray, float]:
    """Solve one linearised program after the other; (curvature, spacing)."""
    most, reach = task.limits.curvature, FIRST_STEP
    for k in range(ROUNDS):
        weight = END_WEIGHT if k >= LOOSE_ROUNDS else 0.1 * END_WEIGHT
        motion = integrate(curvature, spacing, task.start)
        change = _step(task, Iterate(curvature, spacing, motion), reach, weight)
        curvature = np.clip(curvature + change[:-1], -most, most)
        spacing += float(change[-1])
        reach *= SHRINK
        if np.abs(change[:-1]).max() < SETTLED and k > LOOSE_ROUNDS:
            break
    return curvature, spacing


def _step(
    task: SteeringTask, now: Iterate, reach: float, end_weight: float
) -> FloatArray:
    """Solve the program linearised here.

    Its unknowns are changes of x, y, heading and curvature of all stations, then of
    the spacing, and how far the body reaches beyond the area: many, but each row has
    few of them.

    Args:
        task: What is planned.
        now: About which is linearised.
        reach: Bound of the change of the curvature [1/m].
        end_weight: Of the squared error of the end pose.

    Returns:
        Changes of the curvatures and of the spacing, (n + 1,); zero where the solver
        finds none.
    """
    limits, n = task.limits, now.curvature.size
    hessian, gradient = _objective(task, now, end_weight)
    inside, room = _inside(task, now)
    most = limits.curvature_rate * now.spacing
    swing = _rows(n, [(CURVATURE, 1, 1.0), (CURVATURE, 0, -1.0)], n - 1)
    change = np.diff(now.curvature)
    bounds = [room, np.maximum(most - change, 0.0), np.maximum(most + change, 0.0)]
    low, high = np.full(4 * n + 2, -np.inf), np.full(4 * n + 2, np.inf)
    bent = slice(CURVATURE * n, (CURVATURE + 1) * n)
    low[bent] = np.maximum(-limits.curvature - now.curvature, -reach)
    high[bent] = np.minimum(limits.curvature - now.curvature, reach)
    low[bent.start] = high[bent.start] = -now.curvature[0]
    high[-2] = STRETCH * now.spacing
    low[-2:] = -high[-2], 0.0
    for quantity in (X, Y, HEADING):  # the first pose is given
        low[quantity * n] = high[quantity * n] = 0.0
    found = qpsolvers.solve_qp(
        hessian,
        gradient,
        sparse.vstack([inside, swing, -swing], format="csc"),
        np.concatenate(bounds),
        _dynamics(now),
        np.zeros(3 * (n - 1)),
        lb=low,
        ub=high,
        solver="piqp",
        verbose=False,
    )
    if found is None:
        return np.zeros(n + 1)
    return np.append(found[bent], found[-2])


def _rows(n: int, entries: Sequence[_Entry], count: int) -> sparse.csc_matrix:
    """Build rows with the same unknowns of one station after the other.

    Args:
        n: Number of stations.
        entries: (quantity, by how many stations later, factor) each; the quantity
            `SPACING` is the same one in all rows.
        count: Of the rows; the first is that of the first station.
    """
    row = np.arange(count)
    rows, columns, values = [], [], []
    for quantity, later, factor in entries:
        rows.append(row)
        own = np.full(count, quantity * n)
        columns.append(own if quantity == SPACING else own + row + later)
        values.append(np.broadcast_to(np.asarray(factor, dtype=np.float64), count))
    return sparse.csc_matrix(
        (np.concatenate(values), (np.concatenate(rows), np.concatenate(columns))),
        shape=(count, 4 * n + 2),
    )


def _dynamics(now: Iterate) -> sparse.csc_matrix:
    """Let poses follow from curvatures, linearised: rows (3 n - 3, 4 n + 2) = 0."""
    n, ds, motion = now.curvature.size, now.spacing, now.motion
    turn = 0.5 * (now.curvature[1:] + now.curvature[:-1])
    heading: list[_Entry] = [
        (HEADING, 1, -1.0),
        (HEADING, 0, 1.0),
        (CURVATURE, 0, 0.5 * ds),
        (CURVATURE, 1, 0.5 * ds),
        (SPACING, 0, turn),
    ]
    blocks = [_rows(n, heading, n - 1)]
    cos, sin = np.cos(motion.middle), np.sin(motion.middle)
    for quantity, along, by in ((X, cos, -ds * sin), (Y, sin, ds * cos)):
        pose: list[_Entry] = [
            (quantity, 1, -1.0),
            (quantity, 0, 1.0),
            (HEADING, 0, by),
            (CURVATURE, 0, 0.375 * ds * by),
            (CURVATURE, 1, 0.125 * ds * by),
            (SPACING, 0, along + by * motion.lever),
        ]
        blocks.append(_rows(n, pose, n - 1))
    return sparse.csc_matrix(sparse.vstack(blocks))


def _objective(
    task: SteeringTask, now: Iterate, end_weight: float
) -> tuple[sparse.csc_matrix, FloatArray]:
    """Sum the squares; (Hessian, gradient) by the unknowns of `_step`."""
    n, ds, motion = now.curvature.size, now.spacing, now.motion
    off, normal_x, normal_y = offsets(motion.x, motion.y, task.guide)
    rate = [(CURVATURE, 1, 1.0 / ds), (CURVATURE, 0, -1.0 / ds)]
    ends = np.array([(quantity + 1) * n - 1 for quantity in (X, Y, HEADING, CURVATURE)])
    last = sparse.csc_matrix((np.ones(4), (np.arange(4), ends)), shape=(4, 4 * n + 2))
    squares: list[tuple[sparse.csc_matrix, FloatArray, float]] = [
        (_rows(n, rate, n - 1), np.diff(now.curvature) / ds, RATE_WEIGHT * ds),
        (_rows(n, [(CURVATURE, 0, 1.0)], n), now.curvature, CURVATURE_WEIGHT * ds),
        (_rows(n, [(X, 0, normal_x), (Y, 0, normal_y)], n), off, GUIDE_WEIGHT * ds),
        (last, np.append(missed_end(task, motion), now.curvature[-1]), end_weight),
    ]
    hessian = REGULARISATION * sparse.identity(4 * n + 2, format="csc")
    gradient = np.zeros(4 * n + 2)
    for rows, values, weight in squares:
        hessian = hessian + 2.0 * weight * (rows.T @ rows)
        gradient += 2.0 * weight * (values @ rows)
    gradient[-1] = OUTSIDE_PENALTY
    return sparse.csc_matrix(hessian), gradient


def _inside(task: SteeringTask, now: Iterate) -> tuple[sparse.csc_matrix, FloatArray]:
    """Keep the body inside: rows (q, 4 n + 2) · change <= room (q,).

    The outline is inside the area, and no corner of the area is inside the body.
    """
    motion, n = now.motion, now.curvature.size
    x, y = outline_points(motion.x, motion.y, motion.heading, task.outline)
    depth, inward_x, inward_y = depths(x, y, task.boundary)
    i, p = np.nonzero(depth < NEAR)
    gx, gy = inward_x[i, p], inward_y[i, p]
    arm_x, arm_y = -(y - motion.y[:, None])[i, p], (x - motion.x[:, None])[i, p]
    corners = task.boundary[:, :2]
    apart, away_x, away_y = corner_distances(motion.poses, corners, task.box)
    j, c = np.nonzero(apart < NEAR)
    # a body that moves away from the corner is one that the corner moves away from
    ux, uy = -away_x[j, c], -away_y[j, c]
    turn_x, turn_y = -(corners[c, 1] - motion.y[j]), corners[c, 0] - motion.x[j]
    station = np.concatenate([i, j])
    by_x, by_y = np.concatenate([gx, ux]), np.concatenate([gy, uy])
    by_heading = np.concatenate([gx * arm_x + gy * arm_y, ux * turn_x + uy * turn_y])
    count = station.size
    beyond = np.full(count, 4 * n + 1)
    columns = [X * n + station, Y * n + station, HEADING * n + station, beyond]
    values = [-by_x, -by_y, -by_heading, np.full(count, -1.0)]
    rows = sparse.csc_matrix(
        (
            np.concatenate(values),
            (np.tile(np.arange(count), 4), np.concatenate(columns)),
        ),
        shape=(count, 4 * n + 2),
    )
    return rows, np.concatenate([depth[i, p], apart[j, c]])
