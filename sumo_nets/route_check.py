"""Whether a car can follow a route through a network."""

from collections.abc import Sequence
from difflib import get_close_matches
from itertools import pairwise

from sumo_nets.errors import NetworkError
from sumo_nets.net_records import Edge, Net

# Edges that a message lists when none resembles the one asked for.
LISTED = 8

# Networks with more edges are not searched for similar names: it takes seconds.
SEARCHED = 5000


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
                f"{onward_hint(net.edges[first])}"
            )
    indices = [item.index for item in net.edges[route[0]].drivable_lanes]
    if lane is not None and lane not in indices:
        raise NetworkError(
            f'{net.file}: edge "{route[0]}" has no lane {lane} for cars, only {indices}'
        )


def onward_hint(edge: Edge) -> str:
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
