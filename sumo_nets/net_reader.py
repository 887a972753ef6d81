"""Read a .net.xml safely and check that a route runs through it.

libsumo dies of a segmentation fault on a truncated network, which no caller can catch:
every network is therefore parsed to its end here before a simulator sees it. Shapes
stay text until they are asked for: of a city's network a route needs a few.
"""

import gzip
import math
import zlib
from collections.abc import Callable, Mapping
from functools import lru_cache
from pathlib import Path
from typing import IO, Any, cast
from xml.parsers import expat

from sumo_nets.errors import NetworkError
from sumo_nets.net_records import (
    DEFAULT_WIDTH,
    SELF_SWITCHED,
    VEHICLE_CLASS,
    Edge,
    Junction,
    Link,
    Net,
    NetLane,
    Request,
)

# Networks kept in memory: an episode reads its own several times.
KEPT = 2


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
            self._restrictions[self._type] = _number(attributes, "speed")

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
            _number({"width": DEFAULT_WIDTH, **attributes}, "width"),
            _number(attributes, "speed") if limit is None else limit,
            _number(attributes, "length"),
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
        ruled = next((x.id for x in self.junctions.values() if x.requests), None)
        if ruled is not None and not self.connections:
            raise NetworkError(
                f'no <connection> leads over junction "{ruled}", or any other: rebuild '
                "the network by netconvert"
            )
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
        raise NetworkError(f"{net_file}: is no file; allowed: a network")
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


def _number(attributes: Mapping[str, Any], key: str) -> float:
    """Read a number that is finite."""
    try:
        number = float(attributes[key])
    except ValueError:
        number = math.nan
    if not math.isfinite(number):
        raise ValueError(f'{key}="{attributes[key]}" is not a number')
    return number


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


def _allows_cars(attributes: dict[str, str]) -> bool:
    """Read the permissions of a lane."""
    allow, disallow = attributes.get("allow"), attributes.get("disallow")
    if allow is not None:
        return bool({VEHICLE_CLASS, "all"} & set(allow.split()))
    return not {VEHICLE_CLASS, "all"} & set((disallow or "").split())


def _has_cars(classes: str) -> bool:
    """Check whether a list of vehicle classes has cars in it; an empty one has all."""
    return not classes or bool({VEHICLE_CLASS, "all"} & set(classes.split()))
