"""Compiled solver of the piecewise-jerk program: interior point, Riccati recursions.

Mehrotra's predictor-corrector; its Newton step is a recursion over the knots
(`planner.piecewise_jerk.riccati`), its bounds are those of
`planner.piecewise_jerk.bounds`. Iterates always obey the dynamics.
"""

import numpy as np

from planner.numerics.compiled import compiled
from planner.piecewise_jerk.bounds import (
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
from planner.piecewise_jerk.objective import (
    add_slopes,
    fill_hessian,
    fill_slopes,
    free_motion,
    objective_value,
)
from planner.piecewise_jerk.riccati import (
    backward,
    backward_linear,
    forward,
)
from planner.piecewise_jerk.vector_loops import (
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
    objective = objective_value(cost, wish, table)
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
        objective = objective_value(cost, wish, table)
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
        fill_hessian(cost, curved, row, hessian)
        products(ratio, residual, push)
        gather(push, column, sign, sloped)
        fill_slopes(cost, wish, table, gradient)
        add_slopes(row, sloped, gradient)
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
        add_slopes(row, sloped, gradient)
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
    add_slopes(row, sloped, gradient)
    backward_linear(step, gradient, gain, feed)
    forward(step, gain, feed, change)
    answer, last = 0.0, change.shape[0] - 1
    for k in range(change.shape[1]):
        answer += gradient[0, k] * change[0, k] + gradient[1, k] * change[1, k]
        answer += gradient[2, k] * change[2, k] + gradient[3, k] * change[last, k]
    return 0.5 * room * room / max(-answer, 1e-300)


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
