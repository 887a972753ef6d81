"""From the traffic as it is to what the ego believes."""

import math
import zlib
from collections import deque

import numpy as np

from experiments.cosim.perception.noise import (
    ACCELERATION,
    FOREVER,
    HEADING,
    LENGTH,
    MISSED,
    N_CHANNELS,
    SIDEWAYS,
    SPEED,
    WIDTH,
    KeyArray,
    X,
    Y,
    advance_noise,
    normal,
    uniform,
)
from experiments.cosim.perception.settings import PerceptionSettings
from experiments.cosim.perception.visibility import visible
from experiments.cosim.records import TrafficState
from planner.numerics.compiled import compiled
from planner.scene import COLUMNS, Obstacles, RoadUsers
from planner.states import BoolArray, CartesianState, FloatArray, IntArray

EPSILON = 1e-9  # [s]
AT = len(COLUMNS)  # column of the tracks with the time of the last detection [s]
SMALLEST = 0.1  # length or width that is believed [m]
ROOM = 64  # vehicles that there is room for at first


class Perception:
    """Sees, tracks and forgets; carries what it knows from step to step.

    Args:
        settings: How well.
        static: Bodies that hide what is behind them.
        step: Of the loop [s].
        seed: Of all noise.
        centre: From the ego's rear axle to the sensor, along its heading [m].
    """

    def __init__(
        self,
        settings: PerceptionSettings,
        static: Obstacles,
        step: float,
        seed: int,
        centre: float,
    ) -> None:
        self._settings = settings
        self._seed = seed
        self._centre = centre
        self._static = np.column_stack(
            (
                static.x,
                static.y,
                static.heading,
                0.5 * static.length + static.radius,
                0.5 * static.width + static.radius,
            )
        )
        self._walls = _walls(settings.buildings)
        self._memory = math.exp(-step / settings.correlation)
        self._scales = np.array(
            (
                settings.position,
                settings.position,
                settings.heading,
                settings.speed,
                settings.speed,
                settings.heading,  # times the speed
                settings.size,
                settings.missed,
                settings.margin * settings.position,
            )
        )
        self._rows: dict[str, int] = {}
        self._keys = np.zeros(ROOM, np.uint64)
        self._noise = np.full((ROOM, N_CHANNELS), np.nan)
        self._tracks = np.full((ROOM, AT + 1), np.nan)
        # moments that are not known yet, oldest first
        self._coming: deque[tuple[TrafficState, CartesianState]] = deque()
        self._steps = 0

    def perceive(self, traffic: TrafficState, ego: CartesianState) -> RoadUsers:
        """Return what the ego believes now; called once in each step.

        Args:
            traffic: As it is now.
            ego: Rear axle, now.
        """
        self._coming.append((traffic, ego))
        known = traffic.time - self._settings.latency + EPSILON
        while self._coming and (self._coming[0][0].time <= known or not self._steps):
            self._steps += 1  # the first moment is known at once: the ego enters seeing
            self._look(*self._coming.popleft())
        return self._believed(traffic.time)

    def _look(self, traffic: TrafficState, ego: CartesianState) -> None:
        """Detect what can be seen at one moment."""
        users, settings = traffic.vehicles, self._settings
        if not users.ids:
            return
        rows = np.array([self._row(name) for name in users.ids], np.int64)
        keys = self._keys[rows]
        advance_noise(self._noise, rows, keys, self._steps, self._memory)
        sensor = (
            ego.x + self._centre * math.cos(ego.heading),
            ego.y + self._centre * math.sin(ego.heading),
            ego.heading,
        )
        seen = visible(
            users.table,
            sensor,
            (settings.reach, settings.field_of_view),
            self._static,
            self._walls,
            settings.occlusion,
        )
        now = (self._steps, traffic.time)
        _detect(
            (users.table, seen, rows),
            keys,
            self._noise,
            self._scales,
            now,
            self._tracks,
        )

    def _row(self, name: str) -> int:
        """Return the row of a vehicle; a new one gets the next."""
        row = self._rows.get(name)
        if row is not None:
            return row
        row = self._rows[name] = len(self._rows)
        if row == self._keys.size:
            self._keys = np.concatenate([self._keys, np.zeros_like(self._keys)])
            self._noise = np.concatenate(
                [self._noise, np.full_like(self._noise, np.nan)]
            )
            more = np.full_like(self._tracks, np.nan)
            self._tracks = np.concatenate([self._tracks, more])
        self._keys[row] = zlib.crc32(name.encode()) << 32 | self._seed & 0xFFFFFFFF
        return row

    def _believed(self, time: float) -> RoadUsers:
        """Return all vehicles that were seen lately, where they should be now."""
        tracks = self._tracks[: len(self._rows)]
        age = time - tracks[:, AT]
        kept = age <= self._settings.forget_after + self._settings.latency + EPSILON
        indices = np.flatnonzero(kept)  # NaN: never seen
        names = list(self._rows)
        table = np.ascontiguousarray(tracks[indices, :AT].T)
        move_on(table, age[indices])
        return RoadUsers.from_table(tuple(names[i] for i in indices), table)


def _walls(buildings: tuple[FloatArray, ...]) -> FloatArray:
    """Return the sides of polygons, (k, 4)."""
    sides = [np.hstack([corners, np.roll(corners, -1, 0)]) for corners in buildings]
    return np.concatenate(sides) if sides else np.empty((0, 4))


def reckoned(users: RoadUsers, lead: float) -> RoadUsers:
    """Return road users where they will be, at their speed and heading.

    Args:
        users: Now.
        lead: How much later [s].
    """
    if lead == 0.0:
        return users
    table = users.table.copy()
    move_on(table, np.full(len(users.ids), lead))
    return RoadUsers.from_table(users.ids, table)


@compiled
def move_on(table: FloatArray, times: FloatArray) -> None:
    """Move road users along their headings, in place: dead reckoning.

    Args:
        table: Rows as in `planner.scene.COLUMNS`, (8, n).
        times: For which each moves, (n,) [s].
    """
    for i in range(times.size):
        driven = table[3, i] * times[i]
        table[0, i] += driven * math.cos(table[2, i])
        table[1, i] += driven * math.sin(table[2, i])


@compiled
def _detect(
    users: tuple[FloatArray, BoolArray, IntArray],
    keys: KeyArray,
    noise: FloatArray,
    scales: FloatArray,
    now: tuple[int, float],
    tracks: FloatArray,
) -> None:
    """Renew the tracks of the vehicles that are seen and not missed, in place.

    Args:
        users: Their table (8, n), which are visible (n,), their rows (n,).
        keys: Of their noise, (n,).
        noise: Of unit variance, (capacity, 6).
        scales: Standard deviations of the six channels, of the size, the share of
            missed detections, and by how much bodies grow on each side, (9,).
        now: Number of the step, and its time [s].
        tracks: (capacity, 9).
    """
    table, seen, rows = users
    step, time = now
    grown = 2.0 * scales[8]
    for i in range(rows.size):
        if not seen[i] or uniform(keys[i], step, 2 * MISSED) <= scales[7]:
            continue
        row, n = rows[i], noise[rows[i]]
        track = tracks[row]
        track[0] = table[0, i] + scales[0] * n[X]
        track[1] = table[1, i] + scales[1] * n[Y]
        track[2] = table[2, i] + scales[2] * n[HEADING]
        track[3] = max(table[3, i] + scales[3] * n[SPEED], 0.0)
        track[4] = table[4, i] + scales[4] * n[ACCELERATION]
        track[5] = table[5, i] + scales[5] * track[3] * n[SIDEWAYS]
        for column, channel in ((6, LENGTH), (7, WIDTH)):
            size = table[column, i] + scales[6] * normal(keys[i], FOREVER, channel)
            track[column] = max(size, SMALLEST) + grown
        track[8] = time
