"""The road of a scenario: from its segments, or from a SUMO network."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from experiments.commonroad.records import CommonRoadScenario
from experiments.config import Scenario
from experiments.config.road import KinematicRoad
from experiments.cosim.kinematic_world import constant_bounds
from experiments.cosim.replay_world import Replay
from experiments.cosim.road import EgoTask, Road
from experiments.world_setup.conflict_zones import road_junctions, swings
from experiments.world_setup.driven_path import DrivenPath, NoPathError, driven_path
from experiments.world_setup.road_bounds import road_bounds
from experiments.world_setup.road_lanes import growing, route_lanes
from planner.reference_path.path import ReferencePath
from planner.reference_path.segments import Segment, arc, clothoid, line
from planner.scene import Lanes, RoadBounds, SpeedLimits
from planner.states import FloatArray
from planner.vehicle import Vehicle
from sumo_nets.errors import NetworkError
from sumo_nets.network import Network
from sumo_nets.route_path import RoutePath, StopLine, route_path

# A catalogue's exact line and its built net may differ by so much before it is stale.
MAX_DEVIATION = 0.25  # [m]
BEYOND_GOAL = 30.0  # a route that is drawn goes on behind the goal [m]

ENTRY_ROOM = 0.5  # from a junction to the front of an ego that enters [m]


_SEGMENTS: Mapping[str, Callable[..., Segment]] = {
    "line": line,
    "arc": arc,
    "clothoid": clothoid,
}


@dataclass(frozen=True, slots=True, eq=False)
class Layout:
    """A road and the ego's task on it, before anything moves."""

    road: Road
    task: EgoTask
    network: Network | None = None  # of world sumo
    replay: Replay | None = None  # of world commonroad
    lanelets: CommonRoadScenario | None = None  # the file of world commonroad


def plain_road(scenario: Scenario) -> Road:
    """Build the road of the kinematic world."""
    road = scenario.road
    if road is None:
        raise scenario.error(("road",), "is missing")
    segments = [_SEGMENTS[kind](*numbers) for kind, *numbers in road.segments]
    path = ReferencePath.from_segments(segments)
    bounds = constant_bounds(path, road.half_width_m)
    return Road(path, bounds, _plain_lanes(road))


def _plain_lanes(road: KinematicRoad) -> Lanes:
    """Return the lanes of a kinematic road, side by side about its path."""
    if road.lanes is None:
        return Lanes.none()
    count, width = road.lanes.count, road.lanes.width_m
    centres = width * (np.arange(count, dtype=np.float64) - (count - 1) / 2.0)
    return Lanes(np.zeros(1), centres[:, None], np.full((count, 1), width))


def sumo_road(
    network: Network,
    vehicle: Vehicle,
    start: float | None = None,
    goal: float | None = None,
) -> Road:
    """Read the road of a SUMO network.

    Args:
        network: With the route.
        vehicle: The ego, whose path it is.
        start: Where it enters, unless that is not known yet [m].
        goal: Where it has arrived; what it cannot drive of the route beyond is left
            out [m].

    Raises:
        NetworkError: If the network, its route or lane does not exist, or the vehicle
            cannot take one of its bends or would enter inside a junction.
    """
    try:
        return _whole_road(network, vehicle, start)
    except NetworkError:
        route = network.route[:-1]
        while goal is not None and route:
            length = route_path(network.net_file, route, network.lane).length
            if length < goal + vehicle.front_reach + BEYOND_GOAL:
                break
            try:
                return _whole_road(replace(network, route=route), vehicle, start)
            except NetworkError:
                route = route[:-1]
        raise


def _whole_road(network: Network, vehicle: Vehicle, start: float | None) -> Road:
    """Read the road along the whole route of `network`; see `sumo_road`."""
    found = route_path(network.net_file, network.route, network.lane)
    driven = _driven_path(network, found, vehicle)
    path = driven.path
    s, l = path.project(found.points[:, 0], found.points[:, 1], near=driven.near)
    if start is not None:
        _check_entry(network, found, s, start + vehicle.front_reach)
    stop_lines = tuple(
        StopLine(stop.signal, stop.link, float(np.interp(stop.s, found.s, s)))
        for stop in found.stop_lines
    )
    kept = growing(s)
    edges = RoadBounds(s[kept], (found.left + l)[kept], (found.right + l)[kept])
    bounds = road_bounds(found, driven, edges, vehicle)
    lanes, limits = route_lanes(found, s, l), _speed_limits(found, s)
    junctions = road_junctions(found, path, s, vehicle)
    junctions += swings(found, driven, s, vehicle)
    return Road(
        path, bounds, lanes, stop_lines, speed_limits=limits, junctions=junctions
    )


def _check_entry(
    network: Network, found: RoutePath, s: FloatArray, front: float
) -> None:
    """Raise unless the ego's front bumper is on an edge where it enters."""
    for span in found.spans:
        begin, end = np.interp([span.begin, span.end], found.s, s)
        if span.lane.startswith(":") and begin < front < end:
            raise NetworkError(
                f"{network.net_file}: the ego's front, at s = {front:.1f} m, is inside "
                f'a junction (lane "{span.lane}") where it enters: '
                f"take ego.start_m {front - begin + ENTRY_ROOM:.1f} m less, or "
                f"{end - front + ENTRY_ROOM:.1f} m more"
            )


def _speed_limits(found: RoutePath, s: FloatArray) -> SpeedLimits:
    """Return the limits of the route's edges along the reference path.

    In junctions the last one goes on: the speeds of the lanes inside are not limits
    but what their curvature allows.
    """
    begins, limits = [0.0], [math.inf]
    for span in found.spans:
        begin = float(np.interp(span.begin, found.s, s))
        if span.lane.startswith(":") or span.speed_limit == limits[-1]:
            continue
        if begin > begins[-1]:
            begins.append(begin)
            limits.append(span.speed_limit)
        else:
            limits[-1] = span.speed_limit
    return SpeedLimits(np.array(begins), np.array(limits))


def _driven_path(network: Network, found: RoutePath, vehicle: Vehicle) -> DrivenPath:
    """Smooth the points of the route; a road of the catalogue must lie on its line.

    The exact line of a catalogue road itself is not used: its curvature jumps where a
    line meets an arc, and beside the line a speed would jump with it.
    """
    try:
        driven = driven_path(found, vehicle)
    except NoPathError as error:
        raise NoPathError(f"{network.net_file}: {error}", error.lane) from error
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
