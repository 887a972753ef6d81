"""Routes of the traffic that crosses a route, turns into it, or leaves it."""

from collections.abc import Sequence
from itertools import pairwise

from sumo_nets.net_records import Edge, Net
from sumo_nets.routes import length_of, onward_edges

Edges = tuple[str, ...]

# Crossing traffic comes from so far before the junction, if a road leads there [m].
LEAD_IN = 100.0

# Edges before the one that enters the junction, at most.
MOST_BEFORE = 3


def crossing_routes(net: Net, route: Sequence[str]) -> dict[str, tuple[Edges, ...]]:
    """Find the routes over the junctions of a route, by the edge that enters there.

    Edges of the route are left out, and dead ends.
    """
    found: dict[str, tuple[Edges, ...]] = {}
    for before, _ in pairwise(route):
        for arm in sorted(_entering(net, net.edges[before].end), key=lambda e: e.id):
            if arm.id in route or arm.id in found:
                continue
            lead = _lead_in(net, arm)
            routes = tuple((*lead, *_carried_on(onward)) for onward in _ways_on(arm))
            if routes:
                found[arm.id] = routes
    return found


def turning_routes(net: Net, route: Sequence[str]) -> tuple[Edges, ...]:
    """Find the routes that leave a route at its junctions, one for each turn."""
    found: list[Edges] = []
    for number, (before, after) in enumerate(pairwise(route)):
        found += [
            (*route[: number + 1], *_carried_on(onward))
            for onward in _ways_on(net.edges[before])
            if onward.id != after and onward.id not in route
        ]
    return tuple(found)


def _entering(net: Net, junction: str) -> list[Edge]:
    """List the roads for cars that end at a junction."""
    return [e for e in net.at(junction) if _is_road(e) and e.end == junction]


def _is_road(edge: Edge) -> bool:
    """Tell whether cars drive on an edge, outside junctions."""
    return not edge.internal and bool(edge.drivable_lanes)


def _ways_on(edge: Edge) -> list[Edge]:
    """List the edges behind one, without turning back."""
    return [onward for onward in onward_edges(edge) if onward.end != edge.start]


def _lead_in(net: Net, arm: Edge) -> Edges:
    """Go back from an edge until there is room to come up to speed."""
    lead, length = [arm], length_of(arm)
    while length < LEAD_IN and len(lead) <= MOST_BEFORE:
        first = lead[0]
        ways = [e for e in _entering(net, first.start) if first in _ways_on(e)]
        ways = [e for e in ways if e not in lead]
        if not ways:
            break
        longest = max(ways, key=lambda e: (length_of(e), e.id))
        lead.insert(0, longest)
        length += length_of(longest)
    return tuple(edge.id for edge in lead)


def _carried_on(edge: Edge) -> Edges:
    """Go on over one more junction: who ends there would vanish before it."""
    ways = _ways_on(edge)
    return (edge.id, ways[0].id) if ways else (edge.id,)
