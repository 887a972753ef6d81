"""Choose the lanes of a route: dynamic programme over lanes that are connected."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from math import inf
from typing import Any

from sumo_nets.errors import NetworkError
from sumo_nets.net_reader import VEHICLE_CLASS, drivable_lanes

# Costs: a change of lanes outweighs a few edges on a lane that was not wanted.
CHANGE = 10.0
OFF_WANTED = 1.0

# A lane change on an edge shorter than this per lane costs up to twice as much [m].
COMFORTABLE_CHANGE = 40.0


@dataclass(frozen=True, slots=True)
class LaneUse:
    """How an edge is driven: entered on one lane, left on another or the same.

    The fields are sumolib objects; `link` is the connection to the next edge, None on
    the last one.
    """

    entered: Any
    left: Any
    link: Any


# Cost so far, and the uses that lead there.
_Best = tuple[float, tuple[LaneUse, ...]]


def choose_lanes(net: Any, route: Sequence[str], wanted: int) -> tuple[LaneUse, ...]:
    """Find the lanes that keep to index `wanted` with few lane changes.

    Args:
        net: sumolib network, read with internal lanes.
        route: Edge ids, checked.
        wanted: Lane index, 0 is the rightmost.

    Returns:
        One use per edge.

    Raises:
        NetworkError: If no lanes for cars are connected along the whole route.
    """
    edges = [net.getEdge(edge_id) for edge_id in route]
    # Entry lane -> the cheapest way to be on it.
    best: dict[Any, _Best] = {
        lane: (_off(lane, wanted), ()) for lane in drivable_lanes(edges[0])
    }
    for edge, follower in pairwise(edges):
        best = _cross(edge.getOutgoing().get(follower, []), best, wanted)
        if not best:
            raise NetworkError(
                f'no lane for cars from edge "{edge.getID()}" to "{follower.getID()}"'
            )
    _, uses, last = min(
        ((cost, uses, lane) for lane, (cost, uses) in best.items()),
        key=lambda way: (way[0], way[2].getIndex()),
    )
    return (*uses, LaneUse(last, last, None))


def _cross(
    links: Sequence[Any], best: dict[Any, _Best], wanted: int
) -> dict[Any, _Best]:
    """Go from the lanes of one edge over `links` to the lanes of the next."""
    reached: dict[Any, _Best] = {}
    for link in links:
        leaving, entering = link.getFromLane(), link.getToLane()
        if not (leaving.allows(VEHICLE_CLASS) and entering.allows(VEHICLE_CLASS)):
            continue
        base = _off(leaving, wanted) + _off(entering, wanted)
        for lane, (cost, uses) in best.items():
            total = cost + base + _change(lane, leaving)
            if total < reached.get(entering, (inf, ()))[0]:
                reached[entering] = (total, (*uses, LaneUse(lane, leaving, link)))
    return reached


def _off(lane: Any, wanted: int) -> float:
    """Charge a lane other than the wanted one."""
    index: int = lane.getIndex()
    return OFF_WANTED * abs(index - wanted)


def _change(first: Any, second: Any) -> float:
    """Charge changing from one lane of an edge to another."""
    lanes: int = abs(first.getIndex() - second.getIndex())
    length: float = first.getLength()
    shortage = max(0.0, 1.0 - length / (COMFORTABLE_CHANGE * max(lanes, 1)))
    return CHANGE * lanes * (1.0 + shortage)


def via_lanes(net: Any, link: Any) -> tuple[Any, ...]:
    """List the internal lanes that a connection leads over, in driving order."""
    found = []
    via = link.getViaLaneID()
    while via:
        lane = net.getLane(via)
        found.append(lane)
        onward = [
            out for out in lane.getOutgoing() if out.getToLane() is link.getToLane()
        ]
        via = onward[0].getViaLaneID() if onward else ""
    return tuple(found)
