"""The bounds of a piecewise-jerk program in an interior point: slacks, multipliers.

Values that may be bounded stand in a table of columns (4 + m, n): p, p', p'', the m
rows, and the jerk of the interval that begins at the knot. A *block* is the lower or
the upper bound of one column at all knots; blocks without any bound are left out. In a
block that has bounds at some knots only, `active` is 0 at the others, where the slack
stays 1 and the multiplier 0.

Loops over the knots of a block write one array each, so that the compiler makes vector
code of them.
"""

import numpy as np

from planner.numerics.compiled import compiled
from planner.states import FloatArray, IntArray

NO_BOUND = 1e19  # a bound beyond it is none
PROOF_MARGIN = 1e-6  # of a proof, relative to what it is made of


@compiled
def block_columns(
    lower: FloatArray, upper: FloatArray, jerk_lower: float, jerk_upper: float
) -> tuple[IntArray, FloatArray]:
    """Find the blocks that have a bound: (column, sign), (n_blocks,) each.

    The sign is 1 for a lower bound and -1 for an upper one, so that
    sign value + offset is the room to the bound.
    """
    n, n_columns = lower.shape[0], lower.shape[1]
    column = np.empty(2 * n_columns + 2, np.int64)
    sign = np.empty(2 * n_columns + 2)
    count = 0
    for i in range(n_columns + 1):
        for side in (1.0, -1.0):
            if i == n_columns:
                bound = -jerk_lower if side > 0.0 else jerk_upper
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
def block_offsets(
    lower: FloatArray,
    upper: FloatArray,
    jerk_lower: float,
    jerk_upper: float,
    column: IntArray,
    sign: FloatArray,
    offset: FloatArray,
    active: FloatArray,
) -> int:
    """Fill the offsets and where there are bounds, (n_blocks n,); count the bounds."""
    n, n_columns = lower.shape[0], lower.shape[1]
    count = 0
    for b in range(column.size):
        i = column[b]
        for k in range(n):
            offset[b * n + k], active[b * n + k] = 0.0, 0.0
            if i == n_columns:
                there = k < n - 1
                bound = -jerk_lower if sign[b] > 0.0 else jerk_upper
            else:
                bound = -lower[k, i] if sign[b] > 0.0 else upper[k, i]
                there = k > 0 and bound < NO_BOUND
            if there:
                offset[b * n + k], active[b * n + k] = bound, 1.0
                count += 1
    return count


@compiled
def move_table(table: FloatArray, change: FloatArray, alpha: float) -> None:
    """Go a share of the way of a change."""
    for i in range(table.shape[0]):
        for k in range(table.shape[1]):
            table[i, k] += alpha * change[i, k]


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
def rooms(
    table: FloatArray,
    column: IntArray,
    sign: FloatArray,
    offset: FloatArray,
    active: FloatArray,
    room: FloatArray,
) -> None:
    """Fill the room to every bound; 0 where there is none."""
    n = table.shape[1]
    for b in range(column.size):
        i, side = column[b], sign[b]
        for k in range(n):
            room[b * n + k] = active[b * n + k] * (
                side * table[i, k] + offset[b * n + k]
            )


@compiled
def slack_steps(
    change: FloatArray,
    column: IntArray,
    sign: FloatArray,
    active: FloatArray,
    residual: FloatArray,
    d_slack: FloatArray,
) -> None:
    """Fill the steps of the slacks that belong to a change of the table."""
    n = change.shape[1]
    for b in range(column.size):
        i, side = column[b], sign[b]
        for k in range(n):
            d_slack[b * n + k] = (
                active[b * n + k] * (side * change[i, k]) - residual[b * n + k]
            )


@compiled
def gather(
    values: FloatArray, column: IntArray, sign: FloatArray, total: FloatArray
) -> None:
    """Add -sign values of every block to its column of `total`."""
    n = total.shape[1]
    total[:] = 0.0
    for b in range(column.size):
        i, side = column[b], sign[b]
        for k in range(n):
            total[i, k] -= side * values[b * n + k]


@compiled
def gather_curvature(ratio: FloatArray, column: IntArray, curved: FloatArray) -> None:
    """Add the ratios of every block to its column of `curved`."""
    n = curved.shape[1]
    curved[:] = 0.0
    for b in range(column.size):
        i = column[b]
        for k in range(n):
            curved[i, k] += ratio[b * n + k]


@compiled
def farkas(
    step: FloatArray,
    row: FloatArray,
    table: FloatArray,
    column: IntArray,
    dual: FloatArray,
    room: FloatArray,
    push: FloatArray,
    jerk_lower: float,
    jerk_upper: float,
) -> bool:
    """Try the multipliers as a proof that no jerk within its bounds keeps the others.

    With multipliers z >= 0 every feasible motion has sum z (violation) <= 0. The sum is
    affine in the jerk, so that its least value over the jerk's own bounds is at hand;
    where that is positive, there is no feasible motion (Farkas).

    Args:
        step: (n - 1,).
        row: (n, m, 3).
        table: The present motion, (4 + m, n).
        column: Of the blocks, rising.
        dual: Multipliers of the blocks, (n_blocks n,).
        room: To the bounds, (n_blocks n,); 0 where there is none.
        push: The sum's derivatives with respect to the table, (4 + m, n).
        jerk_lower: Of every interval.
        jerk_upper: As `jerk_lower`.
    """
    if not (jerk_lower > -NO_BOUND and jerk_upper < NO_BOUND):
        return False
    n, m = row.shape[0], row.shape[1]
    least, size = 0.0, 0.0
    for b in range(column.size):
        if column[b] == 3 + m:
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
        g0 += push[0, k]
        g1 += push[1, k]
        g2 += push[2, k]
        for i in range(m):
            g0 += push[3 + i, k] * row[k, i, 0]
            g1 += push[3 + i, k] * row[k, i, 1]
            g2 += push[3 + i, k] * row[k, i, 2]
    return least > PROOF_MARGIN * size
