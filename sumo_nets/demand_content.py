"""What demand files name: edges, routes, types, vehicles and where they come from."""

import gzip
import math
import zlib
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache
from pathlib import Path
from typing import IO, NamedTuple, cast
from xml.parsers import expat

from sumo_nets.demand_records import DemandFiles, NamedVehicle
from sumo_nets.errors import NetworkError

EDGE_KEYS = ("edges", "from", "to", "via")
WITH_EDGES = ("route", "trip", "flow", "walk", "personTrip", "ride", "personFlow")
DRIVERS = ("vehicle", "trip", "flow")
DEPARTING = (*DRIVERS, "person", "personFlow", "container", "containerFlow")
NEED_AN_ID = (*DRIVERS, "vType", "vTypeDistribution", "person", "personFlow")
ROOTS = ("routes", "additional", "route-alternatives")
KEPT = 4  # demands in memory
UNITS = (1.0, 60.0, 3600.0, 86_400.0)  # of the parts of a time, from the last [s]


class Place(NamedTuple):
    """Where something stands, for messages."""

    file: Path
    owner: str  # kind and id of the element

    def __str__(self) -> str:
        """Name file and element."""
        return f"{self.file}: {self.owner}"


class WrittenDeparture(NamedTuple):
    """What decides whether vehicles can depart; of many alike one is kept."""

    edges: str  # of the route, or its name; of a trip: from, via, to
    kind: str  # "edges", "route" (a name), "places"
    type: str
    lane: str
    speed: str


@dataclass(frozen=True, slots=True)
class WrittenType:
    """A vType as it is written, with what its car-following model says."""

    file: Path
    attributes: dict[str, str]

    @property
    def vehicle_class(self) -> str:
        """Its class; "" if that is another type's to say."""
        if "refId" in self.attributes:
            return ""
        return self.attributes.get("vClass", "passenger")


@dataclass(slots=True)
class DemandContent:
    """What the files of a demand hold, as far as it is looked at."""

    edges: dict[str, Place] = field(default_factory=dict)  # -> first user
    routes: dict[str, tuple[str, ...]] = field(default_factory=dict)
    vehicles: dict[str, NamedVehicle] = field(default_factory=dict)
    types: dict[str, WrittenType] = field(default_factory=dict)
    departures: dict[WrittenDeparture, Place] = field(default_factory=dict)  # -> first
    ids: dict[str, tuple[Path, ...]] = field(default_factory=dict)  # of anything
    by_name: dict[str, str] = field(
        default_factory=dict
    )  # vehicle -> name of its route
    first: float = math.inf  # departure of anybody [s]
    last: float = -math.inf  # [s]


def read_content(demand: DemandFiles) -> DemandContent:
    """Read all files of a demand.

    Raises:
        NetworkError: If one is missing or damaged, or something in it has no id.
    """
    stamps = []
    for file in demand.files:
        try:
            stamps.append((file, file.stat().st_mtime_ns))
        except OSError as error:
            raise NetworkError(f"{file}: no such demand file") from error
    return _content(tuple(stamps), demand.begin)


@lru_cache(maxsize=KEPT)
def _content(files: Sequence[tuple[Path, int]], begin: float) -> DemandContent:
    """Read files; one that has changed is read anew.

    Args:
        files: With the times of their last changes.
        begin: Of the simulation; who departs before it, SUMO leaves out [s].
    """
    content = DemandContent()
    for file, _ in files:
        parser = expat.ParserCreate()
        handler = _Handler(file, content, parser, begin)
        parser.StartElementHandler = handler.start
        parser.EndElementHandler = handler.end
        opener = gzip.open if file.suffix == ".gz" else open
        try:
            with opener(file, "rb") as source:
                parser.ParseFile(cast("IO[bytes]", source))
        except NetworkError:
            raise
        # An encoding that is not known, or of several bytes, is a lookup or value.
        except (
            expat.ExpatError,
            EOFError,
            zlib.error,
            LookupError,
            ValueError,
        ) as error:
            raise NetworkError(
                f"{file}: truncated or damaged demand ({error})"
            ) from error
        except OSError as error:
            raise NetworkError(f"{file}: cannot be read ({error})") from error
        if handler.root not in ROOTS:
            raise NetworkError(
                f"{file}: the root element is <{handler.root}>; allowed: "
                f"{', '.join(f'<{root}>' for root in ROOTS)}"
            )
    for name, route in content.by_name.items():  # SUMO reads additional files first
        edges = content.routes.get(route, ())
        content.vehicles[name] = replace(content.vehicles[name], route=edges)
    return content


class _Handler:
    """Collects what the tags of one file name."""

    def __init__(
        self,
        file: Path,
        content: DemandContent,
        parser: expat.XMLParserType,
        begin: float,
    ) -> None:
        self.root = ""
        self._begin = begin
        self._file = file
        self._only = (file,)
        self._content = content
        self._parser = parser
        self._owner = ""  # the vehicle, person or route that is open, for messages
        # the open element of `DRIVERS` whose route is in it, and its attributes
        self._driver: tuple[str, dict[str, str]] | None = None
        self._type: WrittenType | None = None  # the last vType
        self._in_calibrator = False  # whose flows have no ids

    def start(self, tag: str, attributes: dict[str, str]) -> None:
        """Take in a start tag."""
        self.root = self.root or tag
        name = attributes.get("id", "")
        if name:
            self._owner = f'{tag} "{name}"'
            files = self._content.ids.setdefault(name, self._only)
            if self._file not in files:
                self._content.ids[name] = (*files, self._file)
        elif tag in NEED_AN_ID and not self._in_calibrator:
            raise NetworkError(
                f"{self._file}: line {self._parser.CurrentLineNumber}: <{tag}> has no "
                "id; allowed: one that no other has"
            )
        self._add_times(tag, attributes)
        if tag == "calibrator":
            self._in_calibrator = True
        elif tag in DRIVERS and not self._in_calibrator:
            self._add_driver(tag, attributes)
        elif tag == "vType":
            self._type = WrittenType(self._file, attributes)
            self._content.types[name] = self._type
        elif tag.startswith("carFollowing-") and self._type is not None:
            self._type.attributes.update(attributes)
        if tag in WITH_EDGES:
            self._add_edges(attributes)
        if tag == "route" and "edges" in attributes:
            self._add_route(name, attributes["edges"])

    def _add_times(self, tag: str, attributes: dict[str, str]) -> None:
        """Note when somebody departs; one whose time is a word may at any time."""
        if tag not in DEPARTING:
            return
        known = attributes.get("depart")
        first = _seconds(known or attributes.get("begin", "0"))
        last = _seconds(known or attributes.get("end", "inf"))
        if math.isnan(first) or math.isnan(last):
            first, last = -math.inf, math.inf
        content = self._content
        content.first = min(content.first, first)
        content.last = max(content.last, last)

    def end(self, tag: str) -> None:
        """Take in an end tag."""
        if tag in DRIVERS:
            self._driver = None
        elif tag == "calibrator":
            self._in_calibrator = False

    def _add_edges(self, attributes: dict[str, str]) -> None:
        """Note every edge that is named, with who names it first."""
        for key in EDGE_KEYS:
            for edge in attributes.get(key, "").split():
                if edge not in self._content.edges:
                    self._content.edges[edge] = Place(self._file, self._owner)

    def _add_route(self, name: str, written: str) -> None:
        """Note a route: of the driver that is open, or one with a name."""
        edges = tuple(written.split())
        if self._driver is None:
            if name:
                self._content.routes[name] = edges
            return
        tag, attributes = self._driver
        self._depart(written, "edges", attributes)
        if tag == "vehicle":
            self._add_vehicle(attributes, edges, whole=True)

    def _add_driver(self, tag: str, attributes: dict[str, str]) -> None:
        """Note a vehicle, trip or flow."""
        self._driver = (tag, attributes)
        if "route" in attributes:
            name = attributes["route"]
            self._depart(name, "route", attributes)
            if tag == "vehicle":
                self._content.by_name[attributes["id"]] = name
                self._add_vehicle(attributes, (), whole=True)
        elif tag == "trip" or "from" in attributes:
            places = " ".join(attributes.get(key, "") for key in ("from", "via", "to"))
            if "from" in attributes and "to" in attributes:
                self._depart(places, "places", attributes)
            if tag == "trip":
                self._add_vehicle(attributes, tuple(places.split()), whole=False)
        elif (
            tag == "vehicle"
        ):  # the route is in it, or SUMO will say that there is none
            self._add_vehicle(attributes, (), whole=True)

    def _add_vehicle(
        self, attributes: dict[str, str], edges: tuple[str, ...], *, whole: bool
    ) -> None:
        """Note a vehicle whose place an ego can take."""
        depart = _seconds(attributes.get("depart", ""))
        name = attributes["id"]
        self._content.vehicles[name] = NamedVehicle(name, depart, edges, whole)

    def _depart(self, edges: str, kind: str, attributes: dict[str, str]) -> None:
        """Note what decides whether a vehicle can depart."""
        if attributes.get("number") == "0":  # of a flow: nobody does
            return
        last = _seconds(attributes.get("end", attributes.get("depart", "")))
        if last < self._begin:
            return
        departure = WrittenDeparture(
            edges,
            kind,
            attributes.get("type", "DEFAULT_VEHTYPE"),
            attributes.get("departLane", ""),
            attributes.get("departSpeed", ""),
        )
        if departure not in self._content.departures:
            self._content.departures[departure] = Place(self._file, self._owner)


def _seconds(written: str) -> float:
    """Read a time [s], also as H:M:S or D:H:M:S; NaN for a word."""
    total = 0.0
    try:
        for part, unit in zip(reversed(written.split(":")), UNITS, strict=False):
            total += float(part) * unit
    except ValueError:  # "triggered"
        return math.nan
    return total if written.count(":") < len(UNITS) else math.nan
