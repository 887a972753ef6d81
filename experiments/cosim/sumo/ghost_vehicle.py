"""The ghost: makes an ego that reaches over a lane line visible to followers.

A vehicle that is moved by `moveToXY` occupies only the lane in which the centre of its
front bumper lies, so that traffic in the other lane drives into the part of its body
that is over the line. A second vehicle, the ghost, therefore rides abreast of the ego
in the centre of the lane that the ego reaches into but is not counted in. When the
front bumper crosses the line the two lanes change their roles, and so does the ghost.
It never leaves the ego's edge: oncoming traffic is on another one. Inside junctions it
works between the parallel lanes of one internal edge. Where the ego swings out to turn
sharply, its rear is still before the junction when SUMO, which counts along the short
lane inside, thinks it gone: then the ghost stands there, as long as what is left.

A long body swings out of the lanes of its turn inside a junction, where SUMO would drop
it from the traffic, to be driven into. `Ghost.update` therefore says where SUMO is to
have the front bumper: there in the middle of the nearest lane. So it is behind
the junction as long as the body reaches into that lane. For an ego that waits at its
line it says a point before the junction (`waiting_place`), and it clears SUMO's own
note of the ego's being over a line (`line_note`).
"""

from collections.abc import Sequence

from experiments.cosim.sumo import frames
from experiments.cosim.sumo.control_modes import KEEP_ROUTE_EXACT, NO_CHECKS, NO_LIMIT
from experiments.cosim.sumo.ghost_pose import (
    GhostPose,
    beside_lanes,
    corners,
    ghost_pose,
    rear_pose,
)
from experiments.cosim.sumo.lanes import LANE_GAP, Strip
from experiments.cosim.sumo.libsumo_api import Libsumo
from experiments.cosim.sumo.line_note import clear_note
from experiments.cosim.sumo.route_place import RoutePlace
from experiments.cosim.sumo.waiting_place import WaitingPlace
from planner.states import CartesianState
from planner.vehicle import Vehicle

GHOST = "ghost@"  # before the id of the ego in the id of its ghost
GHOST_TYPE = "type@ghost@"  # before the ego's type in that of its ghost
SLOWEST_LIMIT = 0.1  # of a lane [m/s]
FASTER = 1.001  # than a ghost is, it may be, against rounding


class Ghost:
    """The ghost of one ego inside SUMO.

    Args:
        sumo: The running libsumo module.
        ego_id: The ego.
        route_id: The ego's route, which the ghost shares.
        type_id: The ego's vehicle type.
        strips: All lanes of each edge on the ego's way, also inside junctions, in the
            order of travel.
    """

    def __init__(
        self,
        sumo: Libsumo,
        ego_id: str,
        route_id: str,
        type_id: str,
        strips: Sequence[Strip],
    ) -> None:
        self._sumo = sumo
        self._ego_id = ego_id
        self.id = GHOST + ego_id
        self._route_id = route_id
        self._type_id = GHOST_TYPE + type_id
        # SUMO refuses a departure above the lane's limit or the type's own; the ghost
        # has to keep up with the ego whatever it does.
        if self._type_id not in sumo.vehicletype.getIDList():
            sumo.vehicletype.copy(type_id, self._type_id)
            # Drawn again until it is between the bounds of the type (`normc`), a factor
            # about another mean would be drawn for ever.
            sumo.vehicletype.setSpeedDeviation(self._type_id, 0.0)
            sumo.vehicletype.setMaxSpeed(self._type_id, NO_LIMIT)
        self._route = RoutePlace(strips)
        self._waiting = WaitingPlace(sumo, ego_id, self._route)
        self._noted = False  # SUMO may think that the ego is over a line
        self._whole = self._length = float(sumo.vehicletype.getLength(self._type_id))
        self.pose: GhostPose | None = None

    def update(
        self,
        ego: CartesianState,
        vehicle: Vehicle,
        front: tuple[float, float],
        *,
        before_line: bool = False,
    ) -> tuple[float, float]:
        """Move the ghost to where the ego, about to be moved to `ego`, needs it.

        Args:
            ego: Rear axle.
            vehicle: The ego's dimensions.
            front: Centre of its front bumper [m].
            before_line: Whether it has a line where it may have to wait just ahead.

        Returns:
            Where SUMO is to have the front bumper: `front`, or a point on the lanes of
            the ego's route beside it, where it has swung out of them in a junction [m].

        Raises:
            libsumo.TraCIException: If SUMO refuses; the session wraps it.
        """
        alive = self.pose is not None
        place = self._waiting.update(front, before_line=before_line)
        on_lanes = True
        if place is None:
            place, on_lanes = front, self._route.locate(front)
        if on_lanes:
            self.pose = self._needed(ego, vehicle, place)
        else:
            place = beside_lanes(self._route.ahead(), front, corners(ego, vehicle))
            self.pose = self._left_behind(ego, vehicle, place)
        if self.pose is not None:
            self._place(self.pose, max(ego.speed, 0.0), alive=alive)
            self._noted = True
        elif alive:
            self._sumo.vehicle.remove(self.id)
        # a step later: SUMO has the ego inside its lane too
        if not on_lanes or (self._noted and self.pose is None and not alive):
            self._noted = not clear_note(self._sumo, self._ego_id)
        return place

    def _needed(
        self, ego: CartesianState, vehicle: Vehicle, front: tuple[float, float]
    ) -> GhostPose | None:
        """Decide where the ghost is needed, if it is."""
        pose = ghost_pose(self._route.strip, front, ego, vehicle)
        if pose is not None:
            return pose
        behind = self._route.road_behind(front)
        if behind is None or behind[1] < vehicle.length:
            return None  # on a road, or SUMO itself has the rear before the junction
        return rear_pose(behind[0], ego, vehicle)

    def _left_behind(
        self, ego: CartesianState, vehicle: Vehicle, place: tuple[float, float]
    ) -> GhostPose | None:
        """Decide the same for an ego whose front has swung out of its lanes.

        Args:
            ego: Rear axle.
            vehicle: The ego's dimensions.
            place: Where SUMO is to have the front bumper [m].
        """
        road = self._route.road
        return rear_pose(road, ego, vehicle, road.lane_of(*place, LANE_GAP))

    def follow(self, route_id: str) -> None:
        """Give the ghost another route; one that is there is made anew."""
        self.remove()
        self._route_id = route_id

    def remove(self) -> None:
        """Take the ghost out of SUMO, where there is one."""
        if self.pose is not None:
            self._sumo.vehicle.remove(self.id)
            self.pose = None

    def _place(self, pose: GhostPose, speed: float, *, alive: bool) -> None:
        """Add the ghost if there is none and move it to its pose."""
        vehicles = self._sumo.vehicle
        if not alive:
            self._allow(speed, f"{pose.edge}_{pose.lane}")
            vehicles.add(
                self.id,
                self._route_id,
                typeID=self._type_id,
                departSpeed=repr(float(speed)),
            )
            vehicles.setSpeedMode(self.id, NO_CHECKS)
            vehicles.setLaneChangeMode(self.id, 0)
            self._length = self._whole
        if pose.length != self._length:
            self._length = pose.length
            vehicles.setLength(self.id, pose.length)
        vehicles.setSpeed(self.id, speed)
        vehicles.moveToXY(
            self.id,
            pose.edge,
            pose.lane,
            pose.x,
            pose.y,
            frames.angle_from_heading(pose.heading),
            KEEP_ROUTE_EXACT,
        )

    def _allow(self, speed: float, lane: str) -> None:
        """Let the type depart on a lane with a speed, and not much faster.

        SUMO looks at the limit of the route's first edge, too. From the greatest factor
        of all vehicles so far it tells how far behind everybody looks before a change
        of lanes: with one of 100 a step takes five times as long in a city.
        """
        sumo = self._sumo
        first = str(sumo.route.getEdges(self._route_id)[0])
        beside = [f"{first}_{k}" for k in range(sumo.edge.getLaneNumber(first))]
        limit = min(float(sumo.lane.getMaxSpeed(name)) for name in (lane, *beside))
        factor = max(1.0, FASTER * speed / max(limit, SLOWEST_LIMIT))
        sumo.vehicletype.setSpeedFactor(self._type_id, factor)
