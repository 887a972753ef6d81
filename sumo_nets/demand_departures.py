"""Departures that a network does not allow.

SUMO finds them only as the vehicle departs, and ends the simulation there. What is
refused here SUMO refuses too, unless it is told to ignore it or the run ends before;
of vehicles that are no cars, or of types that are drawn from a distribution, it may
refuse more.
"""

from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path

import numpy as np
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components

from sumo_nets.demand_content import DemandContent, WrittenDeparture, WrittenType
from sumo_nets.errors import NetworkError
from sumo_nets.net_records import VEHICLE_CLASS, Edge, Net
from sumo_nets.route_check import onward_hint
from sumo_nets.routes import onward_edges

CARS_MAX_SPEED = 200.0 / 3.6  # of a type of cars that names none, SUMO's value [m/s]


def check_departures(content: DemandContent, net: Net) -> None:
    """Check that every vehicle can depart on its route.

    Args:
        content: Of the demand; its edges are all in the network.
        net: The network.

    Raises:
        NetworkError: With file, id and what is allowed.
    """
    reach = _Reach(net)
    sound: set[tuple[str, str, bool]] = set()  # ways that were looked at
    for departure, place in content.departures.items():
        edges = _edges_of(departure, content)
        if not edges:
            continue  # SUMO names it as it loads the file
        known = _type_of(departure, content)
        cars = known is not None and known.vehicle_class == VEHICLE_CLASS
        way = (departure.kind, departure.edges, cars)
        problem = ""
        if way not in sound:
            is_trip = departure.kind == "places"
            problem = (
                reach.gap(edges, cars=cars) if is_trip else _gap(net, edges, cars=cars)
            )
            sound.add(way)
        problem = (
            problem
            or _lane_problem(departure.lane, net.edges[edges[0]], cars=cars)
            or _speed_problem(departure, known)
        )
        if problem:
            raise NetworkError(f"{place}: {problem}")


def _edges_of(departure: WrittenDeparture, content: DemandContent) -> tuple[str, ...]:
    """Return the edges of a departure; none if its route has no edges by itself."""
    if departure.kind == "route":
        return content.routes.get(departure.edges, ())
    return tuple(departure.edges.split())


def _type_of(departure: WrittenDeparture, content: DemandContent) -> WrittenType | None:
    """Return a departure's type; None if it is drawn, or one of SUMO's own."""
    if departure.type == "DEFAULT_VEHTYPE" and departure.type not in content.types:
        return WrittenType(Path(), {})
    return content.types.get(departure.type)


def _gap(net: Net, route: tuple[str, ...], *, cars: bool) -> str:
    """Describe where a route is not connected; "" if it is."""
    for names in pairwise(route):
        first, second = (net.edges[name] for name in names)
        if first.internal or second.internal:
            continue
        if cars:
            connected = bool(first.links_to(second))
        else:
            links = [link for lane in first.lanes for link in lane.links]
            connected = any(link.target.edge is second for link in links)
        if not connected:
            who = "no car can go" if cars else "there is no connection"
            return (
                f'{who} from edge "{first.id}" to "{second.id}"; '
                f"allowed: {onward_hint(first)}"
            )
    return ""


def _lane_problem(written: str, edge: Edge, *, cars: bool) -> str:
    """Describe what is wrong with a lane of departure; "" if nothing is."""
    if not written.isdecimal():
        return ""  # a word, which SUMO checks as it loads the file
    lanes = edge.drivable_lanes if cars else edge.lanes
    allowed = [lane.index for lane in lanes]
    if int(written) in allowed:
        return ""
    listed = ", ".join(map(str, allowed)) or "none"
    of_whom = " for cars" if cars else ""
    return (
        f'departLane="{written}": edge "{edge.id}" has no such lane{of_whom}; '
        f"allowed: {listed}"
    )


def _speed_problem(departure: WrittenDeparture, known: WrittenType | None) -> str:
    """Describe what is wrong with a speed of departure; "" if nothing is."""
    speed = _number(departure.speed)
    if known is None or speed is None:
        return ""
    written = known.attributes.get("maxSpeed", "")
    most = _number(written)
    if not written and known.vehicle_class == VEHICLE_CLASS:
        most = CARS_MAX_SPEED
    if most is None or speed <= most:
        return ""
    return (
        f'departSpeed="{departure.speed}" is above the maxSpeed of its type '
        f'"{departure.type}"; allowed: at most {most:.4g}'
    )


def _number(written: str) -> float | None:
    """Read a number; None if it is a word."""
    try:
        return float(written)
    except ValueError:
        return None


@dataclass(slots=True)
class _Reach:
    """Tells whether cars can get from place to place.

    Edges from each of which all others of their group are reached are one group: of a
    town most are in one, so that a trip costs a look at two numbers.
    """

    net: Net
    _number: dict[str, int] = field(default_factory=dict)  # edge -> group
    _onward: list[set[int]] = field(default_factory=list)  # group -> groups
    _reached: dict[int, set[int]] = field(default_factory=dict)  # group -> groups

    def gap(self, places: tuple[str, ...], *, cars: bool) -> str:
        """Describe between which places there is no way; "" if there is one."""
        if not cars:
            return ""  # trains turn back where no road leads
        if not self._number:
            self._group()
        for begin, end in pairwise(places):
            first, last = self._number.get(begin), self._number.get(end)
            if first is None or last is None:
                continue  # closed to cars at once: SUMO's trips begin beside it
            if last not in self._from(first):
                return (
                    f'no car can get from edge "{begin}" to "{end}"; '
                    f"allowed: edges with a way between them"
                )
        return ""

    def _group(self) -> None:
        """Put the roads for cars into groups."""
        roads = [edge for edge in self.net.roads if edge.drivable_lanes]
        place = {edge.id: number for number, edge in enumerate(roads)}
        pairs = [
            (place[edge.id], place[other.id])
            for edge in roads
            for other in onward_edges(edge)
            if other.id in place
        ]
        rows, columns = np.array(pairs, dtype=np.int64).reshape(-1, 2).T
        size = len(roads)
        graph = csr_array((np.ones(len(pairs)), (rows, columns)), shape=(size, size))
        count, groups = connected_components(graph, connection="strong")
        self._number = {edge.id: int(groups[place[edge.id]]) for edge in roads}
        self._onward = [set() for _ in range(count)]
        for begin, end in pairs:
            self._onward[groups[begin]].add(int(groups[end]))

    def _from(self, group: int) -> set[int]:
        """Return the groups that are reached from one, itself included."""
        if group not in self._reached:
            found, to_do = {group}, [group]
            while to_do:
                new = self._onward[to_do.pop()] - found
                found |= new
                to_do.extend(new)
            self._reached[group] = found
        return self._reached[group]
