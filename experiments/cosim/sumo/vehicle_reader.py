"""Reads SUMO's vehicles: front bumpers and compass angles become centres and headings.

Plain getters, which in libsumo are faster than subscriptions.
"""

from collections.abc import Iterable, Set

import numpy as np

from experiments.cosim.sumo import frames
from experiments.cosim.sumo.libsumo_api import Libsumo
from planner.scene import COLUMNS, RoadUsers

X, Y, HEADING, LENGTH, LATERAL_SPEED = (
    COLUMNS.index(name) for name in ("x", "y", "heading", "length", "lateral_speed")
)


class VehicleReader:
    """Reads all vehicles that are traffic; asks for the size of each only once.

    Args:
        sumo: The running libsumo module.
        hidden: Ids of vehicles that are not traffic.
        left_hand: Whether traffic keeps to the left.
    """

    def __init__(
        self, sumo: Libsumo, hidden: Set[str], *, left_hand: bool = False
    ) -> None:
        self._left_hand = left_hand
        self._vehicles = sumo.vehicle
        self._hidden = hidden
        self._sizes: dict[str, tuple[float, float]] = {}

    def near(self, point: tuple[float, float], radius: float) -> RoadUsers:
        """Read all vehicles whose front is at most `radius` from a point, by id."""
        x, y = point
        return self.of(self._vehicles.getIDList(), x, y, radius**2)

    def of(
        self,
        names: Iterable[str],
        x: float = 0.0,
        y: float = 0.0,
        square: float = np.inf,
    ) -> RoadUsers:
        """Read the vehicles of these names within the root of `square` of (x, y)."""
        vehicles = self._vehicles
        position, angle = vehicles.getPosition, vehicles.getAngle
        speed, acceleration = vehicles.getSpeed, vehicles.getAcceleration
        lateral = vehicles.getLateralSpeed
        wanted = sorted(names)
        table = np.empty((len(COLUMNS), len(wanted)))  # first with fronts and angles
        ids: list[str] = []
        for name in wanted:
            if name in self._hidden:
                continue
            own_x, own_y = position(name)
            if (own_x - x) ** 2 + (own_y - y) ** 2 > square:
                continue
            size = self._sizes.get(name)
            if size is None:
                size = (vehicles.getLength(name), vehicles.getWidth(name))
                self._sizes[name] = size
            motion = (speed(name), acceleration(name), lateral(name))
            table[:, len(ids)] = (own_x, own_y, angle(name), *motion, *size)
            ids.append(name)
        table = np.ascontiguousarray(table[:, : len(ids)])
        heading = frames.heading_from_angle(table[HEADING])
        table[X], table[Y] = frames.centre_from_front(
            table[X], table[Y], heading, table[LENGTH]
        )
        table[HEADING] = heading
        if self._left_hand:  # SUMO counts lateral speeds towards the road's middle
            table[LATERAL_SPEED] *= -1.0
        return RoadUsers.from_table(tuple(ids), table)
