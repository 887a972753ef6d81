"""The area that a car on a route may use: its lanes and the junctions between them.

In the lanes of the route's own direction and in the areas of its junctions a body may
be anywhere; oncoming lanes and pavements are left out.
"""

from collections.abc import Iterable, Sequence
from itertools import pairwise

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry
from shapely.ops import substring

from sumo_nets.centre_line import FloatArray
from sumo_nets.join_lanes import change_span
from sumo_nets.lane_choice import LaneUse, via_lanes
from sumo_nets.net_records import Edge, Net, NetLane

# Closes the slits that rounding leaves between lanes and junctions [m].
SEAM = 0.05

# How far the route's first and last lanes are carried on straight [m]: a body whose
# rear axle is at the begin of a route reaches beyond it.
BEYOND = 30.0

# So far into the lanes beside a body may reach: to where it meets nobody, or so that
# it is still seen to be in its own lane [m].
BESIDE = (0.4, 0.9)

# So far over the middle of the road a body may reach first: to where it meets nobody,
# and to where others can still pass if they see it [m].
ACROSS = (0.25, 0.6)

# Corners of the least area.
CORNERS = 3


def drivable_area(net: Net, uses: Sequence[LaneUse]) -> BaseGeometry:
    """Unite the lanes and junctions of a route.

    Args:
        net: The network.
        uses: The route, edge by edge.

    Returns:
        A polygon or several [m].

    Raises:
        NetworkError: If the shape of a lane or junction is damaged.
    """
    edges = [use.entered.edge for use in uses]
    parts = [_strip(lane) for edge in edges for lane in edge.drivable_lanes]
    parts += [_carried_on(uses[0].entered, 0), _carried_on(uses[-1].left, -1)]
    for use, following in pairwise(uses):
        if use.link is None:
            continue
        inside = via_lanes(net, use.link)
        parts += [_strip(lane) for lane in inside]
        chain = [use.left, *inside, following.entered]
        parts += [_joint(before, after) for before, after in pairwise(chain)]
        parts.append(_junction(net, use.left.edge, following.entered.edge))
    grown = [part.buffer(SEAM, join_style="mitre") for part in parts]
    return shapely.union_all(grown)


def narrower_areas(
    net: Net, uses: Sequence[LaneUse], area: BaseGeometry
) -> tuple[BaseGeometry, ...]:
    """Leave out of an area what others use who drive beside the route.

    These are the other lanes of its edges, its own lanes where its line is not on them,
    and the lanes that lead from there over a junction to the same edge: two who turn
    side by side each keep to their own lane, and nobody waits at a line across two.

    Args:
        net: The network.
        uses: The route, edge by edge.
        area: Of the route.

    Returns:
        Polygons, the narrowest first: without others' lanes; with all of the junctions;
        with strips of the other lanes, too. Empty where nobody drives beside.
    """
    own: list[BaseGeometry] = []
    beside: list[BaseGeometry] = []
    turning: list[BaseGeometry] = []
    for use in uses:
        lanes = use.entered.edge.drivable_lanes
        own += _used_parts(use)
        if len(lanes) > 1:
            beside += [_strip(lane) for lane in lanes]  # the own one is added again
        if use.link is None:
            continue
        own += [_strip(lane) for lane in via_lanes(net, use.link)]
        for link in use.left.edge.links_to(use.link.target.edge):
            if link.source is not use.left:
                turning += [_strip(lane) for lane in via_lanes(net, link)]
    if not beside:
        return ()
    kept = [_without(area, others, own) for others in (beside + turning, beside)]
    return (*kept, *(kept[1].buffer(reach).intersection(area) for reach in BESIDE))


def wider_areas(
    net: Net, uses: Sequence[LaneUse], area: BaseGeometry
) -> tuple[BaseGeometry, ...]:
    """Add the oncoming lanes of a route's roads to its area.

    Where no body can take a bend in its own lanes, drivers swing out over the middle
    of the road.

    Args:
        net: The network.
        uses: The route, edge by edge.
        area: Of the route.

    Returns:
        Polygons, the widest last; empty on a one-way route.
    """
    oncoming = []
    for use in uses:
        edge = use.entered.edge
        back = [
            x for x in net.at(edge.start) if (x.start, x.end) == (edge.end, edge.start)
        ]
        oncoming += [_strip(lane) for x in back for lane in x.drivable_lanes]
    if not oncoming:
        return ()
    grown = [part.buffer(SEAM, join_style="mitre") for part in oncoming]
    whole = shapely.union_all([area, *grown])
    return (*(area.buffer(reach).intersection(whole) for reach in ACROSS), whole)


def _without(
    area: BaseGeometry, others: Sequence[BaseGeometry], own: Sequence[BaseGeometry]
) -> BaseGeometry:
    """Leave others' lanes out of an area, but not where they are the route's too."""
    kept = area.difference(shapely.union_all(others))
    grown = [part.buffer(SEAM, join_style="mitre") for part in (kept, *own)]
    return shapely.union_all(grown).intersection(area)


def boundary_about(area: BaseGeometry, points: FloatArray, reach: float) -> FloatArray:
    """List the sides of an area about some points.

    The area is cut to a box, whose sides count as well.

    Args:
        area: Polygons.
        points: (n, 2) [m].
        reach: From the points to the box [m].

    Returns:
        Sides as x, y of both ends, (k, 4) [m].
    """
    low, high = points.min(axis=0) - reach, points.max(axis=0) + reach
    cut = area.intersection(shapely.box(*low, *high))
    rings = [
        np.asarray(ring.coords)
        for part in _polygons(cut)
        for ring in (part.exterior, *part.interiors)
    ]
    sides = [np.hstack([ring[:-1], ring[1:]]) for ring in rings]
    return np.concatenate(sides) if sides else np.empty((0, 4))


def _polygons(shape: BaseGeometry) -> Iterable[shapely.Polygon]:
    """List the polygons of any geometry."""
    for part in getattr(shape, "geoms", (shape,)):
        if isinstance(part, shapely.Polygon) and not part.is_empty:
            yield part


def _used_parts(use: LaneUse) -> list[BaseGeometry]:
    """Spread the lanes of one edge that the route's line is on, only as far as it is.

    A lane that the line has left is somebody else's: before a turn at the edge's end
    nobody swings out over it.
    """
    if use.entered is use.left:
        return [_strip(use.left)]
    low, high = sorted((use.entered.index, use.left.index))
    length = float(np.hypot(*np.diff(use.left.points, axis=0).T).sum())
    if length == 0.0:
        return []  # damaged: whoever makes the line says so
    begin, end = change_span(length, high - low)
    parts = []
    for lane in use.entered.edge.drivable_lanes:
        if low <= lane.index <= high:
            first = 0.0 if lane is use.entered else begin / length
            last = 1.0 if lane is use.left else end / length
            parts.append(_strip(lane, (first, last)))
    return parts


def _strip(lane: NetLane, share: tuple[float, float] = (0.0, 1.0)) -> BaseGeometry:
    """Spread a lane over its width; a lane without length has no area.

    Args:
        lane: The lane.
        share: From where to where along it, as shares of its length.
    """
    points = lane.points
    if len(np.unique(points, axis=0)) < CORNERS - 1:
        return shapely.Polygon()
    line = substring(shapely.LineString(points), *share, normalized=True)
    return line.buffer(lane.width / 2.0, cap_style="flat", join_style="mitre")


def _carried_on(lane: NetLane, end: int) -> BaseGeometry:
    """Carry all lanes of an edge straight on at one end (0 or -1)."""
    parts = []
    for beside in lane.edge.drivable_lanes:
        points = beside.points
        if len(points) < CORNERS - 1:
            continue
        tip, before = points[end], points[1 if end == 0 else -2]
        ahead = (tip - before) / max(float(np.hypot(*(tip - before))), SEAM)
        line = shapely.LineString([tip, tip + BEYOND * ahead])
        parts.append(line.buffer(beside.width / 2.0, cap_style="flat"))
    return shapely.union_all(parts)


def _joint(before: NetLane, after: NetLane) -> BaseGeometry:
    """Span from the end of a lane to the begin of the next: they may not touch."""
    corners = [*_end(before, -1), *_end(after, 0)]
    hull: BaseGeometry = shapely.MultiPoint(corners).convex_hull
    return hull


def _end(lane: NetLane, end: int) -> list[FloatArray]:
    """Place the two corners of a lane at one end (0 or -1)."""
    points = lane.points
    tip = points[end]
    lengths = np.hypot(*(points - tip).T)
    apart = np.flatnonzero(lengths > SEAM)
    if not apart.size:
        return [tip]
    ahead = points[apart[0 if end == 0 else -1]] - tip
    across = 0.5 * lane.width * np.array([-ahead[1], ahead[0]]) / np.hypot(*ahead)
    return [tip + across, tip - across]


def _junction(net: Net, edge: Edge, following: Edge) -> BaseGeometry:
    """Take the junction's area without what others of its roads have for themselves."""
    junction = net.junctions.get(edge.end)
    outline = junction.outline if junction is not None else np.empty((0, 2))
    if len(outline) < CORNERS:
        return shapely.Polygon()
    whole = shapely.Polygon(outline).buffer(0.0)
    own = {edge.id, following.id}
    others = [
        _strip(x)
        for other in net.at(edge.end)
        if other.id not in own
        for x in other.lanes
    ]
    return whole.difference(shapely.union_all(others + _pavements(net, edge.end)))


def _pavements(net: Net, junction: str) -> list[BaseGeometry]:
    """List the areas of a junction that are for people on foot."""
    areas = [
        lane.points
        for edge in net.edges.values()
        if edge.function == "walkingarea" and edge.id.startswith(f":{junction}_w")
        for lane in edge.lanes
    ]
    kept = [shapely.Polygon(x).buffer(0.0) for x in areas if len(x) >= CORNERS]
    return list(kept)


def distances_to_edge(
    area: BaseGeometry, points: FloatArray, directions: FloatArray, farthest: float
) -> FloatArray:
    """Measure from points along directions to where an area ends.

    Args:
        area: Polygons.
        points: (n, 2) [m].
        directions: Unit vectors, (n, 2).
        farthest: No distance is larger [m].

    Returns:
        (n,) [m]; 0 for points outside.
    """
    rays = shapely.linestrings(np.stack([points, points + farthest * directions], 1))
    places = shapely.points(points)
    shapely.prepare(area)
    hits = shapely.intersection(rays, area.boundary)
    gaps = shapely.distance(places, hits)  # nan without a hit
    gaps = np.where(np.isnan(gaps), farthest, gaps)
    return np.asarray(np.where(shapely.covers(area, places), gaps, 0.0))
