"""Read a .net.xml safely and check that a route runs through it.

libsumo dies of a segmentation fault on a truncated network, which no caller can catch:
every network is therefore parsed to its end here before a simulator sees it.
"""

import gzip
import zlib
from collections.abc import Sequence
from difflib import get_close_matches
from itertools import pairwise
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import sumolib.net

from sumo_nets.errors import NetworkError

# The class of vehicle whose lanes count as road.
VEHICLE_CLASS = "passenger"

# Number of edges that a message lists when none resembles the requested one.
LISTED = 8


def check_complete(net_file: Path) -> None:
    """Check that `net_file` is a complete SUMO network.

    Raises:
        NetworkError: If it is missing, truncated, not XML or not a network.
    """
    if not net_file.is_file():
        raise NetworkError(f"{net_file}: no such network file")
    root = ""
    try:
        opener = gzip.open if net_file.suffix == ".gz" else open
        with opener(net_file, "rb") as source:
            for event, element in ElementTree.iterparse(source, ("start", "end")):
                root = root or element.tag
                if event == "end":
                    element.clear()
    except (ElementTree.ParseError, EOFError, zlib.error) as error:
        raise NetworkError(
            f"{net_file}: truncated or damaged network file ({error})"
        ) from error
    except OSError as error:
        raise NetworkError(f"{net_file}: cannot be read ({error})") from error
    if root != "net":
        raise NetworkError(f"{net_file}: the root element is <{root}>, not <net>")


def read_net(net_file: Path) -> Any:
    """Read a complete network with its junction-internal lanes.

    Returns:
        The `sumolib.net.Net`.

    Raises:
        NetworkError: If the file is missing, truncated, not XML or not a network.
    """
    check_complete(net_file)
    try:
        return sumolib.net.readNet(str(net_file), withInternal=True)
    except (LookupError, ValueError, TypeError, AttributeError) as error:
        # sumolib takes the attributes of a network for granted.
        raise NetworkError(
            f"{net_file}: not a SUMO network ({type(error).__name__}: {error})"
        ) from error


def drivable_lanes(edge: Any) -> list[Any]:
    """List the lanes of a sumolib edge that cars may use, right to left."""
    return [lane for lane in edge.getLanes() if lane.allows(VEHICLE_CLASS)]


def check_route(net: Any, net_file: Path, route: Sequence[str], lane: int) -> None:
    """Check that a car can follow `route` from lane index `lane` of its first edge.

    Raises:
        NetworkError: If an edge is unknown, two edges are not connected for cars, or
            the lane does not exist or is closed to cars.
    """
    if not route:
        raise NetworkError(f"{net_file}: the route is empty")
    for edge_id in route:
        if not net.hasEdge(edge_id) or edge_id.startswith(":"):
            raise NetworkError(
                f'{net_file}: no edge "{edge_id}"; {_close_edges(net, edge_id)}'
            )
    for first, second in pairwise(route):
        follower = net.getEdge(second)
        links = net.getEdge(first).getOutgoing().get(follower, [])
        if not any(_open_to_cars(link) for link in links):
            raise NetworkError(
                f'{net_file}: no car can go from edge "{first}" to "{second}"'
            )
    indices = [item.getIndex() for item in drivable_lanes(net.getEdge(route[0]))]
    if lane not in indices:
        raise NetworkError(
            f'{net_file}: edge "{route[0]}" has no lane {lane} for cars, only {indices}'
        )


def _open_to_cars(link: Any) -> bool:
    """Check whether a connection leads from a lane for cars to a lane for cars."""
    lanes = (link.getFromLane(), link.getToLane())
    return all(lane.allows(VEHICLE_CLASS) for lane in lanes)


def _close_edges(net: Any, edge_id: str) -> str:
    """List the edges whose ids resemble `edge_id`, or a few of all."""
    ids = sorted(edge.getID() for edge in net.getEdges(withInternal=False))
    close = get_close_matches(edge_id, ids, n=3, cutoff=0.5)
    if close:
        return "did you mean " + " or ".join(f'"{name}"' for name in close) + "?"
    more = f" and {len(ids) - LISTED} more" if len(ids) > LISTED else ""
    return "there are " + ", ".join(ids[:LISTED]) + more
