"""From a scenario to a road with obstacles, before anything moves on it."""

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from zlib import crc32

import numpy as np
from numpy.typing import NDArray

from experiments.config import Ego, Obstacle, RandomObstacles, Scenario
from experiments.config.road import Road
from experiments.config.yaml_reader import KeyPath
from experiments.cosim.kinematic_world import constant_road
from experiments.cosim.scene_builder import state_on_path
from experiments.cosim.sumo.obstacle_vehicles import PlacedBody, obstacles_on_path
from experiments.world_setup.driven_path import DrivenPath, driven_path
from experiments.world_setup.obstacle_field import draw_field
from experiments.world_setup.obstacle_field_course import FieldError, Ground
from experiments.world_setup.road_bounds import road_bounds
from planner.errors import PlannerError
from planner.reference_path.path import ReferencePath
from planner.reference_path.segments import Segment, arc, clothoid, line
from planner.scene import Lanes, Obstacles, RoadBounds
from planner.shapes.rectangles import Rectangle, distance
from planner.states import FloatArray
from planner.vehicle import Vehicle, VehicleLimits
from sumo_nets import catalogue
from sumo_nets.catalogue import Network
from sumo_nets.errors import NetworkError
from sumo_nets.route_path import RoutePath, StopLine, route_path

# A catalogue's exact line and its built net may differ by so much before it is stale.
MAX_DEVIATION = 0.25  # [m]

_SEGMENTS: Mapping[str, Callable[..., Segment]] = {
    "line": line,
    "arc": arc,
    "clothoid": clothoid,
}


@dataclass(frozen=True, slots=True, eq=False)
class Layout:
    """A road before anything moves on it."""

    path: ReferencePath
    road: RoadBounds
    obstacles: Obstacles
    stop_lines: tuple[StopLine, ...] = ()
    network: Network | None = None  # of world sumo
    lanes: Lanes = field(default_factory=Lanes.none)


def make_vehicle(ego: Ego) -> Vehicle:
    """Make the planner's vehicle from its section."""
    body = ego.vehicle
    limits = body.limits
    return Vehicle(
        body.length_m,
        body.width_m,
        body.wheelbase_m,
        body.rear_overhang_m,
        VehicleLimits(
            limits.max_speed_mps,
            limits.max_acceleration_mps2,
            limits.max_deceleration_mps2,
            limits.emergency_deceleration_mps2,
            limits.max_lateral_acceleration_mps2,
            limits.max_curvature_1pm,
        ),
    )


def make_layout(scenario: Scenario) -> Layout:
    """Lay the road out and put the obstacles on it.

    Raises:
        ConfigError: If the network, its route or lane is none, something lies beyond
            the road, or an obstacle stands where the ego starts.
    """
    try:
        bare = _sumo_road(scenario) if scenario.world == "sumo" else _plain(scenario)
    except NetworkError as error:
        raise scenario.error(("network",), str(error)) from error
    except PlannerError as error:
        section = "network" if scenario.world == "sumo" else "road"
        raise scenario.error((section,), str(error)) from error
    beyond = scenario.beyond(bare.path.length)
    if beyond is not None:
        raise scenario.error(*beyond)
    _check_on_road(scenario, bare)
    obstacles = obstacles_on_path(bare.path, _placed(listed_obstacles(scenario, bare)))
    _check_start(scenario, bare.path, obstacles)
    return replace(bare, obstacles=obstacles)


def listed_obstacles(scenario: Scenario, bare: Layout) -> tuple[Obstacle, ...]:
    """Give the obstacles; random ones and fields are drawn from the scenario's seed.

    Raises:
        ConfigError: If there is no room for the field.
    """
    section = scenario.obstacles
    key = crc32(b"obstacles")  # apart from the streams of the traffic
    rng = np.random.default_rng([scenario.simulation.seed, key])
    if section.random is not None:
        return _draw(section.random, scenario.ego.goal_m, rng)
    if section.field is None:
        return section.listed
    ego = scenario.ego
    ground = Ground(
        bare.path,
        bare.road,
        make_vehicle(ego),
        ego.start_m,
        ego.start_offset_m,
        ego.goal_m,
    )
    try:
        return draw_field(section.field, ground, rng)
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


def _check_on_road(scenario: Scenario, bare: Layout) -> None:
    """Refuse an ego that starts over the edge or the end of the road."""
    ego, vehicle = scenario.ego, make_vehicle(scenario.ego)
    last = bare.path.length - vehicle.front_reach
    if ego.start_m > last:
        problem = f"is {ego.start_m:g}; allowed: 0 to {last:.1f}, the front on the road"
        raise scenario.error(("ego", "start_m"), problem)
    left, right = bare.road.at(np.array([ego.start_m]))
    least = float(right[0]) + vehicle.width / 2.0
    most = float(left[0]) - vehicle.width / 2.0
    if not least <= ego.start_offset_m <= most:
        room = f"{least:.2f} to {most:.2f}" if least <= most else "a wider road"
        raise scenario.error(
            ("ego", "start_offset_m"),
            f"is {ego.start_offset_m:g} at start_m = {ego.start_m:g}; allowed: {room}",
        )


def _check_start(scenario: Scenario, path: ReferencePath, obstacles: Obstacles) -> None:
    """Refuse an obstacle or a vehicle where the ego starts."""
    ego, vehicle = scenario.ego, make_vehicle(scenario.ego)
    start = state_on_path(path, ego.start_m, ego.start_offset_m, 0.0)
    reach = vehicle.centre_offset
    body = Rectangle(
        start.x + reach * math.cos(start.heading),
        start.y + reach * math.sin(start.heading),
        start.heading,
        vehicle.length,
        vehicle.width,
    )
    listed = bool(scenario.obstacles.listed)
    drawn = "random" if scenario.obstacles.random is not None else "field"
    for index, other in enumerate(_rectangles(obstacles)):
        key: KeyPath = ("obstacles", drawn, "first_m")
        if distance(body, other) <= 0.0:
            key = ("obstacles", index) if listed else key
            raise scenario.error(key, _in_the_way("an obstacle", scenario, other))
    scripted = obstacles_on_path(
        path,
        [
            PlacedBody(f"vehicle.{n}", v.s_m, v.l_m, v.length_m, v.width_m)
            for n, v in enumerate(scenario.vehicles)
        ],
    )
    for index, other in enumerate(_rectangles(scripted)):
        if distance(body, other) <= 0.0:
            problem = _in_the_way("a vehicle", scenario, other)
            raise scenario.error(("vehicles", index), problem)


def _rectangles(bodies: Obstacles) -> Iterator[Rectangle]:
    """Give bodies one by one."""
    names = ("x", "y", "heading", "length", "width", "radius")
    for columns in zip(*(getattr(bodies, name) for name in names), strict=True):
        yield Rectangle(*map(float, columns))


def _in_the_way(what: str, scenario: Scenario, other: Rectangle) -> str:
    """Say from which s on a body is surely clear of the ego's front."""
    ego = scenario.ego
    size = math.hypot(other.length, other.width) / 2.0 + other.radius
    free = ego.start_m + make_vehicle(ego).front_reach + size
    return (
        f"{what} stands on the ego, which starts at s = {ego.start_m:g} m; "
        f"allowed: s_m beyond {free:.1f} m, or aside"
    )


def _plain(scenario: Scenario) -> Layout:
    """Build the road of the kinematic world."""
    road = scenario.road
    if road is None:
        raise scenario.error(("road",), "is missing")
    segments = [_SEGMENTS[kind](*numbers) for kind, *numbers in road.segments]
    path = ReferencePath.from_segments(segments)
    bounds = constant_road(path, road.half_width_m)
    return Layout(path, bounds, Obstacles.none(), lanes=_plain_lanes(road))


def _plain_lanes(road: Road) -> Lanes:
    """Put the lanes of a kinematic road side by side about its path."""
    if road.lanes is None:
        return Lanes.none()
    count, width = road.lanes.count, road.lanes.width_m
    centres = width * (np.arange(count, dtype=np.float64) - (count - 1) / 2.0)
    return Lanes(np.zeros(1), centres[:, None], np.full((count, 1), width))


def _sumo_road(scenario: Scenario) -> Layout:
    """Read the road of a SUMO network."""
    choice = scenario.network
    if choice is None:
        raise scenario.error(("network",), "is missing")
    if choice.file is None:
        network = catalogue.network(choice.name or "")
    else:
        route, lane = choice.route or (), choice.lane or 0
        network = Network.from_file(choice.file, route, lane)
    found = route_path(network.net_file, network.route, network.lane)
    vehicle = make_vehicle(scenario.ego)
    driven = _driven_path(network, found, vehicle)
    path = driven.path
    s, l = path.project(found.points[:, 0], found.points[:, 1], near=driven.near)
    stop_lines = tuple(
        StopLine(stop.signal, stop.link, float(np.interp(stop.s, found.s, s)))
        for stop in found.stop_lines
    )
    kept = _growing(s)
    edges = RoadBounds(s[kept], (found.left + l)[kept], (found.right + l)[kept])
    road = road_bounds(found, driven, edges, vehicle)
    lanes = _lanes(found, s, l)
    return Layout(path, road, Obstacles.none(), stop_lines, network, lanes)


def _lanes(found: RoutePath, s: FloatArray, l: FloatArray) -> Lanes:
    """Place the lanes of the route's edges on the reference path.

    Lanes are told apart by their place beside the one that the route follows; where
    one is missing its width is 0. Inside junctions there are no markings: lanes go
    straight over from one edge to the next.
    """
    spans = [span for span in found.spans if not span.lane.startswith(":")]
    n_right = max((sum(x < 0.0 for x in span.lines) for span in spans), default=0)
    n_left = max((sum(x > 0.0 for x in span.lines) for span in spans), default=0)
    at, centres, widths = [], [], []
    for k in np.flatnonzero(_growing(s)):
        span = next((x for x in spans if x.begin <= found.s[k] <= x.end), None)
        if span is None:
            continue
        edges = span.edges_at(float(found.left[k]))
        own = sum(x < 0.0 for x in span.lines)
        centre = np.zeros(n_right + 1 + n_left)
        width = np.zeros(centre.size)
        first = n_right - own
        there = slice(first, first + edges.size - 1)
        centre[there] = 0.5 * (edges[1:] + edges[:-1])
        width[there] = np.diff(edges)
        centre[:first] = edges[0] - np.arange(first, 0, -1.0)
        beyond = centre.size - there.stop
        centre[there.stop :] = edges[-1] + np.arange(1.0, beyond + 1.0)
        at.append(s[k])
        centres.append(centre + l[k])
        widths.append(width)
    if not at:
        return Lanes.none()
    return Lanes(np.array(at), np.array(centres).T, np.array(widths).T)


def _driven_path(network: Network, found: RoutePath, vehicle: Vehicle) -> DrivenPath:
    """Smooth the points of the route; a road of the catalogue must lie on its line.

    The exact line of a catalogue road would do no good: its curvature jumps where a
    line meets an arc, and beside the line a speed would jump with it.
    """
    try:
        driven = driven_path(found, vehicle)
    except NetworkError as error:
        raise NetworkError(f"{network.net_file}: {error}") from error
    if network.segments:
        first, second = found.points[0], found.points[1]
        heading = math.atan2(second[1] - first[1], second[0] - first[0])
        segments = [_exact_segment(segment) for segment in network.segments]
        exact = ReferencePath.from_segments(
            segments, (float(first[0]), float(first[1]), heading)
        )
        _, l = exact.project(found.points[:, 0], found.points[:, 1], near=found.s)
        if np.abs(l).max() > MAX_DEVIATION:
            raise NetworkError(
                f"{network.net_file}: is {np.abs(l).max():.2f} m off its exact line; "
                "rebuild it with make nets"
            )
    return driven


def _exact_segment(segment: tuple[str, float, float, float]) -> Segment:
    """Turn a segment of the catalogue into one of the planner."""
    kind, length, begin, end = segment
    if kind == "line":
        return line(length)
    return arc(length, begin) if kind == "arc" else clothoid(length, begin, end)


def _growing(s: FloatArray) -> NDArray[np.bool_]:
    """Mark the values that exceed all before them."""
    before = np.concatenate(([-np.inf], np.maximum.accumulate(s)[:-1]))
    return np.asarray(s > before + 1e-6)
