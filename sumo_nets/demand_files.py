"""Checks of demand that comes in SUMO's own files.

SUMO reads route files without a look at what is on the road later: a route that is
not connected would end an episode in its middle. What SUMO refuses as it reads the
files stays its own to say; `explained_refusal` adds the file.
"""

import math
import re
from collections.abc import Sequence
from difflib import get_close_matches
from pathlib import Path

from sumo_nets.demand_content import DemandContent, WrittenType, read_content
from sumo_nets.demand_departures import check_departures
from sumo_nets.demand_records import DemandFiles, NamedVehicle
from sumo_nets.errors import NetworkError
from sumo_nets.net_records import Net
from sumo_nets.routes import fastest_route

RESERVED = ("ego", "ghost@ego")  # ids of the vehicles that an episode adds
DISTRIBUTIONS = ("speedFactor",)  # attributes that may be drawn for each vehicle
DISTRIBUTION = re.compile(r"(norm|normc)\([^()]+\)|[0-9.e+-]+")
SHOWN = 10  # names in a message
SEARCHED = 5000  # names, among which one is looked for that may be meant

FOLLOWING_MODELS = (
    "ACC BKerner CACC CC Daniel1 EIDM IDM IDMM Krauss KraussOrig1 KraussPS KraussX "
    "PWagner2009 Rail SmartSK W99 Wiedemann"
)
CHANGING_MODELS = "DK2008 LC2013 LC2013_CC SL2015 default"


def check_demand(demand: DemandFiles, net: Net) -> None:
    """Check that the files are whole, and that their vehicles can depart.

    Raises:
        NetworkError: With file, id and what to do.
    """
    content = read_content(demand)
    unknown = [edge for edge in content.edges if edge not in net.edges]
    if unknown:
        place = content.edges[unknown[0]]
        more = f" ({len(unknown) - 1} more edges are unknown)" if unknown[1:] else ""
        raise NetworkError(
            f'{place}: edge "{unknown[0]}" is not in {net.file}{more}; '
            "take the network that the demand was made for"
        )
    for kind, there in (("vehicle", content.vehicles), ("vType", content.types)):
        for name in RESERVED:
            if name in there:
                file = content.ids[name][0]
                raise NetworkError(
                    f'{file}: {kind} "{name}": the id is taken; rename it'
                )
    if dict(demand.options).get("ignore-route-errors", "false") == "false":
        check_departures(content, net)


def times_missed(demand: DemandFiles, end: float) -> str:
    """Say so if nobody departs between the begin of a simulation and `end` [s].

    Returns:
        A sentence without its subject; "" if somebody may depart.

    Raises:
        NetworkError: If a file is missing or damaged.
    """
    content = read_content(demand)
    if content.first > content.last:
        return "nobody departs"
    if content.last >= demand.begin and content.first <= end:
        return ""
    last = f" to {content.last:g} s" if math.isfinite(content.last) else " on"
    return (
        f"they depart from {content.first:g} s{last}, the simulation is "
        f"from {demand.begin:g} s to {end:g} s; take another traffic.begin_s"
    )


def named_vehicle(demand: DemandFiles, net: Net, name: str) -> NamedVehicle:
    """Find a vehicle of the route files, its route complete.

    Raises:
        NetworkError: If there is none, or it has no route or time of departure.
    """
    vehicles = read_content(demand).vehicles
    files = _listed(demand.route_files)
    if name not in vehicles:
        raise NetworkError(
            f'{files}: no vehicle "{name}"; {_meant(name, list(vehicles))}allowed: one '
            f"of the {len(vehicles)} vehicles and trips, not of a flow"
            + (f": {', '.join(vehicles)}" if 0 < len(vehicles) <= SHOWN else "")
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


def explained_refusal(demand: DemandFiles, words: str) -> str:
    """Add to what SUMO says of a demand the file, and what is allowed.

    Args:
        demand: That SUMO refused.
        words: SUMO's own, in one line; ids are in single quotes.
    """
    content = read_content(demand)
    quoted = re.findall(r"'([^']*)'", words)
    named = [name for name in quoted if name in content.ids]
    said = words.rstrip(". ") + _allowed(content, words)
    if named:
        # of a type and its vehicle the vehicle, which is named last
        return f"{_listed(content.ids[named[-1]])}: {said}"
    for name, vehicle_type in content.types.items():
        key = _mistaken_key(vehicle_type, words, quoted)
        if key is not None:
            value = vehicle_type.attributes[key]
            return f'{vehicle_type.file}: vType "{name}": {key}="{value}": {said}'
    return f"{_listed(demand.files)}: {said}"


def _listed(files: Sequence[Path]) -> str:
    """List files."""
    return ", ".join(str(file) for file in files)


def _mistaken_key(
    vehicle_type: WrittenType, words: str, quoted: Sequence[str]
) -> str | None:
    """Find the attribute of a type that SUMO speaks of without naming the type."""
    most = 1.0 if "[0-1]" in words else math.inf
    for key, value in vehicle_type.attributes.items():
        if value in quoted:
            return key
        spoken_of = re.search(rf"\b{re.escape(key)}\b", words) is not None
        if key in DISTRIBUTIONS and "distribution" in words:
            if not DISTRIBUTION.fullmatch(value):
                return key
        elif spoken_of and not _is_between(value, most):
            return key
    return None


def _is_between(value: str, most: float) -> bool:
    """Check whether a word is a number above 0, and at most another one."""
    try:
        return 0.0 < float(value) <= most
    except ValueError:
        return False


def _allowed(content: DemandContent, words: str) -> str:
    """Return what is allowed where SUMO says only that something is unknown."""
    unknown = re.search(r"vehicle type '([^']*)' .*not known", words)
    if unknown is not None:
        hint = _meant(unknown[1], list(content.types))
        return f"; {hint}allowed: a vType that is defined before"
    if "Unknown car following model" in words:
        return f"; allowed: {', '.join(FOLLOWING_MODELS.split())}"
    if "Unknown lane change model" in words:
        return f"; allowed: {', '.join(CHANGING_MODELS.split())}"
    return ""


def _meant(name: str, known: Sequence[str]) -> str:
    """Ask whether a name like the given one is meant; "" if none is alike."""
    close = get_close_matches(name, known[:SEARCHED], n=1)
    return f'did you mean "{close[0]}"? ' if close else ""
