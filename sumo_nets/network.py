"""A road network, the ego's route through it, and the streams of its traffic."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Self

from sumo_nets.centre_line import Segment
from sumo_nets.errors import NetworkError
from sumo_nets.nearby_routes import crossing_routes, turning_routes
from sumo_nets.net_reader import read_net
from sumo_nets.net_records import Net
from sumo_nets.route_check import check_route

# Share of the vehicles along a user's route that turn off somewhere.
TURNING = 0.3


@dataclass(frozen=True, slots=True)
class Turn:
    """One route of the traffic of a stream."""

    route: tuple[str, ...]  # edge ids
    share: float  # of the stream's vehicles, relative to the other turns


@dataclass(frozen=True, slots=True)
class Stream:
    """Traffic that enters on one edge.

    The name says which flow of a demand feeds it: "own", "oncoming", or "cross_..." for
    an arm that crosses the ego's route.
    """

    name: str
    turns: tuple[Turn, ...]


@dataclass(frozen=True, slots=True)
class Network:
    """A road network and the ego's route through it."""

    name: str
    net_file: Path
    route: tuple[str, ...]  # edge ids; reaches beyond the last junction
    lane: int  # the ego's lane; 0 is the rightmost
    streams: tuple[Stream, ...]
    description: str
    segments: tuple[Segment, ...] = ()  # of the reference line, if known exactly

    @classmethod
    def from_file(cls, path: str | Path, route: Sequence[str], lane: int = 0) -> Self:
        """Build the record of a user's network.

        Traffic: "own" along the ego's route, of which a part turns off; "oncoming" the
        same way back if every edge has a counterpart; "cross_..." from every other
        road into the junctions of the route, evenly over their turns.

        Args:
            path: The .net.xml (or .net.xml.gz).
            route: Edge ids; must reach beyond the last junction, since traffic at a
                junction does not see an ego whose route ends before it.
            lane: The ego's lane, 0 is the rightmost.

        Raises:
            NetworkError: If the file is missing, truncated or not a network, an edge
                is unknown or not connected to the next, or there is no such lane.
        """
        net_file = Path(path)
        edges = tuple(route)
        net = read_net(net_file)
        check_route(net, edges, lane)
        streams = [Stream("own", _turns(net, edges))]
        back = _way_back(net, edges)
        if back:
            streams.append(Stream("oncoming", _turns(net, back)))
        for arm, ways in crossing_routes(net, edges).items():
            if arm not in back:
                turns = tuple(Turn(way, 1.0) for way in ways)
                streams.append(Stream(f"cross_{arm}", turns))
        return cls(
            name=net_file.name.removesuffix(".gz").removesuffix(".net.xml"),
            net_file=net_file,
            route=edges,
            lane=lane,
            streams=tuple(streams),
            description=f"{net_file} from {edges[0]} to {edges[-1]}",
        )

    def check(self) -> None:
        """Check the network file and every route through it.

        Raises:
            NetworkError: As `from_file`.
        """
        net = read_net(self.net_file)
        check_route(net, self.route, self.lane)
        for stream in self.streams:
            for turn in stream.turns:
                check_route(net, turn.route)


def _turns(net: Net, route: tuple[str, ...]) -> tuple[Turn, ...]:
    """Return a route, and those that leave it on the way."""
    leaving = turning_routes(net, route)
    share = TURNING / max(len(leaving), 1)
    return (
        Turn(route, 1.0 - TURNING if leaving else 1.0),
        *(Turn(way, share) for way in leaving),
    )


def _way_back(net: Net, route: tuple[str, ...]) -> tuple[str, ...]:
    """Return the edges of the reverse route, () unless it is complete."""
    back: list[str] = []
    for edge_id in reversed(route):
        edge = net.edges[edge_id]
        twins = [
            twin.id
            for twin in net.roads
            if (twin.start, twin.end) == (edge.end, edge.start) and twin.drivable_lanes
        ]
        if not twins:
            return ()
        back.append(twins[0])
    try:
        check_route(net, back)
    except NetworkError:
        return ()
    return tuple(back)
