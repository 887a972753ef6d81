"""A world with one conflict on a straight road, as the reference drivers get it.

The other vehicle follows the columns of `Conflicts`, so that planners and reference
drivers see the same motion; positions advance with the speed at the beginning of each
step, as there. A vehicle behind the ego may react to what happens.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from experiments.cosim.conflicts import STEP_S, Conflicts
from experiments.cosim.records import TrafficState
from experiments.cosim.road import EgoTask, Road
from planner.scene import RoadUsers
from planner.states import BoolArray, CartesianState, FloatArray

OTHER = "other"
LEADER = "leader"  # that cuts out
FOLLOWER = "follower"
# id, s [m], l [m], speed [m/s], acceleration [m/s²], lateral speed [m/s], length, width
VehicleRow = tuple[str, float, float, float, float, float, float, float]


@dataclass(frozen=True, slots=True, eq=False)
class ScriptedMotion:
    """A vehicle's motion step by step; arrays are (n_steps,), the last row is held."""

    id: str
    gap: float  # from the ego's front to its rear in the first row [m]
    length: float  # [m]
    width: float  # [m]
    speed: FloatArray  # during the step [m/s]
    l: FloatArray  # centre, positive to the left [m]
    lateral_speed: FloatArray  # positive to the left [m/s]
    visible: BoolArray

    @property
    def settled(self) -> int:
        """First row from which speed and lateral place stay as they are."""
        changes = (np.diff(self.speed) != 0.0) | (np.diff(self.l) != 0.0)
        rows = np.flatnonzero(changes)
        return int(rows[-1]) + 1 if rows.size else 0


@dataclass(frozen=True, slots=True)
class FollowerModel:
    """The Intelligent Driver Model for the vehicle behind the ego; it stays in lane."""

    time_gap: float = 1.2  # [s]
    standstill_gap: float = 2.0  # [m]
    acceleration: float = 1.5  # [m/s²]
    comfortable_braking: float = 2.0  # [m/s²]
    hardest_braking: float = 9.0  # [m/s²]
    faster: float = 1.2  # desired speed over the ego's at the start
    length: float = 4.3  # [m]
    width: float = 1.9  # [m]

    def start_gap(self, speed: float) -> float:
        """Return the gap [m] at which the model holds a common speed [m/s]."""
        wanted = self.standstill_gap + self.time_gap * speed
        return wanted / math.sqrt(1.0 - self.faster**-4)

    def accelerate(
        self, speed: float, desired: float, gap: float, closing: float
    ) -> float:
        """Return the acceleration [m/s²]; the gap may be infinite."""
        free = 1.0 - (speed / desired) ** 4
        if gap <= 0.0:
            return -self.hardest_braking
        root = 2.0 * math.sqrt(self.acceleration * self.comfortable_braking)
        dynamic = self.time_gap * speed + speed * closing / root
        wanted = self.standstill_gap + max(dynamic, 0.0)
        interaction = (wanted / gap) ** 2
        return max(self.acceleration * (free - interaction), -self.hardest_braking)


def other_motion(conflicts: Conflicts, row: int, side: float) -> ScriptedMotion:
    """Return the other vehicle's motion in one conflict.

    Args:
        conflicts: Many conflicts.
        row: Index of the conflict.
        side: From which it comes: 1 left, -1 right.
    """
    sizes = conflicts.sizes
    width = 0.5 * (sizes.ego_width + sizes.other_width)
    offset = np.maximum(conflicts.lateral_gap[:, row] + width, 0.0)
    towards = np.where(offset > 0.0, conflicts.lateral_speed[:, row], 0.0)
    return ScriptedMotion(
        OTHER,
        float(conflicts.gap[row]),
        sizes.other_length,
        sizes.other_width,
        conflicts.other_speed[:, row],
        side * offset,
        -side * towards,
        conflicts.visible[:, row],
    )


def leader_motion(
    conflicts: Conflicts, row: int, following_gap: float, lateral: float, side: float
) -> ScriptedMotion:
    """Return the motion of a leader that cuts out at the ego's speed.

    Args:
        conflicts: Cut-outs.
        row: Index of the conflict.
        following_gap: From the ego to the leader [m].
        lateral: Speed across the lane [m/s].
        side: To which it leaves: 1 left, -1 right.
    """
    n_steps, sizes = len(conflicts.other_speed), conflicts.sizes
    moved = lateral * STEP_S * np.arange(n_steps)
    moving = moved < sizes.lane_width
    return ScriptedMotion(
        LEADER,
        following_gap,
        sizes.other_length,
        sizes.other_width,
        np.full(n_steps, conflicts.ego_speed[row]),
        side * np.minimum(moved, sizes.lane_width),
        np.where(moving, side * lateral, 0.0),
        np.ones(n_steps, dtype=np.bool_),
    )


class ScriptedTraffic:
    """The scripted vehicles of a conflict on the ego's road, step by step.

    Args:
        road: The ego's, which starts in the middle of a lane.
        task: Where the ego starts.
        motions: Of the vehicles, from where the ego starts.
    """

    def __init__(
        self, road: Road, task: EgoTask, motions: tuple[ScriptedMotion, ...]
    ) -> None:
        self._road, self._task, self._motions = road, task, motions
        front = task.start.s + task.vehicle.front_reach
        self._s = np.array([front + m.gap + 0.5 * m.length for m in motions])
        self._row = 0

    @property
    def motions(self) -> tuple[ScriptedMotion, ...]:
        """Motions of the vehicles."""
        return self._motions

    @property
    def time(self) -> float:
        """Time since the start [s]."""
        return self._row * STEP_S

    def advance(self) -> None:
        """Move all of them one step on."""
        for k, motion in enumerate(self._motions):
            self._s[k] += float(_held(motion.speed, self._row)) * STEP_S
        self._row += 1

    def place(self, k: int) -> tuple[float, float, float]:
        """Return arc length, offset [m] and speed [m/s] of vehicle `k`."""
        motion = self._motions[k]
        l, speed = _held(motion.l, self._row), _held(motion.speed, self._row)
        return float(self._s[k]), self._task.start.l + float(l), float(speed)

    def is_visible(self, k: int, ego_s: float) -> bool:
        """Return whether a vehicle can be seen, or the ego has reached it.

        Args:
            k: Index of the vehicle.
            ego_s: Arc length of the ego's rear axle [m].
        """
        motion = self._motions[k]
        if _held(motion.visible, self._row):
            return True
        front = ego_s + self._task.vehicle.front_reach
        return bool(front >= self._s[k] - 0.5 * motion.length)

    def row(self, k: int) -> VehicleRow:
        """Return id, s, l, speed, acceleration, lateral speed, length and width."""
        motion, row = self._motions[k], self._row
        s, l, speed = self.place(k)
        before = float(_held(motion.speed, max(row - 1, 0)))
        return (
            motion.id,
            s,
            l,
            speed,
            (speed - before) / STEP_S,
            float(_held(motion.lateral_speed, row)),
            motion.length,
            motion.width,
        )

    def users(self, rows: Sequence[VehicleRow]) -> RoadUsers:
        """Return rows of vehicles in the plane; they head along the road."""
        s = np.array([row[1] for row in rows], dtype=np.float64)
        l = np.array([row[2] for row in rows], dtype=np.float64)
        point = self._road.path.at(s)
        table = np.empty((8, len(rows)))
        table[0] = point.x - l * point.sin_heading
        table[1] = point.y + l * point.cos_heading
        table[2] = point.heading
        for k in range(5):
            table[3 + k] = [row[3 + k] for row in rows]
        return RoadUsers.from_table(tuple(row[0] for row in rows), table)


class ConflictWorld:
    """A straight road with scripted vehicles and maybe a follower; implements `World`.

    A vehicle that is not visible is left out until it is, or until the ego is at it.

    Args:
        road: Straight, the ego's lane centre at offset 0.
        task: Where the ego starts, and how fast.
        motions: Of the scripted vehicles.
        follower: Of the vehicle behind the ego, None without one.
    """

    def __init__(
        self,
        road: Road,
        task: EgoTask,
        motions: tuple[ScriptedMotion, ...],
        follower: FollowerModel | None = None,
    ) -> None:
        self._road, self._task = road, task
        self._follower = follower
        self._script = ScriptedTraffic(road, task, motions)
        speed = task.start.speed
        self._speed = task.target_speed if speed is None else speed
        self._behind = self._follower_at_start()
        self._ego: CartesianState | None = None

    @property
    def step(self) -> float:
        """Time step [s]."""
        return STEP_S

    @property
    def road(self) -> Road:
        """The ego's road."""
        return self._road

    def enter(self) -> CartesianState:
        """Put the ego's rear axle at its start."""
        self._ego = self._task.state_at_start(self._road.path, self._speed)
        return self._ego

    def observe(self) -> TrafficState:
        """Return the vehicles that can be seen."""
        script, ego_s = self._script, self._ego_place()[0]
        rows = [
            script.row(k)
            for k in range(len(script.motions))
            if script.is_visible(k, ego_s)
        ]
        if self._follower is not None:
            at, speed, acceleration = self._behind
            size = (self._follower.length, self._follower.width)
            rows.append((FOLLOWER, at, 0.0, speed, acceleration, 0.0, *size))
        return TrafficState(script.time, script.users(rows))

    def advance(self, ego: CartesianState) -> CartesianState:
        """Move all vehicles one step on; the follower reacts to the step before."""
        if self._follower is not None:
            self._follow(self._follower)
        self._script.advance()
        self._ego = ego
        return ego

    def close(self) -> None:
        """Do nothing: there is nothing to end."""

    def place(self, k: int) -> tuple[float, float, float]:
        """Return arc length, offset [m] and speed [m/s] of scripted vehicle `k`."""
        return self._script.place(k)

    def _ego_place(self) -> tuple[float, float]:
        """Return arc length and offset of the ego's rear axle [m]."""
        assert self._ego is not None  # noqa: S101 - the loop enters first
        s, l = self._road.path.project(np.array([self._ego.x]), np.array([self._ego.y]))
        return float(s[0]), float(l[0])

    def _follower_at_start(self) -> tuple[float, float, float]:
        """Return centre, speed and acceleration of the follower."""
        model = self._follower
        if model is None:
            return (0.0, 0.0, 0.0)
        rear = self._task.start.s - self._task.vehicle.rear_overhang
        s = rear - model.start_gap(self._speed) - 0.5 * model.length
        return (s, self._speed, 0.0)

    def _follow(self, model: FollowerModel) -> None:
        """Move the follower behind the nearest vehicle in its lane."""
        s, speed, _ = self._behind
        front = s + 0.5 * model.length
        assert self._ego is not None  # noqa: S101 - the loop enters first
        at, l = self._ego_place()
        vehicle = self._task.vehicle
        ahead = [(at - vehicle.rear_overhang, l, vehicle.width, self._ego.speed)]
        for k, motion in enumerate(self._script.motions):
            centre, offset, pace = self.place(k)
            ahead.append((centre - 0.5 * motion.length, offset, motion.width, pace))
        gap, closing = math.inf, 0.0
        for rear, offset, width, pace in ahead:
            beside = abs(offset) >= 0.5 * (width + model.width)
            if not beside and s < rear and rear - front < gap:
                gap, closing = rear - front, speed - pace
        desired = model.faster * self._speed
        acceleration = model.accelerate(speed, desired, gap, closing)
        after = max(speed + acceleration * STEP_S, 0.0)
        s += 0.5 * (speed + after) * STEP_S
        self._behind = (s, after, (after - speed) / STEP_S)


def _held(values: FloatArray | BoolArray, row: int) -> float | bool:
    """Return the value of a row; the last one is held."""
    held: float | bool = values[min(row, values.size - 1)]
    return held
