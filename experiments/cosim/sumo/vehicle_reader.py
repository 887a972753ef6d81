"""Reads SUMO's vehicles: front bumpers and compass angles become centres and headings.

Plain getters, which in libsumo are faster than subscriptions.
"""

from collections.abc import Iterable, Set
from types import ModuleType

import numpy as np

from experiments.cosim.records import Signal, TrafficState
from experiments.cosim.sumo import frames
from planner.states import CartesianState

# x, y of the front bumper, angle, speed, acceleration, lateral speed, length, width
Row = tuple[float, ...]
N_CELLS = 8


class VehicleReader:
    """Everyone but those who are no traffic; sizes are asked for once."""

    def __init__(self, sumo: ModuleType, hidden: Set[str]) -> None:
        self._vehicles = sumo.vehicle
        self._hidden = hidden
        self._sizes: dict[str, tuple[float, float]] = {}

    def near(
        self, point: tuple[float, float], radius: float
    ) -> tuple[list[str], list[Row]]:
        """Read all vehicles whose front is at most `radius` from a point, by id."""
        x, y = point
        return self.of(self._vehicles.getIDList(), x, y, radius**2)

    def of(
        self,
        names: Iterable[str],
        x: float = 0.0,
        y: float = 0.0,
        square: float = np.inf,
    ) -> tuple[list[str], list[Row]]:
        """Read the vehicles of these names within the root of `square` of (x, y)."""
        vehicles = self._vehicles
        position, angle = vehicles.getPosition, vehicles.getAngle
        speed, acceleration = vehicles.getSpeed, vehicles.getAcceleration
        lateral = vehicles.getLateralSpeed
        ids: list[str] = []
        rows: list[Row] = []
        for name in sorted(names):
            if name in self._hidden:
                continue
            own_x, own_y = position(name)
            if (own_x - x) ** 2 + (own_y - y) ** 2 > square:
                continue
            size = self._sizes.get(name)
            if size is None:
                size = (vehicles.getLength(name), vehicles.getWidth(name))
                self._sizes[name] = size
            ids.append(name)
            motion = (speed(name), acceleration(name), lateral(name))
            rows.append((own_x, own_y, angle(name), *motion, *size))
        return ids, rows


def traffic_state(
    time: float,
    ids: list[str],
    rows: list[Row],
    signals: tuple[Signal, ...] = (),
    ghost: CartesianState | None = None,
) -> TrafficState:
    """Bring what was read into the project's frames."""
    x, y, angle, speed, acceleration, lateral, length, width = (
        np.array(rows, dtype=np.float64).reshape(-1, N_CELLS).T
    )
    heading = frames.heading_from_angle(angle)
    centre_x, centre_y = frames.centre_from_front(x, y, heading, length)
    return TrafficState(
        time,
        tuple(ids),
        centre_x,
        centre_y,
        heading,
        speed,
        acceleration,
        length,
        width,
        signals,
        ghost,
        lateral,
    )
