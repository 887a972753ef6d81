"""The junctions on the ego's road: where it meets the movements of others."""

from dataclasses import dataclass

from planner.right_of_way.records import JunctionAhead
from planner.states import FloatArray


@dataclass(frozen=True, slots=True)
class ConflictZone:
    """Where a movement of others comes into the ego's way, or joins it.

    Distances of the others count from the line where they would wait.
    """

    source: str  # lane that the movement comes from
    source_edge: str
    target_edge: str
    inside: tuple[tuple[str, float], ...]  # its lanes in the junction, and their begin
    begin_s: float  # of the zone on the ego's path [m]
    end_s: float  # [m]
    entry: float  # of the zone from the line of the others [m]
    exit: float  # [m]
    limit: float  # of the road they come from [m/s]
    turn_speed: float  # at which they drive over the junction [m/s]
    merges: bool  # whether they go on in the ego's lane
    goes_first: bool  # whether the ego has to give way
    gives_way: bool  # whether they have to give way to the ego
    signal: str  # their traffic light, "" without one
    signal_link: int
    shortest: float = 0.0  # shorter vehicles do not come into the ego's way here [m]


@dataclass(frozen=True, slots=True, eq=False)
class CrossingZone:
    """Where people on foot cross the ego's way."""

    edge: str  # the crossing
    corners: tuple[str, ...]  # edges from which people step on it
    line: FloatArray  # its centre line, (n, 2) [m]
    begin_s: float  # of the zone on the ego's path [m]
    end_s: float  # [m]
    entry: float  # of the ego's way from the begin of the line [m]
    exit: float  # [m]
    goes_first: bool  # whether the ego has to give way
    gives_way: bool  # whether they have to give way to the ego
    signal: str  # their traffic light, "" without one
    signal_link: int


@dataclass(frozen=True, slots=True, eq=False)
class Swing:
    """A stretch on which the ego's body is over lanes of others."""

    begin_s: float  # where the ego's front leaves its lanes [m]
    end_s: float  # where its rear axle is back [m]
    places: FloatArray  # of other lanes that it takes, (n, 2) [m]


@dataclass(frozen=True, slots=True, eq=False)
class RoadJunction:
    """A junction on the ego's road, or a bend where it swings out of its lanes."""

    ahead: JunctionAhead
    zones: tuple[ConflictZone, ...]
    signal: str  # the ego's traffic light, "" without one
    signal_link: int
    swings: tuple[Swing, ...] = ()  # where the ego leaves its lanes, if it does
    crossings: tuple[CrossingZone, ...] = ()
