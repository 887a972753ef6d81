"""Reads obstacles: those that stand, and those that were recorded or predicted."""

import math
from collections.abc import Mapping, Sequence
from typing import Final

import numpy as np
import shapely

from experiments.commonroad.records import Box, Lanelet, MovingObstacle
from experiments.commonroad.shapes import (
    body_box,
    box_along,
    placed,
    read_area,
    read_boxes,
    shape_nodes,
    smallest_box,
)
from experiments.commonroad.states import ObstacleState, read_obstacle_state, read_step
from experiments.commonroad.xml_tree import Node
from planner.states import FloatArray

MOST_STEPS: Final = 200_000  # of one obstacle
MOVES: Final = 0.5  # an area that moves more slowly has no direction [m/s]
_Row = tuple[float, float, float, float, float, float, float, float]


def read_static(
    root: Node, lanelets: Mapping[int, Lanelet]
) -> tuple[tuple[str, Box], ...]:
    """Read what stands: static obstacles and those of the environment."""
    bodies: list[tuple[str, Box]] = []
    for node in root.all("staticObstacle"):
        state = read_obstacle_state(node.need("initialState"), lanelets)
        for shape in shape_nodes(node.need("shape")):
            for box in read_boxes(shape):
                own = placed(box, state.x, state.y, state.heading)
                grown = own._replace(radius=own.radius + state.reach)
                bodies.append((str(node.key()), grown))
    for node in root.all("environmentObstacle"):
        for shape in shape_nodes(node.need("shape")):
            bodies += [(str(node.key()), box) for box in read_boxes(shape)]
    return tuple(bodies)


def read_moving(
    root: Node, lanelets: Mapping[int, Lanelet], step: float
) -> tuple[MovingObstacle, ...]:
    """Read recorded and predicted road users.

    Args:
        root: Of the file.
        lanelets: By id.
        step: Of the file [s].
    """
    found = []
    for node in root.all("dynamicObstacle", "phantomObstacle"):
        states = _states(node, lanelets)
        areas = _occupancies(node)
        rows = _rows_of_states(node, states, step) if states else {}
        if areas:
            heading = states[-1].heading if states else None
            rows.update(_rows_of_areas(areas, heading, step))
        if not rows:
            raise node.error("is never anywhere: it has no state")
        kind = node.child("type")
        first, table = _filled(node, rows)
        name = "phantom" if kind is None else kind.text
        found.append(MovingObstacle(str(node.key()), name, first, table))
    return tuple(found)


def _states(node: Node, lanelets: Mapping[int, Lanelet]) -> list[ObstacleState]:
    """Read the states of an obstacle in the order of time."""
    trajectory = node.child("trajectory")
    nodes = list(node.all("initialState"))
    nodes += [] if trajectory is None else list(trajectory.all("state"))
    by_step = {x.step: x for x in (read_obstacle_state(n, lanelets) for n in nodes)}
    return [by_step[step] for step in sorted(by_step)]


def _occupancies(node: Node) -> dict[int, shapely.Geometry]:
    """Read the areas that an obstacle occupies, by step."""
    areas = {}
    for group in node.all("occupancySet"):
        for occupancy in group.all("occupancy"):
            shapes = shape_nodes(occupancy.need("shape"))
            area = shapely.union_all([read_area(shape) for shape in shapes])
            areas[read_step(occupancy)] = area
    return areas


def _rows_of_states(
    node: Node, states: Sequence[ObstacleState], step: float
) -> dict[int, _Row]:
    """Turn states into rows of a table, by step."""
    box = body_box(node.need("shape"))
    time = step * np.array([state.step for state in states])
    x = np.array([state.x for state in states])
    y = np.array([state.y for state in states])
    heading = np.unwrap([state.heading for state in states])
    along = _rate(x, time) * np.cos(heading) + _rate(y, time) * np.sin(heading)
    speed = _known([state.speed for state in states], along)
    rates = _rate(speed, time)
    acceleration = _known([state.acceleration for state in states], rates)
    rows: dict[int, _Row] = {}
    for k, state in enumerate(states):
        own = placed(box, state.x, state.y, float(heading[k]))
        # a recorded speed below 0 is of a vehicle that rolls back
        rows[state.step] = (
            own.x,
            own.y,
            own.heading,
            max(float(speed[k]), 0.0),
            float(acceleration[k]),
            0.0,
            own.length + 2.0 * state.reach,
            own.width + 2.0 * state.reach,
        )
    return rows


def _known(given: Sequence[float | None], otherwise: FloatArray) -> FloatArray:
    """Take what is given, and other numbers where nothing is."""
    numbers = np.array([math.nan if x is None else x for x in given])
    return np.where(np.isnan(numbers), otherwise, numbers)


def _rate(values: FloatArray, time: FloatArray) -> FloatArray:
    """Return the change of values in time, (n,); 0 of a single value."""
    if values.size == 1:
        return np.zeros(1)
    return np.asarray(np.gradient(values, time))


def _rows_of_areas(
    areas: Mapping[int, shapely.Geometry], heading: float | None, step: float
) -> dict[int, _Row]:
    """Put a rectangle about each area, in the direction in which the areas move."""
    steps = sorted(areas)
    time = step * np.array(steps)
    centroids = [areas[number].centroid for number in steps]
    middles = np.array([(middle.x, middle.y) for middle in centroids])
    pace = np.column_stack([_rate(axis, time) for axis in middles.T])
    speed = np.hypot(*pace.T)
    turned = smallest_box(areas[steps[0]]).heading if heading is None else heading
    rows: dict[int, _Row] = {}
    for k, number in enumerate(steps):
        if speed[k] > MOVES:
            turned = math.atan2(float(pace[k, 1]), float(pace[k, 0]))
        box = box_along(areas[number], turned)
        place = (box.x, box.y, box.heading, float(speed[k]), 0.0, 0.0)
        rows[number] = (*place, box.length, box.width)
    return rows


def _filled(node: Node, rows: Mapping[int, _Row]) -> tuple[int, FloatArray]:
    """Put rows into a table without gaps; returns (first step, (8, n))."""
    steps = sorted(rows)
    first, last = steps[0], steps[-1]
    if last - first >= MOST_STEPS:
        problem = f"lasts {last - first} steps; allowed: less than {MOST_STEPS}"
        raise node.error(problem)
    table = np.array([rows[step] for step in steps]).T
    table[2] = np.unwrap(table[2])
    every = np.arange(first, last + 1)
    filled = np.array([np.interp(every, steps, row) for row in table])
    filled[2] = np.arctan2(np.sin(filled[2]), np.cos(filled[2]))
    return first, filled
