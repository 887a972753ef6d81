"""The speed plan on a path: graph, orders, one program for each, the cheapest wins.

[Thesis] 6.4 with the corrections: the reference of s and v instead of their squares,
start acceleration fixed, every order solved instead of chosen by its area (6.18).
"""

import math
from dataclasses import dataclass, replace

import numpy as np

from planner.lane_change.area_rule import sides_by_area
from planner.lane_change.dynamic_programming import sides_by_search
from planner.lane_change.orders import (
    Bounds,
    Order,
    Side,
    demands,
    order_of,
    possible_orders,
    reachable,
)
from planner.lane_change.settings import OrderRule, SpeedSettings
from planner.lane_change.st_graph import StGraph, st_graph
from planner.motion.piecewise_jerk import (
    MAX_ITERATIONS,
    TOLERANCE,
    PiecewiseJerkProblem,
    PiecewiseJerkSolution,
    QpStatus,
    solve,
    solve_soft,
)
from planner.motion.piecewise_jerk_riccati import (
    SOLVED,
    UNDECIDED,
    interior_point,
)
from planner.scene import Vehicles
from planner.states import BoolArray, FloatArray, Path, SpeedProfile
from planner.vehicle import Vehicle

ROUNDING = 1e-9  # by which bounds of the distance give way [m]
JERK_TIME = 1.5  # in which an acceleration has surely turned into braking [s]


@dataclass(frozen=True, slots=True)
class SpeedTask:
    """What a speed plan is asked for."""

    speed: float  # now [m/s]
    acceleration: float  # now [m/s²]
    target_speed: float  # [m/s]
    end: float = math.inf  # not to be passed by the rear axle [m]


@dataclass(frozen=True, slots=True)
class Alternative:
    """One passing order and what became of it."""

    sides: tuple[tuple[str, Side], ...]
    cost: float  # inf if infeasible


@dataclass(frozen=True, slots=True, eq=False)
class SpeedPlan:
    """A speed profile and why it is this one; `profile` is None if there is none."""

    profile: SpeedProfile | None
    cost: float
    order: tuple[tuple[str, Side], ...]
    alternatives: tuple[Alternative, ...]
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
        chosen = [k for k, (_, s) in enumerate(self.order) if s is side]
        if not chosen or self.profile is None:
            return None
        graph, s = self.graph, self.profile.distance
        gaps = []
        for k in chosen:
            on = graph.hit[k]
            if side is Side.AFTER:
                gaps.append(float((graph.lower[k] - s)[on].min()))
            else:
                gaps.append(float((s - graph.upper[k])[on].min()))
        return graph.ids[chosen[int(np.argmin(gaps))]]


def plan_speed(
    path: Path,
    vehicle: Vehicle,
    users: Vehicles,
    considered: BoolArray,
    task: SpeedTask,
    settings: SpeedSettings,
) -> SpeedPlan:
    """Plan the speed along a path among moving vehicles.

    Args:
        path: Of the ego's rear axle, from where it is.
        vehicle: Dimensions and limits.
        users: Everyone else.
        considered: Who of them counts, (n_users,).
        task: Start, wish and end.
        settings: Weights, margins, horizon.

    Returns:
        The plan. Where no order has a solution, its profile is None and its reason
        says so; `soft_speed` is the next thing to try.
    """
    times = knot_times(settings)
    graph = st_graph(
        path,
        vehicle,
        users,
        considered,
        times,
        settings.along_margin,
        settings.across_margin,
    )
    start = start_state(task, vehicle, settings)
    limits = vehicle.limits
    ceiling = (-limits.max_deceleration, limits.max_acceleration, limits.max_speed)
    reach = reachable(start[1], start[2], ceiling, settings.max_jerk, times)
    end = min(task.end, float(path.distance[-1]))
    bounds = demands(graph, settings, start[1], times)
    orders, nodes = _orders(
        graph, bounds, reach, (start, ceiling), task, end, settings, times
    )
    caps = speed_caps(path, vehicle, task, times)
    best: tuple[PiecewiseJerkSolution, Order] | None = None
    alternatives = []
    common = None
    for order in orders:
        if common is None:
            common = program(order, start, caps, task, vehicle, settings, times)
        solution = _solved(common, order)
        feasible = solution.status is QpStatus.SOLVED
        cost = solution.objective if feasible else math.inf
        alternatives.append(Alternative(_named(graph, order), cost))
        if feasible and (best is None or cost < best[0].objective):
            best = solution, order
    alternatives.sort(key=lambda a: a.cost)
    if best is None:
        why = f"none of {len(orders)} passing orders has a solution"
        return SpeedPlan(
            None,
            math.inf,
            (),
            tuple(alternatives),
            graph,
            nodes,
            len(orders),
            reason=why,
        )
    return SpeedPlan(
        profile_of(best[0], times),
        best[0].objective,
        _named(graph, best[1]),
        tuple(alternatives),
        graph,
        nodes,
        len(orders),
    )


def _orders(
    graph: StGraph,
    bounds: Bounds,
    reach: tuple[FloatArray, FloatArray],
    ego: tuple[tuple[float, float, float], tuple[float, float, float]],
    task: SpeedTask,
    end: float,
    settings: SpeedSettings,
    times: FloatArray,
) -> tuple[list[Order], int]:
    """Give the orders to solve by the rule that is set, and the nodes looked at."""
    start, limits = ego
    rule = settings.order_rule
    if rule is OrderRule.SOLVE_ALL:
        return possible_orders(graph, bounds, reach, end, settings.max_orders)
    if rule is OrderRule.AREA:
        sides: tuple[Side, ...] | None = sides_by_area(
            graph, start[1], limits[0], limits[1], end, times
        )
    else:
        sides = sides_by_search(
            graph,
            start,
            limits,
            task.target_speed,
            end,
            settings,
            settings.grid,
            times,
        )
    if sides is None:
        return [], settings.grid.times * settings.grid.places
    return [order_of(sides, bounds, reach, end)], len(sides)


def soft_speed(
    path: Path,
    vehicle: Vehicle,
    graph: StGraph,
    task: SpeedTask,
    settings: SpeedSettings,
) -> SpeedPlan:
    """Follow everyone ahead, with bounds that may be exceeded where they must be.

    Vehicles that reach the ego's place now or are behind it do not count: it is for
    them to keep clear of what is ahead of them.
    """
    times = knot_times(settings)
    start = start_state(task, vehicle, settings)
    bounds = demands(graph, settings, start[1], times)
    first = np.argmax(graph.hit, axis=1) if len(graph.ids) else np.empty(0, np.int64)
    n = np.arange(first.size)
    ahead = graph.upper[n, first] > 0.5 * (start[1] * times[first])
    upper = np.where(ahead[:, None], bounds.below, np.inf).min(axis=0, initial=np.inf)
    headway = np.where(ahead[:, None], bounds.headway, np.inf)
    end = min(task.end, float(path.distance[-1]))
    order = Order(
        tuple(Side.AFTER if a else Side.BEFORE for a in ahead),
        np.zeros(times.size),
        np.minimum(upper, end),
        headway.min(axis=0, initial=np.inf),
    )
    caps = speed_caps(path, vehicle, task, times)
    problem = program(order, start, caps, task, vehicle, settings, times)
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
        profile_of(solution, times),
        solution.objective,
        _named(graph, order),
        (),
        graph,
        0,
        1,
        solution.slack,
    )


def knot_times(settings: SpeedSettings) -> FloatArray:
    """Give the times of the knots [s]."""
    n = round(settings.duration / settings.step) + 1
    return settings.step * np.arange(n, dtype=np.float64)


def start_state(
    task: SpeedTask, vehicle: Vehicle, settings: SpeedSettings
) -> tuple[float, float, float]:
    """Give (s, v, a) at the start, such that the limits can be kept from there.

    Emergency braking may have been harder than the program allows, and a vehicle that
    has just stopped still decelerates: what the jerk bound could not take back is left
    out.
    """
    speed = max(task.speed, 0.0)
    limits = vehicle.limits
    lowest = max(-limits.max_deceleration, -math.sqrt(2.0 * settings.max_jerk * speed))
    return 0.0, speed, min(max(task.acceleration, lowest), limits.max_acceleration)


def speed_caps(
    path: Path, vehicle: Vehicle, task: SpeedTask, times: FloatArray
) -> FloatArray:
    """Bound the speed at each knot by the curvature there, (n_knots,) [m/s].

    The bound depends on the place, the program knows times: the place is taken from a
    drive at the wished speed, between half and full of which the ego is looked for.
    """
    limits = vehicle.limits
    curvature = np.maximum(np.abs(path.curvature), 1e-6)
    local = np.minimum(
        np.sqrt(limits.max_lateral_acceleration / curvature), limits.max_speed
    )
    if float(local.min()) >= limits.max_speed:
        return np.full(times.size, limits.max_speed)
    fast = max(task.target_speed, task.speed) * times
    caps = np.interp(fast, path.distance, local)
    caps = np.minimum(caps, np.interp(0.75 * fast, path.distance, local))
    caps = np.minimum(caps, np.interp(0.5 * fast, path.distance, local))
    # nobody brakes at once: from the present speed down to the bound
    braking = task.speed - 0.8 * limits.max_deceleration * np.maximum(times - 1.0, 0.0)
    return np.asarray(np.maximum(caps, np.maximum(braking, 0.0)))


def program(
    order: Order,
    start: tuple[float, float, float],
    caps: FloatArray,
    task: SpeedTask,
    vehicle: Vehicle,
    settings: SpeedSettings,
    times: FloatArray,
) -> PiecewiseJerkProblem:
    """Write one order as a program; [Thesis] eq. 6.19, 6.20 corrected."""
    n, limits = times.size, vehicle.limits
    wish = task.target_speed
    reference = np.zeros((n, 3))
    reference[:, 0] = wish * times
    reference[:, 1] = wish
    lower, upper = np.empty((n, 3)), np.empty((n, 3))
    lower[:, 0] = order.lower - ROUNDING
    upper[:, 0] = order.upper
    lower[:, 1], upper[:, 1] = 0.0, np.maximum(caps, 0.0)
    # a speed beyond the limit comes down as fast as the jerk bound lets it
    over = start[1] + np.maximum(start[2], 0.0) ** 2 / (2.0 * settings.max_jerk)
    falling = 0.5 * limits.max_deceleration * np.maximum(times - JERK_TIME, 0.0)
    upper[:, 1] = np.maximum(upper[:, 1], over - falling)
    lower[:, 2], upper[:, 2] = -limits.max_deceleration, limits.max_acceleration
    row = np.zeros((n, 1, 3))
    row[:, 0] = 1.0, settings.front_headway, 0.0
    weights = (
        settings.distance_weight,
        settings.speed_weight,
        settings.acceleration_weight,
    )
    return PiecewiseJerkProblem(
        np.full(n - 1, settings.step),
        np.array(start),
        np.tile(weights, (n, 1)),
        reference,
        settings.jerk_weight,
        lower,
        upper,
        -settings.max_jerk,
        settings.max_jerk,
        row,
        np.full((n, 1), -np.inf),
        order.headway[:, None],
    )


def _solved(common: PiecewiseJerkProblem, order: Order) -> PiecewiseJerkSolution:
    """Solve an order's program, which differs from `common` in three bounds only.

    Checking and copying every array of every order would cost as much as solving.
    """
    lower = np.concatenate([common.lower, common.row_lower], axis=1)
    upper = np.concatenate([common.upper, common.row_upper], axis=1)
    lower[:, 0] = order.lower - ROUNDING
    upper[:, 0] = order.upper
    upper[:, 3] = order.headway
    state, jerk, objective, verdict, iterations = interior_point(
        common.step,
        common.start,
        common.weight,
        common.reference,
        common.jerk_weight,
        lower,
        upper,
        common.row,
        common.jerk_lower,
        common.jerk_upper,
        MAX_ITERATIONS,
        TOLERANCE,
    )
    if verdict == UNDECIDED:
        return solve(
            replace(
                common,
                lower=lower[:, :3],
                upper=upper[:, :3],
                row_upper=upper[:, 3:],
            ),
            "piqp",
        )
    status = QpStatus.SOLVED if verdict == SOLVED else QpStatus.INFEASIBLE
    return PiecewiseJerkSolution(
        status, state, jerk, objective, 0.0, iterations, "riccati"
    )


def profile_of(solution: PiecewiseJerkSolution, times: FloatArray) -> SpeedProfile:
    """Make the record; rounding below a standstill is cut off."""
    s, v, a = solution.state.T
    return SpeedProfile(
        times,
        np.maximum.accumulate(np.maximum(s, 0.0)),
        np.maximum(v, 0.0),
        a,
        np.append(solution.jerk, solution.jerk[-1]),
    )


def _named(graph: StGraph, order: Order) -> tuple[tuple[str, Side], ...]:
    """Name the vehicles of an order."""
    return tuple(zip(graph.ids, order.sides, strict=True))
