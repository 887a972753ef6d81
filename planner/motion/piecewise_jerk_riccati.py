"""Compiled solver of the piecewise-jerk program: interior point, Riccati recursions.

Mehrotra's predictor-corrector. Its Newton step is itself a program without bounds,
min of a quadratic form along the dynamics, and a Riccati recursion over the knots
solves that in O(n): three states, one input. Iterates always obey the dynamics.

What may be bounded stands in one table of values, (n, 4 + m): the columns are p, p',
p'', the m rows, and the jerk of the interval that begins at the knot. Bounds at
infinity are none.
"""

import numpy as np

from planner.compiled import compiled
from planner.states import FloatArray

NO_BOUND = 1e19  # a bound beyond it is none
SOLVED, INFEASIBLE, UNDECIDED = 0, 1, 2  # verdicts of `interior_point`
PROOF_FROM = 4  # iterations before a proof of infeasibility is looked for
PROOF_MARGIN = 1e-6  # of the proof, relative to what it is made of
TO_THE_BOUND = 0.995  # share of the way to the nearest bound that a step may go
LEAST_SLACK = 1.0  # at the beginning


@compiled
def interior_point(  # noqa: PLR0915 - one algorithm, its steps in order
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
    """Solve one program with hard bounds.

    Args:
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
    low, up = _bounds(lower, upper, jerk_lower, jerk_upper, n, m)
    state, jerk = np.empty((n, 3)), np.zeros(n - 1)
    state[0] = start
    _roll_out(step, jerk, state)
    value, change = np.zeros((n, 4 + m)), np.zeros((n, 4 + m))
    _values(state, jerk, row, value)
    # slack and multiplier of the lower [0] and the upper [1] bound, and their steps
    slack, dual = np.ones((2, n, 4 + m)), np.zeros((2, n, 4 + m))
    d_slack, d_dual = np.zeros((2, n, 4 + m)), np.zeros((2, n, 4 + m))
    count = _first_slacks(value, low, up, slack, dual)

    hessian, gradient = np.zeros((n, 6)), np.zeros((n, 3))
    jerk_hessian, jerk_gradient = np.empty(n - 1), np.empty(n - 1)
    gain, feed = np.empty((n - 1, 4)), np.empty(n - 1)
    d_state, d_jerk = np.empty((n, 3)), np.empty(n - 1)
    curved, sloped = np.zeros((n, 4 + m)), np.zeros((n, 4 + m))

    _objective_terms(
        step,
        state,
        jerk,
        weight,
        reference,
        jerk_weight,
        hessian,
        gradient,
        jerk_hessian,
        jerk_gradient,
    )
    _backward(step, hessian, gradient, jerk_hessian, jerk_gradient, gain, feed)
    _forward(step, gain, feed, d_state, d_jerk)
    _values(d_state, d_jerk, row, change)
    if _keeps_bounds(value, change, low, up):  # the least without bounds is the answer
        state += d_state
        jerk += d_jerk
        objective = _objective_terms(
            step,
            state,
            jerk,
            weight,
            reference,
            jerk_weight,
            hessian,
            gradient,
            jerk_hessian,
            jerk_gradient,
        )
        return state, jerk, objective, SOLVED, 0

    dual_residual = 1.0  # relative to the first one; falls with every step taken
    for iteration in range(max_iterations + 1):
        objective = _objective_terms(
            step,
            state,
            jerk,
            weight,
            reference,
            jerk_weight,
            hessian,
            gradient,
            jerk_hessian,
            jerk_gradient,
        )
        gap, violation = _bound_terms(value, low, up, slack, dual, curved, sloped)
        small = tolerance * (1.0 + abs(objective))
        if violation < tolerance and gap < small and dual_residual < tolerance:
            return state, jerk, objective, SOLVED, iteration
        if iteration == max_iterations or not np.isfinite(objective + gap):
            break
        if (
            iteration >= PROOF_FROM
            and violation > tolerance
            and _proven_infeasible(step, row, value, low, up, dual)
        ):
            return state, jerk, np.inf, INFEASIBLE, iteration
        _add_bounds(row, curved, sloped, hessian, gradient, jerk_hessian, jerk_gradient)
        _backward(step, hessian, gradient, jerk_hessian, jerk_gradient, gain, feed)
        _forward(step, gain, feed, d_state, d_jerk)
        _values(d_state, d_jerk, row, change)
        alpha = _directions(
            value, change, low, up, slack, dual, d_slack, d_dual, 0.0, 0.0
        )
        if count > 0:
            alpha = min(alpha, 1.0)
            left = _gap_after(low, up, slack, dual, d_slack, d_dual, alpha)
            target = (left / gap) ** 3 * gap / count
            _centring(low, up, slack, d_slack, d_dual, target, sloped)
            _add_slopes(row, sloped, gradient, jerk_gradient)
            _backward_linear(step, gradient, jerk_gradient, gain, feed)
            _forward(step, gain, feed, d_state, d_jerk)
            _values(d_state, d_jerk, row, change)
            alpha = _directions(
                value, change, low, up, slack, dual, d_slack, d_dual, target, 1.0
            )
        alpha = min(1.0, TO_THE_BOUND * alpha)
        state += alpha * d_state
        jerk += alpha * d_jerk
        value += alpha * change
        slack += alpha * d_slack
        dual += alpha * d_dual
        dual_residual *= 1.0 - alpha
    return state, jerk, np.inf, UNDECIDED, max_iterations


@compiled
def _keeps_bounds(
    value: FloatArray, change: FloatArray, low: FloatArray, up: FloatArray
) -> bool:
    """Tell whether every bound holds after a full step."""
    for k in range(value.shape[0]):
        for i in range(value.shape[1]):
            after = value[k, i] + change[k, i]
            if after < low[k, i] or after > up[k, i]:
                return False
    return True


@compiled
def _proven_infeasible(
    step: FloatArray,
    row: FloatArray,
    value: FloatArray,
    low: FloatArray,
    up: FloatArray,
    dual: FloatArray,
) -> bool:
    """Try the multipliers as a proof that no jerk within its bounds keeps the others.

    With multipliers z >= 0 every feasible motion has sum z (violation) <= 0. The sum is
    affine in the jerk, so that its least value over the jerk's own bounds is at hand;
    where that is positive, there is no feasible motion (Farkas).
    """
    n, m = row.shape[0], row.shape[1]
    jerk_lower, jerk_upper = low[0, 3 + m], up[0, 3 + m]
    if not (jerk_lower > -NO_BOUND and jerk_upper < NO_BOUND):
        return False
    least, size = 0.0, 0.0
    g0, g1, g2 = 0.0, 0.0, 0.0  # of the sum, with respect to the state at knot k
    for k in range(n - 1, -1, -1):
        if k < n - 1:
            h = step[k]
            half = 0.5 * h * h
            slope = h * half / 3.0 * g0 + half * g1 + h * g2
            jerk = value[k, 3 + m]
            best = slope * (jerk_lower - jerk)
            best = min(best, slope * (jerk_upper - jerk))
            least += best
            size += abs(best)
            g2 += half * g0 + h * g1
            g1 += h * g0
        for i in range(3 + m):
            push = 0.0
            if low[k, i] > -NO_BOUND:
                push -= dual[0, k, i]
                part = dual[0, k, i] * (low[k, i] - value[k, i])
                least += part
                size += abs(part)
            if up[k, i] < NO_BOUND:
                push += dual[1, k, i]
                part = dual[1, k, i] * (value[k, i] - up[k, i])
                least += part
                size += abs(part)
            if i == 0:
                g0 += push
            elif i == 1:
                g1 += push
            elif i == 2:
                g2 += push
            else:
                g0 += push * row[k, i - 3, 0]
                g1 += push * row[k, i - 3, 1]
                g2 += push * row[k, i - 3, 2]
    return least > PROOF_MARGIN * size


@compiled
def _bounds(
    lower: FloatArray,
    upper: FloatArray,
    jerk_lower: float,
    jerk_upper: float,
    n: int,
    m: int,
) -> tuple[FloatArray, FloatArray]:
    """Put all bounds into the table, none at knot 0 and for the jerk after the end."""
    low = np.full((n, 4 + m), -np.inf)
    up = np.full((n, 4 + m), np.inf)
    low[1:, : 3 + m] = lower[1:]
    up[1:, : 3 + m] = upper[1:]
    low[: n - 1, 3 + m] = jerk_lower
    up[: n - 1, 3 + m] = jerk_upper
    return low, up


@compiled
def _roll_out(step: FloatArray, jerk: FloatArray, state: FloatArray) -> None:
    """Fill `state` from its first row on."""
    for k in range(step.size):
        h = step[k]
        p, v, a, j = state[k, 0], state[k, 1], state[k, 2], jerk[k]
        state[k + 1, 0] = p + h * (v + h * (0.5 * a + h * j / 6.0))
        state[k + 1, 1] = v + h * (a + 0.5 * h * j)
        state[k + 1, 2] = a + h * j


@compiled
def _values(
    state: FloatArray, jerk: FloatArray, row: FloatArray, value: FloatArray
) -> None:
    """Fill the table of what may be bounded."""
    n, m = row.shape[0], row.shape[1]
    for k in range(n):
        for d in range(3):
            value[k, d] = state[k, d]
        for i in range(m):
            value[k, 3 + i] = (
                row[k, i, 0] * state[k, 0]
                + row[k, i, 1] * state[k, 1]
                + row[k, i, 2] * state[k, 2]
            )
        if k < n - 1:
            value[k, 3 + m] = jerk[k]


@compiled
def _first_slacks(
    value: FloatArray,
    low: FloatArray,
    up: FloatArray,
    slack: FloatArray,
    dual: FloatArray,
) -> int:
    """Begin inside every bound; count the bounds."""
    count = 0
    for k in range(value.shape[0]):
        for i in range(value.shape[1]):
            if low[k, i] > -NO_BOUND:
                slack[0, k, i] = max(value[k, i] - low[k, i], LEAST_SLACK)
                dual[0, k, i] = 1.0
                count += 1
            if up[k, i] < NO_BOUND:
                slack[1, k, i] = max(up[k, i] - value[k, i], LEAST_SLACK)
                dual[1, k, i] = 1.0
                count += 1
    return count


@compiled
def _objective_terms(
    step: FloatArray,
    state: FloatArray,
    jerk: FloatArray,
    weight: FloatArray,
    reference: FloatArray,
    jerk_weight: float,
    hessian: FloatArray,
    gradient: FloatArray,
    jerk_hessian: FloatArray,
    jerk_gradient: FloatArray,
) -> float:
    """Write the objective's derivatives, give its value.

    Columns of `hessian`: 00, 01, 02, 11, 12, 22.
    """
    n = state.shape[0]
    objective = 0.0
    for k in range(n):
        h = step[min(k, n - 2)]
        hessian[k] = 0.0
        for d in range(3):
            curvature = 2.0 * h * weight[k, d]
            error = state[k, d] - reference[k, d]
            objective += 0.5 * curvature * error * error
            gradient[k, d] = curvature * error
            hessian[k, 0 if d == 0 else 2 * d + 1] = curvature
    for k in range(n - 1):
        curvature = 2.0 * step[k] * jerk_weight
        objective += 0.5 * curvature * jerk[k] * jerk[k]
        jerk_hessian[k] = curvature
        jerk_gradient[k] = curvature * jerk[k]
    return objective


@compiled
def _bound_terms(
    value: FloatArray,
    low: FloatArray,
    up: FloatArray,
    slack: FloatArray,
    dual: FloatArray,
    curved: FloatArray,
    sloped: FloatArray,
) -> tuple[float, float]:
    """Write what the bounds add to the Newton system; give (gap, worst violation)."""
    gap, violation = 0.0, 0.0
    for k in range(value.shape[0]):
        for i in range(value.shape[1]):
            curved[k, i], sloped[k, i] = 0.0, 0.0
            if low[k, i] > -NO_BOUND:
                residual = slack[0, k, i] - (value[k, i] - low[k, i])
                ratio = dual[0, k, i] / slack[0, k, i]
                gap += dual[0, k, i] * slack[0, k, i]
                violation = max(violation, abs(residual))
                curved[k, i] += ratio
                sloped[k, i] -= ratio * residual
            if up[k, i] < NO_BOUND:
                residual = slack[1, k, i] - (up[k, i] - value[k, i])
                ratio = dual[1, k, i] / slack[1, k, i]
                gap += dual[1, k, i] * slack[1, k, i]
                violation = max(violation, abs(residual))
                curved[k, i] += ratio
                sloped[k, i] += ratio * residual
    return gap, violation


@compiled
def _add_bounds(
    row: FloatArray,
    curved: FloatArray,
    sloped: FloatArray,
    hessian: FloatArray,
    gradient: FloatArray,
    jerk_hessian: FloatArray,
    jerk_gradient: FloatArray,
) -> None:
    """Add the bounds' part to the derivatives of states and jerk."""
    n, m = row.shape[0], row.shape[1]
    for k in range(n):
        hessian[k, 0] += curved[k, 0]
        hessian[k, 3] += curved[k, 1]
        hessian[k, 5] += curved[k, 2]
        for i in range(m):
            c = curved[k, 3 + i]
            if c != 0.0:
                r0, r1, r2 = row[k, i, 0], row[k, i, 1], row[k, i, 2]
                hessian[k, 0] += c * r0 * r0
                hessian[k, 1] += c * r0 * r1
                hessian[k, 2] += c * r0 * r2
                hessian[k, 3] += c * r1 * r1
                hessian[k, 4] += c * r1 * r2
                hessian[k, 5] += c * r2 * r2
        if k < n - 1:
            jerk_hessian[k] += curved[k, 3 + m]
    _add_slopes(row, sloped, gradient, jerk_gradient)


@compiled
def _add_slopes(
    row: FloatArray,
    sloped: FloatArray,
    gradient: FloatArray,
    jerk_gradient: FloatArray,
) -> None:
    """Add the bounds' part to the gradients only."""
    n, m = row.shape[0], row.shape[1]
    for k in range(n):
        for d in range(3):
            gradient[k, d] += sloped[k, d]
        for i in range(m):
            c = sloped[k, 3 + i]
            if c != 0.0:
                for d in range(3):
                    gradient[k, d] += c * row[k, i, d]
        if k < n - 1:
            jerk_gradient[k] += sloped[k, 3 + m]


@compiled
def _backward(
    step: FloatArray,
    hessian: FloatArray,
    gradient: FloatArray,
    jerk_hessian: FloatArray,
    jerk_gradient: FloatArray,
    gain: FloatArray,
    feed: FloatArray,
) -> None:
    """Riccati recursion: cost-to-go ½ x'P x + g'x from the last knot to the first.

    `gain` keeps A'P B and 1 / (R + B'P B) for the recursion of the gradient alone.
    """
    last = hessian.shape[0] - 1
    p00, p01, p02 = hessian[last, 0], hessian[last, 1], hessian[last, 2]
    p11, p12, p22 = hessian[last, 3], hessian[last, 4], hessian[last, 5]
    for k in range(last - 1, -1, -1):
        h = step[k]
        half = 0.5 * h * h
        b0, b1, b2 = h * half / 3.0, half, h
        c0 = p00 * b0 + p01 * b1 + p02 * b2  # P B
        c1 = p01 * b0 + p11 * b1 + p12 * b2
        c2 = p02 * b0 + p12 * b1 + p22 * b2
        inverse = 1.0 / (jerk_hessian[k] + b0 * c0 + b1 * c1 + b2 * c2)
        m0 = c0  # A' P B
        m1 = h * c0 + c1
        m2 = half * c0 + h * c1 + c2
        gain[k, 0], gain[k, 1], gain[k, 2], gain[k, 3] = m0, m1, m2, inverse
        q01 = h * p00 + p01  # A' P A
        q02 = half * p00 + h * p01 + p02
        q11 = h * (q01 + p01) + p11
        r12 = half * p01 + h * p11 + p12
        q12 = h * q02 + r12
        q22 = half * q02 + h * r12 + half * p02 + h * p12 + p22
        p00 += hessian[k, 0] - m0 * m0 * inverse
        p01 = hessian[k, 1] + q01 - m0 * m1 * inverse
        p02 = hessian[k, 2] + q02 - m0 * m2 * inverse
        p11 = hessian[k, 3] + q11 - m1 * m1 * inverse
        p12 = hessian[k, 4] + q12 - m1 * m2 * inverse
        p22 = hessian[k, 5] + q22 - m2 * m2 * inverse
    _backward_linear(step, gradient, jerk_gradient, gain, feed)


@compiled
def _backward_linear(
    step: FloatArray,
    gradient: FloatArray,
    jerk_gradient: FloatArray,
    gain: FloatArray,
    feed: FloatArray,
) -> None:
    """Do the recursion of the gradient, with the gains of `_backward`."""
    last = gradient.shape[0] - 1
    g0, g1, g2 = gradient[last, 0], gradient[last, 1], gradient[last, 2]
    for k in range(last - 1, -1, -1):
        h = step[k]
        half = 0.5 * h * h
        slope = jerk_gradient[k] + h * half / 3.0 * g0 + half * g1 + h * g2
        feed[k] = -slope * gain[k, 3]
        g2 = gradient[k, 2] + half * g0 + h * g1 + g2 + gain[k, 2] * feed[k]
        g1 = gradient[k, 1] + h * g0 + g1 + gain[k, 1] * feed[k]
        g0 = gradient[k, 0] + g0 + gain[k, 0] * feed[k]


@compiled
def _forward(
    step: FloatArray,
    gain: FloatArray,
    feed: FloatArray,
    d_state: FloatArray,
    d_jerk: FloatArray,
) -> None:
    """Roll the step of the states and the jerk out."""
    d_state[0] = 0.0
    for k in range(step.size):
        h = step[k]
        p, v, a = d_state[k, 0], d_state[k, 1], d_state[k, 2]
        back = gain[k, 0] * p + gain[k, 1] * v + gain[k, 2] * a
        j = feed[k] - gain[k, 3] * back
        d_jerk[k] = j
        d_state[k + 1, 0] = p + h * (v + h * (0.5 * a + h * j / 6.0))
        d_state[k + 1, 1] = v + h * (a + 0.5 * h * j)
        d_state[k + 1, 2] = a + h * j


@compiled
def _directions(
    value: FloatArray,
    change: FloatArray,
    low: FloatArray,
    up: FloatArray,
    slack: FloatArray,
    dual: FloatArray,
    d_slack: FloatArray,
    d_dual: FloatArray,
    target: float,
    second_order: float,
) -> float:
    """Write the steps of slacks and multipliers; give the longest step allowed.

    The corrector (`second_order` = 1) uses the products of the predictor's steps,
    which stand in `d_slack` and `d_dual` when it begins.
    """
    shortest_slack, shortest_dual = 0.0, 0.0  # largest -ds / s and -dz / z
    for k in range(value.shape[0]):
        for i in range(value.shape[1]):
            for side in range(2):
                if side == 0:
                    if not low[k, i] > -NO_BOUND:
                        continue
                    room, moved = value[k, i] - low[k, i], change[k, i]
                else:
                    if not up[k, i] < NO_BOUND:
                        continue
                    room, moved = up[k, i] - value[k, i], -change[k, i]
                s, z = slack[side, k, i], dual[side, k, i]
                product = second_order * d_slack[side, k, i] * d_dual[side, k, i]
                inverse = 1.0 / s
                ds = room - s + moved
                dz = (target - product - z * ds) * inverse - z
                d_slack[side, k, i], d_dual[side, k, i] = ds, dz
                shortest_slack = max(shortest_slack, -ds * inverse)
                if -dz > shortest_dual * z:
                    shortest_dual = -dz / z
    return 1.0 / max(shortest_slack, shortest_dual, 1e-9)


@compiled
def _gap_after(
    low: FloatArray,
    up: FloatArray,
    slack: FloatArray,
    dual: FloatArray,
    d_slack: FloatArray,
    d_dual: FloatArray,
    alpha: float,
) -> float:
    """Say what the gap would be after the predictor's step."""
    gap = 0.0
    for k in range(low.shape[0]):
        for i in range(low.shape[1]):
            if low[k, i] > -NO_BOUND:
                gap += (slack[0, k, i] + alpha * d_slack[0, k, i]) * (
                    dual[0, k, i] + alpha * d_dual[0, k, i]
                )
            if up[k, i] < NO_BOUND:
                gap += (slack[1, k, i] + alpha * d_slack[1, k, i]) * (
                    dual[1, k, i] + alpha * d_dual[1, k, i]
                )
    return gap


@compiled
def _centring(
    low: FloatArray,
    up: FloatArray,
    slack: FloatArray,
    d_slack: FloatArray,
    d_dual: FloatArray,
    target: float,
    sloped: FloatArray,
) -> None:
    """Write what the corrector adds to the bounds' part of the gradient."""
    for k in range(low.shape[0]):
        for i in range(low.shape[1]):
            sloped[k, i] = 0.0
            if low[k, i] > -NO_BOUND:
                product = d_slack[0, k, i] * d_dual[0, k, i]
                sloped[k, i] -= (target - product) / slack[0, k, i]
            if up[k, i] < NO_BOUND:
                product = d_slack[1, k, i] * d_dual[1, k, i]
                sloped[k, i] += (target - product) / slack[1, k, i]
