"""The obstacles of a scenario, listed or drawn, and the room for the ego to start."""

import math
from collections.abc import Iterator
from zlib import crc32

import numpy as np

from experiments.config import Obstacle, RandomObstacles, Scenario
from experiments.config.yaml_reader import KeyPath
from experiments.cosim.road import EgoTask
from experiments.world_setup.bodies_on_road import PlacedBody, obstacles_on_path
from experiments.world_setup.obstacle_field import draw_field
from experiments.world_setup.obstacle_field_course import FieldError
from experiments.world_setup.road import Layout
from planner.scene import Obstacles
from planner.shapes.rectangles import Rectangle, distance
from planner.vehicle import centre_from_rear_axle


def static_bodies(scenario: Scenario, layout: Layout) -> Obstacles:
    """Return the obstacles of a scenario in the plane; see `listed_obstacles`."""
    placed = _placed(listed_obstacles(scenario, layout))
    return obstacles_on_path(layout.road.path, placed)


def listed_obstacles(scenario: Scenario, layout: Layout) -> tuple[Obstacle, ...]:
    """Return the obstacles; random ones and fields are drawn from the scenario's seed.

    Raises:
        ConfigError: If there is no room for the field.
    """
    section = scenario.obstacles
    key = crc32(b"obstacles")  # apart from the streams of the traffic
    rng = np.random.default_rng([scenario.simulation.seed, key])
    if section.random is not None:
        return _draw(section.random, layout.task.goal, rng)
    if section.field is None:
        return section.listed
    try:
        return draw_field(section.field, layout, rng)
    except FieldError as error:
        path = ("obstacles", "field", error.key)
        raise scenario.error(path, error.problem) from error


def _draw(
    section: RandomObstacles, goal: float, rng: np.random.Generator
) -> tuple[Obstacle, ...]:
    """Draw discs from the first place to the goal."""
    drawn = []
    s = section.first_m
    while s <= goal:
        l = rng.uniform(-section.max_offset_m, section.max_offset_m)
        radius = rng.uniform(*section.radius_m)
        if not any(begin <= s <= end for begin, end in section.keep_clear_m):
            drawn.append(
                Obstacle(s_m=round(s, 3), l_m=round(l, 3), radius_m=round(radius, 3))
            )
        s += rng.uniform(*section.spacing_m)
    return tuple(drawn)


def _placed(listed: tuple[Obstacle, ...]) -> list[PlacedBody]:
    """Name the obstacles and give what one shape lacks as 0."""
    return [
        PlacedBody(
            f"obstacle.{number}",
            obstacle.s_m,
            obstacle.l_m,
            length=obstacle.length_m or 0.0,
            width=obstacle.width_m or 0.0,
            radius=obstacle.radius_m or 0.0,
            heading=obstacle.heading_rad,
        )
        for number, obstacle in enumerate(listed)
    ]


def check_on_road(scenario: Scenario, layout: Layout) -> None:
    """Raise if the ego starts over the edge or the end of the road."""
    ego, vehicle = scenario.ego, layout.task.vehicle
    last = layout.road.path.length - vehicle.front_reach
    if ego.start_m > last:
        problem = f"is {ego.start_m:g}; allowed: 0 to {last:.1f}, the front on the road"
        raise scenario.error(("ego", "start_m"), problem)
    left, right = layout.road.bounds.at(np.array([ego.start_m]))
    least = float(right[0]) + vehicle.width / 2.0
    most = float(left[0]) - vehicle.width / 2.0
    if not least <= ego.start_offset_m <= most:
        room = f"{least:.2f} to {most:.2f}" if least <= most else "a wider road"
        raise scenario.error(
            ("ego", "start_offset_m"),
            f"is {ego.start_offset_m:g} at start_m = {ego.start_m:g}; allowed: {room}",
        )


def check_start(scenario: Scenario, layout: Layout) -> None:
    """Raise if an obstacle or a vehicle is where the ego starts."""
    path, vehicle = layout.road.path, layout.task.vehicle
    start = layout.task.state_at_start(path, 0.0)
    centre = centre_from_rear_axle(start, vehicle)
    body = Rectangle(*centre, start.heading, vehicle.length, vehicle.width)
    listed = bool(scenario.obstacles.listed)
    drawn = "random" if scenario.obstacles.random is not None else "field"
    for index, other in enumerate(_rectangles(layout.road.obstacles)):
        key: KeyPath = ("obstacles", drawn, "first_m")
        if distance(body, other) <= 0.0:
            if listed:
                key = ("obstacles", *scenario.obstacles.listed_key, index)
            raise scenario.error(key, _in_the_way("an obstacle", layout.task, other))
    scripted = obstacles_on_path(
        path,
        [
            PlacedBody(f"vehicle.{n}", v.s_m, v.l_m, v.length_m, v.width_m)
            for n, v in enumerate(scenario.vehicles)
        ],
    )
    for index, other in enumerate(_rectangles(scripted)):
        if distance(body, other) <= 0.0:
            problem = _in_the_way("a vehicle", layout.task, other)
            raise scenario.error(("vehicles", index), problem)


def _rectangles(bodies: Obstacles) -> Iterator[Rectangle]:
    """Yield bodies one by one."""
    names = ("x", "y", "heading", "length", "width", "radius")
    for columns in zip(*(getattr(bodies, name) for name in names), strict=True):
        yield Rectangle(*map(float, columns))


def _in_the_way(what: str, task: EgoTask, other: Rectangle) -> str:
    """Return the problem, with the s from which on a body is clear of the ego."""
    start = task.start.s
    size = math.hypot(other.length, other.width) / 2.0 + other.radius
    free = start + task.vehicle.front_reach + size
    return (
        f"{what} stands on the ego, which starts at s = {start:g} m; "
        f"allowed: s_m beyond {free:.1f} m, or aside"
    )
