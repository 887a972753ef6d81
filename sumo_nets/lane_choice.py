"""Choose the lanes of a route: dynamic programme over lanes that are connected."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from math import inf

from sumo_nets.errors import NetworkError
from sumo_nets.net_records import Link, Net, NetLane

# Costs: a change of lanes outweighs a few edges on a lane that was not wanted.
CHANGE = 10.0
OFF_WANTED = 1.0

# Crossing a line that is closed to changes: only where nothing else leads on.
SOLID = 1000.0

# A lane change on an edge shorter than this per lane costs up to twice as much [m].
COMFORTABLE_CHANGE = 40.0


@dataclass(frozen=True, slots=True)
class LaneUse:
    """How an edge is driven: entered on one lane, left on another or the same.

    `link` is the connection to the next edge, None on the last one.
    """

    entered: NetLane
    left: NetLane
    link: Link | None


# Cost so far, and the uses that lead there.
_Best = tuple[float, tuple[LaneUse, ...]]


def choose_lanes(net: Net, route: Sequence[str], wanted: int) -> tuple[LaneUse, ...]:
    """Find the lanes that keep to index `wanted` with few lane changes.

    Args:
        net: The network.
        route: Edge ids, checked.
        wanted: NetLane index, 0 is the rightmost.

    Returns:
        One use per edge.

    Raises:
        NetworkError: If no lanes for cars are connected along the whole route.
    """
    edges = [net.edges[edge_id] for edge_id in route]
    # Entry lane -> the cheapest way to be on it.
    best: dict[NetLane, _Best] = {
        lane: (_off(lane, wanted), ()) for lane in edges[0].drivable_lanes
    }
    for edge, follower in pairwise(edges):
        best = _cross(edge.links_to(follower), best, wanted)
        if not best:
            raise NetworkError(
                f'{net.file}: no lane for cars from edge "{edge.id}" to "{follower.id}"'
            )
    _, uses, last = min(
        ((cost, uses, lane) for lane, (cost, uses) in best.items()),
        key=lambda way: (way[0], way[2].index),
    )
    return (*uses, LaneUse(last, last, None))


def replaced_start(net: Net, route: Sequence[str], wanted: int) -> str | None:
    """Say why a route does not begin in the wanted lane; None if it does.

    Args:
        net: The network.
        route: Edge ids, checked.
        wanted: Lane of the first edge, 0 is the rightmost.

    Raises:
        NetworkError: As `choose_lanes`.
    """
    taken = choose_lanes(net, route, wanted)[0].entered.index
    if taken == wanted:
        return None
    first = net.edges[route[0]]
    onward = first.links_to(net.edges[route[1]])
    if any(link.source.index == wanted for link in onward):
        why = f'from "{route[1]}" on, it asks for more changes of lanes'
    else:
        why = f'it does not lead on to "{route[1]}"'
    return (
        f'{net.file}: the ego begins in lane {taken} of edge "{first.id}", '
        f"not in lane {wanted}: {why}"
    )


def _cross(
    links: Sequence[Link], best: dict[NetLane, _Best], wanted: int
) -> dict[NetLane, _Best]:
    """Go from the lanes of one edge over `links` to the lanes of the next."""
    reached: dict[NetLane, _Best] = {}
    for link in links:
        leaving, entering = link.source, link.target
        base = _off(leaving, wanted) + _off(entering, wanted)
        for lane, (cost, uses) in best.items():
            total = cost + base + _change(lane, leaving) + _solid(lane, leaving)
            if total < reached.get(entering, (inf, ()))[0]:
                reached[entering] = (total, (*uses, LaneUse(lane, leaving, link)))
    return reached


def _off(lane: NetLane, wanted: int) -> float:
    """Charge a lane other than the wanted one."""
    return OFF_WANTED * abs(lane.index - wanted)


def _change(first: NetLane, second: NetLane) -> float:
    """Charge changing from one lane of an edge to another."""
    lanes = abs(first.index - second.index)
    shortage = max(0.0, 1.0 - first.length / (COMFORTABLE_CHANGE * max(lanes, 1)))
    return CHANGE * lanes * (1.0 + shortage)


def _solid(first: NetLane, second: NetLane) -> float:
    """Charge lines that may not be crossed on the way from one lane to another."""
    step = 1 if second.index > first.index else -1
    lanes = first.edge.lanes[first.index : second.index : step]
    crossed = [not (x.leads_up if step > 0 else x.leads_down) for x in lanes]
    return SOLID * sum(crossed)


def via_lanes(net: Net, link: Link) -> tuple[NetLane, ...]:
    """List the internal lanes that a connection leads over, in driving order."""
    found: list[NetLane] = []
    via = link.via
    while via:
        lane = net.lane(via)
        if lane in found:
            raise NetworkError(f'{net.file}: lane "{via}" leads back to itself')
        found.append(lane)
        onward = [out for out in lane.links if out.target is link.target]
        via = onward[0].via if onward else ""
    return tuple(found)
