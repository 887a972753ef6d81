"""Where on the ego's path the movements of others come into its way."""

import math

import numpy as np
import shapely

from experiments.cosim.junctions import (
    ConflictZone,
    CrossingZone,
    RoadJunction,
    Swing,
)
from experiments.world_setup.driven_path import DrivenPath
from experiments.world_setup.long_vehicles import LONG, LongWay
from experiments.world_setup.path_stretches import body_polygons
from experiments.world_setup.waiting_places import MOST_SHORT, waiting_place
from planner.reference_path.body_in_area import body_outline, outline_points
from planner.reference_path.path import ReferencePath
from planner.right_of_way.records import JunctionAhead, Rule
from planner.states import BoolArray, FloatArray, IntArray
from planner.vehicle import Vehicle
from sumo_nets.net_records import Link
from sumo_nets.right_of_way import CrossedPavement, FoeMovement, Passage
from sumo_nets.route_path import JunctionSpan, RoutePath

SPACING = 0.25  # of the places that are looked at [m]
HALF_WIDTH = 1.25  # of other vehicles: lorries and their mirrors [m]
MARGIN = 0.3  # between two bodies that just miss each other [m]
ON_FOOT = 1.0  # from the ego's side to where somebody on foot is out of its way [m]
PAST_LINE = 0.5  # an ego that waits at its line is not on the crossing behind it [m]
ENDS = 2  # of a line
SWEPT_MARGIN = 0.1  # between the ego and a long vehicle that just misses it [m]
LONG_FROM = 7.0  # vehicles of this length cut corners [m]
BEYOND = 2.0  # behind a junction where paths still lie close to each other [m]
COMFORTABLE = 2.2  # lateral acceleration in a turn [m/s²]
OUTSIDE = 0.25  # over the edge of its lanes a body meets nobody [m]
APART = 3.0  # two stretches outside its lanes are one if they are nearer [m]
BEFORE = 1.0  # the ego waits so far before it would leave its lanes [m]
FASTEST = 60.0  # through a junction without a bend [m/s]


def road_junctions(
    found: RoutePath, path: ReferencePath, s: FloatArray, vehicle: Vehicle
) -> tuple[RoadJunction, ...]:
    """Find the conflict zones of all junctions on a route.

    Args:
        found: The route.
        path: As the ego drives it.
        s: Where the route's points lie on the path, (n,) [m].
        vehicle: The ego.

    Returns:
        The junctions where paths come nearer to each other than the bodies are wide,
        or where people on foot cross.
    """
    junctions = [_junction(span, found, path, s, vehicle) for span in found.junctions]
    return tuple(x for x in junctions if x.zones or x.crossings)


def _junction(
    span: JunctionSpan,
    found: RoutePath,
    path: ReferencePath,
    s: FloatArray,
    vehicle: Vehicle,
) -> RoadJunction:
    """Find the conflict zones of one junction."""
    begin, end, inside = (
        float(x) for x in np.interp([span.begin, span.end, span.first_end], found.s, s)
    )
    lane = max((x.begin for x in found.spans if x.begin < span.begin), default=0.0)
    lane = float(np.interp(lane, found.s, s))
    at = np.arange(begin, min(end + BEYOND, path.length), SPACING)
    places = path.at(at)
    points = np.column_stack([places.x, places.y])
    reach = vehicle.width / 2.0 + HALF_WIDTH + MARGIN
    link = span.passage.link
    zones = [_zone(foe, link, at, points, reach) for foe in span.passage.foes]
    zones += [_swept_zone(x, begin, end, path, vehicle) for x in span.passage.beside]
    sharpest = float(np.abs(places.curvature[at <= end]).max(initial=0.0))
    junction = JunctionAhead(
        id=span.passage.junction,
        rule=_rule(span.passage),
        stop_s=waiting_place(
            (lane, begin),
            span.passage.turning,
            found.areas.between(span.begin, span.begin).own,
            path,
            vehicle,
        ),
        exit_s=end,
        speed=min(math.sqrt(COMFORTABLE / max(sharpest, 1e-6)), FASTEST),
        wait_s=inside if span.passage.may_wait_inside else None,
    )
    there = tuple(zone for zone in zones if zone is not None)
    on_foot = [
        _crossing(each, begin, at, points, vehicle) for each in span.passage.crossings
    ]
    crossings = tuple(zone for zone in on_foot if zone is not None)
    return RoadJunction(
        junction, there, link.signal, link.signal_link, crossings=crossings
    )


def _rule(passage: Passage) -> Rule:
    """Return the right of way of the ego at a junction."""
    if not passage.regulated:
        return Rule.MINOR
    state = passage.link.state
    return Rule(state) if state in set(Rule) else Rule.MAJOR


def _crossing(
    crossed: CrossedPavement,
    stop: float,
    at: FloatArray,
    points: FloatArray,
    vehicle: Vehicle,
) -> CrossingZone | None:
    """Find where people on a crossing and the ego come near each other.

    Args:
        crossed: The crossing.
        stop: The ego's line [m].
        at: Arc lengths on the ego's path, (n,) [m].
        points: The path there, (n, 2) [m].
        vehicle: The ego.
    """
    if len(crossed.lane.points) < ENDS:
        return None
    line = shapely.LineString(crossed.lane.points)
    reach = 0.5 * vehicle.width + ON_FOOT
    area = line.buffer(0.5 * crossed.lane.width, cap_style="flat").buffer(MARGIN)
    shapely.prepare(area)
    own = at[shapely.intersects_xy(area, points)]
    if not own.size:
        return None
    along = np.arange(0.0, line.length + SPACING, SPACING)
    places = shapely.get_coordinates(shapely.line_interpolate_point(line, along))
    gap = np.linalg.norm(places[:, None, :] - points[None, :, :], axis=-1)
    theirs = along[gap.min(axis=1) < reach]
    if not theirs.size:
        return None
    return CrossingZone(
        edge=crossed.lane.edge.id,
        corners=crossed.corners,
        line=crossed.lane.points,
        begin_s=max(float(own[0]), stop + PAST_LINE),
        end_s=float(own[-1]),
        entry=float(theirs[0]),
        exit=float(theirs[-1]),
        goes_first=crossed.goes_first,
        gives_way=crossed.gives_way,
        signal=crossed.signal,
        signal_link=crossed.signal_link,
    )


def _zone(
    foe: FoeMovement, own_link: Link, at: FloatArray, points: FloatArray, reach: float
) -> ConflictZone | None:
    """Find where one movement and the ego's come near each other.

    Args:
        foe: The movement.
        own_link: The ego's movement.
        at: Arc lengths on the ego's path, (n,) [m].
        points: The path there, (n, 2) [m].
        reach: Distance of the centre lines at which the bodies touch [m].
    """
    along, line = _line(foe)
    distance = np.linalg.norm(points[:, None, :] - line[None, :, :], axis=-1)
    own = at[distance.min(axis=1) < reach]
    if not own.size:
        return None
    theirs = along[distance.min(axis=0) < reach]
    begins, place = [], 0.0
    for lane in foe.inside:
        begins.append((lane.id, place))
        place += lane.length
    link = foe.link
    return ConflictZone(
        source=link.source.id,
        source_edge=link.source.edge.id,
        target_edge=link.target.edge.id,
        inside=tuple(begins),
        begin_s=float(own[0]),
        end_s=float(own[-1]),
        entry=float(theirs[0]),
        exit=float(theirs[-1]),
        limit=link.source.speed,
        turn_speed=min(lane.speed for lane in foe.inside),
        merges=link.target is own_link.target,
        goes_first=foe.goes_first,
        gives_way=foe.gives_way,
        signal=link.signal,
        signal_link=link.signal_link,
    )


def _swept_zone(
    other: FoeMovement,
    begin: float,
    end: float,
    path: ReferencePath,
    vehicle: Vehicle,
) -> ConflictZone | None:
    """Find where long vehicles sweep over the ego's way, though ways do not meet.

    Nobody waits for the ego there, so that it waits for them.

    Args:
        other: A movement beside the route.
        begin: Of the junction on the ego's path [m].
        end: Of the junction [m].
        path: Of the ego.
        vehicle: The ego.
    """
    link = other.link
    way = LongWay.along(link.source, other.inside, link.target)
    if way is None or not other.inside:
        return None
    first = begin - MOST_SHORT - vehicle.front_reach
    at = np.arange(max(first, 0.0), min(end, path.length), 2 * SPACING)
    egos = body_polygons(path, at, vehicle)
    meets = shapely.distance(egos, shapely.union_all(way.bodies)) < SWEPT_MARGIN
    if not meets.any():
        return None
    own = at[meets]
    ego = shapely.union_all(egos[meets])
    fronts = way.fronts[shapely.distance(way.bodies, ego) < SWEPT_MARGIN]
    places = np.cumsum([0.0, *(lane.length for lane in other.inside)])
    scale = float(places[-1]) / max(way.end - way.begin, SPACING)  # SUMO's by drawn
    return ConflictZone(
        source=link.source.id,
        source_edge=link.source.edge.id,
        target_edge=link.target.edge.id,
        inside=tuple(
            (lane.id, float(x)) for lane, x in zip(other.inside, places, strict=False)
        ),
        begin_s=float(own[0]) + vehicle.front_reach,
        end_s=float(own[-1]) - vehicle.rear_overhang,
        entry=scale * float(fronts[0]),
        exit=scale * (float(fronts[-1]) - LONG),
        limit=link.source.speed,
        turn_speed=min(lane.speed for lane in other.inside),
        merges=False,
        goes_first=True,
        gives_way=False,
        signal=link.signal,
        signal_link=link.signal_link,
        shortest=LONG_FROM,
    )


def _line(foe: FoeMovement) -> tuple[FloatArray, FloatArray]:
    """Return a movement's centre line from where its vehicles wait.

    Returns:
        Distances (m,) as SUMO counts them, and points (m, 2) [m].
    """
    parts: list[FloatArray] = []
    lengths: list[FloatArray] = []
    place = 0.0
    for lane, longest in [
        *((lane, math.inf) for lane in foe.inside),
        (foe.link.target, BEYOND),
    ]:
        points = lane.points
        line = shapely.LineString(points) if len(points) > 1 else None
        if line is None or line.length <= 0.0:
            continue
        drawn = min(line.length, longest)
        steps = np.linspace(0.0, drawn, max(math.ceil(drawn / SPACING), 1) + 1)
        parts.append(
            shapely.get_coordinates(shapely.line_interpolate_point(line, steps))
        )
        lengths.append(place + steps * (lane.length / line.length))
        place += lane.length
    return np.concatenate(lengths), np.concatenate(parts)


def swings(
    found: RoutePath, driven: DrivenPath, s_found: FloatArray, vehicle: Vehicle
) -> tuple[RoadJunction, ...]:
    """Find where the ego's body leaves the lanes of its route for oncoming ones.

    Where that is in a junction or just behind one, the ego waits before the junction:
    inside it would stand in the way of everybody.

    Args:
        found: The route.
        driven: The ego's path.
        s_found: Where the route's points lie on the path, (n,) [m].
        vehicle: The ego.
    """
    path = driven.path
    out = []
    for stretch in driven.planned:
        begin, end = (float(x) for x in np.interp(stretch, s_found, found.s))
        area = found.areas.between(begin, end).own.buffer(OUTSIDE)
        shapely.prepare(area)
        s = np.arange(stretch.begin, stretch.end, 2.0 * SPACING)
        at = path.at(s)
        x, y = outline_points(at.x, at.y, at.heading, body_outline(vehicle, 0.0))
        outside = ~shapely.contains_xy(area, x, y)
        there = outside.any(axis=1)
        if not there.any():
            continue
        parts = [
            Swing(
                float(s[part[0]]) + 0.5 * vehicle.front_reach,
                float(s[part[-1]]),
                np.column_stack([x[part][outside[part]], y[part][outside[part]]]),
            )
            for part in _parts(there, s)
        ]
        sharpest = float(np.abs(at.curvature[there]).max())
        ahead = JunctionAhead(
            id="oncoming",
            rule=Rule.MINOR,
            stop_s=_before_junctions(
                max(parts[0].begin_s - BEFORE, 0.0), found, s_found, vehicle
            ),
            exit_s=parts[-1].end_s,
            speed=min(math.sqrt(COMFORTABLE / max(sharpest, 1e-6)), FASTEST),
        )
        out.append(RoadJunction(ahead, (), "", 0, swings=tuple(parts)))
    return tuple(out)


def _before_junctions(
    stop: float, found: RoutePath, s: FloatArray, vehicle: Vehicle
) -> float:
    """Move a place where the ego waits to before the junction that it would block.

    Args:
        stop: Of its front bumper [m].
        found: The route.
        s: Where the route's points lie on the path, (n,) [m].
        vehicle: The ego.
    """
    for span in reversed(found.junctions):
        begin, end = (float(x) for x in np.interp([span.begin, span.end], found.s, s))
        if begin < stop < end + vehicle.length:
            stop = begin
    return stop


def _parts(there: BoolArray, s: FloatArray) -> list[IntArray]:
    """Split the places that are marked into those that are apart, as rows.

    Args:
        there: Marks, (n,).
        s: Arc lengths of the places, growing, (n,) [m].
    """
    rows = np.flatnonzero(there)
    return np.split(rows, np.flatnonzero(np.diff(s[rows]) > APART) + 1)
