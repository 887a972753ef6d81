"""The simulator's lanes as plain geometry: centre lines, widths, projections.

The ghost and the static obstacles have to be put where SUMO's lanes are, whatever the
ego's reference path does.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from experiments.cosim.sumo.libsumo_api import Libsumo
from planner.errors import InvalidInputError
from planner.numerics.compiled import compiled, inlined
from planner.states import FloatArray, IntArray, freeze

OVERHANG = 20.0  # how far a lane's ends are carried on straight, for long bodies [m]
SAME_POINT = 1e-9  # closer points of a centre line are one [m]
NEXT_LANE: Final = 0  # places in a link of `lane.getLinks`
INTERNAL_LANE: Final = 4
STRIP_MARGIN = 0.4  # SUMO drops a front bumper half a body outside; before it [m]
# Between the end of a lane and the begin of the next one, where these turn: a front
# bumper there is on none of them [m].
LANE_GAP: Final = 0.5
PLANE = 2  # coordinates of a point
TWO = 2  # points of a line, lanes side by side
INSIDE_JUNCTION = ":"  # how the names of lanes there begin
TRAFFIC_CLASS = "passenger"  # of all vehicles in the demand files


@dataclass(frozen=True, slots=True, eq=False)
class Lane:
    """One lane of an edge; `points` is its centre line, (n, 2)."""

    id: str
    edge: str
    index: int  # 0 is the lane at the kerb of its edge, as in SUMO
    width: float  # [m]
    points: FloatArray  # [m]
    stations: FloatArray = field(init=False)  # arc length at each point, (n,) [m]

    def __post_init__(self) -> None:
        """Check and freeze the centre line and measure it."""
        points = without_repeats(self.points)
        lengths = np.hypot(*np.diff(points, axis=0).T)
        object.__setattr__(self, "points", freeze(points))
        object.__setattr__(self, "stations", freeze(np.cumsum(np.append(0.0, lengths))))

    @property
    def length(self) -> float:
        """Length of the centre line [m]."""
        return float(self.stations[-1])

    def project(self, x: float, y: float) -> tuple[float, float]:
        """Return arc length and offset (positive to the left) of a point [m].

        The ends are carried on straight by `OVERHANG`, so that the rear of a body
        whose front is on the lane has an offset too.
        """
        station, offset = _foot_point(self.points, self.stations, x, y, OVERHANG)
        return float(station), float(offset)

    def foot(self, x: float, y: float) -> tuple[float, float]:
        """Return the nearest point of the centre line, ends included [m]."""
        station, _ = _foot_point(self.points, self.stations, x, y, 0.0)
        return self.at(float(station))[:2]

    def at(self, station: float) -> tuple[float, float, float]:
        """Return (x, y) [m] and heading [rad] of the centre line at an arc length."""
        last = self.stations.size - 2
        k = min(max(int(np.searchsorted(self.stations, station)) - 1, 0), last)
        (x0, y0), (x1, y1) = self.points[k], self.points[k + 1]
        heading = math.atan2(y1 - y0, x1 - x0)
        reach = station - float(self.stations[k])
        return (
            float(x0) + reach * math.cos(heading),
            float(y0) + reach * math.sin(heading),
            heading,
        )


def without_repeats(points: ArrayLike) -> FloatArray:
    """Return the points without those that repeat the one before, (n, 2), n >= 2.

    Raises:
        InvalidInputError: If fewer than two different points are left.
    """
    array = np.asarray(points, dtype=np.float64)
    if array.ndim != PLANE or array.shape[1] != PLANE:
        raise InvalidInputError(f"a centre line is (n, 2), not {array.shape}")
    moved = np.any(np.abs(np.diff(array, axis=0)) > SAME_POINT, axis=1)
    array = np.concatenate((array[:1], array[1:][moved]))
    if not moved.any():
        raise InvalidInputError("a centre line needs two different points")
    return array


def edge_lanes(sumo: Libsumo, edge: str) -> list[Lane]:
    """Read all lanes of an edge, from the rightmost to the leftmost.

    Lanes without length, as inside the joint of two edges, are left out. SUMO counts
    from the kerb, which is on the left in left-hand traffic.
    """
    names = [f"{edge}_{k}" for k in range(sumo.edge.getLaneNumber(edge))]
    lanes = [read_lane(sumo, name) for name in names if _has_length(sumo, name)]
    return lanes[::-1] if _counts_from_left(lanes) else lanes


def _counts_from_left(lanes: Sequence[Lane]) -> bool:
    """Tell whether the second lane of an edge lies to the right of the first."""
    if len(lanes) < TWO:
        return False
    x, y, _ = lanes[1].at(lanes[1].length / 2.0)
    return lanes[0].project(x, y)[1] < 0.0


def _has_length(sumo: Libsumo, name: str) -> bool:
    """Tell whether a lane is more than a point."""
    return len({point[:2] for point in sumo.lane.getShape(name)}) >= TWO


def route_strips(sumo: Libsumo, route: Sequence[str]) -> list[list[Lane]]:
    """Read the lanes along a route, edge by edge, also those inside junctions."""
    strips = []
    for edge, following in pairwise([*route, None]):
        strips.append(edge_lanes(sumo, str(edge)))
        inside = _inside_junction(sumo, strips[-1], following)
        strips += [edge_lanes(sumo, internal) for internal in inside]
    return [strip for strip in strips if strip]


def _inside_junction(
    sumo: Libsumo, lanes: Sequence[Lane], following: str | None
) -> list[str]:
    """Return the edges inside the junction before the next edge of the route."""
    ways = [
        link[INTERNAL_LANE]
        for lane in lanes
        for link in sumo.lane.getLinks(lane.id)
        if edge_of(link[NEXT_LANE]) == following
    ]
    edges = []
    while ways and ways[0]:
        edges.append(edge_of(ways[0]))
        ways = [link[INTERNAL_LANE] for link in sumo.lane.getLinks(ways[0])]
    return edges


def edge_of(lane: str) -> str:
    """Return the id of the edge that a lane belongs to."""
    return lane.rpartition("_")[0]


def all_lanes(sumo: Libsumo) -> Iterator[Lane]:
    """Read every lane that cars may use, also those inside junctions."""
    for name in sorted(sumo.lane.getIDList()):
        allowed = sumo.lane.getAllowed(name)
        if (not allowed or TRAFFIC_CLASS in allowed) and _has_length(sumo, name):
            yield read_lane(sumo, name)


def read_lane(sumo: Libsumo, name: str) -> Lane:
    """Read one lane."""
    points = [point[:2] for point in sumo.lane.getShape(name)]
    width = float(sumo.lane.getWidth(name))
    index = int(name.rpartition("_")[2])
    return Lane(name, edge_of(name), index, width, np.array(points))


@compiled
def _foot_point(
    points: FloatArray, stations: FloatArray, x: float, y: float, overhang: float
) -> tuple[float, float]:
    """Find arc length and signed offset of the nearest point of a polyline [m]."""
    best, station, offset = np.inf, 0.0, 0.0
    last = points.shape[0] - 2
    for k in range(last + 1):
        length = stations[k + 1] - stations[k]
        tx = (points[k + 1, 0] - points[k, 0]) / length
        ty = (points[k + 1, 1] - points[k, 1]) / length
        dx, dy = x - points[k, 0], y - points[k, 1]
        reach = dx * tx + dy * ty
        lower = -overhang if k == 0 else 0.0
        upper = length + overhang if k == last else length
        reach = min(max(reach, lower), upper)
        ex, ey = dx - reach * tx, dy - reach * ty
        square = ex * ex + ey * ey
        if square < best:
            best = square
            station = stations[k] + reach
            side = 1.0 if tx * dy - ty * dx >= 0.0 else -1.0
            offset = side * math.sqrt(square)
    return station, offset


class StripTable(NamedTuple):
    """Numbers of lanes side by side, their points one lane after the other."""

    points: FloatArray  # centre lines, (n, 2) [m]
    stations: FloatArray  # arc length at each point, (n,) [m]
    ends: IntArray  # where each lane begins, and the end, (n_lanes + 1,)
    widths: FloatArray  # (n_lanes,) [m]


class Strip:
    """The lanes of one edge side by side, as tables that compiled functions read.

    Args:
        lanes: From the rightmost to the leftmost, at least one.
    """

    def __init__(self, lanes: Sequence[Lane]) -> None:
        self.lanes = tuple(lanes)
        ends = np.cumsum([lane.stations.size for lane in lanes])
        self._table = StripTable(
            freeze(np.concatenate([lane.points for lane in lanes])),
            freeze(np.concatenate([lane.stations for lane in lanes])),
            np.array([0, *ends]),
            np.array([lane.width for lane in lanes]),
        )

    @property
    def inside_junction(self) -> bool:
        """Whether these are lanes inside a junction."""
        return self.lanes[0].edge.startswith(INSIDE_JUNCTION)

    def lane_of(self, x: float, y: float, beyond: float = 0.0) -> int | None:
        """Return the lane in which SUMO counts a front bumper; None off the edge.

        Args:
            x: Of the front bumper [m].
            y: The same [m].
            beyond: So far beyond their ends lanes go on [m].
        """
        index = _lane_of(self._table, x, y, beyond)
        return None if index < 0 else index

    def reached_lane(
        self,
        front: tuple[float, float],
        pose: tuple[float, float, float],
        body: tuple[float, float, float],
    ) -> tuple[Lane, float] | None:
        """Find the lane beside its own that a body reaches into, if there is one.

        Args:
            front: Centre of its front bumper [m].
            pose: Rear axle (x, y) [m] and heading [rad].
            body: Rear overhang, reach to the front, and width [m].

        Returns:
            The lane, and the arc length of the front bumper on it [m].
        """
        index, station = _reached_lane(self._table, front, pose, body)
        return None if index < 0 else (self.lanes[index], station)


@inlined
def _on_lane(strip: StripTable, k: int, x: float, y: float) -> tuple[float, float]:
    """Return arc length and offset of a point on lane `k` [m]."""
    begin, end = strip.ends[k], strip.ends[k + 1]
    return _foot_point(
        strip.points[begin:end], strip.stations[begin:end], x, y, OVERHANG
    )


@compiled
def _lane_of(strip: StripTable, x: float, y: float, beyond: float) -> int:
    """Return the lane that a front bumper is counted in, -1 off the edge."""
    nearest, excess = -1, STRIP_MARGIN
    for k in range(strip.widths.size):
        station, offset = _on_lane(strip, k, x, y)
        outside = abs(offset) - strip.widths[k] / 2.0
        length = strip.stations[strip.ends[k + 1] - 1]
        inside = -beyond <= station <= length + beyond
        if inside and outside < excess:
            nearest, excess = k, outside
    return nearest


@compiled
def _reached_lane(
    strip: StripTable,
    front: tuple[float, float],
    pose: tuple[float, float, float],
    body: tuple[float, float, float],
) -> tuple[int, float]:
    """Find the lane beside its own that a body reaches into.

    Args:
        strip: Lanes of the edge.
        front: Centre of its front bumper [m].
        pose: Rear axle (x, y) [m] and heading [rad].
        body: Rear overhang, reach to the front, and width [m].

    Returns:
        (lane or -1, arc length of the front bumper on it [m]).
    """
    own = _lane_of(strip, front[0], front[1], 0.0)
    if own < 0:
        own = _lane_of(strip, front[0], front[1], LANE_GAP)
    if own < 0:
        return -1, 0.0
    highest, lowest = -np.inf, np.inf
    cos, sin = math.cos(pose[2]), math.sin(pose[2])
    for corner in range(4):
        along = -body[0] if corner in (0, 3) else body[1]
        across = body[2] / 2.0 * (-1.0 if corner in (0, 1) else 1.0)
        x = pose[0] + along * cos - across * sin
        y = pose[1] + along * sin + across * cos
        _, offset = _on_lane(strip, own, x, y)
        highest, lowest = max(highest, offset), min(lowest, offset)
    half = strip.widths[own] / 2.0
    to_left, to_right = highest - half, -lowest - half
    first = 1 if to_left >= to_right else -1  # the side that is reached farther into
    for side in (first, -first):
        excess = to_left if side > 0 else to_right
        if excess > 0.0 and 0 <= own + side < strip.widths.size:
            return own + side, _on_lane(strip, own + side, front[0], front[1])[0]
    return -1, 0.0
