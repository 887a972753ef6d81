"""No lane change into an ego that is abreast: a gap in SUMO's own check, closed.

SUMO's drivers do not change into a lane where a neighbour overlaps them. Seldom (two
episodes of several hundred among obstacles) one begins to do so all the same, into an
ego that TraCI moves; why is not known. No driver would, and the ego cannot get out of
the way of a car that comes sideways, so those who are abreast of the ego may not begin
a lane change. Ahead and behind they are as free as ever.
"""

from types import ModuleType

import numpy as np

from experiments.cosim.records import TrafficState
from experiments.cosim.sumo import frames
from planner.states import CartesianState
from planner.vehicle import Vehicle

LENGTHWISE_MARGIN = 0.5  # bumper to bumper; SUMO decides a step later [m]
SIDEWAYS_REACH = 6.0  # centre to centre: the neighbour lanes [m]
NO_LANE_CHANGES = 0  # SUMO's lane change mode
OWN_LANE_CHANGES = 1621  # SUMO's default mode


def abreast(ego: CartesianState, vehicle: Vehicle, traffic: TrafficState) -> set[str]:
    """Name the vehicles that overlap the ego lengthwise in a neighbour lane.

    Args:
        ego: Rear axle.
        vehicle: The ego's dimensions.
        traffic: Everyone else, at the same moment.

    Returns:
        Ids.
    """
    x, y = frames.centre_from_rear_axle(ego, vehicle)
    dx, dy = traffic.x - x, traffic.y - y
    cos, sin = np.cos(ego.heading), np.sin(ego.heading)
    along = np.abs(dx * cos + dy * sin)
    across = np.abs(dy * cos - dx * sin)
    reach = (vehicle.length + traffic.length) / 2.0 + LENGTHWISE_MARGIN
    same_way = np.cos(traffic.heading - ego.heading) > 0.0
    inside = (along < reach) & (across < SIDEWAYS_REACH) & same_way
    return {traffic.ids[i] for i in np.flatnonzero(inside)}


class LaneChangeHold:
    """Tells SUMO who may not begin a lane change now."""

    def __init__(self, sumo: ModuleType) -> None:
        self._sumo = sumo
        self._held: set[str] = set()

    def update(self, ids: set[str], present: set[str]) -> None:
        """Hold `ids` and release everyone else who is still `present`."""
        mode = self._sumo.vehicle.setLaneChangeMode
        for name in sorted(self._held - ids):
            if name in present:
                mode(name, OWN_LANE_CHANGES)
        for name in sorted(ids - self._held):
            mode(name, NO_LANE_CHANGES)
        self._held = ids
