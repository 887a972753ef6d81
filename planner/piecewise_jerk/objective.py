"""The objective of a piecewise-jerk program by columns; its least without bounds."""

import numpy as np

from planner.numerics.compiled import compiled
from planner.piecewise_jerk.bounds import move_table
from planner.piecewise_jerk.riccati import backward, forward, roll_out
from planner.states import FloatArray


@compiled
def objective_columns(
    step: FloatArray, weight: FloatArray, reference: FloatArray, jerk_weight: float
) -> tuple[FloatArray, FloatArray]:
    """Give the objective ½ sum cost (x - wish)² by columns, (4, n) each."""
    n = weight.shape[0]
    cost, wish = np.zeros((4, n)), np.zeros((4, n))
    for k in range(n):
        h = step[min(k, n - 2)]
        for d in range(3):
            cost[d, k] = 2.0 * h * weight[k, d]
            wish[d, k] = reference[k, d]
        cost[3, k] = 2.0 * h * jerk_weight
    return cost, wish


@compiled
def objective_value(cost: FloatArray, wish: FloatArray, table: FloatArray) -> float:
    """Price the motion in a table; the jerk after the end is 0."""
    n, last = table.shape[1], table.shape[0] - 1
    p, v, a, j = 0.0, 0.0, 0.0, 0.0
    for k in range(n):
        p += cost[0, k] * (table[0, k] - wish[0, k]) ** 2
        v += cost[1, k] * (table[1, k] - wish[1, k]) ** 2
        a += cost[2, k] * (table[2, k] - wish[2, k]) ** 2
        j += cost[3, k] * table[last, k] ** 2
    return 0.5 * ((p + v) + (a + j))


@compiled
def fill_slopes(
    cost: FloatArray, wish: FloatArray, table: FloatArray, gradient: FloatArray
) -> None:
    """Fill the objective's gradient, (4, n)."""
    last = table.shape[0] - 1
    for d in range(4):
        i = d if d < 3 else last
        for k in range(table.shape[1]):
            gradient[d, k] = cost[d, k] * (table[i, k] - wish[d, k])


@compiled
def add_slopes(row: FloatArray, sloped: FloatArray, gradient: FloatArray) -> None:
    """Add what the bounds contribute to the gradient."""
    n, m = row.shape[0], row.shape[1]
    for d in range(4):
        i = d if d < 3 else 3 + m
        for k in range(n):
            gradient[d, k] += sloped[i, k]
    for i in range(m):
        for d in range(3):
            for k in range(n):
                gradient[d, k] += sloped[3 + i, k] * row[k, i, d]


@compiled
def fill_hessian(
    cost: FloatArray, curved: FloatArray, row: FloatArray, hessian: FloatArray
) -> None:
    """Fill the second derivatives, (7, n): 00, 01, 02, 11, 12, 22 and the jerk's."""
    n, m = row.shape[0], row.shape[1]
    for k in range(n):
        hessian[0, k] = cost[0, k] + curved[0, k]
        hessian[1, k], hessian[2, k], hessian[4, k] = 0.0, 0.0, 0.0
        hessian[3, k] = cost[1, k] + curved[1, k]
        hessian[5, k] = cost[2, k] + curved[2, k]
        hessian[6, k] = cost[3, k] + curved[3 + m, k]
    for i in range(m):
        for k in range(n):
            c = curved[3 + i, k]
            r0, r1, r2 = row[k, i, 0], row[k, i, 1], row[k, i, 2]
            hessian[0, k] += c * r0 * r0
            hessian[1, k] += c * r0 * r1
            hessian[2, k] += c * r0 * r2
            hessian[3, k] += c * r1 * r1
            hessian[4, k] += c * r1 * r2
            hessian[5, k] += c * r2 * r2


@compiled
def free_motion(
    step: FloatArray,
    start: FloatArray,
    weight: FloatArray,
    reference: FloatArray,
    jerk_weight: float,
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray, FloatArray]:
    """Solve a program without any bounds; arguments as those of `interior_point`.

    Returns:
        (table (4, n): p, p', p'', jerk; cost and wish, (4, n), of the objective; the
        gains of the recursion, and a spare array of as many feeds).
    """
    n = weight.shape[0]
    cost, wish = objective_columns(step, weight, reference, jerk_weight)
    table, change = np.zeros((4, n)), np.zeros((4, n))
    hessian, gradient = np.zeros((7, n)), np.zeros((4, n))
    gain, feed = np.empty((4, n - 1)), np.empty(n - 1)
    for d in range(3):
        table[d, 0] = start[d]
    roll_out(step, table[3], table)
    fill_hessian(cost, np.zeros((4, n)), np.empty((n, 0, 3)), hessian)
    fill_slopes(cost, wish, table, gradient)
    backward(step, hessian, gradient, gain, feed)
    forward(step, gain, feed, change)
    move_table(table, change, 1.0)
    return table, cost, wish, gain, feed
