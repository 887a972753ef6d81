"""The speed plan on a path: graph, orders, one program for each, the cheapest wins.

[Thesis] 6.4 with the corrections: the reference of s and v instead of their squares,
start acceleration fixed, every order solved instead of chosen by its area (6.18).
"""

import math
from dataclasses import dataclass
from operator import attrgetter

import numpy as np

from planner.lane_change.settings import OrderRule, SpeedSettings
from planner.lane_change.speed.area_rule import sides_by_area
from planner.lane_change.speed.dynamic_programming import sides_by_search
from planner.lane_change.speed.order_solver import SolvedOrders, solve_orders
from planner.lane_change.speed.passing_orders import (
    Bounds,
    DriveLimits,
    Order,
    Orders,
    Reach,
    Side,
    demands,
    order_of,
    possible_orders,
    reachable,
)
from planner.lane_change.speed.printed import corner_graph, printed_order
from planner.lane_change.speed.program import (
    SpeedTask,
    knot_times,
    program,
    speed_caps,
    start_state,
)
from planner.lane_change.speed.st_graph import StGraph, UsersInTime, st_graph
from planner.numerics.compiled import compiled
from planner.piecewise_jerk.solve import QpStatus, solve_soft
from planner.states import BoolArray, FloatArray, Path, SpeedProfile
from planner.vehicle import Vehicle


@dataclass(frozen=True, slots=True)
class OrderOutcome:
    """Outcome of one passing order."""

    sides: tuple[tuple[str, Side], ...]
    cost: float  # inf if infeasible
    exact: bool = True  # else given up: it costs at least this, more than the best


_COST = attrgetter("cost")


@dataclass(frozen=True, slots=True, eq=False)
class SpeedPlan:
    """A speed profile and its reasons; `profile` is None if there is none."""

    profile: SpeedProfile | None
    cost: float
    order: tuple[tuple[str, Side], ...]
    alternatives: tuple[OrderOutcome, ...]
    graph: StGraph
    nodes: int
    solved: int
    slack: float = 0.0  # by which bounds had to be exceeded [m]
    reason: str = ""

    @property
    def ahead(self) -> str | None:
        """Name the vehicle that the ego follows, the nearest of those it is behind."""
        return self._nearest(Side.AFTER)

    @property
    def behind(self) -> str | None:
        """Name the vehicle that follows the ego, the nearest of those it leads."""
        return self._nearest(Side.BEFORE)

    def _nearest(self, side: Side) -> str | None:
        """Find the vehicle of one side that comes nearest to the ego."""
        if self.profile is None or not self.order:
            return None
        graph = self.graph
        chosen = np.array([s is side for _, s in self.order])
        bound, sign = (graph.lower, 1.0) if side is Side.AFTER else (graph.upper, -1.0)
        k = _nearest(graph.hit, bound, sign, chosen, self.profile.distance)
        return None if k < 0 else graph.ids[k]


@compiled
def _nearest(
    hit: BoolArray, bound: FloatArray, sign: float, chosen: BoolArray, s: FloatArray
) -> int:
    """Find which of the chosen vehicles leaves the least room, or -1.

    Args:
        hit: Whether it is on the path, (n, n_knots).
        bound: Where it begins or ends there, (n, n_knots) [m].
        sign: 1 if the ego is behind it, -1 if it is ahead.
        chosen: Which of them count, (n,).
        s: Driven by the ego, (n_knots,) [m].
    """
    found, least = -1, np.inf
    for v in range(chosen.size):
        if not chosen[v]:
            continue
        gap = np.inf
        for k in range(s.size):
            if hit[v, k]:
                gap = min(gap, sign * (bound[v, k] - s[k]))
        if found < 0 or gap < least:
            found, least = v, gap
    return found


def plan_speed(
    path: Path,
    vehicle: Vehicle,
    users: UsersInTime,
    considered: BoolArray,
    task: SpeedTask,
    settings: SpeedSettings,
    cutoff: float = math.inf,
) -> SpeedPlan:
    """Plan the speed along a path among moving vehicles.

    Args:
        path: Of the ego's rear axle, from where it is.
        vehicle: Dimensions and limits.
        users: Every other road user, at the knots of `settings`.
        considered: Which of them count, (n_users,).
        task: Start, target speed and end.
        settings: Weights, margins, horizon.
        cutoff: Orders that are proven to cost more are not solved.

    Returns:
        The plan. Where no order has a solution (or none below `cutoff`), its profile
        is None and it has a reason; `soft_speed` is the next thing to try.
    """
    times = knot_times(settings)
    graph = _graph(path, vehicle, users, considered, settings)
    start = start_state(task, vehicle, settings)
    limits = DriveLimits.of(vehicle)
    reach = reachable(start.speed, start.acceleration, limits, settings.max_jerk, times)
    end = min(task.end, float(path.distance[-1]))
    bounds = demands(graph, settings, start.speed, times)
    orders, nodes = _orders(
        graph, bounds, reach, start.speed, limits, task, end, settings
    )
    caps = speed_caps(path, vehicle, task, times, settings.lateral_acceleration)
    solved = solve_orders(orders, reach, start, caps, task, vehicle, settings, cutoff)
    return _chosen(graph, orders, nodes, solved, times)


def _graph(
    path: Path,
    vehicle: Vehicle,
    users: UsersInTime,
    considered: BoolArray,
    settings: SpeedSettings,
) -> StGraph:
    """Project the road users onto the path, as the settings say."""
    printed = settings.printed
    if printed.four_corners:
        return corner_graph(path, users, considered, printed.corner_distance)
    return st_graph(
        path,
        vehicle,
        users,
        considered,
        settings.along_margin,
        settings.across_margin,
    )


def _chosen(
    graph: StGraph,
    orders: Orders,
    nodes: int,
    solved: SolvedOrders,
    times: FloatArray,
) -> SpeedPlan:
    """Turn the solved orders into the plan."""
    alternatives = [
        OrderOutcome(_named(graph, sides), cost, exact)
        for sides, cost, exact in zip(
            orders.sides, solved.cost.tolist(), solved.exact, strict=True
        )
    ]
    ranked = tuple(sorted(alternatives, key=_COST))
    if solved.best < 0:
        why = f"none of {len(orders)} passing orders has a solution"
        if not all(solved.exact):
            why += " that is cheap enough"
        return SpeedPlan(
            None, math.inf, (), ranked, graph, nodes, len(orders), reason=why
        )
    best = alternatives[solved.best]
    return SpeedPlan(
        profile_of(solved.state, solved.jerk, times),
        best.cost,
        best.sides,
        ranked,
        graph,
        nodes,
        len(orders),
    )


def _orders(
    graph: StGraph,
    bounds: Bounds,
    reach: Reach,
    speed: float,
    limits: DriveLimits,
    task: SpeedTask,
    end: float,
    settings: SpeedSettings,
) -> tuple[Orders, int]:
    """Return the orders to solve by the rule that is set, and the nodes looked at."""
    rule, times = settings.order_rule, knot_times(settings)
    if rule is OrderRule.SOLVE_ALL:
        return possible_orders(graph, bounds, reach, end, settings.max_orders)
    if rule is OrderRule.AREA:
        sides: tuple[Side, ...] | None = sides_by_area(
            graph, speed, limits.braking, limits.acceleration, end, times
        )
    else:
        sides = sides_by_search(
            graph,
            speed,
            limits,
            task.target_speed,
            end,
            settings,
            settings.grid,
            times,
        )
    if sides is None:
        nodes = settings.grid.times * settings.grid.places
        return Orders.of([], times.size), nodes
    if settings.printed.region_bounds:
        order = printed_order(graph, sides, speed, limits, end, times)
    else:
        order = order_of(sides, bounds, reach, end)
    return Orders.of([order], times.size), len(sides)


def soft_speed(
    path: Path,
    vehicle: Vehicle,
    graph: StGraph,
    task: SpeedTask,
    settings: SpeedSettings,
) -> SpeedPlan:
    """Follow every vehicle ahead, with bounds that may be exceeded where they must be.

    Vehicles that reach the ego's place now or are behind it do not count: they have to
    keep clear of what is ahead of them.
    """
    times = knot_times(settings)
    start = start_state(task, vehicle, settings)
    bounds = demands(graph, settings, start.speed, times)
    first = np.argmax(graph.hit, axis=1) if len(graph.ids) else np.empty(0, np.int64)
    n = np.arange(first.size)
    ahead = graph.upper[n, first] > 0.5 * (start.speed * times[first])
    upper = np.where(ahead[:, None], bounds.below, np.inf).min(axis=0, initial=np.inf)
    headway = np.where(ahead[:, None], bounds.headway, np.inf)
    end = min(task.end, float(path.distance[-1]))
    order = Order(
        tuple(Side.AFTER if a else Side.BEFORE for a in ahead),
        np.zeros(times.size),
        np.minimum(upper, end),
        headway.min(axis=0, initial=np.inf),
    )
    caps = speed_caps(path, vehicle, task, times, settings.lateral_acceleration)
    problem = program(order, start, caps, task, vehicle, settings)
    solution = solve_soft(problem)
    if solution.status is not QpStatus.SOLVED:
        return SpeedPlan(
            None,
            math.inf,
            (),
            (),
            graph,
            0,
            1,
            reason="the soft program has no solution",
        )
    return SpeedPlan(
        profile_of(solution.state, solution.jerk, times),
        solution.objective,
        _named(graph, order.sides),
        (),
        graph,
        0,
        1,
        solution.slack,
    )


def profile_of(state: FloatArray, jerk: FloatArray, times: FloatArray) -> SpeedProfile:
    """Make the record; rounding below a standstill is cut off."""
    s, v, a = state.T
    rows = np.empty((5, times.size))
    rows[0], rows[3] = times, a
    np.maximum.accumulate(np.maximum(s, 0.0), out=rows[1])
    np.maximum(v, 0.0, out=rows[2])
    rows[4, :-1], rows[4, -1] = jerk, jerk[-1]
    return SpeedProfile.from_rows(rows)


def _named(graph: StGraph, sides: tuple[Side, ...]) -> tuple[tuple[str, Side], ...]:
    """Name the vehicles of an order."""
    return tuple(zip(graph.ids, sides, strict=True))
