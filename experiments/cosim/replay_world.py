"""A world in which others move as they were recorded; nothing in it reacts."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from experiments.commonroad.records import MovingObstacle, TrafficLight
from experiments.cosim.records import Signal, TrafficState
from experiments.cosim.road import Road
from planner.prediction import (
    LANE_HEADING_TOLERANCE,
    LANE_REACH,
    constant_speed,
)
from planner.reference_path.frenet import FRENET_REACH
from planner.reference_path.path import ReferencePath
from planner.scene import COLUMNS, Lanes, Prediction, RoadUsers
from planner.states import CartesianState, FloatArray, IntArray

# colour of a light of CommonRoad -> SUMO's letter
LETTERS = {"red": "r", "redYellow": "u", "yellow": "y", "green": "G", "inactive": "O"}
X, Y, HEADING, SPEED, LATERAL_SPEED = 0, 1, 2, 3, 5  # rows of a table


@dataclass(frozen=True, slots=True, eq=False)
class ReplayLog:
    """Recorded road users, one behind the other in one table; arrays are (n,)."""

    ids: tuple[str, ...]
    first: IntArray  # step of each one's first column
    last: IntArray
    begin: IntArray  # place of the first column in the table
    table: FloatArray  # rows of `COLUMNS`, (8, n_columns)
    places: FloatArray  # s [m] and l [m] on the ego's path, (2, n_columns)
    step: float  # [s]

    @classmethod
    def of(
        cls, users: Sequence[MovingObstacle], path: ReferencePath, step: float
    ) -> "ReplayLog":
        """Put recordings together and find their places on the ego's path.

        Args:
            users: Recorded.
            path: Of the ego.
            step: Between two columns [s].
        """
        sizes = np.array([user.table.shape[1] for user in users], dtype=np.int64)
        empty = np.empty((len(COLUMNS), 0))
        table = np.concatenate([empty, *(user.table for user in users)], axis=1)
        s, l = path.project(table[X], table[Y], heading=table[HEADING])
        foot = path.at(s)
        error = table[HEADING] - foot.heading
        error = np.arctan2(np.sin(error), np.cos(error))
        along = (np.abs(error) < LANE_HEADING_TOLERANCE) & (np.abs(l) < LANE_REACH)
        drift = table[SPEED] * np.sin(error)
        table[LATERAL_SPEED] = np.where(along, drift, table[LATERAL_SPEED])
        near = np.abs(l) < FRENET_REACH
        places = np.array([np.where(near, s, np.inf), np.where(near, l, 0.0)])
        first = np.array([user.first for user in users], dtype=np.int64)
        return cls(
            tuple(user.id for user in users),
            first,
            first + sizes - 1,
            np.cumsum(sizes) - sizes,
            table,
            places,
            step,
        )

    def at(self, step: int) -> RoadUsers:
        """Return those that are there in a step."""
        there = np.flatnonzero((self.first <= step) & (step <= self.last))
        columns = self.begin[there] + step - self.first[there]
        ids = tuple(self.ids[k] for k in there.tolist())
        return RoadUsers.from_table(ids, self.table[:, columns])


@dataclass(frozen=True, slots=True, eq=False)
class RecordedFuture:
    """Knows what will come, as far as it was recorded; a `Predictor` of one moment.

    Beyond the end of its recording a vehicle keeps its last speed and heading; one that
    was not recorded is predicted as by `constant_speed`.
    """

    log: ReplayLog
    now: int  # step

    def later(self, lead: float) -> "RecordedFuture":
        """Return what is known a time [s] later."""
        return RecordedFuture(self.log, self.now + round(lead / self.log.step))

    def __call__(
        self,
        path: ReferencePath,
        vehicles: RoadUsers,
        times: FloatArray,
        lanes: Lanes | None = None,
    ) -> Prediction:
        """Look vehicles up; see `planner.prediction.Predictor`."""
        log = self.log
        row = {name: k for k, name in enumerate(log.ids)}
        known = [k for k, name in enumerate(vehicles.ids) if name in row]
        rough = constant_speed(path, vehicles, times, lanes)
        if not known:
            return rough
        of = np.array([row[vehicles.ids[k]] for k in known])[:, None]
        steps = self.now + np.rint(times / log.step).astype(np.int64)
        held = np.clip(steps, log.first[of], log.last[of])
        columns = log.begin[of] + held - log.first[of]
        x, y, heading, speed = log.table[:4, columns]
        s, l = log.places[:, columns]
        driven = speed * log.step * np.maximum(steps - log.last[of], 0)
        out = rough.table.copy()
        turned = heading - path.at(np.where(np.isfinite(s), s, 0.0)).heading
        out[:, known] = (
            x + driven * np.cos(heading),
            y + driven * np.sin(heading),
            heading,
            s + driven * np.cos(turned),
            np.where(np.isfinite(s), l + driven * np.sin(turned), 0.0),
        )
        return Prediction.from_table(rough.step, out)


@dataclass(frozen=True, slots=True, eq=False)
class Replay:
    """A recording, and where the ego comes into it."""

    log: ReplayLog
    entry: CartesianState  # the ego's first state
    first: int  # step of the recording in which that is
    lights: tuple[tuple[TrafficLight, float], ...] = ()  # with their lines [m]


class ReplayWorld:
    """Recorded traffic on the ego's road; implements `World`.

    Args:
        road: With its static bodies.
        replay: The others.
        known_future: Tell planners what was recorded.
    """

    def __init__(
        self, road: Road, replay: Replay, *, known_future: bool = False
    ) -> None:
        self._road = road
        self._replay = replay
        self._known_future = known_future
        self._steps = 0

    @property
    def step(self) -> float:
        """Time step [s]."""
        return self._replay.log.step

    @property
    def road(self) -> Road:
        """The ego's road."""
        return self._road

    def enter(self) -> CartesianState:
        """Return the ego's first state."""
        return self._replay.entry

    def observe(self) -> TrafficState:
        """Return all others as they were recorded in this step."""
        return self.moment(self._steps)

    def moment(self, index: int) -> TrafficState:
        """Return the others in a step, counted from the ego's first one."""
        log = self._replay.log
        now = self._replay.first + index
        signals = tuple(
            Signal(str(light.id), stop, LETTERS.get(light.colour(now), "O"))
            for light, stop in self._replay.lights
        )
        future = RecordedFuture(log, now) if self._known_future else None
        return TrafficState(index * log.step, log.at(now), signals, future=future)

    def advance(self, ego: CartesianState) -> CartesianState:
        """Move on by a step; nothing reacts to the ego."""
        self._steps += 1
        return ego

    def close(self) -> None:
        """Do nothing: there is nothing to end."""
