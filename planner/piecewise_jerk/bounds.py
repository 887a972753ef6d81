"""The bounds of a piecewise-jerk program in an interior point: slacks, multipliers.

Values that may be bounded stand in a table of columns (4 + m, n): p, p', p'', the m
rows, and the jerk of the interval that begins at the knot. A *block* is the lower or
the upper bound of one column at all knots; blocks without any bound are left out. In a
block that has bounds at some knots only, `active` is 0 at the others, where the slack
stays 1 and the multiplier 0.

Arrays over bounds are (n_blocks n,), block after block. Loops over the knots of a block
write one array each, so that the compiler makes vector code of them.
"""

from typing import NamedTuple

import numpy as np

from planner.numerics.compiled import compiled
from planner.piecewise_jerk.problem import JerkProgram
from planner.states import FloatArray, IntArray

NO_BOUND = 1e19  # a bound beyond it does not bind
PROOF_MARGIN = 1e-6  # of a proof, relative to what it is made of


class BoundBlocks(NamedTuple):
    """The bounds of a program, block after block: sign value + offset >= 0."""

    column: IntArray  # of the table, growing, (n_blocks,)
    sign: FloatArray  # 1 for a lower bound, -1 for an upper one, (n_blocks,)
    offset: FloatArray  # (n_blocks n,)
    active: FloatArray  # 1 where there is a bound, else 0, (n_blocks n,)
    n_bounds: int


@compiled
def bound_blocks(program: JerkProgram) -> BoundBlocks:
    """Return the blocks that have a bound."""
    lower, upper = program.lower, program.upper
    column, sign = _block_columns(program)
    n, n_columns = lower.shape[0], lower.shape[1]
    offset, active = np.empty(column.size * n), np.empty(column.size * n)
    count = 0
    for b in range(column.size):
        i = column[b]
        for k in range(n):
            offset[b * n + k], active[b * n + k] = 0.0, 0.0
            if i == n_columns:
                there = k < n - 1
                bound = -program.jerk_lower if sign[b] > 0.0 else program.jerk_upper
            else:
                bound = -lower[k, i] if sign[b] > 0.0 else upper[k, i]
                there = k > 0 and bound < NO_BOUND
            if there:
                offset[b * n + k], active[b * n + k] = bound, 1.0
                count += 1
    return BoundBlocks(column, sign, offset, active, count)


@compiled
def _block_columns(program: JerkProgram) -> tuple[IntArray, FloatArray]:
    """Return (column, sign) of the blocks that have a bound, (n_blocks,) each."""
    lower, upper = program.lower, program.upper
    n, n_columns = lower.shape[0], lower.shape[1]
    column = np.empty(2 * n_columns + 2, np.int64)
    sign = np.empty(2 * n_columns + 2)
    count = 0
    for i in range(n_columns + 1):
        for side in (1.0, -1.0):
            if i == n_columns:
                bound = -program.jerk_lower if side > 0.0 else program.jerk_upper
                bounded = bound < NO_BOUND
            else:
                bounded = False
                for k in range(1, n):
                    bound = -lower[k, i] if side > 0.0 else upper[k, i]
                    if bound < NO_BOUND:
                        bounded = True
                        break
            if bounded:
                column[count], sign[count] = i, side
                count += 1
    return column[:count], sign[:count]


@compiled
def row_values(row: FloatArray, table: FloatArray) -> None:
    """Fill the columns of the rows, from those of the states."""
    n, m = row.shape[0], row.shape[1]
    for i in range(m):
        for k in range(n):
            table[3 + i, k] = (
                row[k, i, 0] * table[0, k]
                + row[k, i, 1] * table[1, k]
                + row[k, i, 2] * table[2, k]
            )


@compiled
def bound_residuals(table: FloatArray, blocks: BoundBlocks, room: FloatArray) -> None:
    """Fill the room to every bound, negative where it is broken; 0 without a bound."""
    offset, active = blocks.offset, blocks.active
    n = table.shape[1]
    for b in range(blocks.column.size):
        i, side = blocks.column[b], blocks.sign[b]
        for k in range(n):
            room[b * n + k] = active[b * n + k] * (
                side * table[i, k] + offset[b * n + k]
            )


@compiled
def slack_steps(
    change: FloatArray, blocks: BoundBlocks, residual: FloatArray, d_slack: FloatArray
) -> None:
    """Fill the steps of the slacks that belong to a change of the table."""
    active, n = blocks.active, change.shape[1]
    for b in range(blocks.column.size):
        i, side = blocks.column[b], blocks.sign[b]
        for k in range(n):
            d_slack[b * n + k] = (
                active[b * n + k] * (side * change[i, k]) - residual[b * n + k]
            )


@compiled
def gather(values: FloatArray, blocks: BoundBlocks, total: FloatArray) -> None:
    """Fill `total`, (4 + m, n), with the sum of -sign values of each column's blocks.

    Of multipliers this is their linear term: the derivatives of -sum z (value).
    """
    n = total.shape[1]
    total[:] = 0.0
    for b in range(blocks.column.size):
        i, side = blocks.column[b], blocks.sign[b]
        for k in range(n):
            total[i, k] -= side * values[b * n + k]


@compiled
def gather_curvature(
    ratio: FloatArray, blocks: BoundBlocks, barrier: FloatArray
) -> None:
    """Fill `barrier`, (4 + m, n), with the sums of each column's ratios."""
    n = barrier.shape[1]
    barrier[:] = 0.0
    for b in range(blocks.column.size):
        i = blocks.column[b]
        for k in range(n):
            barrier[i, k] += ratio[b * n + k]


@compiled
def certifies_infeasibility(
    program: JerkProgram,
    blocks: BoundBlocks,
    table: FloatArray,
    dual: FloatArray,
    room: FloatArray,
    linear_term: FloatArray,
) -> bool:
    """Check whether the multipliers prove that no motion keeps all bounds (Farkas).

    With multipliers z >= 0 every feasible motion has sum z (violation) <= 0. The sum is
    affine in the jerk, so that its minimum over the jerk's own bounds is at hand; where
    that is positive, there is no feasible motion; [NocedalWright2006] lemma 12.4.

    Args:
        program: Gives the dynamics and the jerk's bounds.
        blocks: Its bounds.
        table: The present motion, (4 + m, n).
        dual: Multipliers, (n_blocks n,).
        room: To the bounds, (n_blocks n,).
        linear_term: The sum's derivatives with respect to the table, (4 + m, n).
    """
    jerk_lower, jerk_upper = program.jerk_lower, program.jerk_upper
    if not (jerk_lower > -NO_BOUND and jerk_upper < NO_BOUND):
        return False
    step, row = program.step, program.row
    n, m = row.shape[0], row.shape[1]
    least, size = 0.0, 0.0
    for b in range(blocks.column.size):
        if blocks.column[b] == 3 + m:
            break  # the jerk's own bounds stand for themselves
        for i in range(b * n, (b + 1) * n):
            part = dual[i] * room[i]
            least -= part
            size += abs(part)
    g0, g1, g2 = 0.0, 0.0, 0.0  # of the sum, with respect to the state at knot k
    for k in range(n - 1, -1, -1):
        if k < n - 1:
            h = step[k]
            half = 0.5 * h * h
            slope = h * half / 3.0 * g0 + half * g1 + h * g2
            jerk = table[3 + m, k]
            best = min(slope * (jerk_lower - jerk), slope * (jerk_upper - jerk))
            least += best
            size += abs(best)
            g2 += half * g0 + h * g1
            g1 += h * g0
        g0 += linear_term[0, k]
        g1 += linear_term[1, k]
        g2 += linear_term[2, k]
        for i in range(m):
            g0 += linear_term[3 + i, k] * row[k, i, 0]
            g1 += linear_term[3 + i, k] * row[k, i, 1]
            g2 += linear_term[3 + i, k] * row[k, i, 2]
    return least > PROOF_MARGIN * size
