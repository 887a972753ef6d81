"""Which vehicles are on their way over the ego's junctions, and how far they are.

A vehicle's next turn is read from its route: that is what its indicator shows.
"""

from collections.abc import Sequence, Set
from dataclasses import dataclass
from itertools import pairwise

from experiments.cosim.junctions import ConflictZone, RoadJunction
from experiments.cosim.signals import CLEARING, STOP
from experiments.cosim.sumo.libsumo_api import Libsumo
from planner.right_of_way.records import Conflict
from planner.scene import RoadUsers

REACH = 150.0  # to its line; vehicles farther away are left out [m]


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


class MovementReader:
    """Reads the vehicles that come into the ego's way at junctions.

    Args:
        sumo: The running libsumo module.
        junctions: Of the ego's road.
    """

    def __init__(self, sumo: Libsumo, junctions: Sequence[RoadJunction]) -> None:
        self._sumo = sumo
        self._junctions = junctions
        self._zones: dict[tuple[str, str], list[tuple[int, ConflictZone]]] = {}
        for number, junction in enumerate(junctions):
            for zone in junction.zones:
                pair = (zone.source_edge, zone.target_edge)
                self._zones.setdefault(pair, []).append((number, zone))
        self._routes: dict[tuple[str, ...], _Route] = {}
        self._of_vehicle: dict[str, _Route] = {}
        self._lengths: dict[str, float] = {}

    def conflicts(self, near: Set[int], vehicles: RoadUsers) -> tuple[Conflict, ...]:
        """Read the conflicts with vehicles at junctions.

        Args:
            near: Places of the junctions that are looked at.
            vehicles: The traffic about the ego.
        """
        found: list[Conflict] = []
        for row, name in enumerate(vehicles.ids):
            lane = str(self._sumo.vehicle.getLaneID(name))
            index = int(self._sumo.vehicle.getRouteIndex(name))
            if not lane or index < 0:
                continue  # not on the road yet
            route = self._route_of(name, index)
            met = [x for x in route.meetings if x.edge >= index and x.junction in near]
            if not met:
                continue
            position = float(self._sumo.vehicle.getLanePosition(name))
            stood = float(self._sumo.vehicle.getWaitingTime(name))
            length = float(vehicles.length[row])
            speed = float(vehicles.speed[row])
            for meeting in _of_lane(met, lane, index):
                zone = meeting.zone
                place = _place(route, index, lane, position, meeting)
                to_line = meeting.line - place
                left = to_line + zone.exit + length
                if to_line > REACH or left <= 0.0:
                    continue
                found.append(
                    Conflict(
                        crossing=meeting.junction,
                        vehicle=name,
                        begin_s=zone.begin_s,
                        end_s=zone.end_s,
                        entry=to_line + zone.entry,
                        exit=left,
                        to_line=to_line,
                        speed=speed,
                        limit=zone.limit,
                        stood=stood,
                        goes_first=zone.goes_first,
                        held=to_line >= 0.0 and self._is_held(zone),
                    )
                )
        return tuple(found)

    def _is_held(self, zone: ConflictZone) -> bool:
        """Check whether a light holds the vehicles of a movement."""
        if not zone.signal:
            return False
        state = self._sumo.trafficlight.getRedYellowGreenState(zone.signal)
        return state[zone.signal_link] in STOP | CLEARING

    def _route_of(self, name: str, index: int) -> _Route:
        """Return a vehicle's route; read anew if it has been given another one."""
        known = self._of_vehicle.get(name)
        edge = str(self._sumo.vehicle.getRoadID(name))
        if known is not None and (edge.startswith(":") or edge in known.edges[index:]):
            return known
        edges = tuple(self._sumo.vehicle.getRoute(name))
        if edges not in self._routes:
            self._routes[edges] = self._measured(edges)
        self._of_vehicle[name] = self._routes[edges]
        return self._routes[edges]

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
            float(link[7])
            for n in range(lanes)
            for link in self._sumo.lane.getLinks(f"{source}_{n}")
            if link[0].rpartition("_")[0] == target
        ]
        return min(lengths, default=0.0)


def _of_lane(met: Sequence[_Meeting], lane: str, index: int) -> Sequence[_Meeting]:
    """Keep what a vehicle can meet from the lane that it is on.

    Before a junction it may still change its lane if none of its movements begins in
    this one; inside it stays on its way.
    """
    if lane.startswith(":"):
        return [
            x
            for x in met
            if x.edge > index or any(lane == each for each, _ in x.zone.inside)
        ]
    own = [x for x in met if x.edge == index]
    exact = [x for x in own if x.zone.source == lane]
    return [*(exact or own), *(x for x in met if x.edge > index)]


def _place(
    route: _Route, index: int, lane: str, position: float, meeting: _Meeting
) -> float:
    """Return how far along its route a vehicle is [m]."""
    if not lane.startswith(":"):
        return route.begins[index] + position
    if meeting.edge == index:
        begin = next(at for each, at in meeting.zone.inside if each == lane)
        return meeting.line + begin + position
    return route.begins[index + 1] - 1.0 if index + 1 < len(route.begins) else position
