"""Reads SUMO's vehicles: front bumpers and compass angles become centres and headings.

Plain getters, which in libsumo are faster than subscriptions.
"""

from collections.abc import Callable, Iterable, Set
from typing import Any, cast

import numpy as np

from experiments.cosim.records import VehicleLook
from experiments.cosim.sumo import frames
from experiments.cosim.sumo.libsumo_api import Libsumo, Point
from planner.scene import COLUMNS, RoadUsers

PERSON = "person:"  # before the id of somebody on foot
ON_FOOT = VehicleLook("pedestrian", "")
# bits 0 to 2 of SUMO's signals: blinker right, blinker left, emergency blinker
INDICATORS = ("", "right", "left", "both", "both", "both", "both", "both")
LATERAL_SPEED = COLUMNS.index("lateral_speed")
Number = Callable[[str], float]  # of a vehicle's name
Getters = tuple[Callable[[str], Point], Number, Number, Number, Number]


def direct_getter(sumo: Libsumo, name: str) -> Any:
    """Return one of libsumo's readers of vehicles.

    Its Python methods only call functions of its extension module. With thirty
    vehicles these calls alone are a tenth of a step: where the functions are found
    they are called directly.
    """
    extension = getattr(getattr(sumo, "libsumo", None), "_libsumo", None)
    return getattr(extension, f"vehicle_{name}", getattr(sumo.vehicle, name))


def direct_getters(sumo: Libsumo) -> Getters:
    """Return the readers of position, angle, speed, acceleration, lateral speed."""
    return cast(
        Getters,
        tuple(
            direct_getter(sumo, name)
            for name in (
                "getPosition",
                "getAngle",
                "getSpeed",
                "getAcceleration",
                "getLateralSpeed",
            )
        ),
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
        self._persons = sumo.person
        self._getters = direct_getters(sumo)
        self._signals = direct_getter(sumo, "getSignals")
        self._hidden = hidden
        self._sizes: dict[str, tuple[float, float]] = {}
        self._kinds: dict[str, str] = {}

    def looks(self, names: Iterable[str]) -> dict[str, VehicleLook]:
        """Read kind and indicators of vehicles that `near` has just read."""
        signals, known = self._signals, self._kinds
        found = {}
        for name in names:
            if name.startswith(PERSON):
                found[name] = ON_FOOT
                continue
            kind = known.get(name)
            if kind is None:
                kind = known[name] = self._vehicles.getVehicleClass(name)
            found[name] = VehicleLook(kind, INDICATORS[signals(name) & 7])
        return found

    def near(self, point: tuple[float, float], radius: float) -> RoadUsers:
        """Read all vehicles at most `radius` from a point by id, then all on foot."""
        x, y = point
        found = self.of(self._vehicles.getIDList(), x, y, radius**2)
        on_foot = self._persons.getIDList()
        return self._joined(found, on_foot, x, y, radius**2) if on_foot else found

    def _joined(
        self, vehicles: RoadUsers, names: Iterable[str], x: float, y: float, most: float
    ) -> RoadUsers:
        """Add the persons within the root of `most` of (x, y) who are on foot."""
        persons = self._persons
        fronts: list[tuple[float, ...]] = []
        ids: list[str] = []
        for name in sorted(names):
            own_x, own_y = persons.getPosition(name)
            if (own_x - x) ** 2 + (own_y - y) ** 2 > most or persons.getVehicle(name):
                continue
            size = persons.getLength(name), persons.getWidth(name)
            motion = persons.getSpeed(name), 0.0, 0.0
            fronts.append((own_x, own_y, persons.getAngle(name), *motion, *size))
            ids.append(PERSON + name)
        if not ids:
            return vehicles
        table = frames.centres_of(np.array(fronts))
        return RoadUsers.from_table(
            (*vehicles.ids, *ids), np.hstack([vehicles.table, table])
        )

    def of(
        self,
        names: Iterable[str],
        x: float = 0.0,
        y: float = 0.0,
        square: float = np.inf,
    ) -> RoadUsers:
        """Read the vehicles of these names within the root of `square` of (x, y)."""
        position, angle, speed, acceleration, lateral = self._getters
        hidden, sizes = self._hidden, self._sizes
        fronts: list[tuple[float, ...]] = []
        ids: list[str] = []
        for name in sorted(names):
            if name in hidden:
                continue
            own_x, own_y = position(name)
            dx, dy = own_x - x, own_y - y
            if dx * dx + dy * dy > square:
                continue
            size = sizes.get(name) or self._measure(name)
            motion = (speed(name), acceleration(name), lateral(name))
            fronts.append((own_x, own_y, angle(name), *motion, *size))
            ids.append(name)
        rows = np.array(fronts).reshape(-1, len(COLUMNS))
        table = frames.centres_of(rows)
        if self._left_hand:  # SUMO counts lateral speeds towards the road's middle
            table[LATERAL_SPEED] *= -1.0
        return RoadUsers.from_table(tuple(ids), table)

    def _measure(self, name: str) -> tuple[float, float]:
        """Ask for the size of a vehicle and remember it."""
        vehicles = self._vehicles
        size = (vehicles.getLength(name), vehicles.getWidth(name))
        self._sizes[name] = size
        return size
