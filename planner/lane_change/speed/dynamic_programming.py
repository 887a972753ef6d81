"""The conventional way to an order: dynamic programming over a grid of the s-T graph.

The method that [Thesis] ch. 6 is compared with: search (t, s) nodes for the cheapest
course around the vehicles, see on which side of each it passes, then solve the program
in that corridor. The grid decides what it can find and what it costs.
"""

from typing import NamedTuple

import numpy as np

from planner.lane_change.settings import GridSettings, SpeedSettings
from planner.lane_change.speed.passing_orders import DriveLimits, Side
from planner.lane_change.speed.st_graph import StGraph
from planner.numerics.compiled import compiled
from planner.states import BoolArray, FloatArray, IntArray


def sides_by_search(
    graph: StGraph,
    speed: float,
    limits: DriveLimits,
    wish: float,
    end: float,
    settings: SpeedSettings,
    grid: GridSettings,
    times: FloatArray,
) -> tuple[Side, ...] | None:
    """Search the grid and read the sides off the course found.

    Args:
        graph: Of this cycle.
        speed: Of the ego now [m/s].
        limits: Of the ego.
        wish: Wished speed [m/s].
        end: Not to be passed [m].
        settings: Weights of the cost.
        grid: Number of times and places.
        times: Of the knots [s].

    Returns:
        A side for every vehicle; None if no course is free.
    """
    columns = np.rint(np.linspace(0, times.size - 1, grid.times)).astype(np.int64)
    places = np.linspace(0.0, min(end, limits.speed * times[-1]), grid.places)
    free = free_nodes(
        places, graph.hit[:, columns], graph.lower[:, columns], graph.upper[:, columns]
    )
    weights = CourseWeights(
        settings.distance_weight, settings.speed_weight, settings.acceleration_weight
    )
    course = search(times[columns], places, free, speed, limits, wish, weights)
    if course[-1] < 0:
        return None
    s = np.interp(times, times[columns], places[course])
    sides = []
    for v in range(len(graph.ids)):
        first = int(np.argmax(graph.hit[v]))
        middle = 0.5 * (graph.lower[v, first] + graph.upper[v, first])
        sides.append(Side.BEFORE if s[first] > middle else Side.AFTER)
    return tuple(sides)


@compiled
def free_nodes(
    places: FloatArray, hit: BoolArray, lower: FloatArray, upper: FloatArray
) -> BoolArray:
    """Return which nodes no vehicle covers, (n_times, n_places)."""
    free = np.ones((hit.shape[1], places.size), np.bool_)
    for v in range(hit.shape[0]):
        for k in range(hit.shape[1]):
            if hit[v, k]:
                for i in range(places.size):
                    if lower[v, k] < places[i] < upper[v, k]:
                        free[k, i] = False
    return free


class CourseWeights(NamedTuple):
    """Prices of a course."""

    distance: float  # of the squared deviation from the wished motion [1/m²]
    speed: float  # of the squared deviation from the wished speed [s²/m²]
    acceleration: float  # of the squared acceleration [s⁴/m²]


@compiled
def search(
    times: FloatArray,
    places: FloatArray,
    free: BoolArray,
    speed: float,
    limits: DriveLimits,
    wish: float,
    weights: CourseWeights,
) -> IntArray:
    """Find the cheapest course through the nodes.

    A node keeps the speed with which its best predecessor reached it, so that an edge's
    acceleration is known; this is what makes the search an approximation.

    Args:
        times: Of the nodes, (n_times,) [s].
        places: Of the nodes, evenly spaced, (n_places,) [m].
        free: As `free_nodes` makes it.
        speed: Of the ego now [m/s].
        limits: Of the ego.
        wish: Wished speed [m/s].
        weights: See there.

    Returns:
        Index of the place at each time, (n_times,); the last is -1 if none is free.
    """
    lowest, highest = limits.braking, limits.acceleration
    n_times, n_places = times.size, places.size
    cost = np.full((n_times, n_places), np.inf)
    reached = np.zeros((n_times, n_places))
    came = np.full((n_times, n_places), -1, np.int64)
    cost[0, 0], reached[0, 0] = 0.0, speed
    gap = places[1] - places[0]
    for k in range(1, n_times):
        h = times[k] - times[k - 1]
        span = int(limits.speed * h / gap) + 1
        for i in range(n_places):
            if not free[k, i]:
                continue
            off = places[i] - wish * times[k]
            for j in range(max(i - span, 0), i + 1):
                if cost[k - 1, j] == np.inf:
                    continue
                v1 = (places[i] - places[j]) / h
                a1 = (v1 - reached[k - 1, j]) / h
                if v1 > limits.speed or a1 < lowest - 1.0 or a1 > highest + 1.0:
                    continue
                total = cost[k - 1, j] + h * (
                    weights.distance * off * off
                    + weights.speed * (v1 - wish) ** 2
                    + weights.acceleration * a1 * a1
                )
                if total < cost[k, i]:
                    cost[k, i], reached[k, i], came[k, i] = total, v1, j
    course = np.full(n_times, -1, np.int64)
    best = np.argmin(cost[n_times - 1])
    if cost[n_times - 1, best] == np.inf:
        return course
    course[n_times - 1] = best
    for k in range(n_times - 1, 0, -1):
        course[k - 1] = came[k, course[k]]
    return course
