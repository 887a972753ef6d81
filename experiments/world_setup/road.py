"""The road of a scenario: from its segments, or from a SUMO network."""

import logging
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import NamedTuple
from zlib import crc32

import numpy as np
from numpy.typing import NDArray

from experiments.commonroad.records import CommonRoadScenario
from experiments.config import Ego, Scenario
from experiments.config.road import KinematicRoad
from experiments.cosim.kinematic_world import constant_bounds
from experiments.cosim.replay_world import Replay
from experiments.cosim.road import EgoTask, Road
from experiments.world_setup.conflict_zones import road_junctions, swings
from experiments.world_setup.demand_files import taken_vehicle
from experiments.world_setup.driven_path import DrivenPath, NoPathError, driven_path
from experiments.world_setup.road_bounds import road_bounds
from planner.errors import PlannerError
from planner.reference_path.path import ReferencePath
from planner.reference_path.segments import Segment, arc, clothoid, line
from planner.scene import Lanes, RoadBounds, SpeedLimits
from planner.states import BoolArray, FloatArray
from planner.vehicle import Vehicle
from sumo_nets import catalogue
from sumo_nets.catalogue import Network
from sumo_nets.errors import NetworkError
from sumo_nets.lane_choice import choose_lanes, replaced_start, via_lanes
from sumo_nets.map_files import is_map, missing_parts, network_of_map
from sumo_nets.net_reader import Net, check_route, read_net
from sumo_nets.route_path import LaneSpan, RoutePath, StopLine, route_path
from sumo_nets.routes import fastest_route, random_route

# A catalogue's exact line and its built net may differ by so much before it is stale.
MAX_DEVIATION = 0.25  # [m]

DRAWN = 12  # random routes that are tried ...
DRAWN_AT_MOST = 200  # ... of those drawn that avoid bends found to be impossible
ENTRY_ROOM = 0.5  # from a junction to the front of an ego that enters [m]
FRONT_ROOM = 2.0  # before the ego on the first edge of a random route [m]
DRAWN_APART = 0.15  # of the path from its lane as drawn, from which it counts [m]
FARTHEST_APART = 1.2  # by which lanes beside the path are drawn apart from it [m]
BESIDE_PATH = 1.6  # from the line of the route, a lane is another one [m]
SEAM = 0.01  # behind the end of an edge other lanes than the onward ones are gone [m]
BEYOND_GOAL = 30.0  # a random route goes on behind the goal [m]

log = logging.getLogger(__name__)

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


def scenario_network(scenario: Scenario) -> Network:
    """Return the network of the scenario.

    Raises:
        ConfigError: If the scenario has none.
        NetworkError: If the network, its route or lane does not exist.
    """
    choice = scenario.network
    if choice is None:
        raise scenario.error(("network",), "is missing")
    if choice.file is None:
        return catalogue.network(choice.name or "")
    net = read_net(_network_file(Path(choice.file)))
    taken = taken_vehicle(scenario, net)
    if taken is not None:
        return _of_route(net, taken.route, choice.lane)
    if choice.route is not None:
        return _of_route(net, choice.route, choice.lane)
    if choice.from_ is not None and choice.to is not None:
        places = (choice.from_, *(choice.via or ()), choice.to)
        return _of_route(net, fastest_route(net, places), choice.lane)
    return random_network(net, scenario.simulation.seed, scenario.ego)


def _network_file(file: Path) -> Path:
    """Return the network of a file; a map is converted, and what is lost is told."""
    if not is_map(file):
        return file
    converted = network_of_map(file)
    for lost in missing_parts(file, read_net(converted)):
        log.warning("%s", lost)
    return converted


def _of_route(net: Net, route: Sequence[str], lane: int | None) -> Network:
    """Return a network with a route; without a lane from the first one for cars.

    Where the route begins in another lane than the one asked for, the log says why.
    """
    check_route(net, route, lane)
    if lane is None:
        lane = net.edges[route[0]].drivable_lanes[0].index
    else:
        replaced = replaced_start(net, route, lane)
        if replaced is not None:
            log.warning("%s", replaced)
    return Network.from_file(net.file, route, lane)


def random_network(net: Net, seed: int, ego: Ego) -> Network:
    """Draw routes until the ego can drive one.

    Args:
        net: The network.
        seed: The same seed draws the same route.
        ego: Its goal is on the route.

    Raises:
        NetworkError: If there is no route, or the ego can drive none of those drawn.
    """
    rng = np.random.default_rng([seed, crc32(b"route")])
    vehicle = ego.vehicle.to_planner()
    first = ego.start_m + vehicle.front_reach + FRONT_ROOM
    refused, impossible, tried = "", set[str](), 0
    for _ in range(DRAWN_AT_MOST):
        route = random_route(net, rng, ego.goal + BEYOND_GOAL, first)
        try:
            network = _of_route(net, route, None)
            if impossible and not impossible.isdisjoint(_lanes_of(net, network)):
                continue
            tried += 1
            sumo_road(network, vehicle, ego.start_m)
        except NoPathError as error:
            refused = str(error)
            impossible.add(error.lane)
        except (NetworkError, PlannerError) as error:
            refused = str(error)
        else:
            return network
        if tried >= DRAWN:
            break
    raise NetworkError(
        f"{net.file}: the ego can drive none of {tried} random routes; the last one: "
        f"{refused.removeprefix(f'{net.file}: ')}"
    )


def _lanes_of(net: Net, network: Network) -> set[str]:
    """List the lanes of a route, those inside junctions too."""
    uses = choose_lanes(net, network.route, network.lane)
    inside = [x for use in uses if use.link for x in via_lanes(net, use.link)]
    edges = [lane for use in uses for lane in (use.entered, use.left)]
    return {lane.id for lane in (*inside, *edges)}


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
    kept = _growing(s)
    edges = RoadBounds(s[kept], (found.left + l)[kept], (found.right + l)[kept])
    bounds = road_bounds(found, driven, edges, vehicle)
    lanes, limits = _lanes(found, s, l), _speed_limits(found, s)
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


def _lanes(found: RoutePath, s: FloatArray, l: FloatArray) -> Lanes:
    """Return the lanes of the route's edges along the reference path.

    A lane goes on from edge to edge as its connections lead, beside that of the route;
    where the route moves over to the next lane, the path leaves its lane for another.
    Where a lane is missing its width is 0. Inside junctions there are no markings:
    lanes that lead over it beside the route's are interpolated from one edge to the
    next, the others are missing. Where the path is not where its lane is drawn, as in
    tight bends, it is the middle of its lane all the same: a vehicle can follow it.
    """
    spans = [span for span in found.spans if not span.lane.startswith(":")]
    firsts, count = _first_lanes(spans)
    planned = bool(np.abs(l).max() > DRAWN_APART)
    if planned:
        l = np.clip(l, -FARTHEST_APART, FARTHEST_APART)
    kept = np.flatnonzero(_growing(s))
    rows: list[_LaneRow] = []
    before = -1  # place of the span of the last row
    for k in kept:
        here = _span_at(spans, float(found.s[k]), before)
        if here is None:
            continue
        row = _lane_row(spans[here], float(found.left[k]), firsts[here], count)
        row = row.moved(float(s[k]), float(l[k]), on_path=planned)
        if here != before and before >= 0:
            rows += _over_junction(rows[-1], row, spans[before], firsts[before])
        if not rows or row.s > rows[-1].s:
            rows.append(row)
        before = here
    if not rows:
        return Lanes.none()
    at, centre, width, solid = zip(*rows, strict=True)
    lines = np.array(solid)
    return Lanes(
        np.array(at),
        np.array(centre).T,
        np.array(width).T,
        found.left_hand,
        lines[:, :, 0].T,
        lines[:, :, 1].T,
    )


def _first_lanes(spans: Sequence[LaneSpan]) -> tuple[list[int], int]:
    """Number the rightmost lane of each edge, and count all lanes of the route."""
    own = np.cumsum([span.changed for span in spans]).astype(int)
    right = own - [sum(x < 0.0 for x in span.lines) for span in spans]
    left = own + [sum(x > 0.0 for x in span.lines) for span in spans]
    lowest = int(right.min(initial=0)) if right.size else 0
    highest = int(left.max(initial=0)) if left.size else 0
    return (right - lowest).tolist(), highest - lowest + 1


class _LaneRow(NamedTuple):
    """The lanes at one place, right to left."""

    s: float  # [m]
    centre: FloatArray  # (n_lanes,) [m]
    width: FloatArray  # [m]
    solid: BoolArray  # may not be left to the left, to the right, (n_lanes, 2)

    def moved(self, s: float, l: float, *, on_path: bool) -> "_LaneRow":
        """Return the same lanes at `s`, and `l` to the left.

        With `on_path` the lane of the route stays on its line.
        """
        share = np.ones(self.centre.size)
        if on_path:
            share = np.minimum(np.abs(self.centre) / BESIDE_PATH, 1.0)
        return _LaneRow(s, self.centre + share * l, self.width, self.solid)


def _span_at(spans: Sequence[LaneSpan], at: float, first: int) -> int | None:
    """Find the edge at an arc length, from the edge `first` on; None in junctions."""
    numbers = range(max(first, 0), len(spans))
    return next((k for k in numbers if spans[k].begin <= at <= spans[k].end), None)


def _lane_row(span: LaneSpan, left: float, first: int, count: int) -> _LaneRow:
    """Return the lanes of an edge whose carriageway's left edge is `left`.

    Args:
        span: The edge.
        left: At the place [m].
        first: Number of the edge's rightmost lane.
        count: Of all lanes of the route.
    """
    edges = span.edges_at(left)
    centre, width = np.zeros(count), np.zeros(count)
    there = slice(first, first + edges.size - 1)
    centre[there] = 0.5 * (edges[1:] + edges[:-1])
    width[there] = np.diff(edges)
    centre[:first] = edges[0] - np.arange(first, 0, -1.0)
    beyond = centre.size - there.stop
    centre[there.stop :] = edges[-1] + np.arange(1.0, beyond + 1.0)
    solid = np.zeros((count, 2), dtype=bool)
    if len(span.solid) == edges.size - 1:
        solid[there] = span.solid
    return _LaneRow(0.0, centre, width, solid)


def _over_junction(
    last: _LaneRow, following: _LaneRow, span: LaneSpan, first: int
) -> list[_LaneRow]:
    """Return rows inside a junction, where the lanes that do not lead on are missing.

    Args:
        last: Lanes of the edge before.
        following: Lanes of the edge behind the junction.
        span: Of the edge before.
        first: Number of its rightmost lane.
    """
    onward = np.zeros(last.width.size, dtype=bool)
    onward[first : first + len(span.onward)] = span.onward
    begin, end = last.s + SEAM, following.s - SEAM
    if onward.all() or end <= begin:
        return []
    return [
        _LaneRow(at, row.centre, np.where(onward, row.width, 0.0), row.solid)
        for at, row in ((begin, last), (end, following))
    ]


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


def _growing(s: FloatArray) -> NDArray[np.bool_]:
    """Mark the values that exceed all before them."""
    before = np.concatenate(([-np.inf], np.maximum.accumulate(s)[:-1]))
    return np.asarray(s > before + 1e-6)
