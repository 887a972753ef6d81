"""No lane change into an ego that is abreast: a gap in SUMO's own check, closed.

SUMO's drivers do not change into a lane where a neighbour overlaps them. Rarely (two
episodes of several hundred among obstacles) one begins to do so all the same, into an
ego that TraCI moves; the reason is not known. The ego cannot avoid a car that comes
sideways, so vehicles abreast of the ego may not begin a lane change. Vehicles ahead and
behind are not restricted.
"""

import numpy as np

from experiments.cosim.sumo.libsumo_api import Libsumo
from planner.scene import RoadUsers
from planner.states import CartesianState
from planner.vehicle import Vehicle, centre_from_rear_axle

LENGTHWISE_MARGIN = 0.5  # bumper to bumper; SUMO decides a step later [m]
SIDEWAYS_REACH = 6.0  # centre to centre: the neighbour lanes [m]
NO_LANE_CHANGES = 0  # SUMO's lane change mode
OWN_LANE_CHANGES = 1621  # SUMO's default mode


def abreast(ego: CartesianState, vehicle: Vehicle, others: RoadUsers) -> set[str]:
    """Return the ids of vehicles that overlap the ego lengthwise in a neighbour lane.

    Args:
        ego: Rear axle.
        vehicle: The ego's dimensions.
        others: All other vehicles, at the same moment.

    """
    x, y = centre_from_rear_axle(ego, vehicle)
    dx, dy = others.x - x, others.y - y
    cos, sin = np.cos(ego.heading), np.sin(ego.heading)
    along = np.abs(dx * cos + dy * sin)
    across = np.abs(dy * cos - dx * sin)
    reach = (vehicle.length + others.length) / 2.0 + LENGTHWISE_MARGIN
    same_way = np.cos(others.heading - ego.heading) > 0.0
    inside = (along < reach) & (across < SIDEWAYS_REACH) & same_way
    return {others.ids[i] for i in np.flatnonzero(inside)}


class LaneChangeGuard:
    """Keeps vehicles beside the ego from beginning a lane change."""

    def __init__(self, sumo: Libsumo) -> None:
        self._sumo = sumo
        self._held: set[str] = set()

    def update(self, ids: set[str], present: set[str]) -> None:
        """Hold `ids`, and release all others that are still `present`."""
        mode = self._sumo.vehicle.setLaneChangeMode
        for name in sorted(self._held - ids):
            if name in present:
                mode(name, OWN_LANE_CHANGES)
        for name in sorted(ids - self._held):
            mode(name, NO_LANE_CHANGES)
        self._held = ids
