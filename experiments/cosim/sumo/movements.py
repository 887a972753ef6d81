"""Who is on the way over the ego's junctions, how far, and along which lanes.

A vehicle's next turn is read from its route: that is what its indicator shows.
"""

from collections.abc import Callable, Sequence, Set
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from experiments.cosim.junctions import ConflictZone, RoadJunction
from experiments.cosim.signals import CLEARING, STOP
from experiments.cosim.sumo.crossings import CrossingReader
from experiments.cosim.sumo.libsumo_api import Libsumo, Point
from experiments.cosim.sumo.vehicle_reader import PERSON
from planner.right_of_way.records import Foe
from planner.scene import RoadUsers
from planner.states import FloatArray
from planner.ways import NO_WAY, Ways

REACH = 150.0  # to its line; vehicles farther away are left out [m]
WAY_LENGTH = 120.0  # of a way beyond the lane that a vehicle is on [m]
TURNS = 3  # edges of the route that a way depends on
SHORTEST = 0.01  # corners of a way are farther apart [m]
EXCESS = 1.1  # by which drivers exceed a limit, as a factor
STOPPED = 60.0  # for how long a vehicle at a stop of its own counts as standing [s]
GIVING_WAY = 3.0  # braking with which a vehicle that gives way is counted on [m/s²]


@dataclass(frozen=True, slots=True)
class _Meeting:
    """A zone on a vehicle's route; distances count from the begin of the route [m]."""

    junction: int
    zone: ConflictZone
    edge: int  # place in the route of the edge that leads to the junction
    line: float  # end of that edge


@dataclass(frozen=True, slots=True)
class _Route:
    """A route, its edges' begins [m], and where it meets the ego's."""

    edges: tuple[str, ...]
    begins: tuple[float, ...]
    meetings: tuple[_Meeting, ...]


@dataclass(frozen=True, slots=True)
class _Mover:
    """A vehicle on its route, now."""

    name: str
    route: _Route
    index: int  # of its edge in the route; inside a junction of the edge before
    lane: str
    length: float  # [m]
    speed: float  # [m/s]


class MovementReader:
    """Reads the vehicles at the ego's junctions.

    Args:
        sumo: The running libsumo module.
        junctions: Of the ego's road.
        beyond: Which edges a vehicle's route goes on over, behind those that SUMO
            knows of it: it knows a part where an ego's route passes a junction twice.
    """

    def __init__(
        self,
        sumo: Libsumo,
        junctions: Sequence[RoadJunction],
        beyond: Callable[[str], tuple[str, ...]] = lambda _: (),
    ) -> None:
        self._sumo = sumo
        self._beyond = beyond
        self._zones: dict[tuple[str, str], list[tuple[int, ConflictZone]]] = {}
        for number, junction in enumerate(junctions):
            for zone in junction.zones:
                pair = (zone.source_edge, zone.target_edge)
                self._zones.setdefault(pair, []).append((number, zone))
        self._crossings = CrossingReader(sumo, junctions)
        self._routes: dict[tuple[str, ...], _Route] = {}
        self._of_vehicle: dict[str, tuple[str, _Route]] = {}  # with the route's id
        self._lengths: dict[str, float] = {}
        self._inside_lengths: dict[str, float] = {}
        self._ways: dict[tuple[str, ...], int] = {}
        self._lines: list[FloatArray] = []

    def read(self, near: Set[int], vehicles: RoadUsers) -> tuple[tuple[Foe, ...], Ways]:
        """Read foes at junctions, and the ways of all vehicles.

        Args:
            near: Places of the junctions that are looked at.
            vehicles: The traffic about the ego.
        """
        found: list[Foe] = []
        way = np.full(len(vehicles.ids), NO_WAY)
        stop = np.full(len(vehicles.ids), np.inf)
        for row, name in enumerate(vehicles.ids):
            if name.startswith(PERSON):  # on foot: no route of edges to drive
                found += self._crossings.foes(name, near, vehicles, row)
                continue
            mover = self._mover(name, vehicles, row)
            if mover is None:
                continue
            own = self._foes(mover, near)
            found += own
            way[row] = self._way(mover)
            waits = [x.to_line for x in own if _will_wait(x)]
            stop[row] = min(waits, default=np.inf)
        return tuple(found), Ways(way, stop, tuple(self._lines))

    def _mover(self, name: str, vehicles: RoadUsers, row: int) -> _Mover | None:
        """Read where a vehicle is on its route; None if it does not drive there."""
        api = self._sumo.vehicle
        lane, index = str(api.getLaneID(name)), int(api.getRouteIndex(name))
        if not lane or index < 0:
            return None
        route = str(api.getRouteID(name))  # another one once it was changed
        read, known = self._of_vehicle.get(name, ("", None))
        if known is None or route != read:
            edges = (*api.getRoute(name), *self._beyond(name))
            if edges not in self._routes:
                self._routes[edges] = self._measured(edges)
            known = self._routes[edges]
            self._of_vehicle[name] = route, known
        if index >= len(known.edges):
            return None
        length, speed = float(vehicles.length[row]), float(vehicles.speed[row])
        return _Mover(name, known, index, lane, length, speed)

    def _foes(self, mover: _Mover, near: Set[int]) -> list[Foe]:
        """List the foes of a vehicle at junctions that are looked at."""
        met = [
            x
            for x in mover.route.meetings
            if x.edge >= mover.index and x.junction in near
        ]
        if not met:
            return []
        position = float(self._sumo.vehicle.getLanePosition(mover.name))
        stood = float(self._sumo.vehicle.getWaitingTime(mover.name))
        if self._sumo.vehicle.isStopped(mover.name):  # SUMO counts no waiting then
            stood = max(stood, STOPPED)
        found = []
        for meeting in _of_lane(met, mover):
            zone = meeting.zone
            to_line = meeting.line - self._place(mover, position, meeting)
            left = to_line + zone.exit + mover.length
            if to_line > REACH or left <= 0.0 or mover.length < zone.shortest:
                continue
            found.append(
                Foe(
                    junction=meeting.junction,
                    vehicle=mover.name,
                    begin_s=zone.begin_s,
                    end_s=zone.end_s,
                    entry=to_line + zone.entry,
                    exit=left,
                    to_line=to_line,
                    speed=mover.speed,
                    limit=EXCESS * zone.limit,
                    turn_speed=zone.turn_speed,
                    road=meeting.line - mover.route.begins[meeting.edge],
                    merges=zone.merges,
                    stood=stood,
                    goes_first=zone.goes_first,
                    gives_way=zone.gives_way,
                    held=to_line >= 0.0 and self._is_held(zone),
                )
            )
        return found

    def _place(self, mover: _Mover, position: float, meeting: _Meeting) -> float:
        """Return how far along its route a vehicle is [m]."""
        begins, index, lane = mover.route.begins, mover.index, mover.lane
        if not lane.startswith(":"):
            return begins[index] + position
        if meeting.edge == index:
            inside = meeting.zone.inside
            return meeting.line + next(at for x, at in inside if x == lane) + position
        # inside an earlier junction: as far as it still goes to the next edge
        following = begins[min(index + 1, len(begins) - 1)]
        return following - max(self._left_inside(lane) - position, 0.0)

    def _left_inside(self, lane: str) -> float:
        """Return the length from the begin of a lane in a junction to its end [m]."""
        if lane not in self._inside_lengths:
            left, here = 0.0, lane
            while here.startswith(":"):
                left += self._length(here)
                links = self._sumo.lane.getLinks(here)
                here = str(links[0][4] or links[0][0]) if links else ""
            self._inside_lengths[lane] = left
        return self._inside_lengths[lane]

    def _is_held(self, zone: ConflictZone) -> bool:
        """Check whether a light holds the vehicles of a movement."""
        if not zone.signal:
            return False
        state = self._sumo.trafficlight.getRedYellowGreenState(zone.signal)
        return state[zone.signal_link] in STOP | CLEARING

    def _measured(self, edges: tuple[str, ...]) -> _Route:
        """Measure a route and find where it meets the ego's."""
        begins, meetings, place = [0.0], [], 0.0
        for number, pair in enumerate(pairwise(edges)):
            place += self._length(f"{pair[0]}_0")
            for junction, zone in self._zones.get(pair, ()):
                meetings.append(_Meeting(junction, zone, number, place))
            place += self._inside(*pair)
            begins.append(place)
        return _Route(edges, tuple(begins), tuple(meetings))

    def _length(self, lane: str) -> float:
        """Return the length of a lane, read once [m]."""
        if lane not in self._lengths:
            self._lengths[lane] = float(self._sumo.lane.getLength(lane))
        return self._lengths[lane]

    def _inside(self, source: str, target: str) -> float:
        """Return the length of the shortest way over a junction [m]."""
        lanes = int(self._sumo.edge.getLaneNumber(source))
        lengths = [
            self._left_inside(link[4]) if link[4] else float(link[7])
            for n in range(lanes)
            for link in self._sumo.lane.getLinks(f"{source}_{n}")
            if link[0].rpartition("_")[0] == target
        ]
        return min(lengths, default=0.0)

    def _way(self, mover: _Mover) -> int:
        """Return the number of a vehicle's way; NO_WAY if its lane leads elsewhere."""
        edges, first = mover.route.edges, mover.index + 1
        onward = edges[first : first + TURNS]
        inside = mover.lane.startswith(":")
        came_from = (
            edges[mover.index] if inside else "".join(edges[first - 2 : first - 1])
        )
        key = (came_from, mover.lane, *onward)
        if key not in self._ways:
            line = self._line(came_from, mover.lane, onward)
            self._ways[key] = NO_WAY if line is None else len(self._lines)
            if line is not None:
                self._lines.append(line)
        return self._ways[key]

    def _line(
        self, came_from: str, lane: str, onward: Sequence[str]
    ) -> FloatArray | None:
        """Join the lanes of a way: arc length, x, y of its corners, (3, m) [m].

        A vehicle is on the lane of its front bumper: the ones before belong to it.
        """
        points = [*self._before(came_from, lane), *self._sumo.lane.getShape(lane)]
        beyond, edges = 0.0, list(onward)
        while edges and beyond < WAY_LENGTH:
            following = self._next_lane(lane, edges[0])
            if not following:
                break
            lane = following
            points += self._sumo.lane.getShape(lane)
            beyond += self._length(lane)
            if lane.rpartition("_")[0] == edges[0]:
                edges.pop(0)
        if edges and beyond == 0.0:
            return None
        corners = np.array(points, dtype=np.float64)[:, :2]
        apart = np.hypot(*np.diff(corners, axis=0).T) > SHORTEST
        corners = corners[np.concatenate(([True], apart))]
        if len(corners) == 1:
            return None
        at = np.concatenate(([0.0], np.cumsum(np.hypot(*np.diff(corners, axis=0).T))))
        return np.ascontiguousarray(np.vstack([at, corners.T]))

    def _before(self, edge: str, lane: str) -> list[Point]:
        """List the corners of the lanes that lead from an edge to a lane."""
        for n in range(int(self._sumo.edge.getLaneNumber(edge)) if edge else 0):
            first = f"{edge}_{n}"
            for link in self._sumo.lane.getLinks(first):
                via = [link[4]] if link[4] else []
                while via and via[-1] != lane:
                    onward = self._sumo.lane.getLinks(via[-1])
                    if not onward or not onward[0][4]:
                        break
                    via.append(onward[0][4])
                if lane in via:
                    via = via[: via.index(lane)]
                elif link[0] != lane:
                    continue
                return [
                    x for each in (first, *via) for x in self._sumo.lane.getShape(each)
                ]
        return []

    def _next_lane(self, lane: str, edge: str) -> str:
        """Return the lane that follows on the way to an edge, "" if there is none."""
        for link in self._sumo.lane.getLinks(lane):
            if link[0].rpartition("_")[0] == edge:
                return str(link[4] or link[0])
        return ""


def _will_wait(foe: Foe) -> bool:
    """Check whether a vehicle is expected to stop at its line."""
    if foe.to_line <= 0.0:
        return False
    lawful = foe.held or (foe.gives_way and not foe.goes_first)
    return lawful and foe.speed**2 <= 2.0 * GIVING_WAY * foe.to_line


def _of_lane(met: Sequence[_Meeting], mover: _Mover) -> Sequence[_Meeting]:
    """Keep what a vehicle can meet from the lane that it is on.

    Before a junction it may still change its lane if none of its movements begins in
    this one; inside it stays on its way.
    """
    lane, later = mover.lane, [x for x in met if x.edge > mover.index]
    own = [x for x in met if x.edge == mover.index]
    if lane.startswith(":"):
        there = [x for x in own if any(lane == each for each, _ in x.zone.inside)]
        return [*there, *later]
    exact = [x for x in own if x.zone.source == lane]
    return [*(exact or own), *later]
