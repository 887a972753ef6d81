"""Passing orders: before or after each vehicle on the path; [Thesis] 6.4.2, general.

The thesis has one vehicle and two regions, A above and B below it. Here every vehicle
on the path is passed BEFORE (the ego is ahead of it) or AFTER (behind it). Orders are
built vehicle by vehicle, in the order of first contact, and dropped as soon as their
bounds leave no room, or none that the ego can reach.
"""

from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from planner.lane_change.settings import SpeedSettings
from planner.lane_change.speed.st_graph import StGraph
from planner.numerics.compiled import compiled
from planner.states import BoolArray, FloatArray, IntArray

ROUNDING = 1e-6  # [m]


class Side(StrEnum):
    """How the ego passes a vehicle."""

    BEFORE = "before"
    AFTER = "after"


@dataclass(frozen=True, slots=True, eq=False)
class Bounds:
    """What each way of passing demands; arrays are (n, n_knots), infinite off the path.

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


def reachable(
    speed: float,
    acceleration: float,
    limits: tuple[float, float, float],
    jerk: float,
    times: FloatArray,
) -> tuple[FloatArray, FloatArray]:
    """Give the least and greatest distance that the ego can have driven.

    Args:
        speed: Now [m/s].
        acceleration: Now [m/s²].
        limits: Strongest braking (negative), acceleration [m/s²], speed [m/s].
        jerk: Its bound [m/s³].
        times: Of the knots [s].

    Returns:
        (least, greatest), (n_knots,): jerk-limited full braking and full acceleration.
        They may do a little more than the program allows, never less.
    """
    step = float(times[1] - times[0])
    lowest, highest, fastest = limits
    # an acceleration is taken back in time, and until then speeds the ego up
    fastest = max(fastest, speed + max(acceleration, 0.0) ** 2 / (2.0 * jerk))
    fastest += max(acceleration, 0.0) * step
    return (
        _extreme(speed, acceleration, lowest, -jerk, 0.0, step, times.size),
        _extreme(speed, acceleration, highest, jerk, fastest, step, times.size),
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
    return Bounds(
        *_demands(
            graph.hit,
            graph.lower,
            graph.upper,
            graph.speed,
            speed,
            times,
            settings.relax_time,
            settings.front_gap,
            settings.front_headway,
            settings.rear_gap,
            settings.rear_headway,
        )
    )


@compiled
def _demands(
    hit: BoolArray,
    lower: FloatArray,
    upper: FloatArray,
    speeds: FloatArray,
    speed: float,
    times: FloatArray,
    relax_time: float,
    front_gap: float,
    front_headway: float,
    rear_gap: float,
    rear_headway: float,
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Give (below, above, headway) of `demands`."""
    shape = hit.shape
    below, above = np.full(shape, np.inf), np.full(shape, -np.inf)
    headway = np.full(shape, np.inf)
    for v in range(shape[0]):
        rear = rear_gap + rear_headway * speeds[v]
        lack_below, lack_above, lack_headway = 0.0, 0.0, 0.0
        now = hit[v, 0]
        # who is on the path now is passed on the side where the ego is
        ahead = now and lower[v, 0] + upper[v, 0] > 0.0
        if now:
            lack_below = max(front_gap - lower[v, 0], 0.0) if ahead else 0.0
            lack_above = 0.0 if ahead else max(upper[v, 0] + rear, 0.0)
            lack_headway = front_headway * speed + front_gap - lower[v, 0]
            lack_headway = max(lack_headway, 0.0)
        for k in range(shape[1]):
            if not hit[v, k]:
                continue
            done = min(times[k] / relax_time, 1.0)
            fade = 1.0 - done * done * (3.0 - 2.0 * done)  # level at both ends
            front = lower[v, k] - front_gap
            below[v, k] = -np.inf if now and not ahead else front + lack_below * fade
            above[v, k] = np.inf if ahead else upper[v, k] + rear - lack_above * fade
            headway[v, k] = front + lack_headway * fade
    return below, above, headway


def order_of(
    sides: tuple[Side, ...],
    bounds: Bounds,
    reach: tuple[FloatArray, FloatArray],
    end: float,
) -> Order:
    """Make the corridor of one order; nobody says that it can be driven."""
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
    reach: tuple[FloatArray, FloatArray],
    end: float,
    max_orders: int,
) -> tuple[list[Order], int]:
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
    least, greatest = reach
    sides, corridors, nodes = _enumerate(
        graph.hit,
        graph.lower,
        bounds.below,
        bounds.above,
        bounds.headway,
        least,
        np.minimum(greatest, end),
        max_orders,
    )
    found = [
        Order(tuple(_SIDES[side] for side in row), *corridor)
        for row, corridor in zip(sides.tolist(), corridors, strict=True)
    ]
    return found, nodes


_SIDES = (Side.AFTER, Side.BEFORE)  # by the number that the compiled code uses


@compiled
def _enumerate(
    hit: BoolArray,
    contact: FloatArray,
    below: FloatArray,
    above: FloatArray,
    headway: FloatArray,
    least: FloatArray,
    greatest: FloatArray,
    max_orders: int,
) -> tuple[IntArray, FloatArray, int]:
    """Go through the tree of orders, depth first, BEFORE before AFTER.

    Returns:
        (sides (n_orders, n), 1 for BEFORE; corridors (n_orders, 3, n_knots): lower,
        upper, headway; nodes looked at).
    """
    n, n_knots = hit.shape
    sequence = _by_contact(hit, contact)
    room = min(max_orders, 2 ** min(n, 20))
    found_sides, found = np.zeros((room, n), np.int64), np.empty((room, 3, n_knots))
    # the stack holds at most one sibling for each depth, and the node itself
    depth, sides = np.zeros(n + 2, np.int64), np.zeros((n + 2, n), np.int64)
    corridor = np.empty((n + 2, 3, n_knots))
    corridor[0, 0], corridor[0, 1], corridor[0, 2] = least, greatest, np.inf
    top, count, nodes = 0, 0, 0
    while top >= 0 and count < room:
        nodes += 1
        level = depth[top]
        if not _is_open(corridor[top]):
            top -= 1
        elif level == n:
            found_sides[count], found[count] = sides[top], corridor[top]
            count += 1
            top -= 1
        else:
            v = sequence[level]
            depth[top], depth[top + 1] = level + 1, level + 1
            sides[top + 1], corridor[top + 1] = sides[top], corridor[top]
            sides[top, v], sides[top + 1, v] = 0, 1
            for k in range(n_knots):
                corridor[top, 1, k] = min(corridor[top, 1, k], below[v, k])
                corridor[top, 2, k] = min(corridor[top, 2, k], headway[v, k])
                corridor[top + 1, 0, k] = max(corridor[top + 1, 0, k], above[v, k])
            top += 1
    return found_sides[:count], found[:count], nodes


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
def _is_open(corridor: FloatArray) -> bool:
    """Tell whether a corridor leaves room at every knot after the first."""
    for k in range(1, corridor.shape[1]):
        if corridor[0, k] > corridor[1, k] + ROUNDING:
            return False
    return True
