"""The conventional way to an order: dynamic programming over a grid of the s-T graph.

The method that [Thesis] ch. 6 is compared with: search (t, s) nodes for the cheapest
course around the vehicles, see on which side of each it passes, then solve the program
in that corridor. The grid decides what it can find and what it costs.
"""

import numpy as np

from planner.lane_change.settings import GridSettings, SpeedSettings
from planner.lane_change.speed.passing_orders import Side
from planner.lane_change.speed.st_graph import StGraph
from planner.numerics.compiled import compiled
from planner.states import BoolArray, FloatArray, IntArray


def sides_by_search(
    graph: StGraph,
    start: tuple[float, float, float],
    limits: tuple[float, float, float],
    wish: float,
    end: float,
    settings: SpeedSettings,
    grid: GridSettings,
    times: FloatArray,
) -> tuple[Side, ...] | None:
    """Search the grid and read the sides off the course found.

    Args:
        graph: Of this cycle.
        start: (s, v, a) now.
        limits: Strongest braking (negative), acceleration [m/s²], speed [m/s].
        wish: Wished speed [m/s].
        end: Not to be passed [m].
        settings: Weights of the cost.
        grid: Number of times and places.
        times: Of the knots [s].

    Returns:
        A side for every vehicle; None if no course is free.
    """
    columns = np.rint(np.linspace(0, times.size - 1, grid.times)).astype(np.int64)
    places = np.linspace(0.0, min(end, limits[2] * times[-1]), grid.places)
    course = search(
        times[columns],
        places,
        free_nodes(
            places,
            graph.hit[:, columns],
            graph.lower[:, columns],
            graph.upper[:, columns],
        ),
        start[1],
        limits[0],
        limits[1],
        limits[2],
        wish,
        settings.distance_weight,
        settings.speed_weight,
        settings.acceleration_weight,
    )
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
    """Tell which nodes no vehicle covers, (n_times, n_places)."""
    free = np.ones((hit.shape[1], places.size), np.bool_)
    for v in range(hit.shape[0]):
        for k in range(hit.shape[1]):
            if hit[v, k]:
                for i in range(places.size):
                    if lower[v, k] < places[i] < upper[v, k]:
                        free[k, i] = False
    return free


@compiled
def search(
    times: FloatArray,
    places: FloatArray,
    free: BoolArray,
    speed: float,
    lowest: float,
    highest: float,
    fastest: float,
    wish: float,
    distance_weight: float,
    speed_weight: float,
    acceleration_weight: float,
) -> IntArray:
    """Find the cheapest course through the nodes.

    A node keeps the speed with which its best predecessor reached it, so that an edge's
    acceleration is known; this is what makes the search an approximation.

    Returns:
        Index of the place at each time, (n_times,); the last is -1 if none is free.
    """
    n_times, n_places = times.size, places.size
    cost = np.full((n_times, n_places), np.inf)
    reached = np.zeros((n_times, n_places))
    came = np.full((n_times, n_places), -1, np.int64)
    cost[0, 0], reached[0, 0] = 0.0, speed
    gap = places[1] - places[0]
    for k in range(1, n_times):
        h = times[k] - times[k - 1]
        span = int(fastest * h / gap) + 1
        for i in range(n_places):
            if not free[k, i]:
                continue
            off = places[i] - wish * times[k]
            for j in range(max(i - span, 0), i + 1):
                if cost[k - 1, j] == np.inf:
                    continue
                v1 = (places[i] - places[j]) / h
                a1 = (v1 - reached[k - 1, j]) / h
                if v1 > fastest or a1 < lowest - 1.0 or a1 > highest + 1.0:
                    continue
                total = cost[k - 1, j] + h * (
                    distance_weight * off * off
                    + speed_weight * (v1 - wish) ** 2
                    + acceleration_weight * a1 * a1
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
