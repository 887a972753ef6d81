"""Find routes for cars through a network: by chance, or from place to place."""

import heapq
from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from sumo_nets.errors import NetworkError
from sumo_nets.net_records import Edge, Net
from sumo_nets.route_check import check_route

# A random route is tried from so many edges before the network counts as too small.
TRIES = 200

# Edges of a random route: over two junctions if that can be, else over one, or none.
FEWEST_EDGES = (3, 2, 1)


def onward_edges(edge: Edge) -> list[Edge]:
    """List the edges that a car can go on to, sorted by id."""
    links = [link for lane in edge.drivable_lanes for link in lane.links]
    found = {link.target.edge for link in links if link.target.drivable}
    return sorted(found, key=lambda other: other.id)


def length_of(edge: Edge) -> float:
    """Return the length of an edge's first lane for cars [m]."""
    return edge.drivable_lanes[0].length


def random_route(
    net: Net, rng: np.random.Generator, least: float, first: float = 0.0
) -> tuple[str, ...]:
    """Drive at random, never twice over an edge and without turning back.

    Args:
        net: The network.
        rng: Decides where it begins and how it turns.
        least: Length of the route [m].
        first: Least length of its first edge [m].

    Raises:
        NetworkError: If no such route is found.
    """
    roads = [edge for edge in net.roads if edge.drivable_lanes]
    edges = sorted((e for e in roads if length_of(e) >= first), key=lambda e: e.id)
    if not edges:
        raise NetworkError(f"{net.file}: no edge of {first:g} m is open to cars")
    for fewest in FEWEST_EDGES:
        for _ in range(TRIES):
            start = edges[int(rng.integers(len(edges)))]
            route = _wander(start, rng, least, fewest)
            if route is not None:
                return tuple(edge.id for edge in route)
    raise NetworkError(f"{net.file}: no route of {least:g} m was found; name one")


def _wander(
    start: Edge, rng: np.random.Generator, least: float, fewest: int
) -> list[Edge] | None:
    """Drive at random until the route is long enough; None in a dead end before."""
    route, driven = [start], length_of(start)
    while driven < least or len(route) < fewest:
        here = route[-1]
        ways = [
            edge
            for edge in onward_edges(here)
            if edge not in route and edge.end != here.start
        ]
        if not ways:
            return None
        route.append(ways[int(rng.integers(len(ways)))])
        driven += length_of(route[-1])
    return route


def fastest_route(net: Net, places: Sequence[str]) -> tuple[str, ...]:
    """Find the fastest way over edges in a given order, by the limits of the lanes.

    Args:
        net: The network.
        places: Edges: from, via, to.

    Raises:
        NetworkError: If an edge is unknown, or there is no way.
    """
    for place in places:
        check_route(net, [place])
    route = [places[0]]
    for begin, end in pairwise(places):
        route += _fastest(net, begin, end)[1:]
    return tuple(route)


def _fastest(net: Net, begin: str, end: str) -> list[str]:
    """Find the way between two edges, both included (Dijkstra)."""
    before: dict[str, str] = {}
    done: set[str] = set()
    open_edges = [(0.0, begin, "")]
    while open_edges:
        time, name, source = heapq.heappop(open_edges)
        if name in done:
            continue
        done.add(name)
        before[name] = source
        if name == end:
            way = [name]
            while before[way[-1]]:
                way.append(before[way[-1]])
            return way[::-1]
        for edge in onward_edges(net.edges[name]):
            if edge.id not in done:
                speed = max(lane.speed for lane in edge.drivable_lanes)
                heapq.heappush(
                    open_edges,
                    (time + length_of(edge) / max(speed, 0.1), edge.id, name),
                )
    raise NetworkError(f'{net.file}: no car can get from edge "{begin}" to "{end}"')
