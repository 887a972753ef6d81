"""Compiled solver of the piecewise-jerk program: interior point, Riccati recursions.

Mehrotra's predictor-corrector; its Newton step is a recursion over the knots
(`planner.motion.piecewise_jerk_recursions`), its bounds are those of
`planner.motion.piecewise_jerk_bounds`. Iterates always obey the dynamics.
"""

import numpy as np

from planner.compiled import compiled
from planner.motion.piecewise_jerk_bounds import (
    NO_BOUND,
    block_columns,
    block_offsets,
    farkas,
    gather,
    gather_curvature,
    move_table,
    rooms,
    row_values,
    slack_steps,
)
from planner.motion.piecewise_jerk_recursions import (
    backward,
    backward_linear,
    forward,
    roll_out,
)
from planner.motion.vector_loops import (
    centring,
    dot,
    dual_steps,
    inverses,
    largest,
    least,
    longest_step,
    move,
    predicted,
    products,
    residuals,
    shortfalls,
)
from planner.states import FloatArray

SOLVED, INFEASIBLE, UNDECIDED, TOO_DEAR = 0, 1, 2, 3  # verdicts of `interior_point`
PROOF_FROM = 2  # iterations before a proof of infeasibility is looked for
CUT_FROM = 1  # and one of being too dear
TO_THE_BOUND = 0.995  # share of the way to the nearest bound that a step may go
LEAST_SLACK = 1.0  # at the beginning
CUT_MARGIN = 1e-6  # by which a bound has to exceed the cost to beat, relative


@compiled
def interior_point(
    step: FloatArray,
    start: FloatArray,
    weight: FloatArray,
    reference: FloatArray,
    jerk_weight: float,
    lower: FloatArray,
    upper: FloatArray,
    row: FloatArray,
    jerk_lower: float,
    jerk_upper: float,
    max_iterations: int,
    tolerance: float,
) -> tuple[FloatArray, FloatArray, float, int, int]:
    """Solve one program with hard bounds, whatever it costs; see `cheaper_than`."""
    return cheaper_than(
        np.inf,
        step,
        start,
        weight,
        reference,
        jerk_weight,
        lower,
        upper,
        row,
        jerk_lower,
        jerk_upper,
        max_iterations,
        tolerance,
    )


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
    cost, wish = _columns(step, weight, reference, jerk_weight)
    table, change = np.zeros((4, n)), np.zeros((4, n))
    hessian, gradient = np.zeros((7, n)), np.zeros((4, n))
    gain, feed = np.empty((4, n - 1)), np.empty(n - 1)
    for d in range(3):
        table[d, 0] = start[d]
    roll_out(step, table[3], table)
    _hessian(cost, np.zeros((4, n)), np.empty((n, 0, 3)), hessian)
    _slopes(cost, wish, table, gradient)
    backward(step, hessian, gradient, gain, feed)
    forward(step, gain, feed, change)
    move_table(table, change, 1.0)
    return table, cost, wish, gain, feed


@compiled
def cheaper_than(  # noqa: C901, PLR0915 - one algorithm, its steps in order
    cost_to_beat: float,
    step: FloatArray,
    start: FloatArray,
    weight: FloatArray,
    reference: FloatArray,
    jerk_weight: float,
    lower: FloatArray,
    upper: FloatArray,
    row: FloatArray,
    jerk_lower: float,
    jerk_upper: float,
    max_iterations: int,
    tolerance: float,
) -> tuple[FloatArray, FloatArray, float, int, int]:
    """Solve one program with hard bounds, unless it is proven to cost too much.

    Args:
        cost_to_beat: Where the multipliers prove that every motion within the bounds
            costs more, the verdict is TOO_DEAR and the objective that lower bound.
        step: (n - 1,).
        start: (3,).
        weight: (n, 3).
        reference: (n, 3).
        jerk_weight: > 0.
        lower: Of states and rows, (n, 3 + m); knot 0 is not looked at.
        upper: As `lower`.
        row: (n, m, 3).
        jerk_lower: Of every interval.
        jerk_upper: As `jerk_lower`.
        max_iterations: Before giving up.
        tolerance: Of the bounds, and of the gap relative to the objective.

    Returns:
        (state (n, 3), jerk (n - 1,), objective, verdict, iterations).
    """
    n, m = row.shape[0], row.shape[1]
    free, cost, wish, gain, feed = free_motion(
        step, start, weight, reference, jerk_weight
    )
    table, change = np.empty((4 + m, n)), np.zeros((4 + m, n))
    table[:3], table[3 + m] = free[:3], free[3]
    row_values(row, table)
    hessian, gradient = np.empty((7, n)), np.empty((4, n))
    curved, sloped = np.empty((4 + m, n)), np.empty((4 + m, n))

    column, sign = block_columns(lower, upper, jerk_lower, jerk_upper)
    size = column.size * n  # of flat tables, block after block
    offset, active = np.empty(size), np.empty(size)
    count = block_offsets(
        lower, upper, jerk_lower, jerk_upper, column, sign, offset, active
    )
    room, slack, dual = np.empty(size), np.empty(size), np.empty(size)
    rooms(table, column, sign, offset, active, room)
    objective = _objective(cost, wish, table)
    if least(room) >= 0.0 and np.isfinite(objective):  # bounds change nothing
        return _states(table), table[3 + m, :-1].copy(), objective, SOLVED, 0

    free_objective, free_gain, free_room = objective, gain.copy(), room.copy()
    margin = CUT_MARGIN * (1.0 + abs(cost_to_beat))
    if cost_to_beat < NO_BOUND:  # what the free motion breaks may be proof enough
        shortfalls(room, dual)
        gather(dual, column, sign, sloped)
        above = dot(dual, room)
        above = _dearer(step, row, gain, sloped, above, gradient, feed, change)
        if objective + above > cost_to_beat + margin:
            jerk = table[3 + m, :-1].copy()
            return _states(table), jerk, objective + above, TOO_DEAR, 0
    inverse, ratio, residual = np.empty(size), np.empty(size), np.empty(size)
    d_slack, d_dual, push = np.empty(size), np.empty(size), np.empty(size)
    _begin(room, active, slack, dual)
    dual_residual = 1.0  # relative to the first one; falls with every step taken
    for iteration in range(max_iterations + 1):
        objective = _objective(cost, wish, table)
        residuals(slack, active, room, residual)
        gap = dot(slack, dual)
        violation = max(largest(residual), -least(residual))
        small = tolerance * (1.0 + abs(objective))
        if violation < tolerance and gap < small and dual_residual < tolerance:
            jerk = table[3 + m, :-1].copy()
            return _states(table), jerk, objective, SOLVED, iteration
        if iteration == max_iterations or not np.isfinite(objective + gap):
            break
        if iteration >= PROOF_FROM and violation > tolerance:
            gather(dual, column, sign, sloped)
            if farkas(
                step, row, table, column, dual, room, sloped, jerk_lower, jerk_upper
            ):
                jerk = table[3 + m, :-1].copy()
                return _states(table), jerk, np.inf, INFEASIBLE, iteration
        if iteration >= CUT_FROM and cost_to_beat < NO_BOUND:
            gather(dual, column, sign, sloped)
            above = dot(dual, free_room)
            above = _dearer(step, row, free_gain, sloped, above, gradient, feed, change)
            if free_objective + above > cost_to_beat + margin:
                jerk = table[3 + m, :-1].copy()
                return _states(table), jerk, free_objective + above, TOO_DEAR, iteration
        inverses(slack, inverse)
        products(dual, inverse, ratio)
        gather_curvature(ratio, column, curved)
        _hessian(cost, curved, row, hessian)
        products(ratio, residual, push)
        gather(push, column, sign, sloped)
        _slopes(cost, wish, table, gradient)
        _add_slopes(row, sloped, gradient)
        backward(step, hessian, gradient, gain, feed)
        forward(step, gain, feed, change)
        row_values(row, change)
        slack_steps(change, column, sign, active, residual, d_slack)
        products(d_slack, inverse, push)
        # of the predictor dz / z = -1 - ds / s
        nearest = max(-least(push), 1.0 + largest(push))
        alpha = min(1.0 / nearest, 1.0)
        predicted(ratio, d_slack, dual, d_dual)
        crossed = dot(d_slack, d_dual)
        left = (1.0 - alpha) * gap + alpha * alpha * crossed
        centre = (left / gap) ** 3 * gap / count
        centring(centre, active, d_slack, d_dual, inverse, push)
        gather(push, column, sign, sloped)
        _add_slopes(row, sloped, gradient)
        backward_linear(step, gradient, gain, feed)
        forward(step, gain, feed, change)
        row_values(row, change)
        slack_steps(change, column, sign, active, residual, d_slack)
        dual_steps(push, ratio, d_slack, dual, d_dual)
        alpha = longest_step(slack, d_slack, inverse, dual, d_dual)
        # where the gap is small the bounds in reach are those that hold in the end
        share = max(TO_THE_BOUND, 1.0 - gap / (1.0 + abs(objective)))
        alpha = min(1.0, share * alpha)
        move_table(table, change, alpha)
        move(slack, d_slack, alpha)
        move(dual, d_dual, alpha)
        rooms(table, column, sign, offset, active, room)
        dual_residual *= 1.0 - alpha
    jerk = table[3 + m, :-1].copy()
    return _states(table), jerk, np.inf, UNDECIDED, max_iterations


@compiled
def _dearer(
    step: FloatArray,
    row: FloatArray,
    gain: FloatArray,
    sloped: FloatArray,
    room: float,
    gradient: FloatArray,
    feed: FloatArray,
    change: FloatArray,
) -> float:
    """Say by how much at least the bounds make the motion dearer than the free one.

    For multipliers t z the dual function is f_free - t z'room + ½ t² z'J dx, where dx
    is the answer of the free motion to the push of the multipliers. It bounds the
    cost from below for every t >= 0; here for the best t.

    Args:
        step: (n - 1,).
        row: (n, m, 3).
        gain: Of the recursion without bounds.
        sloped: Push of the multipliers, (4 + m, n).
        room: z'room of the free motion; negative where it breaks bounds.
        gradient: Overwritten, as are `feed` and `change`.
        feed: As above.
        change: As above.
    """
    if room >= 0.0:
        return 0.0
    gradient[:] = 0.0
    _add_slopes(row, sloped, gradient)
    backward_linear(step, gradient, gain, feed)
    forward(step, gain, feed, change)
    answer, last = 0.0, change.shape[0] - 1
    for k in range(change.shape[1]):
        answer += gradient[0, k] * change[0, k] + gradient[1, k] * change[1, k]
        answer += gradient[2, k] * change[2, k] + gradient[3, k] * change[last, k]
    return 0.5 * room * room / max(-answer, 1e-300)


@compiled
def _columns(
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
def _objective(cost: FloatArray, wish: FloatArray, table: FloatArray) -> float:
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
def _slopes(
    cost: FloatArray, wish: FloatArray, table: FloatArray, gradient: FloatArray
) -> None:
    """Fill the objective's gradient, (4, n)."""
    last = table.shape[0] - 1
    for d in range(4):
        i = d if d < 3 else last
        for k in range(table.shape[1]):
            gradient[d, k] = cost[d, k] * (table[i, k] - wish[d, k])


@compiled
def _add_slopes(row: FloatArray, sloped: FloatArray, gradient: FloatArray) -> None:
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
def _hessian(
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
def _states(table: FloatArray) -> FloatArray:
    """Give the states as rows, (n, 3)."""
    state = np.empty((table.shape[1], 3))
    for k in range(table.shape[1]):
        state[k, 0], state[k, 1], state[k, 2] = table[0, k], table[1, k], table[2, k]
    return state


@compiled
def _begin(
    room: FloatArray, active: FloatArray, slack: FloatArray, dual: FloatArray
) -> None:
    """Begin inside every bound, with slack times multiplier 1 at each.

    Where there is no bound, the slack is 1 and the multiplier 0.
    """
    for i in range(room.size):
        if active[i] > 0.0:
            slack[i] = max(room[i], LEAST_SLACK)
            dual[i] = 1.0 / slack[i]
        else:
            slack[i], dual[i] = 1.0, 0.0
