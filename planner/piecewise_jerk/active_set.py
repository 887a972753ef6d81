"""Compiled dual active-set solver of the piecewise-jerk program, for warm starts.

The method of Goldfarb and Idnani [GoldfarbIdnani1983]: begin at the minimum without
bounds, add the most violated bound, one at a time, and drop those that no longer push.
The objective only ever rises, so that a search can stop as soon as it passes a cutoff;
infeasibility shows as a bound that nothing can meet; and a program with a few bounds
more goes on from where the one before ended, which is why it stands beside the interior
point of `interior_point`. Bounds of the jerk are not looked at.

H⁻¹ is never written as a matrix: the Hessian of the jerks is that of a linear
quadratic problem along the dynamics, and one backward and one forward pass of its
Riccati recursion give H⁻¹a in O(n). How a motion responds to a push on one value
depends on the weights alone, so that all programs of a search share these responses.

Values that may be bounded are columns of a table, (n, 3 + m): p, p', p'' and the m
rows. A bound is (knot, column, sign): sign * value >= sign * limit.
"""

from typing import NamedTuple

import numpy as np

from planner.numerics.compiled import compiled, inlined
from planner.piecewise_jerk.problem import JerkProgram, Verdict
from planner.states import FloatArray, IntArray

DEPENDENT = 1e-11  # of a normal's length that is left beside the active ones

# Plain numbers: numba compiles these in.
SOLVED = int(Verdict.SOLVED)
INFEASIBLE = int(Verdict.INFEASIBLE)
UNDECIDED = int(Verdict.UNDECIDED)
ABOVE_CUTOFF = int(Verdict.ABOVE_CUTOFF)


class ActiveSet(NamedTuple):
    """A motion that is the minimum for its active bounds; arrays change in place."""

    state: FloatArray  # (n, 3)
    knot: IntArray  # of each active bound, (capacity,)
    column: IntArray  # (capacity,)
    sign: IntArray  # 1 for a lower bound, -1 for an upper one, (capacity,)
    dual: FloatArray  # multipliers, (capacity,)
    gram: FloatArray  # normals' products a_i' H⁻¹ a_j, (capacity, capacity)


class Progress(NamedTuple):
    """Cost and active bounds of a solve so far."""

    cost: float  # of the motion; where it is not SOLVED, a lower bound
    n_active: int  # bounds


class ActiveSetOptions(NamedTuple):
    """When to stop."""

    cutoff: float  # as soon as the objective is known to reach this
    max_steps: int  # before giving up
    tolerance: float  # by which a bound may be violated


class ResponseCache(NamedTuple):
    """Motions' responses to a push on one value of the table, as far as computed."""

    place: IntArray  # of each value's response, -1 if there is none yet, (n, 3 + m);
    # at knot 0, which is never pushed, how many there are
    response: FloatArray  # (n (3 + m), n, 3)


class Direction(NamedTuple):
    """Where the most violated bound would move motion and multipliers."""

    products: FloatArray  # of its normal with those of the active bounds, (capacity,)
    change: FloatArray  # of their multipliers for a unit of its own, (capacity,)
    factor: FloatArray  # Cholesky factor of `gram`, (capacity, capacity)
    state: FloatArray  # of the motion for a unit, (n, 3)


class Violated(NamedTuple):
    """A bound that is violated; the knot is -1 where all hold."""

    knot: int
    column: int
    sign: int
    short: float  # by how much


@compiled
def riccati_gains(program: JerkProgram) -> FloatArray:
    """Compute the gains of the Riccati recursion of a program without bounds.

    Returns:
        A'P B and 1 / (R + B'P B) for each interval, (n - 1, 4).
    """
    step, weight, jerk_weight = program.step, program.weight, program.jerk_weight
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
    feedforward: FloatArray,
    state: FloatArray,
) -> None:
    """Fill `state` with H⁻¹ push: how the motion gives way to a push.

    Args:
        step: (n - 1,).
        gain: As `riccati_gains` makes it.
        push: On the states, (n, 3); zero beyond knot `last`.
        last: See there.
        feedforward: Overwritten, (n - 1,).
        state: Output, (n, 3).
    """
    n = push.shape[0]
    g0, g1, g2 = -push[last, 0], -push[last, 1], -push[last, 2]
    feedforward[last:] = 0.0
    for k in range(last - 1, -1, -1):
        h = step[k]
        half = 0.5 * h * h
        slope = h * half / 3.0 * g0 + half * g1 + h * g2
        f = -slope * gain[k, 3]
        feedforward[k] = f
        g2 = half * g0 + h * g1 + g2 + gain[k, 2] * f - push[k, 2]
        g1 = h * g0 + g1 + gain[k, 1] * f - push[k, 1]
        g0 = g0 + gain[k, 0] * f - push[k, 0]
    p, v, a = 0.0, 0.0, 0.0
    state[0] = 0.0
    for k in range(n - 1):
        h = step[k]
        back = gain[k, 0] * p + gain[k, 1] * v + gain[k, 2] * a
        j = feedforward[k] - gain[k, 3] * back
        p += h * (v + h * (0.5 * a + h * j / 6.0))
        v += h * (a + 0.5 * h * j)
        a += h * j
        state[k + 1, 0], state[k + 1, 1], state[k + 1, 2] = p, v, a


@compiled
def unconstrained_minimum(
    program: JerkProgram, gain: FloatArray
) -> tuple[FloatArray, float]:
    """Solve a program without its bounds.

    Returns:
        (state (n, 3), objective).
    """
    step, weight, reference = program.step, program.weight, program.reference
    n = weight.shape[0]
    state, change = np.empty((n, 3)), np.empty((n, 3))
    push, feedforward = np.empty((n, 3)), np.empty(n - 1)
    state[0] = program.start
    for k in range(n - 1):
        h = step[k]
        state[k + 1, 0] = state[k, 0] + h * (state[k, 1] + 0.5 * h * state[k, 2])
        state[k + 1, 1] = state[k, 1] + h * state[k, 2]
        state[k + 1, 2] = state[k, 2]
    for k in range(n):
        h = step[min(k, n - 2)]
        for d in range(3):
            push[k, d] = -2.0 * h * weight[k, d] * (state[k, d] - reference[k, d])
    respond(step, gain, push, n - 1, feedforward, change)
    state += change
    cost = 0.0
    for k in range(n):
        h = step[min(k, n - 2)]
        for d in range(3):
            cost += h * weight[k, d] * (state[k, d] - reference[k, d]) ** 2
        if k < n - 1:
            cost += program.jerk_weight * (state[k + 1, 2] - state[k, 2]) ** 2 / h
    return state, cost


@compiled
def empty_response_cache(n: int, n_columns: int) -> ResponseCache:
    """Allocate a cache for programs of n knots."""
    place = np.full((n, n_columns), -1, dtype=np.int64)
    place[0, 0] = 0
    return ResponseCache(place, np.empty((n * n_columns, n, 3)))


@compiled
def response_to(
    program: JerkProgram,
    gain: FloatArray,
    knot: int,
    column: int,
    cache: ResponseCache,
) -> int:
    """Return where in the cache the response to a push on one value is.

    It is computed where it is not there yet.

    Args:
        program: Gives steps and rows.
        gain: As `riccati_gains` makes it.
        knot: Of the value.
        column: Of the value.
        cache: Of the responses so far.
    """
    place = cache.place
    if place[knot, column] < 0:
        n = program.step.size + 1
        push, feedforward = np.zeros((n, 3)), np.empty(n - 1)
        add_normal(push, program.row, knot, column, 1.0)
        free = cache.response[place[0, 0]]
        respond(program.step, gain, push, knot, feedforward, free)
        place[knot, column] = place[0, 0]
        place[0, 0] += 1
    return int(place[knot, column])


@compiled
def dual_active_set(
    program: JerkProgram,
    gain: FloatArray,
    cache: ResponseCache,
    active: ActiveSet,
    begin: Progress,
    options: ActiveSetOptions,
) -> tuple[int, Progress, int]:
    """Solve from a motion that is the minimum for its active bounds.

    Args:
        program: To solve; its bounds may be tighter than those of `active`.
        gain: As `riccati_gains` makes it.
        cache: Of the responses known so far; grows.
        active: Where to begin; where it ends afterwards.
        begin: Cost and number of active bounds there.
        options: When to stop.

    Returns:
        (value of `Verdict`, where it ended, steps taken).
    """
    capacity = active.dual.size
    cost, count = begin.cost, begin.n_active
    valid = 0  # rows of the factor that belong to the present active set
    toward = _allocate_direction(active)
    for taken in range(options.max_steps):
        bound = most_violated(program, active.state, options.tolerance)
        if bound.knot < 0:
            return SOLVED, Progress(cost, count), taken
        if count == capacity:
            return UNDECIDED, Progress(cost, count), taken
        at = response_to(program, gain, bound.knot, bound.column, cache)
        response = cache.response[at]
        own = value_of(response, program.row, bound.knot, bound.column)
        _fill_products(program.row, bound, response, active, count, toward.products)
        multiplier, short = 0.0, bound.short
        while True:
            valid = factorise(active.gram, toward.factor, valid, count)
            solve_factor(toward.factor, count, toward.products, toward.change)
            left = _own_curvature(own, toward, count)
            free = left > DEPENDENT * own
            drop, longest = _blocking(active.dual, toward.change, count)
            full = short / left if free else np.inf
            if drop < 0 and not free:
                return INFEASIBLE, Progress(np.inf, count), taken
            length = min(full, longest)
            if free:
                _fill_direction(bound.sign, response, active, count, cache, toward)
                add_scaled(active.state, length, toward.state)
                cost += length * left * (0.5 * length + multiplier)
                short -= length * left
            for i in range(count):
                active.dual[i] -= length * toward.change[i]
            multiplier += length
            if cost >= options.cutoff:
                return ABOVE_CUTOFF, Progress(cost, count), taken
            if full <= longest:
                add_constraint(bound, multiplier, own, toward.products, active, count)
                count += 1
                break
            count = drop_constraint(drop, active, toward.products, count)
            valid = min(valid, drop)
    return UNDECIDED, Progress(cost, count), options.max_steps


@inlined
def _allocate_direction(active: ActiveSet) -> Direction:
    """Allocate what each step fills."""
    capacity = active.dual.size
    return Direction(
        np.empty(capacity),
        np.empty(capacity),
        np.empty((capacity, capacity)),
        np.empty_like(active.state),
    )


@inlined
def _fill_products(
    row: FloatArray,
    bound: Violated,
    response: FloatArray,
    active: ActiveSet,
    count: int,
    products: FloatArray,
) -> None:
    """Fill the products of a bound's normal with those of the active bounds."""
    for i in range(count):
        value = value_of(response, row, active.knot[i], active.column[i])
        products[i] = active.sign[i] * bound.sign * value


@inlined
def _own_curvature(own: float, toward: Direction, count: int) -> float:
    """Return how fast a bound's violation falls while the active bounds are kept."""
    left = own
    for i in range(count):
        left -= toward.change[i] * toward.products[i]
    return left


@inlined
def _blocking(dual: FloatArray, change: FloatArray, count: int) -> tuple[int, float]:
    """Find the active bound whose multiplier is 0 first: (index or -1, step length)."""
    drop, longest = -1, np.inf
    for i in range(count):
        if change[i] > 0.0 and dual[i] < longest * change[i]:
            drop, longest = i, dual[i] / change[i]
    return drop, longest


@inlined
def _fill_direction(
    sign: int,
    response: FloatArray,
    active: ActiveSet,
    count: int,
    cache: ResponseCache,
    toward: Direction,
) -> None:
    """Fill how the motion moves towards a bound, along the active ones."""
    toward.state[:] = 0.0
    add_scaled(toward.state, float(sign), response)
    for i in range(count):
        other = cache.response[cache.place[active.knot[i], active.column[i]]]
        add_scaled(toward.state, -active.sign[i] * toward.change[i], other)


@compiled
def most_violated(
    program: JerkProgram, state: FloatArray, tolerance: float
) -> Violated:
    """Find the bound that a motion violates most, by more than the tolerance."""
    row, low, up = program.row, program.lower, program.upper
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
    return Violated(knot, column, sign, worst)


@compiled
def add_scaled(target: FloatArray, by: float, other: FloatArray) -> None:
    """Add a multiple of one array to another of its shape, without a temporary."""
    flat, added = target.reshape(-1), other.reshape(-1)
    for i in range(flat.size):
        flat[i] += by * added[i]


@compiled
def value_of(state: FloatArray, row: FloatArray, knot: int, column: int) -> float:
    """Return one value of the table."""
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


@inlined
def add_constraint(
    bound: Violated,
    multiplier: float,
    own: float,
    products: FloatArray,
    active: ActiveSet,
    count: int,
) -> None:
    """Add one bound to an active set of `count`."""
    active.knot[count], active.column[count] = bound.knot, bound.column
    active.sign[count] = bound.sign
    active.dual[count] = multiplier
    active.gram[count, :count], active.gram[count, count] = products[:count], own


@compiled
def drop_constraint(
    drop: int, active: ActiveSet, products: FloatArray, count: int
) -> int:
    """Drop one bound from an active set of `count`; return the new count."""
    gram = active.gram
    for i in range(drop, count - 1):
        active.knot[i], active.column[i] = active.knot[i + 1], active.column[i + 1]
        active.sign[i] = active.sign[i + 1]
        active.dual[i] = active.dual[i + 1]
        products[i] = products[i + 1]
        for j in range(count):
            gram[i, j] = gram[i + 1, j]
    for i in range(count - 1):
        for j in range(drop, count - 1):
            gram[i, j] = gram[i, j + 1]
    return count - 1
