"""Demand that comes in SUMO's own files: what they name, and whether it fits a network.

SUMO reads route files piece by piece while it runs: an edge that does not exist would
end an episode in its middle. All files are therefore read to their ends before.
"""

import gzip
import math
import zlib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from difflib import get_close_matches
from functools import lru_cache
from pathlib import Path
from typing import IO, cast
from xml.etree import ElementTree
from xml.parsers import expat

from sumo_nets.errors import NetworkError
from sumo_nets.net_records import Net
from sumo_nets.routes import fastest_route

# Options of a configuration that shape the traffic. None names a file: a configuration
# of somebody else must not write or read any. Neither are those here that the episode
# sets: step length, seed, teleporting, collisions.
TRAFFIC_OPTIONS = frozenset(
    (
        "step-method.ballistic",
        "extrapolate-departpos",
        "lateral-resolution",
        "route-steps",
        "no-internal-links",
        "ignore-junction-blocker",
        "ignore-route-errors",
        "keep-after-arrival",
        "max-num-vehicles",
        "max-num-persons",
        "scale",
        "scale-suffix",
        "waiting-time-memory",
        "startup-wait-threshold",
        "max-depart-delay",
        "sloppy-insert",
        "eager-insert",
        "emergency-insert",
        "insertion-checks",
        "random-depart-offset",
        "lanechange.overtake-right",
        "tls.all-off",
        "tls.actuated.jam-threshold",
        "tls.actuated.detector-length",
        "tls.delay_based.detector-range",
        "tls.yellow.min-decel",
        "railsignal-moving-block",
        "railsignal.moving-block.default-classes",
        "railsignal.moving-block.max-dist",
        "railsignal.max-block-length",
        "railsignal.default-classes",
        "slope-centered",
        "time-to-impatience",
        "default.departspeed",
        "default.departlane",
        "default.action-step-length",
        "default.carfollowmodel",
        "default.speeddev",
        "default.emergencydecel",
        "parking.maneuver",
        "use-stop-ended",
        "use-stop-started",
        "pedestrian.model",
        "pedestrian.timegap-crossing",
        "pedestrian.striping.stripe-width",
        "pedestrian.striping.dawdling",
        "pedestrian.striping.mingap-to-vehicle",
        "pedestrian.striping.jamtime",
        "pedestrian.striping.jamtime.crossing",
        "pedestrian.striping.jamtime.narrow",
        "pedestrian.striping.jamfactor",
        "pedestrian.striping.reserve-oncoming",
        "pedestrian.striping.reserve-oncoming.junctions",
        "pedestrian.striping.reserve-oncoming.max",
        "pedestrian.striping.legacy-departposlat",
        "pedestrian.striping.walkingarea-detail",
        "pedestrian.jupedsim.step-length",
        "pedestrian.jupedsim.exit-tolerance",
        "pedestrian.jupedsim.model",
        "pedestrian.jupedsim.strength-neighbor-repulsion",
        "pedestrian.jupedsim.range-neighbor-repulsion",
        "pedestrian.jupedsim.strength-geometry-repulsion",
        "pedestrian.jupedsim.range-geometry-repulsion",
        "ride.stop-tolerance",
        "mapmatch.distance",
        "mapmatch.junctions",
        "mapmatch.taz",
        "routing-algorithm",
        "weights.turnaround-penalty",
        "weights.reversal-penalty",
        "weights.random-factor",
        "weights.random-factor.dynamic",
        "weights.minor-penalty",
        "weights.tls-penalty",
        "weights.priority-factor",
        "weights.separate-turns",
        "persontrip.walk-opposite-factor",
        "persontrip.walkfactor",
        "persontrip.transfer.car-walk",
        "persontrip.transfer.taxi-walk",
        "persontrip.transfer.walk-taxi",
        "persontrip.default.group",
        "persontrip.taxi.waiting-time",
        "persontrip.ride-public-line",
        "railway.max-train-length",
        "replay-rerouting",
        "device.rerouting.probability",
        "device.rerouting.explicit",
        "device.rerouting.deterministic",
        "device.rerouting.period",
        "device.rerouting.pre-period",
        "device.rerouting.adaptation-weight",
        "device.rerouting.adaptation-steps",
        "device.rerouting.adaptation-interval",
        "device.rerouting.threshold.factor",
        "device.rerouting.threshold.constant",
        "device.rerouting.with-taz",
        "device.rerouting.mode",
        "device.rerouting.synchronize",
        "device.rerouting.railsignal",
        "device.rerouting.bike-speeds",
        "person-device.rerouting.probability",
        "person-device.rerouting.explicit",
        "person-device.rerouting.deterministic",
        "person-device.rerouting.period",
        "person-device.rerouting.mode",
        "person-device.rerouting.scope",
    )
)
RESERVED = ("ego", "ghost@ego")  # ids of the vehicles that an episode adds
EDGE_KEYS = ("edges", "from", "to", "via")
WITH_EDGES = ("route", "trip", "flow", "walk", "personTrip", "ride", "personFlow")
ROOTS = ("routes", "additional", "route-alternatives")
KEPT = 4  # demands in memory


@dataclass(frozen=True, slots=True)
class DemandFiles:
    """Files of a demand, and when and how SUMO is to run them."""

    route_files: tuple[Path, ...]
    additional_files: tuple[Path, ...] = ()
    begin: float = 0.0  # [s]
    options: tuple[tuple[str, str], ...] = ()  # of SUMO's command line
    net_file: Path | None = None  # that the demand was made for, if it says so

    @property
    def files(self) -> tuple[Path, ...]:
        """All files."""
        return (*self.route_files, *self.additional_files)


@dataclass(frozen=True, slots=True)
class NamedVehicle:
    """A vehicle of a route file."""

    id: str
    depart: float  # [s]
    route: tuple[str, ...]  # edges; of a trip: from, via, to
    whole: bool  # whether the route is complete, not only places on it


def read_sumocfg(file: Path) -> DemandFiles:
    """Read the demand of a .sumocfg.

    Raises:
        NetworkError: If it is missing, damaged, or has no demand.
    """
    try:
        root = ElementTree.parse(file).getroot()
    except OSError as error:
        raise NetworkError(f"{file}: no such configuration") from error
    except (ElementTree.ParseError, LookupError, ValueError) as error:
        raise NetworkError(f"{file}: damaged configuration ({error})") from error
    values = {item.tag: item.get("value", "") for item in root.iter()}
    if "load-state" in values:
        raise NetworkError(
            f"{file}: load-state: is not supported; allowed: route-files"
        )
    routes = _paths(file, values.get("route-files", ""))
    if not routes:
        raise NetworkError(f"{file}: names no route-files: there is no demand in it")
    try:
        begin = float(values.get("begin") or 0.0)
    except ValueError:
        begin = math.nan
    if not 0.0 <= begin < math.inf:
        raise NetworkError(
            f'{file}: begin: is "{values["begin"]}"; allowed: seconds >= 0'
        )
    options = [
        (name, value) for name, value in values.items() if name in TRAFFIC_OPTIONS
    ]
    net = _paths(file, values.get("net-file", ""))
    return DemandFiles(
        routes,
        _paths(file, values.get("additional-files", "")),
        begin,
        tuple(options),
        net[0] if net else None,
    )


def _paths(file: Path, value: str) -> tuple[Path, ...]:
    """Split a list of files, which are relative to the configuration."""
    names = (name.strip() for name in value.split(","))  # which may hold blanks
    return tuple((file.parent / name).resolve() for name in names if name)


@dataclass(slots=True)
class _Content:
    """What the route files hold, as far as it is looked at."""

    edges: dict[str, tuple[Path, str]] = field(default_factory=dict)  # -> first user
    routes: dict[str, tuple[str, ...]] = field(default_factory=dict)
    vehicles: dict[str, NamedVehicle] = field(default_factory=dict)
    ids: set[str] = field(default_factory=set)


class _Handler:
    """Collects edges, routes and vehicles from the tags of one file."""

    def __init__(self, file: Path, content: _Content) -> None:
        self.root = ""
        self._file = file
        self._content = content
        self._owner = ""  # the vehicle, person or route that is open, for messages
        self._vehicle: tuple[str, float] | None = None  # that waits for its route

    def start(self, tag: str, attributes: dict[str, str]) -> None:
        """Take in a start tag."""
        self.root = self.root or tag
        name = attributes.get("id", "")
        if name:
            self._owner = f'{tag} "{name}"'
        if tag in ("vehicle", "trip"):
            self._add_vehicle(tag, attributes)
        if tag not in WITH_EDGES:
            return
        for key in EDGE_KEYS:
            for edge in attributes.get(key, "").split():
                self._content.edges.setdefault(edge, (self._file, self._owner))
        if tag == "route" and "edges" in attributes:
            edges = tuple(attributes["edges"].split())
            if self._vehicle is not None:
                owner, depart = self._vehicle
                found = NamedVehicle(owner, depart, edges, whole=True)
                self._content.vehicles[owner] = found
            elif name:
                self._content.routes[name] = edges

    def _add_vehicle(self, tag: str, attributes: dict[str, str]) -> None:
        """Note a vehicle or a trip."""
        name = attributes.get("id", "")
        self._content.ids.add(name)
        try:
            depart = float(attributes.get("depart", "nan"))
        except ValueError:  # "triggered"
            depart = float("nan")
        if tag == "trip":
            places = (
                attributes.get("from", ""),
                *attributes.get("via", "").split(),
                attributes.get("to", ""),
            )
            self._content.vehicles[name] = NamedVehicle(
                name, depart, tuple(x for x in places if x), whole=False
            )
        elif "route" in attributes:
            edges = self._content.routes.get(attributes["route"], ())
            found = NamedVehicle(name, depart, edges, whole=True)
            self._content.vehicles[name] = found
        else:
            self._vehicle = (name, depart)

    def end(self, tag: str) -> None:
        """Take in an end tag."""
        if tag == "vehicle":
            self._vehicle = None


def check_demand(demand: DemandFiles, net: Net) -> None:
    """Check that the files are whole and every edge that they name exists.

    Raises:
        NetworkError: With file, id and what to do.
    """
    content = _content(_stamped(demand))
    unknown = [edge for edge in content.edges if edge not in net.edges]
    if unknown:
        file, owner = content.edges[unknown[0]]
        more = f" ({len(unknown) - 1} more edges are unknown)" if unknown[1:] else ""
        raise NetworkError(
            f'{file}: {owner}: edge "{unknown[0]}" is not in {net.file}{more}; '
            "take the network that the demand was made for"
        )
    taken = sorted(content.ids & set(RESERVED))
    if taken:
        file = demand.route_files[0]
        raise NetworkError(f'{file}: vehicle "{taken[0]}": the id is taken; rename it')


def named_vehicle(demand: DemandFiles, net: Net, name: str) -> NamedVehicle:
    """Find a vehicle of the route files, its route complete.

    Raises:
        NetworkError: If there is none, or it has no route or time of departure.
    """
    vehicles = _content(_stamped(demand)).vehicles
    files = ", ".join(str(file) for file in demand.route_files)
    if name not in vehicles:
        close = get_close_matches(name, list(vehicles)[:5000], n=1)
        hint = f'did you mean "{close[0]}"? ' if close else ""
        raise NetworkError(
            f'{files}: no vehicle "{name}"; {hint}allowed: one of the '
            f"{len(vehicles)} vehicles and trips, not of a flow"
        )
    found = vehicles[name]
    if not found.route or not found.depart >= 0.0:
        raise NetworkError(
            f'{files}: vehicle "{name}": has no {"time" if found.route else "route"} '
            "to take over; allowed: a number as depart, and edges"
        )
    if found.whole:
        return found
    route = fastest_route(net, found.route)
    return NamedVehicle(name, found.depart, route, whole=True)


def _stamped(demand: DemandFiles) -> tuple[tuple[Path, int], ...]:
    """Return the files with the times of their last changes."""
    stamps = []
    for file in demand.files:
        try:
            stamps.append((file, file.stat().st_mtime_ns))
        except OSError as error:
            raise NetworkError(f"{file}: no such demand file") from error
    return tuple(stamps)


@lru_cache(maxsize=KEPT)
def _content(files: Sequence[tuple[Path, int]]) -> _Content:
    """Read all files of a demand."""
    content = _Content()
    for file, _ in files:
        handler = _Handler(file, content)
        parser = expat.ParserCreate()
        parser.StartElementHandler = handler.start
        parser.EndElementHandler = handler.end
        opener = gzip.open if file.suffix == ".gz" else open
        try:
            with opener(file, "rb") as source:
                parser.ParseFile(cast("IO[bytes]", source))
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
    return content


def command_options(demand: DemandFiles) -> Iterator[str]:
    """Return the options of SUMO's command line, files aside."""
    for name, value in demand.options:
        # In one word: a value that looks like an option would be one.
        yield f"--{name}={value}"
