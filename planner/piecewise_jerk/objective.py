"""The objective of a piecewise-jerk program by columns; its minimum without bounds."""

from typing import NamedTuple

import numpy as np

from planner.numerics.compiled import compiled
from planner.piecewise_jerk.problem import JerkProgram
from planner.piecewise_jerk.riccati import backward, forward, roll_out
from planner.piecewise_jerk.vector_loops import move_table
from planner.states import FloatArray


class Objective(NamedTuple):
    """½ sum curvature (x - reference)² over p, p', p'' and jerk; arrays are (4, n)."""

    curvature: FloatArray
    reference: FloatArray


class FreeMotion(NamedTuple):
    """Minimum of a program without its bounds, and the recursion that found it."""

    table: FloatArray  # p, p', p'', jerk, (4, n)
    objective: Objective
    gain: FloatArray  # of the recursion, (4, n - 1)
    feedforward: FloatArray  # as many spare places, (n - 1,)


@compiled
def objective_columns(program: JerkProgram) -> Objective:
    """Return the objective by columns."""
    step, weight, reference = program.step, program.weight, program.reference
    n = weight.shape[0]
    columns = Objective(np.zeros((4, n)), np.zeros((4, n)))
    for k in range(n):
        h = step[min(k, n - 2)]
        for d in range(3):
            columns.curvature[d, k] = 2.0 * h * weight[k, d]
            columns.reference[d, k] = reference[k, d]
        columns.curvature[3, k] = 2.0 * h * program.jerk_weight
    return columns


@compiled
def objective_value(objective: Objective, table: FloatArray) -> float:
    """Price the motion in a table; the jerk after the end is 0."""
    curvature, reference = objective.curvature, objective.reference
    n, last = table.shape[1], table.shape[0] - 1
    p, v, a, j = 0.0, 0.0, 0.0, 0.0
    for k in range(n):
        p += curvature[0, k] * (table[0, k] - reference[0, k]) ** 2
        v += curvature[1, k] * (table[1, k] - reference[1, k]) ** 2
        a += curvature[2, k] * (table[2, k] - reference[2, k]) ** 2
        j += curvature[3, k] * table[last, k] ** 2
    return 0.5 * ((p + v) + (a + j))


@compiled
def fill_gradient(
    objective: Objective, table: FloatArray, gradient: FloatArray
) -> None:
    """Fill the objective's gradient, (4, n)."""
    curvature, reference = objective.curvature, objective.reference
    last = table.shape[0] - 1
    for d in range(4):
        i = d if d < 3 else last
        for k in range(table.shape[1]):
            gradient[d, k] = curvature[d, k] * (table[i, k] - reference[d, k])


@compiled
def add_linear_term(
    row: FloatArray, linear_term: FloatArray, gradient: FloatArray
) -> None:
    """Add to the gradient what the bounds contribute, (4 + m, n)."""
    n, m = row.shape[0], row.shape[1]
    for d in range(4):
        i = d if d < 3 else 3 + m
        for k in range(n):
            gradient[d, k] += linear_term[i, k]
    for i in range(m):
        for d in range(3):
            for k in range(n):
                gradient[d, k] += linear_term[3 + i, k] * row[k, i, d]


@compiled
def fill_hessian(
    objective: Objective, barrier: FloatArray, row: FloatArray, hessian: FloatArray
) -> None:
    """Fill the second derivatives, (7, n): 00, 01, 02, 11, 12, 22 and the jerk's.

    Args:
        objective: By columns.
        barrier: What the bounds add to the curvature of each column, (4 + m, n).
        row: (n, m, 3).
        hessian: Output.
    """
    n, m = row.shape[0], row.shape[1]
    curvature = objective.curvature
    for k in range(n):
        hessian[0, k] = curvature[0, k] + barrier[0, k]
        hessian[1, k], hessian[2, k], hessian[4, k] = 0.0, 0.0, 0.0
        hessian[3, k] = curvature[1, k] + barrier[1, k]
        hessian[5, k] = curvature[2, k] + barrier[2, k]
        hessian[6, k] = curvature[3, k] + barrier[3 + m, k]
    for i in range(m):
        for k in range(n):
            c = barrier[3 + i, k]
            r0, r1, r2 = row[k, i, 0], row[k, i, 1], row[k, i, 2]
            hessian[0, k] += c * r0 * r0
            hessian[1, k] += c * r0 * r1
            hessian[2, k] += c * r0 * r2
            hessian[3, k] += c * r1 * r1
            hessian[4, k] += c * r1 * r2
            hessian[5, k] += c * r2 * r2


@compiled
def free_motion(program: JerkProgram) -> FreeMotion:
    """Solve a program without any of its bounds."""
    step, n = program.step, program.weight.shape[0]
    objective = objective_columns(program)
    table, change = np.zeros((4, n)), np.zeros((4, n))
    hessian, gradient = np.zeros((7, n)), np.zeros((4, n))
    gain, feedforward = np.empty((4, n - 1)), np.empty(n - 1)
    for d in range(3):
        table[d, 0] = program.start[d]
    roll_out(step, table[3], table)
    fill_hessian(objective, np.zeros((4, n)), np.empty((n, 0, 3)), hessian)
    fill_gradient(objective, table, gradient)
    backward(step, hessian, gradient, gain, feedforward)
    forward(step, gain, feedforward, change)
    move_table(table, change, 1.0)
    return FreeMotion(table, objective, gain, feedforward)
