"""An ego that waits at its line: SUMO is told that it is still before the junction.

Where a lane inside a junction does not begin straight on, or is nearer than the end of
the ego's lane, SUMO counts an ego that waits at its line in the junction, and everybody
waits for it. Half a lane's width before its end the lane is the ego's without doubt.
"""

import math

from experiments.cosim.sumo.lanes import INSIDE_JUNCTION
from experiments.cosim.sumo.libsumo_api import Libsumo
from experiments.cosim.sumo.route_place import RoutePlace

BEFORE_END = 0.1  # farther than half a lane, an ego that waits is put back [m]
AT_END = 3.0  # an ego at its line is not farther from the end of its lane [m]


class WaitingPlace:
    """Where SUMO is to have an ego that is before a line.

    Args:
        sumo: The running libsumo module.
        ego_id: The ego.
        place: Its place on its route.
    """

    def __init__(self, sumo: Libsumo, ego_id: str, place: RoutePlace) -> None:
        self._sumo = sumo
        self._ego_id = ego_id
        self._place = place
        self._held = False  # the ego is put on its lane, not into the junction

    def update(
        self, front: tuple[float, float], *, before_line: bool
    ) -> tuple[float, float] | None:
        """Return where to put an ego that waits and that SUMO has in the junction.

        Args:
            front: Centre of its front bumper [m].
            before_line: Whether it has a line where it may have to wait just ahead.

        Returns:
            A point of its lane [m]; None where the ego stays where it is.
        """
        point = self._before_end(front) if before_line else None
        self._held = point is not None
        return point

    def _before_end(self, front: tuple[float, float]) -> tuple[float, float] | None:
        """Return the point of its lane for an ego that SUMO has in the junction."""
        lane_id = str(self._sumo.vehicle.getLaneID(self._ego_id))
        if not self._held and not lane_id.startswith(INSIDE_JUNCTION):
            return None
        lane = min(
            self._place.road.lanes, key=lambda x: math.dist(front, x.foot(*front))
        )
        before = lane.length - lane.width / 2.0 - BEFORE_END
        station = min(lane.project(*front)[0], before)
        if math.dist(front, lane.at(lane.length)[:2]) > AT_END or station < 0.0:
            return None
        self._place.go_back_to_road()
        return lane.at(station)[:2]
