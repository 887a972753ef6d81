"""Our own judgement of every step: contacts, clearance, and leaving the road.

SUMO's collision detection misses overlaps across lane lines and sees some that are
none, so it is a cross-check only. Here the ego's rectangle is held against every
vehicle and every static body, swept from the step before to this one, so that nothing
passes through anything between two samples.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from experiments.cosim.records import TrafficState
from experiments.cosim.sumo import frames
from planner.numerics.compiled import compiled
from planner.reference_path.path import ReferencePath
from planner.scene import Obstacles, RoadBounds
from planner.shapes.rectangles import (
    CONTACT_TOLERANCE,
    HALF_LENGTH,
    HALF_WIDTH,
    HEADING,
    RADIUS,
    X,
    Y,
    core_distance,
    swept_contact,
)
from planner.states import CartesianState, FloatArray
from planner.vehicle import Vehicle

# Corners and middles of the sides, as parts of (half length, half width).
OUTLINE = np.array(
    [(1, 1), (0, 1), (-1, 1), (-1, 0), (-1, -1), (0, -1), (1, -1), (1, 0)],
    dtype=np.float64,
)


@dataclass(frozen=True, slots=True)
class Verdict:
    """What one step came to."""

    contacts: tuple[str, ...]  # bodies touched since the step before, vehicles first
    clearance: float  # to the nearest body now [m]; 0 on contact, inf without one
    nearest: str | None
    off_road: float  # how far the body reaches over the road's edge [m]; 0 inside


class Truth:
    """Judges one episode, step by step; remembers only the step before.

    Args:
        vehicle: The ego's dimensions.
        path: Reference path.
        road: Lateral room along the path.
        obstacles: Static bodies.
    """

    def __init__(
        self,
        vehicle: Vehicle,
        path: ReferencePath,
        road: RoadBounds,
        obstacles: Obstacles,
    ) -> None:
        self._vehicle = vehicle
        self._path = path
        self._road = road
        self._static_ids = obstacles.ids
        self._static = np.column_stack(
            (
                obstacles.x,
                obstacles.y,
                obstacles.heading,
                obstacles.length / 2.0,
                obstacles.width / 2.0,
                obstacles.radius,
            )
        )
        self._ids: tuple[str, ...] = ()
        self._rows: FloatArray | None = None
        self._ego: FloatArray | None = None

    def judge(self, ego: CartesianState, traffic: TrafficState, near: float) -> Verdict:
        """Judge the step that led to this moment.

        A vehicle is compared with itself a step ago by its id; one that has just come
        into view is judged as it is now.

        Args:
            ego: Rear axle, now.
            traffic: Everyone else, now.
            near: About where the ego is on the path [m].

        Returns:
            The verdict.
        """
        ego_row = self._ego_row(ego)
        rows = self._body_rows(traffic)
        before, known = self._before(traffic.ids, rows)
        ego_before = ego_row if self._ego is None else self._ego
        touched, nearest, clearance = _hold_against(
            ego_before, ego_row, before, rows, known
        )
        self._ids, self._rows, self._ego = traffic.ids, rows, ego_row
        return Verdict(
            tuple(self._name(int(i)) for i in np.flatnonzero(touched)),
            float(clearance),
            self._name(nearest) if nearest >= 0 else None,
            self._off_road(ego_row, near),
        )

    def _name(self, index: int) -> str:
        """Give the id of a row; vehicles come before static bodies."""
        count = len(self._ids)
        return self._ids[index] if index < count else self._static_ids[index - count]

    def _ego_row(self, ego: CartesianState) -> FloatArray:
        """Pack the ego's rectangle."""
        x, y = frames.centre_from_rear_axle(ego, self._vehicle)
        half_length, half_width = self._vehicle.length / 2.0, self._vehicle.width / 2.0
        return np.array((x, y, ego.heading, half_length, half_width, 0.0))

    def _body_rows(self, traffic: TrafficState) -> FloatArray:
        """Pack all rectangles, vehicles before static bodies, (n, 6)."""
        count = len(traffic.ids)
        rows = np.empty((count + len(self._static), 6))
        rows[:count, X] = traffic.x
        rows[:count, Y] = traffic.y
        rows[:count, HEADING] = traffic.heading
        rows[:count, HALF_LENGTH] = traffic.length / 2.0
        rows[:count, HALF_WIDTH] = traffic.width / 2.0
        rows[:count, RADIUS] = 0.0
        rows[count:] = self._static
        return rows

    def _before(
        self, ids: tuple[str, ...], rows: FloatArray
    ) -> tuple[FloatArray, NDArray[np.bool_]]:
        """Find where each body was a step ago, and whether that is known."""
        known = np.ones(len(rows), np.bool_)
        if ids == self._ids and self._rows is not None:
            return self._rows, known
        before = rows.copy()
        place = {name: i for i, name in enumerate(self._ids)}
        for i, name in enumerate(ids):
            was = place.get(name)
            if was is None or self._rows is None:
                known[i] = False
            else:
                before[i] = self._rows[was]
        return before, known

    def _off_road(self, ego: FloatArray, near: float) -> float:
        """Measure how far the body's outline reaches over the road's edge [m]."""
        cos, sin = math.cos(ego[HEADING]), math.sin(ego[HEADING])
        along, across = (OUTLINE * ego[HALF_LENGTH : HALF_WIDTH + 1]).T
        s, l = self._path.project(
            ego[X] + along * cos - across * sin,
            ego[Y] + along * sin + across * cos,
            near=near,
        )
        left, right = self._road.at(s)
        return max(float(np.max(l - left)), float(np.max(right - l)), 0.0)


@compiled
def _hold_against(
    ego_before: FloatArray,
    ego: FloatArray,
    before: FloatArray,
    now: FloatArray,
    known: NDArray[np.bool_],
) -> tuple[NDArray[np.bool_], int, float]:
    """Give contacts (n,), the nearest body's index (-1 without one) and its distance.

    Circles about the rectangles decide for bodies that are far away.
    """
    touched = np.zeros(now.shape[0], dtype=np.bool_)
    nearest, clearance = -1, np.inf
    ego_circle = math.hypot(ego[HALF_LENGTH], ego[HALF_WIDTH])
    ego_travel = math.hypot(ego[X] - ego_before[X], ego[Y] - ego_before[Y])
    for i in range(now.shape[0]):
        body = now[i]
        circle = math.hypot(body[HALF_LENGTH], body[HALF_WIDTH]) + body[RADIUS]
        dx, dy = body[X] - ego[X], body[Y] - ego[Y]
        apart = math.hypot(dx, dy) - circle - ego_circle
        if apart < clearance:
            gap = core_distance(
                dx,
                dy,
                ego[HEADING],
                ego[HALF_LENGTH],
                ego[HALF_WIDTH],
                body[HEADING],
                body[HALF_LENGTH],
                body[HALF_WIDTH],
            )
            gap = max(gap - body[RADIUS], 0.0)
            if gap < clearance:
                nearest, clearance = i, gap
            if gap <= CONTACT_TOLERANCE:
                touched[i] = True
        if known[i] and not touched[i]:
            # Circles turn with their bodies: only the centres' travel counts.
            travel = math.hypot(body[X] - before[i, X], body[Y] - before[i, Y])
            if apart <= ego_travel + travel + CONTACT_TOLERANCE:
                touched[i] = swept_contact(ego_before, ego, before[i], body)
    return touched, nearest, clearance
