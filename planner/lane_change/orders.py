"""Passing orders: before or after each vehicle on the path; [Thesis] 6.4.2, general.

The thesis has one vehicle and two regions, A above and B below it. Here every vehicle
on the path is passed BEFORE (the ego is ahead of it) or AFTER (behind it). Orders are
built vehicle by vehicle, in the order of first contact, and dropped as soon as their
bounds leave no room, or none that the ego can reach.
"""

from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from planner.compiled import compiled
from planner.lane_change.settings import SpeedSettings
from planner.lane_change.st_graph import StGraph
from planner.states import FloatArray

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
    lower, upper, hit = graph.lower, graph.upper, graph.hit
    done = np.minimum(times / settings.relax_time, 1.0)
    fade = 1.0 - done**2 * (3.0 - 2.0 * done)  # level at both ends: jerk is bounded
    rear = settings.rear_gap + settings.rear_headway * graph.speed[:, None]
    below = lower - settings.front_gap
    above = upper + rear
    headway = lower - settings.front_gap
    now = hit[:, 0]
    wanted = settings.front_headway * speed
    lack_below = np.where(now, np.maximum(-below[:, 0], 0.0), 0.0)
    lack_above = np.where(now, np.maximum(above[:, 0], 0.0), 0.0)
    lack_headway = np.where(now, np.maximum(wanted - headway[:, 0], 0.0), 0.0)
    # who is on the path now is passed on the side where the ego is
    ahead = now & (lower[:, 0] + upper[:, 0] > 0.0)
    below[now & ~ahead] = -np.inf
    above[ahead] = np.inf
    return Bounds(
        np.where(hit, below + lack_below[:, None] * fade, np.inf),
        np.where(hit, above - lack_above[:, None] * fade, -np.inf),
        np.where(hit, headway + lack_headway[:, None] * fade, np.inf),
    )


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
    n_knots = least.size
    first = np.where(graph.hit.any(axis=1), np.argmax(graph.hit, axis=1), n_knots)
    sequence = np.lexsort((graph.lower[np.arange(first.size), first % n_knots], first))
    found: list[Order] = []
    nodes = 0
    open_end = np.full(n_knots, np.inf)
    stack: list[tuple[tuple[Side, ...], FloatArray, FloatArray, FloatArray]] = [
        ((), least, np.minimum(greatest, end), open_end)
    ]
    while stack and len(found) < max_orders:
        sides, lower, upper, headway = stack.pop()
        nodes += 1
        if np.any(lower[1:] > upper[1:] + ROUNDING):
            continue
        if len(sides) == sequence.size:
            by_vehicle = dict(zip(sequence.tolist(), sides, strict=True))
            ordered = tuple(by_vehicle[k] for k in range(len(sides)))
            found.append(Order(ordered, lower, upper, headway))
            continue
        v = int(sequence[len(sides)])
        after = (
            (*sides, Side.AFTER),
            lower,
            np.minimum(upper, bounds.below[v]),
            np.minimum(headway, bounds.headway[v]),
        )
        before = (
            (*sides, Side.BEFORE),
            np.maximum(lower, bounds.above[v]),
            upper,
            headway,
        )
        stack.extend((after, before))
    return found, nodes
