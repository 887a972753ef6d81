"""What the route planner remembers from cycle to cycle."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum

from planner.lane_change.phases.memory import Phase
from planner.route.lane_frame import LaneFrame
from planner.scene import Lanes
from planner.states import Trajectory


class Driver(StrEnum):
    """The family that drives."""

    CRUISE = "cruise"
    DENSE = "dense"


@dataclass(frozen=True, slots=True)
class LaneManoeuvre:
    """Which lane is followed and which one is wanted."""

    lane: int  # kept or left
    phase: Phase = Phase.KEEP
    target: int | None = None
    why: str = ""  # the reason for another lane
    beside: str = ""  # the body that leaves no gap there, while one is looked for


@dataclass(frozen=True, slots=True, eq=False)
class RouteMemory:
    """State handed from one cycle to the next."""

    manoeuvre: LaneManoeuvre
    trajectory: Trajectory  # on the reference path
    driver: Driver = Driver.CRUISE
    stood: float = 0.0  # for how long the ego has stood [s]
    round_until: float = 0.0  # the whole road may be used up to this s [m]
    close_until: float = 0.0  # bodies may be passed without a margin up to this s [m]
    crawled: float = 0.0  # for how long `dense` has not got on [s]
    dense: object = None  # memory of that family, while it drives
    given: Lanes | None = None  # the scene's lanes ...
    followed: Lanes | None = None  # ... and those of them that can be followed
    # made of the lanes once: (lane, whether along the reference path) to frame
    frames: Mapping[tuple[int, bool], LaneFrame] = field(default_factory=dict)
