"""Our own check of every step: contacts, clearance, and leaving the road.

SUMO's collision detection misses overlaps across lane lines and reports some contacts
that are not there, so it is a cross-check only. Here the ego's rectangle is compared
with every vehicle and every static body, swept from the step before to this one, so
that nothing passes through anything between two samples.
"""

import math
from dataclasses import dataclass

import numpy as np

from experiments.cosim.road import Road
from planner.numerics.compiled import compiled, inlined
from planner.reference_path.path import PROJECTION_REACH, PathTable
from planner.reference_path.projection import NO_DIRECTION, foot
from planner.scene import RoadUsers
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
from planner.states import BoolArray, CartesianState, FloatArray, IntArray
from planner.vehicle import Vehicle, centre_from_rear_axle

# Corners and middles of the sides, as parts of (half length, half width).
OUTLINE = np.array(
    [(1, 1), (0, 1), (-1, 1), (-1, 0), (-1, -1), (0, -1), (1, -1), (1, 0)],
    dtype=np.float64,
)
UNKNOWN = -1  # row of a vehicle that was not there a step ago
N_RECTANGLE = 6  # numbers of a rectangle grown by a radius, as `rectangles` names them


@dataclass(frozen=True, slots=True)
class StepCheck:
    """The result of checking one step."""

    contacts: tuple[str, ...]  # bodies touched since the step before, vehicles first
    clearance: float  # to the nearest body now [m]; 0 on contact, inf without one
    nearest: str | None
    off_road: float  # how far the body reaches over the road's edge [m]; 0 inside


class CollisionMonitor:
    """Checks one episode, step by step; keeps only the step before.

    Args:
        road: Of the episode, with its static bodies.
        vehicle: The ego's dimensions.
    """

    def __init__(self, road: Road, vehicle: Vehicle) -> None:
        self._vehicle = vehicle
        self._road = road
        static = road.obstacles
        self._static = np.column_stack(
            (
                static.x,
                static.y,
                static.heading,
                static.length / 2.0,
                static.width / 2.0,
                static.radius,
            )
        )
        self._edges = (road.bounds.s, road.bounds.left, road.bounds.right)
        self._same = np.arange(0)  # columns of vehicles that are the same as before
        self._before: RoadUsers | None = None
        self._ego: FloatArray | None = None

    def check(self, ego: CartesianState, vehicles: RoadUsers, near: float) -> StepCheck:
        """Check the step that led to this moment.

        A vehicle is compared with itself a step ago by its id; one that has just come
        into view is checked as it is now.

        Args:
            ego: Rear axle, now.
            vehicles: All others, now.
            near: Rough arc length of the ego on the path [m].

        Returns:
            The result.
        """
        ego_row = self._ego_row(ego)
        before = vehicles if self._before is None else self._before
        ego_before = ego_row if self._ego is None else self._ego
        touched, nearest, clearance, off_road = _check_step(
            (ego_before, ego_row),
            (before.table, vehicles.table, self._rows_before(vehicles.ids)),
            self._static,
            self._road.path.table,
            self._edges,
            (float(near) - PROJECTION_REACH, float(near) + PROJECTION_REACH),
        )
        self._before, self._ego = vehicles, ego_row
        return StepCheck(
            tuple(self._name(i, vehicles) for i in touched),
            clearance,
            self._name(nearest, vehicles) if nearest >= 0 else None,
            off_road,
        )

    def _name(self, body: int, vehicles: RoadUsers) -> str:
        """Return the id of a body; vehicles come before static ones."""
        n = len(vehicles.ids)
        return vehicles.ids[body] if body < n else self._road.obstacles.ids[body - n]

    def _ego_row(self, ego: CartesianState) -> FloatArray:
        """Return the ego's rectangle as numbers, (6,)."""
        return ego_rectangle(ego, self._vehicle)

    def _rows_before(self, ids: tuple[str, ...]) -> IntArray:
        """Return each vehicle's column in the table a step ago, (n,), or `UNKNOWN`."""
        if self._before is not None and ids == self._before.ids:
            if self._same.size != len(ids):
                self._same = np.arange(len(ids))
            return self._same
        return columns_before(() if self._before is None else self._before.ids, ids)


def ego_rectangle(ego: CartesianState, vehicle: Vehicle) -> FloatArray:
    """Return the ego's rectangle as numbers, (6,)."""
    x, y = centre_from_rear_axle(ego, vehicle)
    half_length, half_width = vehicle.length / 2.0, vehicle.width / 2.0
    return np.array((x, y, ego.heading, half_length, half_width, 0.0))


def columns_before(before: tuple[str, ...], ids: tuple[str, ...]) -> IntArray:
    """Return the place of each id among those of a step ago, or `UNKNOWN`, (n,)."""
    place = {name: i for i, name in enumerate(before)}
    return np.array([place.get(name, UNKNOWN) for name in ids], np.int64)


@inlined
def fill_rectangle(table: FloatArray, k: int, row: FloatArray) -> None:
    """Copy vehicle `k` of a table of road users into the numbers of a rectangle."""
    row[X], row[Y], row[HEADING] = table[0, k], table[1, k], table[2, k]
    row[HALF_LENGTH], row[HALF_WIDTH] = table[6, k] / 2.0, table[7, k] / 2.0
    row[RADIUS] = 0.0


@compiled
def _check_step(
    egos: tuple[FloatArray, FloatArray],
    vehicles: tuple[FloatArray, FloatArray, IntArray],
    static: FloatArray,
    path: PathTable,
    edges: tuple[FloatArray, FloatArray, FloatArray],
    limits: tuple[float, float],
) -> tuple[list[int], int, float, float]:
    """Check all bodies and the road's edges.

    Args:
        egos: The ego's rectangle a step ago and now, (6,) each.
        vehicles: As in `_check_bodies`: a step ago, now, and where each was.
        static: Rectangles that do not move, (n_static, 6).
        path: Tables of the reference path.
        edges: Arc lengths, left and right bounds of the road, (n,) each [m].
        limits: Arc lengths between which the body lies [m].

    Returns:
        (bodies touched; index of the nearest one or -1, its distance [m]; how far the
        body reaches over the road's edge [m]).
    """
    touched, nearest, clearance = _check_bodies(
        egos[0], egos[1], vehicles[0], vehicles[1], vehicles[2], static
    )
    hits = [i for i in range(touched.size) if touched[i]]
    return hits, nearest, clearance, excess_over_edges(egos[1], path, edges, limits)


@inlined
def excess_over_edges(
    ego: FloatArray,
    path: PathTable,
    edges: tuple[FloatArray, FloatArray, FloatArray],
    limits: tuple[float, float],
) -> float:
    """Compute how far the body's outline reaches over the road's edge [m]."""
    cos, sin = math.cos(ego[HEADING]), math.sin(ego[HEADING])
    s, l = np.empty(OUTLINE.shape[0]), np.empty(OUTLINE.shape[0])
    for k in range(s.size):
        along = OUTLINE[k, 0] * ego[HALF_LENGTH]
        across = OUTLINE[k, 1] * ego[HALF_WIDTH]
        x = ego[X] + along * cos - across * sin
        y = ego[Y] + along * sin + across * cos
        s[k], l[k] = foot(
            path.knots, path.bins, path.blocks, x, y, limits, NO_DIRECTION
        )
    left = np.interp(s, edges[0], edges[1])
    right = np.interp(s, edges[0], edges[2])
    farthest = 0.0
    for k in range(s.size):
        farthest = max(l[k] - left[k], right[k] - l[k], farthest)
    return farthest


@inlined
def check_pair(
    ego: tuple[FloatArray, FloatArray, float, float],
    was: FloatArray,
    body: FloatArray,
    farthest: float,
    known: bool,  # noqa: FBT001 - compiled
) -> tuple[float, bool]:
    """Check the ego and one body.

    Circles about the rectangles decide for bodies that are far away.

    Args:
        ego: Its rectangle a step ago and now, (6,) each, radius of the circle about it
            and how far it has moved [m].
        was: The body's rectangle a step ago, (6,).
        body: The same now.
        farthest: A larger gap need not be known [m].
        known: Whether the body was there a step ago.

    Returns:
        (gap now, infinite where it is not known; whether they touched in between).
    """
    before, now, ego_circle, ego_travel = ego
    circle = math.hypot(body[HALF_LENGTH], body[HALF_WIDTH]) + body[RADIUS]
    dx, dy = body[X] - now[X], body[Y] - now[Y]
    apart = math.hypot(dx, dy) - circle - ego_circle
    gap, touches = np.inf, False
    if apart < farthest:
        gap = core_distance(
            dx,
            dy,
            now[HEADING],
            now[HALF_LENGTH],
            now[HALF_WIDTH],
            body[HEADING],
            body[HALF_LENGTH],
            body[HALF_WIDTH],
        )
        gap = max(gap - body[RADIUS], 0.0)
        touches = gap <= CONTACT_TOLERANCE
    if known and not touches:
        # Circles turn with their bodies: only the centres' travel counts.
        travel = math.hypot(body[X] - was[X], body[Y] - was[Y])
        if apart <= ego_travel + travel + CONTACT_TOLERANCE:
            touches = swept_contact(before, now, was, body)
    return gap, touches


@compiled
def _check_bodies(
    ego_before: FloatArray,
    ego: FloatArray,
    before: FloatArray,
    now: FloatArray,
    rows_before: IntArray,
    static: FloatArray,
) -> tuple[BoolArray, int, float]:
    """Check all bodies, vehicles before static ones.

    Args:
        ego_before: The ego's rectangle a step ago, (6,).
        ego: The same now.
        before: Table of the road users a step ago, (8, m).
        now: The same now, (8, n).
        rows_before: Column of each vehicle in `before`, or `UNKNOWN`, (n,).
        static: Rectangles that do not move, (n_static, 6).

    Returns:
        (contacts (n + n_static,), index of the nearest body or -1, its distance [m]).
    """
    n = now.shape[1]
    touched = np.zeros(n + static.shape[0], dtype=np.bool_)
    nearest, clearance = -1, np.inf
    ego_circle = math.hypot(ego[HALF_LENGTH], ego[HALF_WIDTH])
    ego_travel = math.hypot(ego[X] - ego_before[X], ego[Y] - ego_before[Y])
    body, was = np.empty(N_RECTANGLE), np.empty(N_RECTANGLE)
    for i in range(n + static.shape[0]):
        known = True
        if i < n:
            fill_rectangle(now, i, body)
            known = rows_before[i] != UNKNOWN
            if known:
                fill_rectangle(before, rows_before[i], was)
        else:
            body[:] = static[i - n]
            was[:] = body
        gap, touches = check_pair(
            (ego_before, ego, ego_circle, ego_travel), was, body, clearance, known
        )
        if gap < clearance:
            nearest, clearance = i, gap
        touched[i] = touches
    return touched, nearest, clearance
