"""Who gives way to whom where a route runs over junctions.

Read from the network alone: SUMO keeps for each movement over a junction which others
it meets (`foes`) and to which of them it has to give way (`response`).
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Final

from sumo_nets.errors import NetworkError
from sumo_nets.lane_choice import LaneUse, via_lanes
from sumo_nets.net_records import Junction, Link, Net, NetLane, Request

UNREGULATED: Final = "unregulated"  # kind of a junction


@dataclass(frozen=True, slots=True, eq=False)
class FoeMovement:
    """A movement of cars that crosses the route's one over a junction, or joins it."""

    link: Link
    inside: tuple[NetLane, ...]  # its lanes inside the junction, in driving order
    goes_first: bool  # whether the route has to give way to it
    gives_way: bool  # whether it has to give way to the route


@dataclass(frozen=True, slots=True, eq=False)
class CrossedPavement:
    """A crossing for people on foot that a route leads over."""

    lane: NetLane  # of the crossing
    corners: tuple[str, ...]  # edges from which people step on it
    goes_first: bool  # whether the route has to give way to them
    gives_way: bool  # whether they have to give way to the route
    signal: str  # their traffic light, "" without one
    signal_link: int


@dataclass(frozen=True, slots=True, eq=False)
class Passage:
    """The way of a route over one junction where it meets others."""

    junction: str
    link: Link
    inside: tuple[NetLane, ...]
    may_wait_inside: bool  # at the end of its first lane inside
    foes: tuple[FoeMovement, ...]
    crossings: tuple[CrossedPavement, ...] = ()
    regulated: bool = True  # without rules the others do not look at each other
    # movements from other roads that do not meet the route, as SUMO sees it
    beside: tuple[FoeMovement, ...] = ()

    @property
    def turning(self) -> tuple[tuple[NetLane, ...], ...]:
        """Lanes of all movements of others: that before, those inside, that behind."""
        every = (*self.foes, *self.beside)
        return tuple((x.link.source, *x.inside, x.link.target) for x in every)


def passages(net: Net, uses: Sequence[LaneUse]) -> tuple[Passage | None, ...]:
    """Find the junctions of a route at which it meets others.

    These are movements of cars, and crossings of people on foot.

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
    if junction is None:
        return None
    if junction.kind == UNREGULATED:
        found = _without_rules(net, junction, link)
    elif junction.requests:
        found = _by_table(net, junction, link)
    else:
        return None
    met = {foe.link for foe in found.foes}
    beside = tuple(
        FoeMovement(other, via_lanes(net, other), goes_first=True, gives_way=False)
        for other in _from_other_roads(net, junction, link)
        if other not in met
    )
    if not (found.foes or found.crossings or beside):
        return None
    return replace(found, beside=beside)


def _from_other_roads(net: Net, junction: Junction, link: Link) -> list[Link]:
    """List the movements of cars over a junction that come from another road."""
    return [
        other
        for other in net.movements(junction)
        if other.via
        and other.source.edge is not link.source.edge
        and other.source.drivable
        and other.target.drivable
    ]


def _by_table(net: Net, junction: Junction, link: Link) -> Passage:
    """Read from SUMO's table whom a movement meets, and who goes first."""
    movements = net.movements(junction)
    own = next((n for n, other in enumerate(movements) if other is link), -1)
    request = junction.requests.get(own)
    if request is None:
        raise NetworkError(
            f'{net.file}: junction "{junction.id}" has no request of the connection '
            f'from "{link.source.id}" to "{link.target.id}": rebuild the network'
        )
    foes = []
    crossings = []
    for index, other in enumerate(movements):
        if not request.meets(index):
            continue
        if other.target.edge.function == "crossing":
            crossings.append(_crossed(other, index, request, junction.requests, own))
        if not other.via:
            continue
        if not (other.source.drivable and other.target.drivable):
            continue
        back = junction.requests.get(index)
        gives_way = back is not None and back.yields_to(own)
        goes_first = request.yields_to(index)
        foes.append(FoeMovement(other, via_lanes(net, other), goes_first, gives_way))
    inside = via_lanes(net, link)
    return Passage(
        junction.id, link, inside, request.cont, tuple(foes), tuple(crossings)
    )


def _without_rules(net: Net, junction: Junction, link: Link) -> Passage:
    """List who may come over a junction whose vehicles do not look at each other.

    SUMO keeps no foes of such a junction. The route gives way to whoever comes from
    another road.
    """
    foes = tuple(
        FoeMovement(other, via_lanes(net, other), goes_first=True, gives_way=False)
        for other in _from_other_roads(net, junction, link)
    )
    inside = via_lanes(net, link)
    return Passage(
        junction.id, link, inside, may_wait_inside=False, foes=foes, regulated=False
    )


def _crossed(
    link: Link, index: int, request: Request, requests: Mapping[int, Request], own: int
) -> CrossedPavement:
    """Read who goes first at a crossing.

    Args:
        link: From a corner of the junction onto the crossing.
        index: Of that movement.
        request: Of the route's movement.
        requests: Of all movements over the junction, by index.
        own: Index of the route's movement.
    """
    back = requests.get(index)
    beyond = [onward.target.edge.id for onward in link.target.links]
    return CrossedPavement(
        lane=link.target,
        corners=(link.source.edge.id, *beyond),
        goes_first=request.yields_to(index),
        gives_way=back is not None and back.yields_to(own),
        signal=link.signal,
        signal_link=link.signal_link,
    )
