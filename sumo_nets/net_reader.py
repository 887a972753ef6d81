"""Read a .net.xml safely and check that a route runs through it.

libsumo dies of a segmentation fault on a truncated network, which no caller can catch:
every network is therefore parsed to its end here before a simulator sees it. Shapes
stay text until they are asked for: of a city's network a route needs a few.
"""

import gzip
import zlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from difflib import get_close_matches
from functools import lru_cache
from itertools import pairwise
from pathlib import Path
from typing import IO, cast
from xml.parsers import expat

import numpy as np
from numpy.typing import NDArray

from sumo_nets.errors import NetworkError

# The class of vehicle whose lanes count as road.
VEHICLE_CLASS = "passenger"

# Of a lane whose element names no width [m], SUMO's value.
DEFAULT_WIDTH = 3.2

# Edges that a message lists when none resembles the one asked for.
LISTED = 8

# Networks kept in memory: an episode reads its own several times.
KEPT = 2

# Networks with more edges are not searched for similar names: it takes seconds.
SEARCHED = 5000

# Functions of edges that vehicles drive on.
ROADS = ("normal", "connector", "internal")

# Kinds of junctions whose lights the simulator switches itself, without a program.
SELF_SWITCHED = ("rail_crossing", "rail_signal")


@dataclass(frozen=True, slots=True, eq=False)
class NetLane:
    """A lane of an edge; lane 0 is the one at the kerb."""

    id: str
    edge: "Edge" = field(repr=False)
    index: int
    width: float  # [m]
    speed: float  # limit for cars [m/s]
    length: float  # as the simulator counts it, not that of the shape [m]
    drivable: bool  # whether cars may use it
    shape_text: str = field(repr=False)
    links: list["Link"] = field(default_factory=list, repr=False)  # that lead away
    leads_up: bool = True  # whether cars may change to the lane of the next index
    leads_down: bool = True  # ... and to the one of the index before

    @property
    def points(self) -> NDArray[np.float64]:
        """Centre line without its height, (n, 2) [m].

        Raises:
            NetworkError: If the shape is not a list of points.
        """
        return _points(self.shape_text, f'lane "{self.id}"')


@dataclass(frozen=True, slots=True, eq=False)
class Edge:
    """A road in one direction."""

    id: str
    function: str
    start: str  # junction, "" inside one
    end: str
    lanes: list[NetLane] = field(default_factory=list, repr=False)  # by index

    @property
    def internal(self) -> bool:
        """Whether it lies inside a junction."""
        return self.function == "internal"

    @property
    def drivable_lanes(self) -> list[NetLane]:
        """Lanes that cars may use, by index."""
        return [lane for lane in self.lanes if lane.drivable]

    def links_to(self, other: "Edge") -> list["Link"]:
        """List the links from lanes for cars to lanes for cars of another edge."""
        links = [link for lane in self.drivable_lanes for link in lane.links]
        return [x for x in links if x.target.edge is other and x.target.drivable]


@dataclass(frozen=True, slots=True, eq=False)
class Link:
    """A connection of two lanes."""

    source: NetLane
    target: NetLane
    via: str  # lane inside the junction, "" without one
    signal: str  # traffic light, "" without one
    signal_link: int  # place in the light's state string
    state: str  # right of way, SUMO's letter: M m = s w Z; with a signal o


@dataclass(frozen=True, slots=True)
class Request:
    """What a movement over a junction has to do with the others there.

    `response` and `foes` are strings of 0 and 1, the movement of index 0 last.
    """

    response: str  # to which movements it has to give way
    foes: str  # which movements it meets
    cont: bool  # whether a vehicle may wait inside the junction

    def yields_to(self, index: int) -> bool:
        """Check whether the movement gives way to the one of an index."""
        return self.response[-1 - index : len(self.response) - index] == "1"

    def meets(self, index: int) -> bool:
        """Check whether the movement meets the one of an index."""
        return self.foes[-1 - index : len(self.foes) - index] == "1"


@dataclass(frozen=True, slots=True, eq=False)
class Junction:
    """A node of the network."""

    id: str
    kind: str
    shape_text: str = field(repr=False)
    incoming: tuple[str, ...] = field(default=(), repr=False)  # lanes that end here
    requests: dict[int, Request] = field(default_factory=dict, repr=False)  # by index

    @property
    def outline(self) -> NDArray[np.float64]:
        """Corners of its area, (n, 2) [m]; dead ends have fewer than three.

        Raises:
            NetworkError: If the shape is not a list of points.
        """
        if not self.shape_text.strip():
            return np.empty((0, 2))
        return _points(self.shape_text, f'junction "{self.id}"')


@dataclass(frozen=True, slots=True, eq=False)
class Net:
    """A road network."""

    file: Path
    left_hand: bool
    edges: dict[str, Edge] = field(repr=False)
    junctions: dict[str, Junction] = field(repr=False)

    @property
    def roads(self) -> list[Edge]:
        """Edges outside junctions that vehicles drive on."""
        return [e for e in self.edges.values() if e.function in ROADS[:2]]

    def at(self, junction: str) -> list[Edge]:
        """List the edges that begin or end at a junction."""
        return [e for e in self.edges.values() if junction in (e.start, e.end)]

    def lane(self, lane_id: str) -> NetLane:
        """Get a lane.

        Raises:
            NetworkError: If there is none of this id.
        """
        edge_id, _, index = lane_id.rpartition("_")
        edge = self.edges.get(edge_id)
        for lane in edge.lanes if edge is not None else ():
            if str(lane.index) == index:
                return lane
        raise NetworkError(f'{self.file}: no lane "{lane_id}"')

    def movements(self, junction: Junction) -> list[Link]:
        """List the movements over a junction by their index, those of cars or not.

        Steps from a pavement to a corner of the junction and back have no index.
        """
        links = [link for lane in junction.incoming for link in self.lane(lane).links]
        return [link for link in links if not _on_pavement(link)]


class _Handler:
    """Builds a network from the start and end tags of its file."""

    def __init__(self) -> None:
        self.root = ""
        self.left_hand = False
        self.edges: dict[str, Edge] = {}
        self.junctions: dict[str, Junction] = {}
        self.connections: list[dict[str, str]] = []
        self.programs: set[str] = set()  # of the traffic lights
        self._restrictions: dict[str, float] = {}  # edge type -> limit of cars [m/s]
        self._type = ""  # of the element that is open
        self._edge: Edge | None = None
        self._junction: Junction | None = None
        self._parts: dict[str, Callable[[dict[str, str]], None]] = {
            "type": self._open_type,
            "restriction": self._restrict,
            "edge": self._open_edge,
            "lane": self._add_lane,
            "junction": self._open_junction,
            "request": self._add_request,
            "connection": self.connections.append,
            "tlLogic": self._add_program,
        }

    def start(self, tag: str, attributes: dict[str, str]) -> None:
        """Take in a start tag."""
        if not self.root:
            self.root = tag
            self.left_hand = attributes.get("lefthand") in ("true", "1", "yes")
        part = self._parts.get(tag)
        if part is None:
            return
        try:
            part(attributes)
        except KeyError as error:
            raise NetworkError(f"{_named(tag, attributes)} has no {error}") from error
        except ValueError as error:
            raise NetworkError(f"{_named(tag, attributes)}: {error}") from error

    def end(self, tag: str) -> None:
        """Take in an end tag."""
        if tag == "edge":
            self._edge = None
        elif tag == "junction":
            self._junction = None

    def _open_type(self, attributes: dict[str, str]) -> None:
        """Remember which type of edges the next restrictions belong to."""
        self._type = attributes["id"]

    def _restrict(self, attributes: dict[str, str]) -> None:
        """Keep a speed limit that is for cars alone."""
        if attributes["vClass"] == VEHICLE_CLASS:
            self._restrictions[self._type] = float(attributes["speed"])

    def _open_edge(self, attributes: dict[str, str]) -> None:
        """Add an edge; its lanes follow."""
        self._edge = Edge(
            attributes["id"],
            attributes.get("function", "normal"),
            attributes.get("from", ""),
            attributes.get("to", ""),
        )
        self._type = attributes.get("type", "")
        self.edges[self._edge.id] = self._edge

    def _add_lane(self, attributes: dict[str, str]) -> None:
        """Add a lane to the open edge."""
        if self._edge is None:
            return
        limit = self._restrictions.get(self._type)
        lane = NetLane(
            attributes["id"],
            self._edge,
            int(attributes["index"]),
            float(attributes.get("width", DEFAULT_WIDTH)),
            float(attributes["speed"]) if limit is None else limit,
            float(attributes["length"]),
            _allows_cars(attributes),
            attributes["shape"],
            leads_up=_has_cars(attributes.get("changeLeft", "")),
            leads_down=_has_cars(attributes.get("changeRight", "")),
        )
        self._edge.lanes.append(lane)

    def _open_junction(self, attributes: dict[str, str]) -> None:
        """Add a junction; its requests follow."""
        self._junction = Junction(
            attributes["id"],
            attributes.get("type", ""),
            attributes.get("shape", ""),
            tuple(attributes.get("incLanes", "").split()),
        )
        self.junctions[self._junction.id] = self._junction
        if self._junction.kind in SELF_SWITCHED:
            self.programs.add(self._junction.id)

    def _add_request(self, attributes: dict[str, str]) -> None:
        """Add what one movement over the open junction has to do with the others."""
        if self._junction is not None:
            self._junction.requests[int(attributes["index"])] = Request(
                attributes.get("response", ""),
                attributes.get("foes", ""),
                attributes.get("cont") == "1",
            )

    def _add_program(self, attributes: dict[str, str]) -> None:
        """Remember that a traffic light has a program."""
        self.programs.add(attributes["id"])

    def connect(self) -> None:
        """Add the links, once all lanes are known.

        Raises:
            NetworkError: If this is not a network, or a connection has no lane.
        """
        if self.root != "net":
            raise NetworkError(f"the root element is <{self.root}>, not <net>")
        for link in self.connections:
            try:
                source = self.edges[link["from"]].lanes[int(link["fromLane"])]
                target = self.edges[link["to"]].lanes[int(link["toLane"])]
            except (LookupError, ValueError) as error:
                raise NetworkError(
                    f'the connection from "{link.get("from")}" to "{link.get("to")}" '
                    f"has no lane ({type(error).__name__}: {error})"
                ) from error
            signal = link.get("tl", "")
            if signal and source.drivable and signal not in self.programs:
                raise NetworkError(
                    f'the traffic light "{signal}" has no program (<tlLogic>): rebuild '
                    "the network by netconvert, with --tls.rebuild"
                )
            place = int(link.get("linkIndex", -1))
            state = link.get("state", "")
            source.links.append(
                Link(source, target, link.get("via", ""), signal, place, state)
            )


def check_complete(net_file: Path) -> None:
    """Check that `net_file` is a complete SUMO network.

    Raises:
        NetworkError: If it is missing, truncated, not XML or not a network.
    """
    read_net(net_file)


def read_net(net_file: Path) -> Net:
    """Read a complete network with its junction-internal lanes.

    Raises:
        NetworkError: If the file is missing, truncated, not XML or not a network.
    """
    try:
        state = net_file.stat()
    except OSError as error:
        raise NetworkError(f"{net_file}: no such network file") from error
    if not net_file.is_file():
        raise NetworkError(f"{net_file}: no such network file")
    return _read(net_file, state.st_mtime_ns, state.st_size)


@lru_cache(maxsize=KEPT)
def _read(net_file: Path, _changed: int, _size: int) -> Net:
    """Parse a network; a file that has changed is read anew."""
    handler = _Handler()
    parser = expat.ParserCreate()
    parser.StartElementHandler = handler.start
    parser.EndElementHandler = handler.end
    opener = gzip.open if net_file.suffix == ".gz" else open
    try:
        with opener(net_file, "rb") as source:
            parser.ParseFile(cast("IO[bytes]", source))
        handler.connect()
    except NetworkError as error:
        raise NetworkError(f"{net_file}: {error}{_advice(handler.root)}") from error
    except (expat.ExpatError, EOFError, zlib.error, LookupError, ValueError) as error:
        raise NetworkError(
            f"{net_file}: truncated or damaged network file ({error})"
        ) from error
    except OSError as error:
        raise NetworkError(f"{net_file}: cannot be read ({error})") from error
    return Net(net_file, handler.left_hand, handler.edges, handler.junctions)


def _named(tag: str, attributes: dict[str, str]) -> str:
    """Name an element for a message."""
    return f'<{tag} id="{attributes["id"]}">' if "id" in attributes else f"<{tag}>"


def _advice(root: str) -> str:
    """Name the way from a file of another kind to a network."""
    if root == "OpenDRIVE":
        return "; netconvert --opendrive-files FILE -o FILE.net.xml makes a network"
    if root == "osm":
        return "; netconvert --osm-files FILE -o FILE.net.xml makes a network"
    if root in ("configuration", "sumoConfiguration"):
        return "; its net-file is the network"
    return ""


def _on_pavement(link: Link) -> bool:
    """Check whether people on foot cross no road by a link."""
    source, target = link.source.edge.function, link.target.edge.function
    return target == "walkingarea" or (source == "walkingarea" and target != "crossing")


def _allows_cars(attributes: dict[str, str]) -> bool:
    """Read the permissions of a lane."""
    allow, disallow = attributes.get("allow"), attributes.get("disallow")
    if allow is not None:
        return bool({VEHICLE_CLASS, "all"} & set(allow.split()))
    return not {VEHICLE_CLASS, "all"} & set((disallow or "").split())


def _has_cars(classes: str) -> bool:
    """Check whether a list of vehicle classes has cars in it; an empty one has all."""
    return not classes or bool({VEHICLE_CLASS, "all"} & set(classes.split()))


def _points(text: str, name: str) -> NDArray[np.float64]:
    """Parse a shape; heights are left out.

    Raises:
        NetworkError: If it is not a list of finite points.
    """
    try:
        points = np.array([[float(x) for x in p.split(",")[:2]] for p in text.split()])
    except ValueError as error:
        raise NetworkError(f"{name}: the shape is damaged ({error})") from error
    if points.shape != (len(points), 2) or not np.isfinite(points).all():
        raise NetworkError(f'{name}: the shape "{text[:40]}" is not a list of points')
    return points


def check_route(net: Net, route: Sequence[str], lane: int | None = None) -> None:
    """Check that a car can follow `route` from lane index `lane` of its first edge.

    Args:
        net: The network.
        route: Edge ids.
        lane: None: any lane will do.

    Raises:
        NetworkError: If an edge is unknown, two edges are not connected for cars, or
            the lane does not exist or is closed to cars.
    """
    if not route:
        raise NetworkError(f"{net.file}: the route is empty")
    for edge_id in route:
        if edge_id not in net.edges or net.edges[edge_id].internal:
            raise NetworkError(
                f'{net.file}: no edge "{edge_id}"; {_close_edges(net, edge_id)}'
            )
        if not net.edges[edge_id].drivable_lanes:
            raise NetworkError(f'{net.file}: edge "{edge_id}" has no lane for cars')
    for first, second in pairwise(route):
        if not net.edges[first].links_to(net.edges[second]):
            raise NetworkError(
                f'{net.file}: no car can go from edge "{first}" to "{second}"; '
                f"{_onward(net.edges[first])}"
            )
    indices = [item.index for item in net.edges[route[0]].drivable_lanes]
    if lane is not None and lane not in indices:
        raise NetworkError(
            f'{net.file}: edge "{route[0]}" has no lane {lane} for cars, only {indices}'
        )


def _onward(edge: Edge) -> str:
    """Name the edges that a car can go on to."""
    links = [x for lane in edge.drivable_lanes for x in lane.links if x.target.drivable]
    ids = sorted({link.target.edge.id for link in links})
    return f"it leads to {', '.join(ids[:LISTED])}" if ids else "it is a dead end"


def _close_edges(net: Net, edge_id: str) -> str:
    """Name the edges whose ids resemble `edge_id`, or a few of all."""
    ids = sorted(edge.id for edge in net.roads)
    close = (
        get_close_matches(edge_id, ids, n=3, cutoff=0.5) if len(ids) < SEARCHED else []
    )
    if close:
        return "did you mean " + " or ".join(f'"{name}"' for name in close) + "?"
    more = f" and {len(ids) - LISTED} more" if len(ids) > LISTED else ""
    return "there are " + ", ".join(ids[:LISTED]) + more
