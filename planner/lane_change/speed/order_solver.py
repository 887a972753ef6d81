"""Solves the programs of many passing orders for the cheapest, in compiled code.

The orders whose corridor the unbounded motion breaks least come first; a later one is
given up when its multipliers prove that it cannot be cheaper than the best so far. The
winner is the one that solving every order to the end would give.
"""

from dataclasses import dataclass

import numpy as np

from planner.lane_change.settings import SpeedSettings
from planner.lane_change.speed.passing_orders import Corridors, Orders, Reach
from planner.lane_change.speed.program import (
    ROUNDING,
    SpeedTask,
    StartState,
    bounded_program,
    limit_tables,
    program,
)
from planner.numerics.compiled import compiled
from planner.piecewise_jerk.interior_point import (
    ABOVE_CUTOFF,
    INFEASIBLE,
    SOLVED,
    solve_with_cutoff,
)
from planner.piecewise_jerk.objective import free_motion
from planner.piecewise_jerk.problem import JerkProgram, Verdict
from planner.piecewise_jerk.solve import OPTIONS, QpStatus, solve
from planner.states import FloatArray, IntArray
from planner.vehicle import Vehicle

S, HEADWAY = 0, 3  # columns of the bounds: s, v, a and the row s + tau v


@dataclass(frozen=True, slots=True, eq=False)
class SolvedOrders:
    """Outcome of each order, and the motion of the cheapest."""

    cost: FloatArray  # (n_orders,); inf if infeasible
    exact: tuple[bool, ...]  # else the cost is a lower bound, above that of the best
    best: int  # -1 if none has a solution
    state: FloatArray  # (n_knots, 3)
    jerk: FloatArray  # (n_knots - 1,)


def solve_orders(
    orders: Orders,
    reach: Reach,
    start: StartState,
    caps: FloatArray,
    task: SpeedTask,
    vehicle: Vehicle,
    settings: SpeedSettings,
    cutoff: float = np.inf,
) -> SolvedOrders:
    """Find the cheapest of some orders.

    Args:
        orders: With their corridors.
        reach: What it alone bounds needs no bound.
        start: Of the ego.
        caps: Of the speed, (n_knots,) [m/s].
        task: Start and reference.
        vehicle: Its limits.
        settings: Weights and steps.
        cutoff: Orders that are proven dearer than this are given up, too.
    """
    lower, upper = limit_tables(start, caps, vehicle, settings)
    problem = bounded_program(start, task, settings, lower, upper)
    cost, verdict, best, state, jerk = _cheapest(
        problem, orders.corridors, reach, cutoff
    )
    verdicts = verdict.tolist()
    for i, outcome in enumerate(verdicts):
        if outcome != Verdict.UNDECIDED:
            continue
        found = solve(program(orders[i], start, caps, task, vehicle, settings), "piqp")
        if found.status is not QpStatus.SOLVED:
            continue
        cost[i], verdicts[i] = found.objective, Verdict.SOLVED
        if found.objective < (cost[best] if best >= 0 else np.inf):
            best, state, jerk = i, found.state, found.jerk
    exact = tuple(v != Verdict.ABOVE_CUTOFF for v in verdicts)
    return SolvedOrders(cost, exact, best, state, jerk)


@compiled
def _cheapest(
    problem: JerkProgram, corridors: Corridors, reach: Reach, cutoff: float
) -> tuple[FloatArray, IntArray, int, FloatArray, FloatArray]:
    """Solve order after order: (costs, verdicts, index of the best, its motion)."""
    n_orders, n = corridors.lower.shape
    lower, upper = problem.lower, problem.upper
    cost, verdict = np.full(n_orders, np.inf), np.full(n_orders, INFEASIBLE)
    best, best_state, best_jerk = -1, np.empty((n, 3)), np.empty(n - 1)
    free = free_motion(problem).table
    for i in np.argsort(_broken(corridors, free[0])):
        for k in range(n):
            low, up = corridors.lower[i, k], corridors.upper[i, k]
            lower[k, S] = low - ROUNDING if low > reach.least[k] else -np.inf
            upper[k, S] = up if up < reach.greatest[k] else np.inf
            upper[k, HEADWAY] = corridors.headway[i, k]
        to_beat = cutoff if best < 0 else min(cost[best], cutoff)
        found = solve_with_cutoff(problem, to_beat, OPTIONS)
        verdict[i] = found.verdict
        if found.verdict in (SOLVED, ABOVE_CUTOFF):
            cost[i] = found.objective
        if found.verdict == SOLVED and (best < 0 or found.objective < cost[best]):
            best, best_state, best_jerk = i, found.state, found.jerk
    return cost, verdict, best, best_state, best_jerk


@compiled
def _broken(corridors: Corridors, distance: FloatArray) -> FloatArray:
    """Compute by how much a motion leaves each corridor, summed over knots [m]."""
    total = np.zeros(corridors.lower.shape[0])
    for i in range(corridors.lower.shape[0]):
        for k in range(corridors.lower.shape[1]):
            s = distance[k]
            total[i] += max(corridors.lower[i, k] - s, s - corridors.upper[i, k], 0.0)
    return total
