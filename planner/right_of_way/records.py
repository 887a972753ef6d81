"""What the rules of a junction are decided from."""

import math
from dataclasses import dataclass
from enum import StrEnum
from typing import NamedTuple


class Rule(StrEnum):
    """Right of way of the ego's movement over a junction; values are SUMO's letters."""

    MAJOR = "M"
    MINOR = "m"
    RIGHT_BEFORE_LEFT = "="
    STOP = "s"
    ALL_WAY_STOP = "w"
    ZIPPER = "Z"
    OFF = "o"  # a signal that does not work: as MINOR
    OFF_MAJOR = "O"


MUST_STOP = frozenset({Rule.STOP, Rule.ALL_WAY_STOP})


@dataclass(frozen=True, slots=True)
class JunctionAhead:
    """The ego's way over a junction; arc lengths are of the reference path [m]."""

    id: str  # of the junction
    rule: Rule
    stop_s: float  # where the front bumper waits
    exit_s: float  # end of the junction
    speed: float  # at which the ego can drive through [m/s]
    wait_s: float | None = None  # where it may wait inside the junction


class Foe(NamedTuple):
    """Another vehicle on its way through the ego's, or into it.

    The zone is where the two bodies could touch: the ego is in it from the moment its
    front bumper passes `begin_s` until its rear one passes `end_s`.
    """

    junction: int  # place in the list of junctions
    vehicle: str
    begin_s: float  # of the zone on the ego's path [m]
    end_s: float  # [m]
    entry: float  # from the other's front to the zone; negative once it is in it [m]
    exit: float  # that its rear bumper has to go until it has left [m]
    to_line: float  # to where it would wait; negative once it is over that [m]
    speed: float  # of the other [m/s]
    limit: float  # that it keeps on its road, one's own excess included [m/s]
    turn_speed: float  # at which its way over the junction is driven [m/s]
    road: float  # length of its road before the line, where the limit holds [m]
    merges: bool  # whether it goes on in the ego's lane
    stood: float  # for how long it has stood [s]; 0 while it moves
    goes_first: bool  # whether the ego has to give way to it
    gives_way: bool  # whether it has to give way to the ego
    held: bool  # by a red light


class AtJunction(NamedTuple):
    """The ego on its way to a junction."""

    front: float  # arc length of the front bumper [m]
    rear: float  # of the rear one [m]
    speed: float  # [m/s]
    target_speed: float  # [m/s]
    deceleration: float  # for braking that can still be asked for [m/s²]
    emergency_deceleration: float  # [m/s²]


class Waiting(NamedTuple):
    """What is remembered of a junction from cycle to cycle."""

    stopped: bool = False  # whether the ego has come to a stand at its line
    stood: float = 0.0  # for how long it has stood there [s]
    goes: bool = False  # whether it was free to go in the cycle before
    waited: float = 0.0  # for how long it has stood there, creeping apart [s]
    place: float = math.inf  # where it has to stop; inf if it may go [m]
    quiet: float = math.inf  # since one that does not stand has blocked it [s]


class Permission(NamedTuple):
    """The decision on one junction."""

    stop_s: float | None  # where the ego has to stop; None: it may go
    memory: Waiting
    because_of: str  # the vehicle that goes first, or why else; "" if it may go
