"""Branch and bound over the sides on which obstacles are passed.

The root is the program with the road alone. Where its path goes through an obstacle,
that obstacle's two sides are two programs more, each with more bounds and so no
cheaper; a path that goes through none is a leaf. What lies under a program is dropped
only where it is proven empty, or dearer than the leaves already found. A program goes
on from the end of the one above it.
"""

from enum import IntEnum
from typing import NamedTuple

import numpy as np

from planner.dense.tube.corridor import Passages
from planner.numerics.compiled import compiled, inlined
from planner.piecewise_jerk.active_set import (
    ABOVE_CUTOFF,
    INFEASIBLE,
    SOLVED,
    ActiveSet,
    ActiveSetOptions,
    Progress,
    dual_active_set,
    empty_response_cache,
    riccati_gains,
    unconstrained_minimum,
)
from planner.piecewise_jerk.problem import JerkProgram
from planner.states import FloatArray, IntArray

THROUGH = 1e-6  # a path this deep in an obstacle goes through it [m]
CAPACITY = 96  # bounds that push at once
MAX_OPEN = 1000  # nodes that wait at once
NO_PLACE = -1  # the store cannot take what would be pushed


class Dropped(IntEnum):
    """Why a node was dropped."""

    TUBE_EMPTY = 0  # bounds cross somewhere
    INFEASIBLE = 1  # proven
    DEARER = 2  # than the leaves already found
    UNDECIDED = 3


# Plain numbers: numba compiles these in.
TUBE_EMPTY = int(Dropped.TUBE_EMPTY)
PROVEN_INFEASIBLE = int(Dropped.INFEASIBLE)
DEARER = int(Dropped.DEARER)
UNDECIDED = int(Dropped.UNDECIDED)
N_REASONS = len(Dropped)


class SearchOptions(NamedTuple):
    """Which sequences are looked for, and when to stop."""

    ceiling: float  # sequences that cost as much or more are not looked for
    keep: int  # how many of the cheapest are returned
    max_programs: int
    max_steps: int  # of each program
    tolerance: float  # of its bounds


class Leaves(NamedTuple):
    """The cheapest sequences of sides, in the order of their cost."""

    cost: FloatArray  # (keep,); inf where there is none
    sides: FloatArray  # 1 to the left, -1 to the right, (keep, n_obstacles)
    state: FloatArray  # l, l', l'' of their paths, (keep, n, 3)


class NodeCounts(NamedTuple):
    """Numbers of nodes; the search may be incomplete at the limit of programs."""

    tube_empty: int
    infeasible: int
    dearer: int
    undecided: int
    programs: int  # solved


class NodeStore(NamedTuple):
    """Nodes that wait, a stack: each goes on from the end of the program above it."""

    sides: FloatArray  # 1, -1, or 0 where open, (size, n_obstacles)
    cost: FloatArray  # of the program above, (size,)
    n_active: IntArray  # bounds there, (size,)
    state: FloatArray  # (size, n, 3)
    knot: IntArray  # of the active bounds, as are the next three, (size, CAPACITY)
    column: IntArray
    sign: IntArray
    dual: FloatArray
    gram: FloatArray  # (size, CAPACITY, CAPACITY)


@compiled
def branch_and_bound(
    program: JerkProgram,
    passages: Passages,
    given: FloatArray,
    options: SearchOptions,
) -> tuple[Leaves, NodeCounts]:
    """Find the cheapest sequences of sides and their paths.

    Args:
        program: With the road alone.
        passages: Of the obstacles.
        given: Sides to keep, 0 where open, (n_obstacles,).
        options: See there.
    """
    n, n_obstacles = program.weight.shape[0], given.size
    leaves = no_leaves(n, n_obstacles, options.keep)
    gain = riccati_gains(program)
    cache = empty_response_cache(n, program.lower.shape[1])
    dearest = largest_cost(program)
    dropped, programs = np.zeros(N_REASONS, dtype=np.int64), 0
    store = allocate_nodes(n, n_obstacles, options.keep)
    waiting = push_root(store, program, gain, given)
    tight, sides = with_own_bounds(program), np.empty(n_obstacles)
    while waiting > 0 and programs < options.max_programs:
        waiting -= 1
        node = waiting
        sides[:] = store.sides[node]
        # Bound
        cutoff = min(options.ceiling, leaves.cost[options.keep - 1])
        if store.cost[node] >= cutoff:
            dropped[DEARER] += 1
            continue
        tight.lower[:], tight.upper[:] = program.lower, program.upper
        if not narrow_columns(tight, sides, passages):
            dropped[TUBE_EMPTY] += 1
            continue
        verdict, end, _ = dual_active_set(
            tight,
            gain,
            cache,
            active_set_of(store, node),
            Progress(store.cost[node], store.n_active[node]),
            ActiveSetOptions(
                min(cutoff, dearest), options.max_steps, options.tolerance
            ),
        )
        programs += 1
        # Prune
        if verdict != SOLVED:
            dropped[reason(verdict, end.cost, dearest)] += 1
            continue
        # Branch
        chosen, to_left = branching(store.state[node], tight.row, sides, passages)
        if chosen >= 0:
            pushed = push_both_sides(store, node, end, sides, chosen, to_left)
        else:
            insert_leaf(leaves, end.cost, sides, store.state[node])
            pushed = 0
            if options.keep > 1:
                pushed = push_alternatives(store, node, end, sides)
        if pushed == NO_PLACE:
            dropped[UNDECIDED] += 1
        else:
            waiting += pushed
    return leaves, node_counts(dropped, programs)


@inlined
def no_leaves(n: int, n_obstacles: int, keep: int) -> Leaves:
    """Allocate the leaves for programs of n knots."""
    return Leaves(
        np.full(keep, np.inf), np.zeros((keep, n_obstacles)), np.zeros((keep, n, 3))
    )


@inlined
def with_own_bounds(program: JerkProgram) -> JerkProgram:
    """Return a program whose bounds can be narrowed."""
    return JerkProgram(
        program.step,
        program.start,
        program.weight,
        program.reference,
        program.jerk_weight,
        np.empty_like(program.lower),
        np.empty_like(program.upper),
        program.row,
        program.jerk_lower,
        program.jerk_upper,
    )


@inlined
def node_counts(dropped: IntArray, programs: int) -> NodeCounts:
    """Make the record of the counts."""
    return NodeCounts(
        dropped[TUBE_EMPTY],
        dropped[PROVEN_INFEASIBLE],
        dropped[DEARER],
        dropped[UNDECIDED],
        programs,
    )


@inlined
def reason(verdict: int, cost: float, dearest: float) -> int:
    """Return why a node whose program was not solved is dropped, as in `Dropped`."""
    if verdict == INFEASIBLE:
        return PROVEN_INFEASIBLE
    if verdict == ABOVE_CUTOFF:
        return DEARER if cost < dearest else PROVEN_INFEASIBLE
    return UNDECIDED


@inlined
def bounds_column(program: JerkProgram) -> int:
    """Return the first column that obstacles bound: the rows', or l's without rows."""
    return 0 if program.row.shape[1] == 0 else 3


@compiled
def largest_cost(program: JerkProgram) -> float:
    """Bound the cost of every motion within the bounds: what is dearer is infeasible.

    The second derivative is bounded, so the first and the third are; with them the
    rows bound the offset.
    """
    first = bounds_column(program)
    step, start, weight = program.step, program.start, program.weight
    lower, upper, reference = program.lower, program.upper, program.reference
    length = step.sum()
    bend = max(np.abs(lower[1:, 2]).max(), np.abs(upper[1:, 2]).max(), abs(start[2]))
    slope = abs(start[1]) + bend * length
    offset = max(np.abs(lower[1:, first]).max(), np.abs(upper[1:, first]).max())
    if first > 0:
        offset += np.abs(program.row[:, 0, 1]).max() * slope
    offset = max(offset, abs(start[0])) + np.abs(reference[:, 0]).max()
    slope += np.abs(reference[:, 1]).max()
    bend += np.abs(reference[:, 2]).max()
    jerk = 2.0 * bend / step.min()
    worst = (
        weight[:, 0].max() * offset**2
        + weight[:, 1].max() * slope**2
        + weight[:, 2].max() * bend**2
        + program.jerk_weight * jerk**2
    )
    return float(2.0 * length * worst)


@inlined
def allocate_nodes(n: int, n_obstacles: int, keep: int) -> NodeStore:
    """Allocate the store for programs of n knots."""
    size = n_obstacles + 2  # without alternatives, two nodes wait on each level
    if keep > 1:
        size = min(n_obstacles * (n_obstacles + 1) // 2 + 2, MAX_OPEN)
    return NodeStore(
        np.empty((size, n_obstacles)),
        np.empty(size),
        np.empty(size, dtype=np.int64),
        np.empty((size, n, 3)),
        np.empty((size, CAPACITY), dtype=np.int64),
        np.empty((size, CAPACITY), dtype=np.int64),
        np.empty((size, CAPACITY), dtype=np.int64),
        np.empty((size, CAPACITY)),
        np.empty((size, CAPACITY, CAPACITY)),
    )


@inlined
def active_set_of(store: NodeStore, node: int) -> ActiveSet:
    """Return the place where a node's program begins, and where it will end."""
    return ActiveSet(
        store.state[node],
        store.knot[node],
        store.column[node],
        store.sign[node],
        store.dual[node],
        store.gram[node],
    )


@inlined
def push_root(
    store: NodeStore, program: JerkProgram, gain: FloatArray, given: FloatArray
) -> int:
    """Push the program with the road alone, at its minimum without bounds."""
    store.sides[0], store.n_active[0] = given, 0
    store.state[0], store.cost[0] = unconstrained_minimum(program, gain)
    return 1


@compiled
def copy_node(store: NodeStore, source: int, target: int, count: int) -> None:
    """Copy where a program ended, so that another one can go on from there."""
    store.state[target] = store.state[source]
    store.knot[target, :count] = store.knot[source, :count]
    store.column[target, :count] = store.column[source, :count]
    store.sign[target, :count] = store.sign[source, :count]
    store.dual[target, :count] = store.dual[source, :count]
    store.gram[target, :count, :count] = store.gram[source, :count, :count]


@compiled
def push_both_sides(
    store: NodeStore,
    node: int,
    end: Progress,
    sides: FloatArray,
    chosen: int,
    to_left: bool,  # noqa: FBT001 - a fact about the path
) -> int:
    """Push the two sides of one obstacle over a node; the nearer is on top.

    Args:
        store: Where to push; the node itself gives its place to the first.
        node: The program that has ended.
        end: Where it ended.
        sides: Decided under it, (n_obstacles,).
        chosen: Obstacle to branch on.
        to_left: Whether its left is nearer.

    Returns:
        Nodes pushed, or NO_PLACE.
    """
    if node + 2 > store.cost.size:
        return NO_PLACE
    copy_node(store, node, node + 1, end.n_active)
    for child in (node + 1, node):
        store.sides[child] = sides
        store.sides[child, chosen] = 1.0 if to_left == (child == node + 1) else -1.0
        store.cost[child], store.n_active[child] = end.cost, end.n_active
    return 2


@compiled
def push_alternatives(
    store: NodeStore, node: int, end: Progress, sides: FloatArray
) -> int:
    """Push what is left under a leaf, split by the first side that differs.

    The next best may differ in an obstacle that the leaf's path passes anyhow.

    Args:
        store: As in `push_both_sides`; the node's sides are those it was solved with.
        node: The leaf.
        end: Where its program ended.
        sides: On which its path passes the obstacles, (n_obstacles,).

    Returns:
        Nodes pushed, or NO_PLACE.
    """
    open_ones = np.flatnonzero(store.sides[node] == 0.0)
    if node + open_ones.size > store.cost.size:
        return NO_PLACE
    for child in range(node + open_ones.size - 1, node - 1, -1):
        if child > node:
            copy_node(store, node, child, end.n_active)
            store.sides[child] = store.sides[node]
        store.cost[child], store.n_active[child] = end.cost, end.n_active
        for i in open_ones[: child - node]:
            store.sides[child, i] = sides[i]
        turned = open_ones[child - node]
        store.sides[child, turned] = -sides[turned]
    return int(open_ones.size)


@compiled
def narrow_columns(program: JerkProgram, sides: FloatArray, passages: Passages) -> bool:
    """Narrow bounds in place for the sides chosen; return whether all stay open."""
    low, up, first = program.lower, program.upper, bounds_column(program)
    left, right, window = passages
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
    state: FloatArray, row: FloatArray, sides: FloatArray, passages: Passages
) -> tuple[int, bool]:
    """Choose the obstacle to branch on: the one that the path is deepest in.

    If it goes through none, the sides on which it passes the open ones are written
    into `sides`.

    Returns:
        (obstacle, -1 if the path goes through none; whether its left is nearer).
    """
    left, right, window = passages
    chosen, most, to_left = -1, THROUGH, True
    passed = np.zeros(sides.size)
    for i in range(sides.size):
        if sides[i] != 0.0:
            continue
        depth_left, depth_right = 0.0, 0.0
        for k in range(window[i, 0], window[i, 1]):
            for d in range(left.shape[2]):
                value = state[k, 0]
                if row.shape[1] > 0:
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
def insert_leaf(
    leaves: Leaves, cost: float, sides: FloatArray, state: FloatArray
) -> None:
    """Insert a leaf in its place among the cheapest."""
    place = leaves.cost.size - 1
    while place > 0 and leaves.cost[place - 1] > cost:
        leaves.cost[place] = leaves.cost[place - 1]
        leaves.sides[place] = leaves.sides[place - 1]
        leaves.state[place] = leaves.state[place - 1]
        place -= 1
    leaves.cost[place], leaves.sides[place] = cost, sides
    leaves.state[place] = state
