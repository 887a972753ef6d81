"""Branch and bound over the sides on which obstacles are passed.

The root is the program with the road alone. Where its path goes through an obstacle,
that obstacle's two sides are two programs more, each with more bounds and so no
cheaper; a path that goes through none is a leaf. What lies under a program is dropped
only where it is proven empty, or dearer than the leaves already found. A program goes
on from the end of the one above it.
"""

import numpy as np

from planner.numerics.compiled import compiled
from planner.piecewise_jerk.active_set import (
    INFEASIBLE,
    SOLVED,
    TOO_DEAR,
    least_without_bounds,
    no_responses,
    riccati_gains,
    take_in_bounds,
)
from planner.states import FloatArray, IntArray

THROUGH = 1e-6  # a path this deep in an obstacle goes through it [m]
CAPACITY = 96  # bounds that push at once
MAX_OPEN = 1000  # nodes that wait at once
TUBE_EMPTY, PROVEN, DEARER, UNDECIDED, PROGRAMS = 0, 1, 2, 3, 4  # columns of `counts`


@compiled
def cheapest_sides(  # noqa: C901, PLR0912, PLR0915 - one search, its steps in order
    step: FloatArray,
    start: FloatArray,
    weight: FloatArray,
    reference: FloatArray,
    jerk_weight: float,
    lower: FloatArray,
    upper: FloatArray,
    row: FloatArray,
    first: int,
    left: FloatArray,
    right: FloatArray,
    window: IntArray,
    given: FloatArray,
    ceiling: float,
    keep: int,
    limits: tuple[int, int, float],
) -> tuple[FloatArray, FloatArray, FloatArray, IntArray]:
    """Find the cheapest sequences of sides and their paths.

    Args:
        step: (n - 1,) [m].
        start: l, l', l'', (3,).
        weight: (n, 3).
        reference: (n, 3).
        jerk_weight: > 0.
        lower: Of states and rows with the road alone, (n, 3 + m).
        upper: As `lower`.
        row: (n, m, 3).
        first: Column of `lower` that holds the rows' bounds: 0 where the one row is
            l itself, else 3.
        left: As `corridor.obstacle_rows` makes it, (n_obstacles, n, n_discs).
        right: As `left`.
        window: As `left`.
        given: Sides to keep, 0 where open, (n_obstacles,).
        ceiling: Sequences that cost as much or more are not looked for.
        keep: How many of the cheapest to give.
        limits: Programs to solve at most, steps of each, tolerance of bounds.

    Returns:
        (cost (keep,), inf where there is none; sides (keep, n_obstacles); states (keep,
        n, 3); counts (5,): nodes dropped for an empty tube, proven infeasible, too
        dear, not decided; programs solved). Where the last is at its limit the search
        may be incomplete.
    """
    n, n_obstacles = weight.shape[0], window.shape[0]
    costs, counts = np.full(keep, np.inf), np.zeros(5, dtype=np.int64)
    best, states = np.zeros((keep, n_obstacles)), np.zeros((keep, n, 3))
    gain = riccati_gains(step, weight, jerk_weight)
    place_of, pool = no_responses(n, lower.shape[1])
    dearest = largest_cost(
        step, start, weight, reference, jerk_weight, lower, upper, row, first
    )
    room = n_obstacles + 2  # without alternatives, two nodes wait on each level
    if keep > 1:
        room = min(n_obstacles * (n_obstacles + 1) // 2 + 2, MAX_OPEN)
    stack, bounds = np.empty((room, n_obstacles)), np.empty(room)
    states_of, duals = np.empty((room, n, 3)), np.empty((room, CAPACITY))
    actives = np.empty((room, CAPACITY, 3), dtype=np.int64)
    grams = np.empty((room, CAPACITY, CAPACITY))
    sizes = np.empty(room, dtype=np.int64)
    stack[0], sizes[0] = given, 0
    states_of[0], bounds[0] = least_without_bounds(
        step, start, weight, reference, jerk_weight, gain
    )
    depth = 1
    low, up, sides = np.empty_like(lower), np.empty_like(upper), np.empty(n_obstacles)
    while depth > 0 and counts[PROGRAMS] < limits[0]:
        depth -= 1
        sides[:] = stack[depth]
        cutoff = min(ceiling, costs[keep - 1])
        if bounds[depth] >= cutoff:
            counts[DEARER] += 1
            continue
        low[:], up[:] = lower, upper
        if not narrow_columns(low, up, first, sides, left, right, window):
            counts[TUBE_EMPTY] += 1
            continue
        verdict, cost, size, _ = take_in_bounds(
            step,
            gain,
            row,
            low,
            up,
            place_of,
            pool,
            states_of[depth],
            bounds[depth],
            actives[depth],
            duals[depth],
            grams[depth],
            sizes[depth],
            min(cutoff, dearest),
            limits[1],
            limits[2],
        )
        counts[PROGRAMS] += 1
        if verdict != SOLVED:
            place = UNDECIDED
            if verdict == INFEASIBLE:
                place = PROVEN
            elif verdict == TOO_DEAR:
                place = DEARER if cost < dearest else PROVEN
            counts[place] += 1
            continue
        chosen, to_left = branching(
            states_of[depth], row, first, sides, left, right, window
        )
        if chosen < 0:
            open_ones = np.flatnonzero(stack[depth] == 0.0)
            _insert(cost, sides, states_of[depth], costs, best, states)
            if keep == 1:
                continue
            # The next best may differ in an obstacle that this path passes anyhow:
            # split what is left under this node by the first side that differs.
            if depth + open_ones.size > room:
                counts[UNDECIDED] += 1
                continue
            for place in range(depth + open_ones.size - 1, depth - 1, -1):
                if place > depth:
                    _copy_node(depth, place, size, states_of, actives, duals, grams)
                    stack[place] = stack[depth]
                bounds[place], sizes[place] = cost, size
                for i in open_ones[: place - depth]:
                    stack[place, i] = sides[i]
                turned = open_ones[place - depth]
                stack[place, turned] = -sides[turned]
            depth += open_ones.size
            continue
        if depth + 2 > room:
            counts[UNDECIDED] += 1
            continue
        _copy_node(depth, depth + 1, size, states_of, actives, duals, grams)
        for place in (depth + 1, depth):  # the nearer side is looked at first
            stack[place] = sides
            stack[place, chosen] = 1.0 if to_left == (place == depth + 1) else -1.0
            bounds[place], sizes[place] = cost, size
        depth += 2
    return costs, best, states, counts


@compiled
def largest_cost(
    step: FloatArray,
    start: FloatArray,
    weight: FloatArray,
    reference: FloatArray,
    jerk_weight: float,
    lower: FloatArray,
    upper: FloatArray,
    row: FloatArray,
    first: int,
) -> float:
    """Bound the cost of every motion within the bounds: what is dearer is infeasible.

    The second derivative is bounded, so the first and the third are; with them the
    rows bound the offset. Arguments as in `cheapest_sides`.
    """
    length = step.sum()
    bend = max(np.abs(lower[1:, 2]).max(), np.abs(upper[1:, 2]).max(), abs(start[2]))
    slope = abs(start[1]) + bend * length
    offset = max(np.abs(lower[1:, first]).max(), np.abs(upper[1:, first]).max())
    if first > 0:
        offset += np.abs(row[:, 0, 1]).max() * slope
    offset = max(offset, abs(start[0])) + np.abs(reference[:, 0]).max()
    slope += np.abs(reference[:, 1]).max()
    bend += np.abs(reference[:, 2]).max()
    jerk = 2.0 * bend / step.min()
    worst = (
        weight[:, 0].max() * offset**2
        + weight[:, 1].max() * slope**2
        + weight[:, 2].max() * bend**2
        + jerk_weight * jerk**2
    )
    return float(2.0 * length * worst)


@compiled
def _copy_node(
    source: int,
    target: int,
    size: int,
    states: FloatArray,
    actives: IntArray,
    duals: FloatArray,
    grams: FloatArray,
) -> None:
    """Copy where a program stands, so that another one can go on from there."""
    states[target] = states[source]
    actives[target, :size] = actives[source, :size]
    duals[target, :size] = duals[source, :size]
    grams[target, :size, :size] = grams[source, :size, :size]


@compiled
def narrow_columns(
    low: FloatArray,
    up: FloatArray,
    first: int,
    sides: FloatArray,
    left: FloatArray,
    right: FloatArray,
    window: IntArray,
) -> bool:
    """Narrow bounds in place for the sides chosen; tell whether all stay open."""
    for i in range(sides.size):
        if sides[i] == 0.0:
            continue
        for k in range(window[i, 0], window[i, 1]):
            for d in range(left.shape[2]):
                if sides[i] > 0.0:
                    low[k, first + d] = max(low[k, first + d], left[i, k, d])
                else:
                    up[k, first + d] = min(up[k, first + d], right[i, k, d])
                if low[k, first + d] > up[k, first + d]:
                    return False
    return True


@compiled
def branching(
    state: FloatArray,
    row: FloatArray,
    first: int,
    sides: FloatArray,
    left: FloatArray,
    right: FloatArray,
    window: IntArray,
) -> tuple[int, bool]:
    """Choose the obstacle to branch on: the one that the path is deepest in.

    If it goes through none, the sides on which it passes the open ones are written
    into `sides`.

    Returns:
        (obstacle, -1 if the path goes through none; whether its left is nearer).
    """
    chosen, most, to_left = -1, THROUGH, True
    passed = np.zeros(sides.size)
    for i in range(sides.size):
        if sides[i] != 0.0:
            continue
        depth_left, depth_right = 0.0, 0.0
        for k in range(window[i, 0], window[i, 1]):
            for d in range(left.shape[2]):
                value = state[k, 0]
                if first > 0:
                    value = row[k, d, 0] * state[k, 0] + row[k, d, 1] * state[k, 1]
                depth_left = max(depth_left, left[i, k, d] - value)
                depth_right = max(depth_right, value - right[i, k, d])
        nearer = depth_left <= depth_right
        passed[i] = 1.0 if nearer else -1.0
        if min(depth_left, depth_right) > most:
            most = min(depth_left, depth_right)
            chosen, to_left = i, nearer
    if chosen < 0:
        for i in range(sides.size):
            if sides[i] == 0.0:
                sides[i] = passed[i]
    return chosen, to_left


@compiled
def _insert(
    cost: float,
    sides: FloatArray,
    state: FloatArray,
    costs: FloatArray,
    best: FloatArray,
    states: FloatArray,
) -> None:
    """Put a leaf in its place among the cheapest."""
    place = costs.size - 1
    while place > 0 and costs[place - 1] > cost:
        costs[place] = costs[place - 1]
        best[place] = best[place - 1]
        states[place] = states[place - 1]
        place -= 1
    costs[place], best[place], states[place] = cost, sides, state
