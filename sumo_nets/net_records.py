"""A road network as it is read: edges, lanes, links, junctions."""

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from sumo_nets.errors import NetworkError

# The class of vehicle whose lanes count as road.
VEHICLE_CLASS = "passenger"

# Of a lane whose element names no width [m], SUMO's value.
DEFAULT_WIDTH = 3.2

# Functions of edges that vehicles drive on.
ROADS = ("normal", "connector", "internal")

# Kinds of junctions whose lights the simulator switches itself, without a program.
SELF_SWITCHED = ("rail_crossing", "rail_signal")


@dataclass(frozen=True, slots=True, eq=False)
class NetLane:
    """A lane of an edge; lane 0 is the one at the kerb."""

    id: str
    edge: "Edge" = field(repr=False)
    index: int
    width: float  # [m]
    speed: float  # limit for cars [m/s]
    length: float  # as the simulator counts it, not that of the shape [m]
    drivable: bool  # whether cars may use it
    shape_text: str = field(repr=False)
    links: list["Link"] = field(default_factory=list, repr=False)  # that lead away
    leads_up: bool = True  # whether cars may change to the lane of the next index
    leads_down: bool = True  # ... and to the one of the index before

    @property
    def points(self) -> NDArray[np.float64]:
        """Centre line without its height, (n, 2) [m].

        Raises:
            NetworkError: If the shape is not a list of points.
        """
        return _points(self.shape_text, f'lane "{self.id}"')


@dataclass(frozen=True, slots=True, eq=False)
class Edge:
    """A road in one direction."""

    id: str
    function: str
    start: str  # junction, "" inside one
    end: str
    lanes: list[NetLane] = field(default_factory=list, repr=False)  # by index

    @property
    def internal(self) -> bool:
        """Whether it lies inside a junction."""
        return self.function == "internal"

    @property
    def drivable_lanes(self) -> list[NetLane]:
        """Lanes that cars may use, by index."""
        return [lane for lane in self.lanes if lane.drivable]

    def links_to(self, other: "Edge") -> list["Link"]:
        """List the links from lanes for cars to lanes for cars of another edge."""
        links = [link for lane in self.drivable_lanes for link in lane.links]
        return [x for x in links if x.target.edge is other and x.target.drivable]


@dataclass(frozen=True, slots=True, eq=False)
class Link:
    """A connection of two lanes."""

    source: NetLane
    target: NetLane
    via: str  # lane inside the junction, "" without one
    signal: str  # traffic light, "" without one
    signal_link: int  # place in the light's state string
    state: str  # right of way, SUMO's letter: M m = s w Z; with a signal o


@dataclass(frozen=True, slots=True)
class Request:
    """What a movement over a junction has to do with the others there.

    `response` and `foes` are strings of 0 and 1, the movement of index 0 last.
    """

    response: str  # to which movements it has to give way
    foes: str  # which movements it meets
    cont: bool  # whether a vehicle may wait inside the junction

    def yields_to(self, index: int) -> bool:
        """Check whether the movement gives way to the one of an index."""
        return self.response[-1 - index : len(self.response) - index] == "1"

    def meets(self, index: int) -> bool:
        """Check whether the movement meets the one of an index."""
        return self.foes[-1 - index : len(self.foes) - index] == "1"


@dataclass(frozen=True, slots=True, eq=False)
class Junction:
    """A node of the network."""

    id: str
    kind: str
    shape_text: str = field(repr=False)
    incoming: tuple[str, ...] = field(default=(), repr=False)  # lanes that end here
    requests: dict[int, Request] = field(default_factory=dict, repr=False)  # by index

    @property
    def outline(self) -> NDArray[np.float64]:
        """Corners of its area, (n, 2) [m]; dead ends have fewer than three.

        Raises:
            NetworkError: If the shape is not a list of points.
        """
        if not self.shape_text.strip():
            return np.empty((0, 2))
        return _points(self.shape_text, f'junction "{self.id}"')


@dataclass(frozen=True, slots=True, eq=False)
class Net:
    """A road network."""

    file: Path
    left_hand: bool
    edges: dict[str, Edge] = field(repr=False)
    junctions: dict[str, Junction] = field(repr=False)

    @property
    def roads(self) -> list[Edge]:
        """Edges outside junctions that vehicles drive on."""
        return [e for e in self.edges.values() if e.function in ROADS[:2]]

    def at(self, junction: str) -> list[Edge]:
        """List the edges that begin or end at a junction."""
        return [e for e in self.edges.values() if junction in (e.start, e.end)]

    def lane(self, lane_id: str) -> NetLane:
        """Get a lane.

        Raises:
            NetworkError: If there is none of this id.
        """
        edge_id, _, index = lane_id.rpartition("_")
        edge = self.edges.get(edge_id)
        for lane in edge.lanes if edge is not None else ():
            if str(lane.index) == index:
                return lane
        raise NetworkError(f'{self.file}: no lane "{lane_id}"')

    def movements(self, junction: Junction) -> list[Link]:
        """List the movements over a junction by their index, those of cars or not.

        Steps from a pavement to a corner of the junction and back have no index.
        """
        links = [link for lane in junction.incoming for link in self.lane(lane).links]
        return [link for link in links if not _on_pavement(link)]


def _on_pavement(link: Link) -> bool:
    """Check whether people on foot cross no road by a link."""
    source, target = link.source.edge.function, link.target.edge.function
    return target == "walkingarea" or (source == "walkingarea" and target != "crossing")


def _points(text: str, name: str) -> NDArray[np.float64]:
    """Parse a shape; heights are left out.

    Raises:
        NetworkError: If it is not a list of finite points.
    """
    try:
        points = np.array([[float(x) for x in p.split(",")[:2]] for p in text.split()])
    except ValueError as error:
        raise NetworkError(f"{name}: the shape is damaged ({error})") from error
    if points.shape != (len(points), 2) or not np.isfinite(points).all():
        raise NetworkError(f'{name}: the shape "{text[:40]}" is not a list of points')
    return points
