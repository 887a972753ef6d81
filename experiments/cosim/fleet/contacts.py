"""Contacts of many egos with everybody, in one sweep along x.

Every ego is compared with the vehicles whose centres are near its own in x; which those
are a sorted list tells. The pairs are checked as for a single ego.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from experiments.cosim.collision_monitor import (
    N_RECTANGLE,
    UNKNOWN,
    StepCheck,
    check_pair,
    columns_before,
    ego_rectangle,
    excess_over_edges,
    fill_rectangle,
)
from experiments.cosim.road import Road
from planner.numerics.compiled import compiled
from planner.reference_path.path import PROJECTION_REACH, PathTable
from planner.scene import RoadUsers
from planner.shapes.rectangles import HALF_LENGTH, HALF_WIDTH, X, Y
from planner.states import CartesianState, FloatArray, IntArray
from planner.vehicle import Vehicle

SWEPT = 150.0  # a body farther from an ego is not looked at [m]


@dataclass(frozen=True, slots=True, eq=False)
class CheckedEgo:
    """An ego whose step is checked."""

    id: str
    state: CartesianState
    body: Vehicle
    road: Road
    s: float  # about where it is on its path [m]


class FleetMonitor:
    """Checks all egos of a simulation, step by step; keeps only the step before."""

    def __init__(self) -> None:
        self._before: RoadUsers | None = None
        self._rows: dict[str, FloatArray] = {}  # of the egos, a step ago
        self._same = np.arange(0)

    def check(self, egos: Sequence[CheckedEgo], users: RoadUsers) -> list[StepCheck]:
        """Check the step that led to this moment.

        Args:
            egos: All of them; there is one for each id.
            users: Everybody, the egos too.

        Returns:
            The result for each ego. Clearances beyond `SWEPT` count as infinite.
        """
        before = users if self._before is None else self._before
        rows = {one.id: ego_rectangle(one.state, one.body) for one in egos}
        now = np.array(list(rows.values())).reshape(-1, N_RECTANGLE)
        was = np.array([self._rows.get(one.id, rows[one.id]) for one in egos])
        place = {name: column for column, name in enumerate(users.ids)}
        own = np.array([place.get(one.id, UNKNOWN) for one in egos], np.int64)
        pairs, nearest, clearance = _check_fleet(
            (was.reshape(-1, N_RECTANGLE), now, own),
            (before.table, users.table, self._columns(users.ids)),
            np.argsort(users.x, kind="stable"),
            SWEPT,
        )
        self._before, self._rows = users, rows
        touched: dict[int, list[str]] = {}
        for ego, column in pairs:
            touched.setdefault(ego, []).append(users.ids[column])
        off_road = self._off_road(egos, now)
        return [
            StepCheck(
                tuple(sorted(touched.get(k, ()))),
                float(clearance[k]),
                users.ids[nearest[k]] if nearest[k] >= 0 else None,
                off_road[k],
            )
            for k in range(len(egos))
        ]

    def _columns(self, ids: tuple[str, ...]) -> IntArray:
        """Return each vehicle's column in the table a step ago, or `UNKNOWN`."""
        if self._before is None:
            return np.full(len(ids), UNKNOWN, np.int64)
        if ids == self._before.ids:
            if self._same.size != len(ids):
                self._same = np.arange(len(ids))
            return self._same
        return columns_before(self._before.ids, ids)

    @staticmethod
    def _off_road(egos: Sequence[CheckedEgo], rows: FloatArray) -> list[float]:
        """Return how far each ego reaches over its road's edge [m]; 0 inside."""
        of_road: dict[int, list[int]] = {}
        for k, one in enumerate(egos):
            of_road.setdefault(id(one.road), []).append(k)
        found = [0.0] * len(egos)
        for members in of_road.values():
            road = egos[members[0]].road
            excess = _excesses(
                rows[members],
                road.path.table,
                (road.bounds.s, road.bounds.left, road.bounds.right),
                np.array([egos[k].s for k in members]),
            )
            for k, value in zip(members, excess.tolist(), strict=True):
                found[k] = value
        return found


@compiled
def _excesses(
    egos: FloatArray,
    path: PathTable,
    edges: tuple[FloatArray, FloatArray, FloatArray],
    near: FloatArray,
) -> FloatArray:
    """Compute how far egos on one road reach over its edge, (n,) [m]."""
    out = np.empty(egos.shape[0])
    for k in range(out.size):
        limits = (near[k] - PROJECTION_REACH, near[k] + PROJECTION_REACH)
        out[k] = excess_over_edges(egos[k], path, edges, limits)
    return out


@compiled
def _check_fleet(
    egos: tuple[FloatArray, FloatArray, IntArray],
    vehicles: tuple[FloatArray, FloatArray, IntArray],
    order: IntArray,
    reach: float,
) -> tuple[list[tuple[int, int]], IntArray, FloatArray]:
    """Check every ego with the vehicles near it in x.

    Args:
        egos: Rectangles a step ago and now, (n, 6) each, and the column of each ego
            among the vehicles, or `UNKNOWN`, (n,).
        vehicles: Tables of road users a step ago and now, (8, m) each, and the column
            of each vehicle a step ago, or `UNKNOWN`, (m,).
        order: Columns of the vehicles by growing x, (m,).
        reach: Of the sweep [m].

    Returns:
        (pairs of an ego and the column of a vehicle that it touched; column of the
        nearest vehicle or -1, its distance [m], (n,) each).
    """
    was, now, own = egos
    before, table, columns = vehicles
    sorted_x = table[0][order]
    nearest = np.full(now.shape[0], -1)
    clearance = np.full(now.shape[0], np.inf)
    pairs = [(0, 0)][:0]
    body, earlier = np.empty(N_RECTANGLE), np.empty(N_RECTANGLE)
    for e in range(now.shape[0]):
        ego = (
            was[e],
            now[e],
            math.hypot(now[e, HALF_LENGTH], now[e, HALF_WIDTH]),
            math.hypot(now[e, X] - was[e, X], now[e, Y] - was[e, Y]),
        )
        first = np.searchsorted(sorted_x, now[e, X] - reach)
        for place in range(first, order.size):
            if sorted_x[place] > now[e, X] + reach:
                break
            column = order[place]
            if column == own[e] or abs(table[1, column] - now[e, Y]) > reach:
                continue
            fill_rectangle(table, column, body)
            known = columns[column] != UNKNOWN
            if known:
                fill_rectangle(before, columns[column], earlier)
            gap, touches = check_pair(ego, earlier, body, clearance[e], known)
            if gap < clearance[e]:
                nearest[e], clearance[e] = column, gap
            if touches:
                pairs.append((e, column))
    return pairs, nearest, clearance
