"""Who gives way to whom where a route runs over junctions.

Read from the network alone: SUMO keeps for each movement over a junction which others
it meets (`foes`) and to which of them it has to give way (`response`).
"""

from collections.abc import Sequence
from dataclasses import dataclass

from sumo_nets.errors import NetworkError
from sumo_nets.lane_choice import LaneUse, via_lanes
from sumo_nets.net_reader import Link, Net, NetLane


@dataclass(frozen=True, slots=True, eq=False)
class FoeMovement:
    """A movement of cars that crosses the route's one over a junction, or joins it."""

    link: Link
    inside: tuple[NetLane, ...]  # its lanes inside the junction, in driving order
    goes_first: bool  # whether the route has to give way to it
    gives_way: bool  # whether it has to give way to the route


@dataclass(frozen=True, slots=True, eq=False)
class Passage:
    """The way of a route over one junction where it meets others."""

    junction: str
    link: Link
    inside: tuple[NetLane, ...]
    may_wait_inside: bool  # at the end of its first lane inside
    foes: tuple[FoeMovement, ...]


def passages(net: Net, uses: Sequence[LaneUse]) -> tuple[Passage | None, ...]:
    """Find the junctions of a route at which it meets other movements of cars.

    Args:
        net: The network.
        uses: How each edge of the route is driven.

    Returns:
        One for each use but the last; None where the route meets nobody.

    Raises:
        NetworkError: If lanes inside a junction are missing.
    """
    return tuple(
        None if use.link is None else _passage(net, use.link) for use in uses[:-1]
    )


def _passage(net: Net, link: Link) -> Passage | None:
    """Find the movements that one over a junction meets."""
    junction = net.junctions.get(link.source.edge.end)
    if junction is None or not junction.requests:
        return None
    movements = net.movements(junction)
    own = next((n for n, other in enumerate(movements) if other is link), -1)
    request = junction.requests.get(own)
    if request is None:
        raise NetworkError(
            f'{net.file}: junction "{junction.id}" has no request of the connection '
            f'from "{link.source.id}" to "{link.target.id}": rebuild the network'
        )
    foes = []
    for index, other in enumerate(movements):
        if not request.meets(index) or not other.via:
            continue
        if not (other.source.drivable and other.target.drivable):
            continue
        back = junction.requests.get(index)
        gives_way = back is not None and back.yields_to(own)
        goes_first = request.yields_to(index)
        foes.append(FoeMovement(other, via_lanes(net, other), goes_first, gives_way))
    if not foes:
        return None
    inside = via_lanes(net, link)
    return Passage(junction.id, link, inside, request.cont, tuple(foes))
