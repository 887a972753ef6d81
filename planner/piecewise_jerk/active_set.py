"""Compiled dual active-set solver of the piecewise-jerk program, for warm starts.

The method of Goldfarb and Idnani [GoldfarbIdnani1983]: begin at the least without
bounds, take in the most violated bound, one at a time, and let go of those that no
longer push. The objective only ever rises, so that a search can stop as soon as it
passes what it has to beat; infeasibility shows as a bound that nothing can meet; and
a program with a few bounds more goes on from where the one before ended.

H⁻¹ is never written as a matrix: the Hessian of the jerks is that of a linear
quadratic problem along the dynamics, and one backward and one forward pass of its
Riccati recursion give H⁻¹a in O(n). How a motion responds to a push on one value
depends on the weights alone, so that all programs of a search share these responses.

What may be bounded are columns of a table, (n, 3 + m): p, p', p'' and the m rows. A
bound is (knot, column, sign): sign * value >= sign * limit.
"""

import numpy as np

from planner.numerics.compiled import compiled
from planner.states import FloatArray, IntArray

SOLVED, INFEASIBLE, UNDECIDED, TOO_DEAR = 0, 1, 2, 3  # verdicts
DEPENDENT = 1e-11  # of a normal's length that is left beside the active ones


@compiled
def riccati_gains(
    step: FloatArray, weight: FloatArray, jerk_weight: float
) -> FloatArray:
    """Run the Riccati recursion of a program without bounds.

    Args:
        step: (n - 1,).
        weight: (n, 3).
        jerk_weight: > 0.

    Returns:
        A'P B and 1 / (R + B'P B) for each interval, (n - 1, 4).
    """
    n = weight.shape[0]
    gain = np.empty((n - 1, 4))
    h = step[n - 2]
    p00, p11, p22 = (
        2.0 * h * weight[n - 1, 0],
        2.0 * h * weight[n - 1, 1],
        2.0 * h * weight[n - 1, 2],
    )
    p01, p02, p12 = 0.0, 0.0, 0.0
    for k in range(n - 2, -1, -1):
        h = step[k]
        half = 0.5 * h * h
        b0, b1, b2 = h * half / 3.0, half, h
        c0 = p00 * b0 + p01 * b1 + p02 * b2  # P B
        c1 = p01 * b0 + p11 * b1 + p12 * b2
        c2 = p02 * b0 + p12 * b1 + p22 * b2
        inverse = 1.0 / (2.0 * h * jerk_weight + b0 * c0 + b1 * c1 + b2 * c2)
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
        p00 += 2.0 * h * weight[k, 0] - m0 * m0 * inverse
        p01 = q01 - m0 * m1 * inverse
        p02 = q02 - m0 * m2 * inverse
        p11 = 2.0 * h * weight[k, 1] + q11 - m1 * m1 * inverse
        p12 = q12 - m1 * m2 * inverse
        p22 = 2.0 * h * weight[k, 2] + q22 - m2 * m2 * inverse
    return gain


@compiled
def respond(
    step: FloatArray,
    gain: FloatArray,
    push: FloatArray,
    last: int,
    feed: FloatArray,
    state: FloatArray,
) -> None:
    """Write H⁻¹ push into `state`: how the motion gives way to a push.

    Args:
        step: (n - 1,).
        gain: As `riccati_gains` makes it.
        push: On the states, (n, 3); zero beyond knot `last`.
        last: See there.
        feed: Room to work in, (n - 1,).
        state: Output, (n, 3).
    """
    n = push.shape[0]
    g0, g1, g2 = -push[last, 0], -push[last, 1], -push[last, 2]
    feed[last:] = 0.0
    for k in range(last - 1, -1, -1):
        h = step[k]
        half = 0.5 * h * h
        slope = h * half / 3.0 * g0 + half * g1 + h * g2
        f = -slope * gain[k, 3]
        feed[k] = f
        g2 = half * g0 + h * g1 + g2 + gain[k, 2] * f - push[k, 2]
        g1 = h * g0 + g1 + gain[k, 1] * f - push[k, 1]
        g0 = g0 + gain[k, 0] * f - push[k, 0]
    p, v, a = 0.0, 0.0, 0.0
    state[0] = 0.0
    for k in range(n - 1):
        h = step[k]
        back = gain[k, 0] * p + gain[k, 1] * v + gain[k, 2] * a
        j = feed[k] - gain[k, 3] * back
        p += h * (v + h * (0.5 * a + h * j / 6.0))
        v += h * (a + 0.5 * h * j)
        a += h * j
        state[k + 1, 0], state[k + 1, 1], state[k + 1, 2] = p, v, a


@compiled
def least_without_bounds(
    step: FloatArray,
    start: FloatArray,
    weight: FloatArray,
    reference: FloatArray,
    jerk_weight: float,
    gain: FloatArray,
) -> tuple[FloatArray, float]:
    """Give the least of a program without its bounds.

    Returns:
        (state (n, 3), objective).
    """
    n = weight.shape[0]
    state, change = np.empty((n, 3)), np.empty((n, 3))
    push, feed = np.empty((n, 3)), np.empty(n - 1)
    state[0] = start
    for k in range(n - 1):
        h = step[k]
        state[k + 1, 0] = state[k, 0] + h * (state[k, 1] + 0.5 * h * state[k, 2])
        state[k + 1, 1] = state[k, 1] + h * state[k, 2]
        state[k + 1, 2] = state[k, 2]
    for k in range(n):
        h = step[min(k, n - 2)]
        for d in range(3):
            push[k, d] = -2.0 * h * weight[k, d] * (state[k, d] - reference[k, d])
    respond(step, gain, push, n - 1, feed, change)
    state += change
    cost = 0.0
    for k in range(n):
        h = step[min(k, n - 2)]
        for d in range(3):
            cost += h * weight[k, d] * (state[k, d] - reference[k, d]) ** 2
        if k < n - 1:
            cost += jerk_weight * (state[k + 1, 2] - state[k, 2]) ** 2 / h
    return state, cost


@compiled
def response_to(
    step: FloatArray,
    gain: FloatArray,
    row: FloatArray,
    knot: int,
    column: int,
    place: IntArray,
    pool: FloatArray,
) -> int:
    """Find the response to a push on one value, or compute and keep it.

    Args:
        step: (n - 1,).
        gain: As `riccati_gains` makes it.
        row: (n, m, 3).
        knot: Of the value.
        column: Of the value.
        place: Where each value's response is in the pool, -1 if it is not yet,
            (n, 3 + m); at knot 0, which is never pushed, how many there are.
        pool: Responses, (n (3 + m), n, 3).

    Returns:
        The place in the pool.
    """
    if place[knot, column] < 0:
        n = step.size + 1
        push, feed = np.zeros((n, 3)), np.empty(n - 1)
        add_normal(push, row, knot, column, 1.0)
        respond(step, gain, push, knot, feed, pool[place[0, 0]])
        place[knot, column] = place[0, 0]
        place[0, 0] += 1
    return int(place[knot, column])


@compiled
def no_responses(n: int, n_columns: int) -> tuple[IntArray, FloatArray]:
    """Make the empty table and pool of `response_to`."""
    place = np.full((n, n_columns), -1, dtype=np.int64)
    place[0, 0] = 0
    return place, np.empty((n * n_columns, n, 3))


@compiled
def take_in_bounds(  # noqa: C901, PLR0912, PLR0915 - one algorithm, its steps in order
    step: FloatArray,
    gain: FloatArray,
    row: FloatArray,
    low: FloatArray,
    up: FloatArray,
    place: IntArray,
    pool: FloatArray,
    state: FloatArray,
    cost: float,
    active: IntArray,
    dual: FloatArray,
    gram: FloatArray,
    count: int,
    ceiling: float,
    max_steps: int,
    tolerance: float,
) -> tuple[int, float, int, int]:
    """Go from a motion that is the least for its active bounds to the least for all.

    Args:
        step: (n - 1,).
        gain: As `riccati_gains` makes it.
        row: (n, m, 3).
        low: Of states and rows, (n, 3 + m); knot 0 is not looked at.
        up: As `low`.
        place: Of the responses known so far; see `response_to`. Changed in place, as
            are the five other arrays below.
        pool: Of responses.
        state: (n, 3).
        cost: Of `state`.
        active: Knot, column, sign of each active bound, (capacity, 3).
        dual: Their multipliers, (capacity,).
        gram: Normals' products a_i' H⁻¹ a_j, (capacity, capacity).
        count: Of active bounds.
        ceiling: Stop as soon as the objective is known to reach this.
        max_steps: Before giving up.
        tolerance: By which a bound may be violated.

    Returns:
        (verdict, objective or a lower bound of it, active bounds, steps taken).
    """
    capacity = dual.size
    factor = np.empty((capacity, capacity))
    products, move = np.empty(capacity), np.empty(capacity)
    direction = np.empty_like(state)
    valid = 0  # rows of `factor` that belong to the present active set
    for taken in range(max_steps):
        knot, column, sign, short = most_violated(row, low, up, state, tolerance)
        if knot < 0:
            return SOLVED, cost, count, taken
        if count == capacity:
            return UNDECIDED, cost, count, taken
        response = pool[response_to(step, gain, row, knot, column, place, pool)]
        own = value_of(response, row, knot, column)
        for i in range(count):
            at, of, way = active[i, 0], active[i, 1], active[i, 2]
            products[i] = way * sign * value_of(response, row, at, of)
        multiplier = 0.0
        while True:
            valid = factorise(gram, factor, valid, count)
            solve_factor(factor, count, products, move)
            left = own
            for i in range(count):
                left -= move[i] * products[i]
            free = left > DEPENDENT * own
            drop, longest = -1, np.inf
            for i in range(count):
                if move[i] > 0.0 and dual[i] < longest * move[i]:
                    drop, longest = i, dual[i] / move[i]
            full = short / left if free else np.inf
            if drop < 0 and not free:
                return INFEASIBLE, np.inf, count, taken
            length = min(full, longest)
            if free:
                direction[:] = 0.0
                add_scaled(direction, sign, response)
                for i in range(count):
                    other = pool[place[active[i, 0], active[i, 1]]]
                    add_scaled(direction, -active[i, 2] * move[i], other)
                add_scaled(state, length, direction)
                cost += length * left * (0.5 * length + multiplier)
                short -= length * left
            for i in range(count):
                dual[i] -= length * move[i]
            multiplier += length
            if cost >= ceiling:
                return TOO_DEAR, cost, count, taken
            if full <= longest:
                active[count, 0], active[count, 1] = knot, column
                active[count, 2] = sign
                dual[count] = multiplier
                gram[count, :count], gram[count, count] = products[:count], own
                count += 1
                break
            count = let_go(drop, active, dual, gram, products, count)
            valid = min(valid, drop)
    return UNDECIDED, cost, count, max_steps


@compiled
def most_violated(
    row: FloatArray,
    low: FloatArray,
    up: FloatArray,
    state: FloatArray,
    tolerance: float,
) -> tuple[int, int, int, float]:
    """Find the bound that a motion violates most.

    Returns:
        (knot, -1 if all hold; column; 1 for a lower bound, -1 for an upper; by how
        much).
    """
    n, m = row.shape[0], row.shape[1]
    worst = tolerance
    knot, column, sign = -1, 0, 1
    for k in range(1, n):
        for c in range(3 + m):
            if c < 3:
                value = state[k, c]
            else:
                value = (
                    row[k, c - 3, 0] * state[k, 0]
                    + row[k, c - 3, 1] * state[k, 1]
                    + row[k, c - 3, 2] * state[k, 2]
                )
            if low[k, c] - value > worst:
                worst, knot, column, sign = low[k, c] - value, k, c, 1
            if value - up[k, c] > worst:
                worst, knot, column, sign = value - up[k, c], k, c, -1
    return knot, column, sign, worst


@compiled
def add_scaled(target: FloatArray, by: float, other: FloatArray) -> None:
    """Add a multiple of one array to another of its shape, without a temporary."""
    flat, added = target.reshape(-1), other.reshape(-1)
    for i in range(flat.size):
        flat[i] += by * added[i]


@compiled
def value_of(state: FloatArray, row: FloatArray, knot: int, column: int) -> float:
    """Give one value of the table."""
    if column < 3:
        return float(state[knot, column])
    r = row[knot, column - 3]
    return float(r[0] * state[knot, 0] + r[1] * state[knot, 1] + r[2] * state[knot, 2])


@compiled
def add_normal(
    push: FloatArray, row: FloatArray, knot: int, column: int, by: float
) -> None:
    """Add the normal of one value of the table to a push, in place."""
    if column < 3:
        push[knot, column] += by
    else:
        for d in range(3):
            push[knot, d] += by * row[knot, column - 3, d]


@compiled
def factorise(gram: FloatArray, factor: FloatArray, valid: int, count: int) -> int:
    """Complete the Cholesky factor of the active bounds' products."""
    for i in range(valid, count):
        for j in range(i + 1):
            rest = gram[i, j]
            for c in range(j):
                rest -= factor[i, c] * factor[j, c]
            if i == j:
                factor[i, i] = np.sqrt(max(rest, 1e-16 * gram[i, i]))
            else:
                factor[i, j] = rest / factor[j, j]
    return count


@compiled
def solve_factor(
    factor: FloatArray, count: int, right: FloatArray, out: FloatArray
) -> None:
    """Solve L L' out = right."""
    for i in range(count):
        rest = right[i]
        for j in range(i):
            rest -= factor[i, j] * out[j]
        out[i] = rest / factor[i, i]
    for i in range(count - 1, -1, -1):
        rest = out[i]
        for j in range(i + 1, count):
            rest -= factor[j, i] * out[j]
        out[i] = rest / factor[i, i]


@compiled
def let_go(
    drop: int,
    active: IntArray,
    dual: FloatArray,
    gram: FloatArray,
    products: FloatArray,
    count: int,
) -> int:
    """Take one bound out of the active set; give the new count."""
    for i in range(drop, count - 1):
        active[i] = active[i + 1]
        dual[i] = dual[i + 1]
        products[i] = products[i + 1]
        for j in range(count):
            gram[i, j] = gram[i + 1, j]
    for i in range(count - 1):
        for j in range(drop, count - 1):
            gram[i, j] = gram[i, j + 1]
    return count - 1
