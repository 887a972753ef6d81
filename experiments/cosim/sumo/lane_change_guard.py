"""No lane change into an ego that is abreast: a gap in SUMO's own check, closed.

SUMO's drivers do not change into a lane where a neighbour overlaps them. Rarely (two
episodes of several hundred among obstacles) one begins to do so all the same, into an
ego that TraCI moves; the reason is not known. The ego cannot avoid a car that comes
sideways, so vehicles abreast of the ego may not begin a lane change. Vehicles ahead and
behind are not restricted.
"""

import math
from collections.abc import Iterable

import numpy as np

from experiments.cosim.sumo.control_modes import NO_LANE_CHANGES, OWN_LANE_CHANGES
from experiments.cosim.sumo.libsumo_api import Libsumo
from experiments.cosim.sumo.vehicle_reader import PERSON
from planner.numerics.compiled import compiled, inlined
from planner.scene import RoadUsers
from planner.states import BoolArray, CartesianState, FloatArray
from planner.vehicle import Vehicle, centre_from_rear_axle

LENGTHWISE_MARGIN = 0.5  # bumper to bumper; SUMO decides a step later [m]
SIDEWAYS_REACH = 6.0  # centre to centre: the neighbour lanes [m]


def abreast(ego: CartesianState, vehicle: Vehicle, others: RoadUsers) -> set[str]:
    """Return the ids of vehicles that overlap the ego lengthwise in a neighbour lane.

    Args:
        ego: Rear axle.
        vehicle: The ego's dimensions.
        others: All other vehicles, at the same moment.

    """
    x, y = centre_from_rear_axle(ego, vehicle)
    ids = others.ids
    return {ids[i] for i in _abreast((x, y, ego.heading), vehicle.length, others.table)}


@compiled
def _abreast(
    ego: tuple[float, float, float], ego_length: float, others: FloatArray
) -> list[int]:
    """Return the columns of the vehicles that overlap the ego.

    Args:
        ego: Centre (x, y) [m] and heading [rad].
        ego_length: Of its body [m].
        others: Table of road users, (8, n).
    """
    inside = np.zeros(others.shape[1], np.bool_)
    _mark_abreast(ego, ego_length, others, inside)
    return [k for k in range(inside.size) if inside[k]]


@inlined
def _mark_abreast(
    ego: tuple[float, float, float],
    ego_length: float,
    others: FloatArray,
    inside: BoolArray,
) -> None:
    """Mark the vehicles that overlap the ego; see `_abreast`."""
    x, y, ego_heading = ego
    cos, sin = math.cos(ego_heading), math.sin(ego_heading)
    for k in range(inside.size):
        dx, dy = others[0, k] - x, others[1, k] - y
        along = abs(dx * cos + dy * sin)
        across = abs(dy * cos - dx * sin)
        reach = (ego_length + others[6, k]) / 2.0 + LENGTHWISE_MARGIN
        same_way = math.cos(others[2, k] - ego_heading) > 0.0
        if along < reach and across < SIDEWAYS_REACH and same_way:
            inside[k] = True


@compiled
def abreast_of_any(egos: FloatArray, others: FloatArray) -> BoolArray:
    """Mark the vehicles that overlap one of many egos, and egos that do, (n,).

    Args:
        egos: Centre x, y [m], heading [rad] and length [m], (n_egos, 4).
        others: Table of road users, (8, n).
    """
    inside = np.zeros(others.shape[1], np.bool_)
    for e in range(egos.shape[0]):
        pose = (egos[e, 0], egos[e, 1], egos[e, 2])
        _mark_abreast(pose, egos[e, 3], others, inside)
    return inside


class LaneChangeGuard:
    """Keeps vehicles beside the ego from beginning a lane change."""

    def __init__(self, sumo: Libsumo) -> None:
        self._sumo = sumo
        self._held: set[str] = set()

    def update(self, ids: set[str], present: Iterable[str]) -> None:
        """Hold `ids`, and release all others that are still `present`."""
        ids = {name for name in ids if not name.startswith(PERSON)}
        if ids == self._held:
            return
        there = set(present)
        mode = self._sumo.vehicle.setLaneChangeMode
        for name in sorted(self._held - ids):
            if name in there:
                mode(name, OWN_LANE_CHANGES)
        for name in sorted(ids - self._held):
            mode(name, NO_LANE_CHANGES)
        self._held = ids
