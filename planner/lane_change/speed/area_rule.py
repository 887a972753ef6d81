"""The rule of the thesis: one region for each vehicle, chosen by its area.

[Thesis] eq. 6.12-6.18. Region A lies above a vehicle in the s-T graph (the ego goes
first), B below it. Which of them can be reached is judged by uniform acceleration at
the time t0 of first contact; where both can, the larger area before t0 wins. With
several vehicles, which the thesis leaves open, each is judged alone.
"""

import numpy as np

from planner.lane_change.speed.passing_orders import Side
from planner.lane_change.speed.st_graph import StGraph
from planner.states import FloatArray


def sides_by_area(
    graph: StGraph,
    speed: float,
    braking: float,
    acceleration: float,
    end: float,
    times: FloatArray,
) -> tuple[Side, ...]:
    """Choose a side for every vehicle.

    Args:
        graph: Of this cycle.
        speed: Of the ego now [m/s].
        braking: Its strongest deceleration, negative [m/s²].
        acceleration: Its strongest acceleration [m/s²].
        end: Length of the path, S_L [m].
        times: Of the knots [s].
    """
    sides = []
    for v in range(len(graph.ids)):
        first = int(np.argmax(graph.hit[v]))
        t0 = float(times[first])
        low, high = float(graph.lower[v, first]), float(graph.upper[v, first])
        if first == 0:  # it is on the path now: nothing to choose
            sides.append(Side.AFTER if low + high > 0.0 else Side.BEFORE)
            continue
        can_lead = speed * t0 + 0.5 * acceleration * t0**2 > high  # 6.12
        can_yield = speed * t0 + 0.5 * braking * t0**2 < low  # 6.15
        if can_lead and can_yield:
            before = times[: first + 1]
            lead = area_above(before, speed, acceleration, high, end)
            follow = area_below(before, speed, braking, low)
            sides.append(Side.BEFORE if lead > follow else Side.AFTER)
        else:
            sides.append(Side.BEFORE if can_lead else Side.AFTER)
    return tuple(sides)


def area_above(
    times: FloatArray, speed: float, acceleration: float, high: float, end: float
) -> float:
    """Area of region A before t0 = times[-1], [Thesis] eq. 6.13, 6.14, 6.18 [m s]."""
    t0 = float(times[-1])
    upper = np.minimum(speed * times + 0.5 * acceleration * times**2, end)
    lower = speed * times + (high - speed * t0) / t0**2 * times**2
    return float(np.trapezoid(upper - lower, times))


def area_below(times: FloatArray, speed: float, braking: float, low: float) -> float:
    """Area of region B before t0 = times[-1], [Thesis] eq. 6.16, 6.17, 6.18 [m s]."""
    t0 = float(times[-1])
    upper = speed * times + (low - speed * t0) / t0**2 * times**2
    moving = np.minimum(times, -speed / braking)  # it does not reverse
    lower = speed * moving + 0.5 * braking * moving**2
    return float(np.trapezoid(upper - lower, times))
