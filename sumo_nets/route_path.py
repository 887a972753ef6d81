"""The way of the ego through any SUMO network as points, road edges and stop lines.

Plain arrays: whoever needs a smooth reference path fits it to the points.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np

from sumo_nets.centre_line import FloatArray
from sumo_nets.errors import NetworkError
from sumo_nets.join_lanes import Piece, blend, densify, resample, stitch
from sumo_nets.lane_choice import LaneUse, choose_lanes, via_lanes
from sumo_nets.net_reader import read_net
from sumo_nets.net_records import Net, NetLane
from sumo_nets.right_of_way import Passage, passages
from sumo_nets.route_areas import AreasOfEdges, RouteAreas
from sumo_nets.route_check import check_route

# Largest distance of neighbouring points [m].
SPACING = 1.0

# A link without a lane inside the junction must bridge no more than this [m].
BRIDGED = 0.5


@dataclass(frozen=True, slots=True)
class StopLine:
    """A stop line at traffic lights on the route."""

    signal: str  # SUMO's id of the traffic light
    link: int  # place in the light's state string
    s: float  # arc length along the points [m]


@dataclass(frozen=True, slots=True, eq=False)
class JunctionSpan:
    """A junction on the route where it meets other movements; arc lengths [m]."""

    passage: Passage
    begin: float  # end of the lane before it, where vehicles wait
    end: float  # begin of the lane behind it
    first_end: float  # end of its first lane inside, where vehicles may wait


@dataclass(frozen=True, slots=True)
class LaneSpan:
    """A stretch of the route on one edge, or on one lane inside a junction.

    The lane is the one the stretch is left on. `lines` are the lane markings that lie
    inside the carriageway, relative to the lane's centre line, right to left [m]; so
    are `left` and `right`, the edges of the carriageway. `speed_limit` is that of cars.
    """

    lane: str
    begin: float  # arc length [m]
    end: float  # [m]
    lines: tuple[float, ...]
    speed_limit: float  # [m/s]
    left: float  # [m]
    right: float  # [m]
    moved: float = 0.0  # `left` at the begin, where the lane is another one, less it
    onward: tuple[bool, ...] = ()  # lanes, right to left, that go on beside the route's
    changed: int = 0  # lanes by which the route moves over to the left
    # of each lane, right to left, whether it may not be left to the left, to the right
    solid: tuple[tuple[bool, bool], ...] = ()

    def edges_at(self, left: float) -> FloatArray:
        """Return the edges of all lanes where the carriageway's left edge is `left`.

        Between two lanes the route's line moves over, and the edges with it.
        """
        low, high = min(self.moved, 0.0), max(self.moved, 0.0)
        shift = min(max(left - self.left, low), high)
        return np.array([self.right, *self.lines, self.left]) + shift


@dataclass(frozen=True, slots=True, eq=False)
class RoutePath:
    """A route's centre line and its road; arrays are (n,), `points` is (n, 2).

    `left` and `right` are the edges of the carriageway as lateral offsets from the
    points: left > 0 > right. Only lanes in the route's direction that cars may use
    count. Inside junctions the edges are interpolated.
    """

    points: FloatArray  # x, y [m], at most SPACING apart
    s: FloatArray  # arc length along the points [m]
    left: FloatArray  # [m]
    right: FloatArray  # [m]
    stop_lines: tuple[StopLine, ...]
    spans: tuple[LaneSpan, ...]
    areas: RouteAreas  # where a body may be
    left_hand: bool = False  # whether traffic keeps to the left
    junctions: tuple[JunctionSpan, ...] = ()

    @property
    def lanes(self) -> tuple[str, ...]:
        """NetLane ids in driving order, those inside junctions too."""
        return tuple(span.lane for span in self.spans)

    @property
    def length(self) -> float:
        """Length of the polyline [m]."""
        return float(self.s[-1])


def route_path(net_file: str | Path, route: Sequence[str], lane: int) -> RoutePath:
    """Find the centre line of a route and the road about it.

    Lanes are chosen so that they are connected, keep to index `lane` and change as
    seldom as possible; where a change is needed, the line moves over smoothly.

    Args:
        net_file: The .net.xml.
        route: Edge ids.
        lane: Wanted lane; 0 is the rightmost.

    Raises:
        NetworkError: If the network is damaged or the route does not run through it.
    """
    path = Path(net_file)
    net = read_net(path)
    check_route(net, route, lane)
    uses = choose_lanes(net, route, lane)
    try:
        pieces, limits = _pieces(net, uses)
    except NetworkError as error:
        message = str(error)
        if str(path) not in message:
            message = f"{path}: {message}"
        raise NetworkError(message) from error
    line = stitch([densify(piece, SPACING) for piece in pieces])
    if line.ends[-1] <= 0.0:
        raise NetworkError(f"{path}: route {' '.join(route)} has no length")
    ends = pairwise((0.0, *line.ends))
    edges = [k for k, piece in enumerate(pieces) if not piece.name.startswith(":")]
    onward = {k: _onward(use) for k, use in zip(edges, uses, strict=True)}
    changed = {
        k: use.left.index - use.entered.index
        for k, use in zip(edges, uses, strict=True)
    }
    solid = {k: _solid_lines(use) for k, use in zip(edges, uses, strict=True)}
    if net.left_hand:  # lane 0 is the leftmost
        solid = {k: tuple((b, a) for a, b in x[::-1]) for k, x in solid.items()}
        onward = {k: lanes[::-1] for k, lanes in onward.items()}
        changed = {k: -lanes for k, lanes in changed.items()}
    spans = tuple(
        LaneSpan(
            piece.name,
            begin,
            end,
            piece.lines,
            limit,
            float(piece.left[-1]),
            float(piece.right[-1]),
            float(piece.left[0] - piece.left[-1]),
            onward.get(number, ()),
            changed.get(number, 0),
            solid.get(number, ()),
        )
        for number, (piece, (begin, end), limit) in enumerate(
            zip(pieces, ends, limits, strict=True)
        )
    )
    columns = (line.points, line.s, line.left, line.right)
    for column in columns:
        column.setflags(write=False)
    stop_lines = _stop_lines(uses, spans)
    junctions = _junctions(passages(net, uses), spans)
    begins = [spans[k].begin for k in edges]
    areas = AreasOfEdges(net, uses, begins)
    return RoutePath(*columns, stop_lines, spans, areas, net.left_hand, junctions)


def _pieces(net: Net, uses: Sequence[LaneUse]) -> tuple[list[Piece], list[float]]:
    """Convert the uses of edges and the junctions between them into pieces and limits.

    A lane inside a junction may be a single point: it is left out.
    """
    left_hand = net.left_hand
    pieces, limits = [_edge_piece(uses[0], left_hand)], [uses[0].left.speed]
    for use, following in pairwise(uses):
        onward = _edge_piece(following, left_hand)
        inside = () if use.link is None else via_lanes(net, use.link)
        _check_bridged(use, inside, following)
        inside = tuple(lane for lane in inside if len(_shape(lane)) > 1)
        before = (pieces[-1].left[-1], pieces[-1].right[-1])
        after = (onward.left[0], onward.right[0])
        lengths = [lane.length for lane in inside]
        done = np.concatenate(([0.0], np.cumsum(lengths))) / max(sum(lengths), 1e-9)
        for number, lane in enumerate(inside):
            points = _shape(lane)
            share = done[number] + (done[number + 1] - done[number]) * _fractions(
                points
            )
            left = (1.0 - share) * before[0] + share * after[0]
            right = (1.0 - share) * before[1] + share * after[1]
            pieces.append(Piece(lane.id, points, left, right, ()))
            limits.append(lane.speed)
        pieces.append(onward)
        limits.append(following.left.speed)
    return pieces, limits


def _check_bridged(use: LaneUse, inside: Sequence[NetLane], following: LaneUse) -> None:
    """Refuse a junction that has no lanes inside: its vehicles would jump over it."""
    begin, end = use.left.points[-1], following.entered.points[0]
    gap = float(np.hypot(*(end - begin)))
    if not inside and gap > BRIDGED:
        raise NetworkError(
            f'no lane leads over junction "{use.left.edge.end}", {gap:.1f} m from '
            f'"{use.left.id}" to "{following.entered.id}": the network has no internal '
            "links; build it by netconvert without --no-internal-links"
        )


def _edge_piece(use: LaneUse, left_hand: bool) -> Piece:  # noqa: FBT001
    """Return the line on one edge, blended where the lane is changed."""
    ends = []
    for lane in (use.entered, use.left):
        left, right, lines = _carriageway(lane, left_hand)
        points = _shape(lane)
        count = len(points)
        if count == 1:
            raise NetworkError(f'lane "{lane.id}" has no length')
        ends.append(
            Piece(lane.id, points, np.full(count, left), np.full(count, right), lines)
        )
    if use.entered is use.left:
        return ends[1]
    lanes = abs(use.entered.index - use.left.index)
    first, second = (resample(piece, SPACING, ends[0]) for piece in ends)
    return blend(first, second, lanes)


def _carriageway(
    lane: NetLane,
    left_hand: bool,  # noqa: FBT001 - a property of the network
) -> tuple[float, float, tuple[float, ...]]:
    """Measure the road about a lane: left edge, right edge, lines between [m]."""
    own = lane.index
    beside = _beside(lane)
    inner, kerb = 0.5 * lane.width, -0.5 * lane.width
    edges = [kerb, inner]
    for other in beside:
        if other.index > own:
            inner += other.width
            edges.append(inner)
    for other in reversed(beside):
        if other.index < own:
            kerb -= other.width
            edges.append(kerb)
    if left_hand:  # lane 0 is the leftmost
        inner, kerb, edges = -kerb, -inner, [-edge for edge in edges]
    return inner, kerb, tuple(sorted(edges)[1:-1])


def _beside(lane: NetLane) -> list[NetLane]:
    """List the lanes for cars about a lane, itself included, up to the first gap."""
    lanes = {item.index: item for item in lane.edge.drivable_lanes}
    first = last = lane.index
    while first - 1 in lanes:
        first -= 1
    while last + 1 in lanes:
        last += 1
    return [lanes[index] for index in range(first, last + 1)]


def _onward(use: LaneUse) -> tuple[bool, ...]:
    """Tell which lanes lead over the junction beside the route's, by index."""
    beside, link = _beside(use.left), use.link
    if link is None:
        return (True,) * len(beside)
    aside = link.target.index - link.source.index
    return tuple(
        any(
            other.target.edge is link.target.edge
            and other.target.index == lane.index + aside
            and other.target.drivable
            for other in lane.links
        )
        for lane in beside
    )


def _solid_lines(use: LaneUse) -> tuple[tuple[bool, bool], ...]:
    """Tell of the lanes beside the route's which lines may not be crossed, by index.

    Returns:
        Whether a lane may not be left to the next index, and to the one before.
    """
    return tuple((not x.leads_up, not x.leads_down) for x in _beside(use.left))


def _shape(lane: NetLane) -> FloatArray:
    """Return the centre line of a lane without points that repeat, (n, 2)."""
    points = lane.points
    kept = np.ones(len(points), dtype=bool)
    kept[1:] = np.any(np.diff(points, axis=0) != 0.0, axis=1)
    return points[kept]


def _fractions(points: FloatArray) -> FloatArray:
    """Give the share of the length that lies behind each point, (n,)."""
    lengths = np.linalg.norm(np.diff(points, axis=0), axis=1)
    done = np.concatenate(([0.0], np.cumsum(lengths)))
    return np.asarray(done / max(float(done[-1]), 1e-9))


def _stop_lines(
    uses: Sequence[LaneUse], spans: Sequence[LaneSpan]
) -> tuple[StopLine, ...]:
    """Find the stop lines: ends of lanes whose connection has a signal."""
    # A route may return to a lane, so lanes are distinguished by their order.
    ends = [span.end for span in spans if not span.lane.startswith(":")]
    return tuple(
        StopLine(use.link.signal, use.link.signal_link, end)
        for use, end in zip(uses, ends, strict=True)
        if use.link is not None and use.link.signal
    )


def _junctions(
    met: Sequence[Passage | None], spans: Sequence[LaneSpan]
) -> tuple[JunctionSpan, ...]:
    """Find where on the route its junctions lie; one `met` per edge but the last."""
    edges = [n for n, span in enumerate(spans) if not span.lane.startswith(":")]
    found = []
    for passage, (first, second) in zip(met, pairwise(edges), strict=True):
        if passage is not None:
            begin, end = spans[first].end, spans[second].begin
            inside = spans[first + 1].end if second - first > 1 else end
            found.append(JunctionSpan(passage, begin, end, inside))
    return tuple(found)
