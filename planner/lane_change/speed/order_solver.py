"""Solves the programs of many passing orders for the cheapest, in compiled code.

The orders whose corridor the unbounded motion breaks least come first; a later one is
given up when its multipliers prove that it cannot be cheaper than the best so far. The
winner is the one that solving every order to the end would give.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from planner.lane_change.settings import SpeedSettings
from planner.lane_change.speed.passing_orders import Order
from planner.lane_change.speed.program import (
    ROUNDING,
    SpeedTask,
    limit_tables,
    program,
    reference_motion,
    speed_tables,
)
from planner.numerics.compiled import compiled
from planner.piecewise_jerk.interior_point import (
    INFEASIBLE,
    SOLVED,
    TOO_DEAR,
    UNDECIDED,
    cheaper_than,
)
from planner.piecewise_jerk.objective import free_motion
from planner.piecewise_jerk.solve import (
    MAX_ITERATIONS,
    TOLERANCE,
    QpStatus,
    solve,
)
from planner.states import FloatArray, IntArray, freeze
from planner.vehicle import Vehicle


@dataclass(frozen=True, slots=True, eq=False)
class SolvedOrders:
    """What became of each order, and the motion of the cheapest."""

    cost: FloatArray  # (n_orders,); inf if infeasible
    exact: tuple[bool, ...]  # else the cost is a lower bound, above that of the best
    best: int  # -1 if none has a solution
    state: FloatArray  # (n_knots, 3)
    jerk: FloatArray  # (n_knots - 1,)


def solve_orders(
    orders: Sequence[Order],
    reach: tuple[FloatArray, FloatArray],
    start: tuple[float, float, float],
    caps: FloatArray,
    task: SpeedTask,
    vehicle: Vehicle,
    settings: SpeedSettings,
    cost_to_beat: float = np.inf,
) -> SolvedOrders:
    """Find the cheapest of some orders.

    Args:
        orders: With their corridors.
        reach: From `orders.reachable`; what it alone bounds needs no bound.
        start: (s, v, a) now.
        caps: Of the speed, (n_knots,) [m/s].
        task: Start and wish.
        vehicle: Its limits.
        settings: Weights and steps.
        cost_to_beat: Orders that are proven dearer than this are given up, too.
    """
    tables = speed_tables(settings)
    lower, upper = limit_tables(start, caps, vehicle, settings)
    corridors = np.empty((len(orders), 3, tables.times.size))
    for i, order in enumerate(orders):
        corridors[i, 0], corridors[i, 1] = order.lower, order.upper
        corridors[i, 2] = order.headway
    cost, verdict, best, state, jerk = _cheapest(
        cost_to_beat,
        corridors,
        reach[0],
        reach[1],
        tables.step,
        freeze(start),
        tables.weight,
        reference_motion(task, tables.times),
        settings.jerk_weight,
        lower,
        upper,
        tables.row,
        settings.max_jerk,
    )
    for i in np.flatnonzero(verdict == UNDECIDED).tolist():
        found = solve(program(orders[i], start, caps, task, vehicle, settings), "piqp")
        if found.status is not QpStatus.SOLVED:
            continue
        cost[i], verdict[i] = found.objective, SOLVED
        if found.objective < (cost[best] if best >= 0 else np.inf):
            best, state, jerk = i, found.state, found.jerk
    exact = tuple(v != TOO_DEAR for v in verdict.tolist())
    return SolvedOrders(cost, exact, best, state, jerk)


@compiled
def _cheapest(
    cost_to_beat: float,
    corridors: FloatArray,
    least: FloatArray,
    greatest: FloatArray,
    step: FloatArray,
    start: FloatArray,
    weight: FloatArray,
    reference: FloatArray,
    jerk_weight: float,
    lower: FloatArray,
    upper: FloatArray,
    row: FloatArray,
    max_jerk: float,
) -> tuple[FloatArray, IntArray, int, FloatArray, FloatArray]:
    """Solve order after order: (costs, verdicts, index of the best, its motion)."""
    n_orders, n = corridors.shape[0], corridors.shape[2]
    cost, verdict = np.full(n_orders, np.inf), np.full(n_orders, INFEASIBLE)
    best, best_state, best_jerk = -1, np.empty((n, 3)), np.empty(n - 1)
    free = free_motion(step, start, weight, reference, jerk_weight)[0]
    for i in np.argsort(_broken(corridors, free)):
        for k in range(n):
            low, up = corridors[i, 0, k], corridors[i, 1, k]
            lower[k, 0] = low - ROUNDING if low > least[k] else -np.inf
            upper[k, 0] = up if up < greatest[k] else np.inf
            upper[k, 3] = corridors[i, 2, k]
        to_beat = cost_to_beat if best < 0 else min(cost[best], cost_to_beat)
        state, jerk, objective, found, _ = cheaper_than(
            to_beat,
            step,
            start,
            weight,
            reference,
            jerk_weight,
            lower,
            upper,
            row,
            -max_jerk,
            max_jerk,
            MAX_ITERATIONS,
            TOLERANCE,
        )
        verdict[i] = found
        if found in (SOLVED, TOO_DEAR):
            cost[i] = objective
        if found == SOLVED and (best < 0 or objective < cost[best]):
            best, best_state, best_jerk = i, state, jerk
    return cost, verdict, best, best_state, best_jerk


@compiled
def _broken(corridors: FloatArray, free: FloatArray) -> FloatArray:
    """Say by how much a motion leaves each corridor, summed over the knots [m]."""
    total = np.zeros(corridors.shape[0])
    for i in range(corridors.shape[0]):
        for k in range(corridors.shape[2]):
            s = free[0, k]
            total[i] += max(corridors[i, 0, k] - s, s - corridors[i, 1, k], 0.0)
    return total
