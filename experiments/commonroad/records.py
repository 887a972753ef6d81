"""What a CommonRoad file holds, in SI units; steps are counted in the file's own."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import NamedTuple

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from planner.states import FloatArray

# Countries whose traffic keeps to the left, by the first letters of a benchmark's id.
LEFT_HAND = frozenset(
    {
        *("AUS", "BGD", "BRB", "BWA", "CYP", "GBR", "HKG", "IDN", "IND", "IRL", "JAM"),
        *("JPN", "KEN", "LKA", "MAC", "MLT", "MUS", "MYS", "NAM", "NPL", "NZL", "PAK"),
        *("SGP", "THA", "TTO", "TZA", "UGA", "ZAF", "ZMB", "ZWE"),
    }
)


class Box(NamedTuple):
    """A rectangle grown by a radius; of an obstacle, or within its own frame."""

    x: float  # centre [m]
    y: float
    heading: float  # [rad]
    length: float  # [m]
    width: float
    radius: float = 0.0


class Range(NamedTuple):
    """An interval; both ends belong to it."""

    begin: float
    end: float

    @property
    def middle(self) -> float:
        """Middle of the interval."""
        return 0.5 * (self.begin + self.end)


@dataclass(frozen=True, slots=True, eq=False)
class StopMark:
    """A stop line of a lanelet; without points it is at the lanelet's end."""

    points: FloatArray | None  # (2, 2) [m]
    lights: tuple[int, ...]


@dataclass(frozen=True, eq=False)
class Lanelet:
    """A piece of lane in driving direction; bounds have the same number of points."""

    id: int
    left: FloatArray  # (n, 2) [m]
    right: FloatArray  # (n, 2) [m]
    predecessors: tuple[int, ...] = ()
    successors: tuple[int, ...] = ()
    # neighbours, and whether they have the same driving direction
    beside_left: tuple[int, bool] | None = None
    beside_right: tuple[int, bool] | None = None
    kinds: frozenset[str] = frozenset()
    users: frozenset[str] = frozenset()
    signs: tuple[int, ...] = ()
    lights: tuple[int, ...] = ()
    stop: StopMark | None = None
    closed: bool = False  # to cars: a way for others, such as people on foot

    @cached_property
    def centre(self) -> FloatArray:
        """Middle line, (n, 2) [m]."""
        return 0.5 * (self.left + self.right)

    @cached_property
    def along(self) -> FloatArray:
        """Arc length of the middle line's points, (n,) [m]."""
        sides = np.hypot(*np.diff(self.centre, axis=0).T)
        return np.concatenate([[0.0], np.cumsum(sides)])

    @property
    def length(self) -> float:
        """Length of the middle line [m]."""
        return float(self.along[-1])

    @property
    def same_left(self) -> int | None:
        """Neighbour to the left with the same driving direction."""
        beside = self.beside_left
        return beside[0] if beside is not None and beside[1] else None

    @property
    def same_right(self) -> int | None:
        """Neighbour to the right with the same driving direction."""
        beside = self.beside_right
        return beside[0] if beside is not None and beside[1] else None

    @cached_property
    def area(self) -> BaseGeometry:
        """Polygon between the bounds."""
        outline = np.concatenate([self.left, self.right[::-1]])
        return shapely.make_valid(shapely.Polygon(outline))

    def heading_at(self, x: float, y: float) -> float:
        """Return the direction of the middle line nearest to a point [rad]."""
        line = self.centre
        begin, side = line[:-1], np.diff(line, axis=0)
        square = np.maximum((side**2).sum(axis=1), 1e-12)
        share = ((np.array([x, y]) - begin) * side).sum(axis=1) / square
        foot = begin + np.clip(share, 0.0, 1.0)[:, None] * side
        nearest = int(np.argmin(np.hypot(*(foot - (x, y)).T)))
        return float(np.arctan2(side[nearest, 1], side[nearest, 0]))

    def place_of(self, x: float, y: float) -> float:
        """Return the arc length of the middle line's point nearest to a point [m]."""
        return float(
            shapely.line_locate_point(shapely.LineString(self.centre), _p(x, y))
        )


def _p(x: float, y: float) -> shapely.Point:
    """Make a point."""
    return shapely.Point(x, y)


@dataclass(frozen=True, slots=True)
class TrafficLight:
    """A traffic light: its cycle repeats from `offset` on."""

    id: int
    colours: tuple[str, ...]
    durations: tuple[int, ...]  # in steps
    offset: int  # in steps
    direction: str  # all, left, straight, right, leftStraight, ...
    active: bool

    def colour(self, step: int) -> str:
        """Return the colour in a step; inactive without a cycle."""
        total = sum(self.durations)
        if not self.active or total <= 0:
            return "inactive"
        left = (step - self.offset) % total
        for colour, duration in zip(self.colours, self.durations, strict=True):
            if left < duration:
                return colour
            left -= duration
        return self.colours[-1]


@dataclass(frozen=True, slots=True, eq=False)
class MovingObstacle:
    """A recorded road user; rows of `table` are those of `planner.scene.COLUMNS`."""

    id: str
    kind: str
    first: int  # step of the first column
    table: FloatArray  # (8, n), a column a step

    @property
    def last(self) -> int:
        """Step of the last column."""
        return self.first + int(self.table.shape[1]) - 1


@dataclass(frozen=True, slots=True)
class InitialState:
    """Where the ego's centre is at the beginning; intervals are taken in the middle."""

    step: int
    x: float  # [m]
    y: float
    heading: float  # [rad]
    speed: float  # [m/s]
    acceleration: float = 0.0  # [m/s²]
    yaw_rate: float = 0.0  # [rad/s]
    slip: float = 0.0  # [rad]


@dataclass(frozen=True, slots=True, eq=False)
class GoalState:
    """One of the states of which the ego has to reach one; None is not asked for."""

    steps: Range
    area: BaseGeometry | None = None  # that has to hold the ego's centre
    lanelets: tuple[int, ...] = ()  # of which the area was given
    heading: Range | None = None  # begin <= end [rad]
    speed: Range | None = None  # [m/s]


@dataclass(frozen=True, slots=True, eq=False)
class PlanningProblem:
    """Where the ego begins, and where it has to get."""

    id: int
    start: InitialState
    goals: tuple[GoalState, ...]

    @property
    def last_step(self) -> int:
        """Latest step in which a goal may be reached."""
        return max(int(goal.steps.end) for goal in self.goals)


@dataclass(frozen=True, slots=True, eq=False)
class RoadNetwork:
    """Lanelets and what stands beside them, by their ids."""

    lanelets: Mapping[int, Lanelet]
    speed_limits: Mapping[int, float] = field(default_factory=dict)  # of signs [m/s]
    lights: Mapping[int, TrafficLight] = field(default_factory=dict)
    # (from, to) lanelet -> left, straight, right
    turns: Mapping[tuple[int, int], str] = field(default_factory=dict)
    missing: tuple[int, ...] = ()  # lanelets that others refer to, not in the file


@dataclass(frozen=True, slots=True, eq=False)
class CommonRoadScenario:
    """A file."""

    file: Path
    benchmark_id: str
    step: float  # [s]
    network: RoadNetwork
    static: tuple[tuple[str, Box], ...]  # id, body; several may be of one obstacle
    moving: tuple[MovingObstacle, ...]
    problems: tuple[PlanningProblem, ...]
    version: str = "2020a"  # of the format

    @property
    def left_hand(self) -> bool:
        """Whether traffic keeps to the left."""
        country = self.benchmark_id.removeprefix("C-")[:3]
        return country in LEFT_HAND

    def problem(self, wanted: int | None) -> PlanningProblem:
        """Return a planning problem, the first one if none is named.

        Raises:
            KeyError: If there is none of that id.
        """
        if wanted is None:
            return self.problems[0]
        return {problem.id: problem for problem in self.problems}[wanted]
