"""What each of many egos sees in a step, and what it is to expect of the others.

Vehicles are predicted once for all egos on one road: where a vehicle will be does not
depend on who looks at it, only on the path along which it is placed.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from experiments.cosim.road import Road
from experiments.cosim.scene_builder import PLANNED_RADIUS, Outlook
from planner.scene import Prediction, RoadUsers, Vehicles
from planner.states import BoolArray, CartesianState, FloatArray, IntArray

VIEW_RADIUS = 150.0  # of egos on roads with junctions [m]; else PLANNED_RADIUS

Looker = tuple[str, CartesianState, Road, Outlook]


@dataclass(frozen=True, slots=True, eq=False)
class _Shared:
    """The vehicles near any ego of a path, predicted along its path."""

    rows: IntArray  # of each vehicle of the snapshot in the prediction, (m,)
    prediction: Prediction


class FleetSight:
    """The view of all egos on one snapshot.

    Args:
        users: Everybody, the egos too.
        lookers: Of each ego its id, rear axle, road, and how others are predicted.
    """

    def __init__(self, users: RoadUsers, lookers: Sequence[Looker]) -> None:
        self._users = users
        self._lookers = lookers
        self._square = _squares(users, lookers)
        self._near: dict[int, tuple[BoolArray, RoadUsers]] = {}
        self._shared: dict[tuple[int, int], _Shared] = {}
        self._of_path: dict[tuple[int, int], list[int]] = {}
        for k, (_, _, road, outlook) in enumerate(lookers):
            key = (id(road.path), id(outlook.predictor))
            self._of_path.setdefault(key, []).append(k)

    def seen(self, k: int) -> RoadUsers:
        """Return everybody near ego `k` but itself."""
        if not self._lookers[k][2].junctions:
            return self._planned(k)[1]
        return self._among(self._square[k] <= VIEW_RADIUS**2)

    def predicted(self, k: int) -> Vehicles:
        """Return everybody that ego `k` plans with, and where they will be."""
        _, _, road, outlook = self._lookers[k]
        key = (id(road.path), id(outlook.predictor))
        if key not in self._shared:
            self._shared[key] = self._predict(self._of_path[key], road, outlook)
        shared, (near, users) = self._shared[key], self._planned(k)
        table = np.take(shared.prediction.table, shared.rows[near], axis=1)
        prediction = Prediction.from_table(shared.prediction.step, table)
        return Vehicles.predicted(users, prediction)

    def _planned(self, k: int) -> tuple[BoolArray, RoadUsers]:
        """Return whom ego `k` plans with: marks among everybody, and the vehicles."""
        if k not in self._near:
            near = self._square[k] <= PLANNED_RADIUS**2
            self._near[k] = near, self._among(near)
        return self._near[k]

    def _among(self, near: BoolArray) -> RoadUsers:
        """Return the vehicles that are marked."""
        users, indices = self._users, np.flatnonzero(near)
        ids = users.ids
        names = tuple([ids[i] for i in indices.tolist()])
        return RoadUsers.from_table(names, np.take(users.table, indices, axis=1))

    def _predict(self, egos: list[int], road: Road, outlook: Outlook) -> _Shared:
        """Predict everybody near any of some egos."""
        near: BoolArray = np.any(self._square[egos] <= PLANNED_RADIUS**2, axis=0)
        users = self._users.among(near)
        rows = np.cumsum(near) - 1
        return _Shared(
            rows, outlook.predictor(road.path, users, outlook.times, road.lanes)
        )


def _squares(users: RoadUsers, lookers: Sequence[Looker]) -> FloatArray:
    """Return the squared distance of each vehicle from each ego, (n, m) [m²].

    That of an ego from itself is infinite.
    """
    x = np.array([state.x for _, state, _, _ in lookers])[:, None]
    y = np.array([state.y for _, state, _, _ in lookers])[:, None]
    square: FloatArray = (users.x - x) ** 2 + (users.y - y) ** 2
    place = {name: column for column, name in enumerate(users.ids)}
    for k, (name, _, _, _) in enumerate(lookers):
        if name in place:
            square[k, place[name]] = np.inf
    return square
