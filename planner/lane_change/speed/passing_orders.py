"""Passing orders: before or after each vehicle on the path; [Thesis] 6.4.2, general.

The thesis has one vehicle and two regions, A above and B below it. Here every vehicle
on the path is passed BEFORE (the ego is ahead of it) or AFTER (behind it). Orders are
built vehicle by vehicle, in the order of first contact, and dropped as soon as their
bounds leave no room, or none that the ego can reach.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import NamedTuple, overload

import numpy as np

from planner.lane_change.settings import SpeedSettings
from planner.lane_change.speed.st_graph import StGraph
from planner.numerics.compiled import compiled, inlined
from planner.states import BoolArray, FloatArray, IntArray
from planner.vehicle import Vehicle

ROUNDING = 1e-6  # [m]


class Side(StrEnum):
    """How the ego passes a vehicle."""

    BEFORE = "before"
    AFTER = "after"


class Bounds(NamedTuple):
    """Bounds of each way of passing; arrays are (n, n_knots), infinite off the path.

    `below` is an upper bound of the ego's distance if it passes after the vehicle,
    `above` a lower bound if it passes before. `headway` bounds s + tau v.
    """

    below: FloatArray
    above: FloatArray
    headway: FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class Order:
    """One passing order and the corridor it leaves, (n_knots,) each."""

    sides: tuple[Side, ...]  # in the order of the graph
    lower: FloatArray
    upper: FloatArray
    headway: FloatArray


class Corridors(NamedTuple):
    """Bounds that orders leave, (n_orders, n_knots) each; see `Order`."""

    lower: FloatArray
    upper: FloatArray
    headway: FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class Orders(Sequence[Order]):
    """Passing orders in one table, which compiled code reads."""

    sides: tuple[tuple[Side, ...], ...]  # of each order
    corridors: Corridors

    @classmethod
    def of(cls, orders: Sequence[Order], n_knots: int) -> "Orders":
        """Put orders into a table."""
        tables = (
            np.array([getattr(order, name) for order in orders]).reshape(-1, n_knots)
            for name in Corridors._fields
        )
        return cls(tuple(order.sides for order in orders), Corridors(*tables))

    def __len__(self) -> int:
        """Count the orders."""
        return len(self.sides)

    @overload
    def __getitem__(self, index: int) -> Order: ...

    @overload
    def __getitem__(self, index: slice) -> Sequence[Order]: ...

    def __getitem__(self, index: int | slice) -> Order | Sequence[Order]:
        """Return one order, or some."""
        if isinstance(index, slice):
            return [self[k] for k in range(len(self))[index]]
        return Order(self.sides[index], *(table[index] for table in self.corridors))


class DriveLimits(NamedTuple):
    """Limits of the ego in a speed plan."""

    braking: float  # strongest, negative [m/s²]
    acceleration: float  # [m/s²]
    speed: float  # [m/s]

    @classmethod
    def of(cls, vehicle: Vehicle) -> "DriveLimits":
        """Return the limits of a vehicle."""
        limits = vehicle.limits
        return cls(-limits.max_deceleration, limits.max_acceleration, limits.max_speed)


class Reach(NamedTuple):
    """Bounds of the distance that the ego can have driven, (n_knots,) each [m]."""

    least: FloatArray
    greatest: FloatArray


def reachable(
    speed: float,
    acceleration: float,
    limits: DriveLimits,
    jerk: float,
    times: FloatArray,
) -> Reach:
    """Compute the least and greatest distance that the ego can have driven.

    Jerk-limited full braking and full acceleration; they may do a little more than the
    program allows, never less.

    Args:
        speed: Now [m/s].
        acceleration: Now [m/s²].
        limits: Of the ego.
        jerk: Its bound [m/s³].
        times: Of the knots [s].
    """
    step = float(times[1] - times[0])
    # an acceleration is taken back in time, and until then speeds the ego up
    fastest = max(limits.speed, speed + max(acceleration, 0.0) ** 2 / (2.0 * jerk))
    fastest += max(acceleration, 0.0) * step
    n = times.size
    return Reach(
        _extreme(speed, acceleration, limits.braking, -jerk, 0.0, step, n),
        _extreme(speed, acceleration, limits.acceleration, jerk, fastest, step, n),
    )


@compiled
def _extreme(
    speed: float,
    acceleration: float,
    limit: float,
    jerk: float,
    speed_limit: float,
    step: float,
    n: int,
) -> FloatArray:
    """Integrate the hardest braking or acceleration up to a speed limit."""
    distance = np.zeros(n)
    v, a = speed, acceleration
    for k in range(1, n):
        wanted = a + jerk * step
        after = max(wanted, limit) if jerk < 0.0 else min(wanted, limit)
        if jerk < 0.0:
            ahead = max(v + after * step, speed_limit)
            distance[k] = distance[k - 1] + min(v, ahead) * step
        else:
            ahead = min(v + max(a, after) * step, max(speed_limit, v))
            distance[k] = distance[k - 1] + max(v, ahead) * step
        v, a = ahead, after
    return distance


def demands(
    graph: StGraph, settings: SpeedSettings, speed: float, times: FloatArray
) -> Bounds:
    """Turn the graph into bounds, with gaps and headways.

    A gap that is too short now must not make the program infeasible: what lacks at the
    first knot is opened within `relax_time`. A vehicle that comes onto the path later
    gets its full gap.

    Args:
        graph: Of this cycle.
        settings: Gaps and headways.
        speed: Of the ego now [m/s].
        times: Of the knots [s].
    """
    gaps = GapRules(
        settings.relax_time,
        settings.front_gap,
        settings.front_headway,
        settings.rear_gap,
        settings.rear_headway,
    )
    stays = Stays(graph.hit, graph.lower, graph.upper, graph.speed)
    return Bounds(*_demands(stays, gaps, speed, times))


class Stays(NamedTuple):
    """When vehicles are on the path; arrays as in `StGraph`."""

    hit: BoolArray
    lower: FloatArray
    upper: FloatArray
    speed: FloatArray


class GapRules(NamedTuple):
    """Gaps to keep, and the time in which one that is too short is opened."""

    relax_time: float  # [s]
    front_gap: float  # [m]
    front_headway: float  # [s]
    rear_gap: float  # [m]
    rear_headway: float  # [s]


@compiled
def _demands(
    stays: Stays, gaps: GapRules, speed: float, times: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Compute (below, above, headway) of `demands`."""
    hit, lower, upper = stays.hit, stays.lower, stays.upper
    front_gap = gaps.front_gap
    shape = hit.shape
    below, above = np.full(shape, np.inf), np.full(shape, -np.inf)
    headway = np.full(shape, np.inf)
    for v in range(shape[0]):
        rear = gaps.rear_gap + gaps.rear_headway * stays.speed[v]
        lack_below, lack_above, lack_headway = 0.0, 0.0, 0.0
        now = hit[v, 0]
        # a vehicle that is on the path now is passed on the side where the ego is
        ahead = now and lower[v, 0] + upper[v, 0] > 0.0
        if now:
            lack_below = max(front_gap - lower[v, 0], 0.0) if ahead else 0.0
            lack_above = 0.0 if ahead else max(upper[v, 0] + rear, 0.0)
            lack_headway = gaps.front_headway * speed + front_gap - lower[v, 0]
            lack_headway = max(lack_headway, 0.0)
        for k in range(shape[1]):
            if not hit[v, k]:
                continue
            done = min(times[k] / gaps.relax_time, 1.0)
            fade = 1.0 - done * done * (3.0 - 2.0 * done)  # level at both ends
            front = lower[v, k] - front_gap
            below[v, k] = -np.inf if now and not ahead else front + lack_below * fade
            above[v, k] = np.inf if ahead else upper[v, k] + rear - lack_above * fade
            headway[v, k] = front + lack_headway * fade
    return below, above, headway


def order_of(
    sides: tuple[Side, ...],
    bounds: Bounds,
    reach: Reach,
    end: float,
) -> Order:
    """Compute the corridor of one order, whether it can be driven or not."""
    least, greatest = reach
    lower, upper = least, np.minimum(greatest, end)
    headway = np.full(least.size, np.inf)
    for v, side in enumerate(sides):
        if side is Side.BEFORE:
            lower = np.maximum(lower, bounds.above[v])
        else:
            upper = np.minimum(upper, bounds.below[v])
            headway = np.minimum(headway, bounds.headway[v])
    return Order(sides, lower, upper, headway)


def possible_orders(
    graph: StGraph,
    bounds: Bounds,
    reach: Reach,
    end: float,
    max_orders: int,
) -> tuple[Orders, int]:
    """Enumerate the orders that the ego might be able to drive.

    Args:
        graph: Of this cycle.
        bounds: Of each vehicle.
        reach: From `reachable`.
        end: Where the path ends or the ego has to stop [m].
        max_orders: Stop after so many.

    Returns:
        (orders, nodes looked at).
    """
    sides, corridors, nodes = _enumerate(
        graph.hit,
        graph.lower,
        bounds,
        Reach(reach.least, np.minimum(reach.greatest, end)),
        max_orders,
    )
    named = tuple(tuple(_SIDES[side] for side in row) for row in sides.tolist())
    return Orders(named, corridors), nodes


_SIDES = (Side.AFTER, Side.BEFORE)  # by the number that the compiled code uses
AFTER, BEFORE = 0, 1


@compiled
def _enumerate(
    hit: BoolArray,
    contact: FloatArray,
    bounds: Bounds,
    reach: Reach,
    max_orders: int,
) -> tuple[IntArray, Corridors, int]:
    """Enumerate the tree of orders, depth first, BEFORE before AFTER.

    Returns:
        (sides (n_orders, n), BEFORE or AFTER; corridors; nodes looked at).
    """
    n, n_knots = hit.shape
    sequence = _by_contact(hit, contact)
    room = min(max_orders, 2 ** min(n, 20))
    found_sides, found = np.zeros((room, n), np.int64), _allocate(room, n_knots)
    # the stack holds at most one sibling for each depth, and the node itself
    depth, sides = np.zeros(n + 2, np.int64), np.zeros((n + 2, n), np.int64)
    stack = _allocate(n + 2, n_knots)
    stack.lower[0], stack.upper[0] = reach.least, reach.greatest
    stack.headway[0] = np.inf
    top, count, nodes = 0, 0, 0
    while top >= 0 and count < room:
        nodes += 1
        level = depth[top]
        if not _is_open(stack.lower[top], stack.upper[top]):
            top -= 1
        elif level == n:
            found_sides[count] = sides[top]
            _copy(stack, top, found, count)
            count += 1
            top -= 1
        else:
            v = sequence[level]
            depth[top], depth[top + 1] = level + 1, level + 1
            sides[top + 1] = sides[top]
            _copy(stack, top, stack, top + 1)
            sides[top, v], sides[top + 1, v] = AFTER, BEFORE
            for k in range(n_knots):
                stack.upper[top, k] = min(stack.upper[top, k], bounds.below[v, k])
                stack.headway[top, k] = min(stack.headway[top, k], bounds.headway[v, k])
                stack.lower[top + 1, k] = max(
                    stack.lower[top + 1, k], bounds.above[v, k]
                )
            top += 1
    corridors = Corridors(
        found.lower[:count], found.upper[:count], found.headway[:count]
    )
    return found_sides[:count], corridors, nodes


@compiled
def _allocate(n: int, n_knots: int) -> Corridors:
    """Allocate n corridors."""
    shape = (n, n_knots)
    return Corridors(np.empty(shape), np.empty(shape), np.empty(shape))


@inlined
def _copy(source: Corridors, i: int, target: Corridors, j: int) -> None:
    """Copy one corridor."""
    target.lower[j] = source.lower[i]
    target.upper[j] = source.upper[i]
    target.headway[j] = source.headway[i]


@compiled
def _by_contact(hit: BoolArray, contact: FloatArray) -> IntArray:
    """Sort vehicles by the knot of first contact, then by the place of it."""
    n, n_knots = hit.shape
    first, place = np.full(n, n_knots), np.zeros(n)
    for v in range(n):
        for k in range(n_knots):
            if hit[v, k]:
                first[v], place[v] = k, contact[v, k]
                break
    sequence = np.arange(n)
    for i in range(1, n):
        v, j = sequence[i], i - 1
        key = (first[v], place[v])
        while j >= 0 and key < (first[sequence[j]], place[sequence[j]]):
            sequence[j + 1] = sequence[j]
            j -= 1
        sequence[j + 1] = v
    return sequence


@compiled
def _is_open(lower: FloatArray, upper: FloatArray) -> bool:
    """Check whether a corridor leaves room at every knot after the first."""
    return not np.any(lower[1:] > upper[1:] + ROUNDING)
