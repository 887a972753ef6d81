"""The way of the ego through any SUMO network as points, road edges and stop lines.

Plain arrays: whoever needs a smooth reference path fits it to the points.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from sumo_nets.centre_line import FloatArray
from sumo_nets.errors import NetworkError
from sumo_nets.join_lanes import Piece, blend, densify, resample, stitch
from sumo_nets.lane_choice import LaneUse, choose_lanes, via_lanes
from sumo_nets.net_reader import check_route, drivable_lanes, read_net

# Largest distance of neighbouring points [m].
SPACING = 1.0

# Length over which the line moves one lane over [m].
CHANGE_LENGTH = 50.0


@dataclass(frozen=True, slots=True)
class StopLine:
    """A stop line at traffic lights on the route."""

    signal: str  # SUMO's id of the traffic light
    link: int  # place in the light's state string
    s: float  # arc length along the points [m]


@dataclass(frozen=True, slots=True)
class LaneSpan:
    """A stretch of the route on one edge, or on one lane inside a junction.

    The lane is the one the stretch is left on. `lines` are the lane markings that lie
    inside the carriageway, relative to the lane's centre line, right to left [m].
    """

    lane: str
    begin: float  # arc length [m]
    end: float  # [m]
    lines: tuple[float, ...]


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

    @property
    def lanes(self) -> tuple[str, ...]:
        """Lane ids in driving order, those inside junctions too."""
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
    check_route(net, path, route, lane)
    uses = choose_lanes(net, route, lane)
    pieces = _pieces(net, uses)
    line = stitch([densify(piece, SPACING) for piece in pieces])
    if line.ends[-1] <= 0.0:
        raise NetworkError(f"{path}: route {' '.join(route)} has no length")
    spans = tuple(
        LaneSpan(piece.name, begin, end, piece.lines)
        for piece, begin, end in zip(pieces, (0.0, *line.ends), line.ends, strict=False)
    )
    columns = (line.points, line.s, line.left, line.right)
    for column in columns:
        column.setflags(write=False)
    return RoutePath(*columns, stop_lines=_stop_lines(uses, spans), spans=spans)


def _pieces(net: Any, uses: Sequence[LaneUse]) -> list[Piece]:
    """Convert the uses of edges and the junctions between them into pieces."""
    pieces: list[Piece] = []
    for place, use in enumerate(uses):
        pieces.append(_edge_piece(use))
        if use.link is None:
            continue
        inside = via_lanes(net, use.link)
        onward = _edge_piece(uses[place + 1])
        before = (pieces[-1].left[-1], pieces[-1].right[-1])
        after = (onward.left[0], onward.right[0])
        lengths = [lane.getLength() for lane in inside]
        done = np.concatenate(([0.0], np.cumsum(lengths))) / max(sum(lengths), 1e-9)
        for number, lane in enumerate(inside):
            points = _shape(lane)
            share = done[number] + (done[number + 1] - done[number]) * _fractions(
                points
            )
            left = (1.0 - share) * before[0] + share * after[0]
            right = (1.0 - share) * before[1] + share * after[1]
            pieces.append(Piece(lane.getID(), points, left, right, ()))
    return pieces


def _edge_piece(use: LaneUse) -> Piece:
    """Return the line on one edge, blended where the lane is changed."""
    ends = []
    for lane in (use.entered, use.left):
        left, right, lines = _carriageway(lane)
        points = _shape(lane)
        count = len(points)
        ends.append(
            Piece(
                lane.getID(), points, np.full(count, left), np.full(count, right), lines
            )
        )
    if use.entered is use.left:
        return ends[1]
    lanes = abs(use.entered.getIndex() - use.left.getIndex())
    first, second = (resample(piece, SPACING, ends[0]) for piece in ends)
    return blend(first, second, CHANGE_LENGTH * lanes)


def _carriageway(lane: Any) -> tuple[float, float, tuple[float, ...]]:
    """Measure the road about a lane: left edge, right edge, lines between [m]."""
    own = lane.getIndex()
    widths = {
        item.getIndex(): item.getWidth() for item in drivable_lanes(lane.getEdge())
    }
    left, right = 0.5 * widths[own], -0.5 * widths[own]
    edges = [right, left]
    index = own + 1
    while index in widths:
        left += widths[index]
        edges.append(left)
        index += 1
    index = own - 1
    while index in widths:
        right -= widths[index]
        edges.append(right)
        index -= 1
    return left, right, tuple(sorted(edges)[1:-1])


def _shape(lane: Any) -> FloatArray:
    """Return the centre line of a lane, (n, 2), without its height."""
    return np.array([point[:2] for point in lane.getShape()], dtype=np.float64)


def _fractions(points: FloatArray) -> FloatArray:
    """Return the share of the length behind each point, (n,)."""
    lengths = np.linalg.norm(np.diff(points, axis=0), axis=1)
    done = np.concatenate(([0.0], np.cumsum(lengths)))
    return np.asarray(done / max(float(done[-1]), 1e-9))


def _stop_lines(
    uses: Sequence[LaneUse], spans: Sequence[LaneSpan]
) -> tuple[StopLine, ...]:
    """Find the stop lines: ends of lanes whose connection has a signal."""
    # A route may return to a lane, so lanes are distinguished by their order.
    ends = [span.end for span in spans if not span.lane.startswith(":")]
    links = [(use.link, end) for use, end in zip(uses, ends, strict=True) if use.link]
    return tuple(
        StopLine(link.getTLSID(), int(link.getTLLinkIndex()), end)
        for link, end in links
        if link.getTLSID()
    )
