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

SUMO itself notes, too, that the ego is over a line, but only in the step in which it
moves the ego from one lane object to another, and with a duration of lane changes it
forgets to take that back: long after, cars in the lane that the ego has left brake with
all they have when it passes them. Once the body is inside its lane, the ego is put into
the lane beside and back, which happens between two steps and clears the note. The note
must be gone, too, when the ego leaves the lanes of its route: SUMO 1.28 then forgets
which lanes the rear of a long body is in, but not those of the note, and the process
dies as soon as a vehicle there asks how far back the ego reaches.

A long body swings out of the lanes of its turn inside a junction, where SUMO would drop
it from the traffic, to be driven into. `Ghost.update` therefore says where SUMO is to
have the front bumper: there in the middle of the nearest lane. So it is behind
the junction as long as the body reaches into that lane.

Where a lane inside a junction does not begin straight on, or is nearer than the end of
the ego's lane, SUMO counts an ego that waits at its line in the junction, and everybody
waits for it. Half a lane's width before its end the lane is the ego's without doubt.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from experiments.cosim.sumo import frames
from experiments.cosim.sumo.lanes import LANE_GAP, Lane, Strip, edge_of
from experiments.cosim.sumo.libsumo_api import Libsumo
from planner.states import CartesianState, FloatArray
from planner.vehicle import Vehicle

GHOST = "ghost@"  # before the id of the ego in the id of its ghost
GHOST_TYPE = "type@ghost@"  # before the ego's type in that of its ghost
NO_LIMIT = 100.0  # [m/s]
SLOWEST_LIMIT = 0.1  # of a lane [m/s]
FASTER = 1.001  # than a ghost is, it may be, against rounding
KEEP_ROUTE_EXACT = 3  # moveToXY: exact position, route kept
NO_CHECKS = 32  # setSpeedMode: obey the commanded speed
LOOK_AHEAD = 4  # strips in which the ego may turn up next
INSIDE_JUNCTION = ":"  # how the names of lanes there begin
REACHES_IN = 0.3  # a body that reaches less into a lane leaves it to others [m]
SHORTEST = 0.5  # of a ghost that stands for what is left before a junction [m]
BEFORE_END = 0.1  # farther than half a lane, an ego that waits is put back [m]
AT_END = 3.0  # an ego at its line is not farther from the end of its lane [m]
PAST_LINE = 2.5  # so near behind the line a body is in the way of all who cross it [m]


@dataclass(frozen=True, slots=True)
class GhostPose:
    """Required pose of the ghost, abreast of the ego: front bumper [m, rad]."""

    edge: str
    lane: int
    x: float
    y: float
    heading: float
    length: float  # of the ghost


def ghost_pose(
    lanes: Sequence[Lane], ego: CartesianState, vehicle: Vehicle
) -> GhostPose | None:
    """Decide whether the ego needs a ghost, and in which lane.

    Args:
        lanes: All lanes of the edge that the ego's front bumper is on, from the
            rightmost to the leftmost.
        ego: Rear axle.
        vehicle: The ego's dimensions.

    Returns:
        The ghost's pose, or None where the body stays inside its own lane, would only
        reach off the edge, or is not on this edge at all.
    """
    front_x, front_y, _ = frames.front_from_rear_axle(ego, vehicle)
    return _pose_in(Strip(lanes), (front_x, front_y), ego, vehicle)


def _pose_in(
    strip: Strip, front: tuple[float, float], ego: CartesianState, vehicle: Vehicle
) -> GhostPose | None:
    """Decide as `ghost_pose` does; `front` is the centre of the front bumper [m]."""
    pose = (ego.x, ego.y, ego.heading)
    body = (vehicle.rear_overhang, vehicle.front_reach, vehicle.width)
    reached = strip.reached_lane(front, pose, body)
    if reached is None:
        return None
    lane, station = reached
    return GhostPose(lane.edge, lane.index, *lane.at(station), vehicle.length)


def rear_pose(
    before: Strip, ego: CartesianState, vehicle: Vehicle, own: int | None = None
) -> GhostPose | None:
    """Stand in for the rear of a body that is still in a lane before a junction.

    Args:
        before: Lanes of the road that the ego's front bumper has left.
        ego: Rear axle.
        vehicle: The ego's dimensions.
        own: Lane in which SUMO has the ego, if it is one of these.

    Returns:
        A pose at the lane's end; None where nothing of the body is there any more, or
        close behind it, where the ways of the lane have not parted yet.
    """
    outline = corners(ego, vehicle)
    best = None
    for number, lane in enumerate(before.lanes):
        if number == own:
            continue
        station = _rearmost_in(lane, outline)
        length = min(max(lane.length - station, SHORTEST), vehicle.length)
        near = station <= lane.length + PAST_LINE
        if near and (best is None or length > best.length):
            place = lane.at(min(station + length, lane.length))
            best = GhostPose(lane.edge, lane.index, *place, length)
    return best


def _rearmost_in(lane: Lane, outline: FloatArray) -> float:
    """Return the least arc length at which a body is in a lane; inf if it is not [m].

    Args:
        lane: The lane.
        outline: Corners of the body, (4, 2) [m].
    """
    reach = lane.width / 2.0 - REACHES_IN
    places = [lane.project(*point) for point in outline.tolist()]
    if min(l for _, l in places) > reach or max(l for _, l in places) < -reach:
        return math.inf
    inside = [s for s, l in places if abs(l) < reach]
    return max(min(inside or [s for s, _ in places]), 0.0)


def lane_of(lanes: Sequence[Lane], x: float, y: float) -> int | None:
    """Return the lane of an edge in which SUMO counts a front bumper; None off it.

    The lane changes exactly where the point crosses the line between two lanes.
    """
    return Strip(lanes).lane_of(x, y)


def corners(ego: CartesianState, vehicle: Vehicle) -> FloatArray:
    """Return the corners of the ego's rectangle, (4, 2) [m], counter-clockwise."""
    cos, sin = np.cos(ego.heading), np.sin(ego.heading)
    along = np.array([-vehicle.rear_overhang, vehicle.front_reach])[[0, 1, 1, 0]]
    across = vehicle.width / 2.0 * np.array([-1.0, -1.0, 1.0, 1.0])
    return np.column_stack(
        (ego.x + along * cos - across * sin, ego.y + along * sin + across * cos)
    )


def beside_lanes(
    strips: Sequence[Strip], front: tuple[float, float], outline: FloatArray
) -> tuple[float, float]:
    """Return the point of the nearest lane beside a front bumper that is on none.

    Args:
        strips: Where it may be.
        front: Centre of the front bumper [m].
        outline: Corners of the body, (4, 2) [m].

    Returns:
        The point of its centre line [m]; `front` where the lane is no part of a
        junction and nothing of the body is in it: there SUMO's traffic passes it.
    """
    lanes = [lane for strip in strips for lane in strip.lanes]
    lane = min(lanes, key=lambda x: math.dist(front, x.foot(*front)))
    foot = lane.foot(*front)
    at_end = foot in (lane.at(0.0)[:2], lane.at(lane.length)[:2])
    inside = lane.edge.startswith(INSIDE_JUNCTION)
    there = _rearmost_in(lane, outline) <= lane.length
    return foot if at_end or inside or there else front


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
        self._strips = tuple(strips)
        self._strip = 0  # where the ego was last seen
        self._held = False  # the ego is put on its lane, not into the junction
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
        place = front
        held = self._before_end(front) if before_line else None
        self._held = held is not None
        if held is not None:
            place, on_lanes = held, True
        else:
            on_lanes = self._locate(front)
        if on_lanes:
            self.pose = self._needed(ego, vehicle, place)
        else:
            place = beside_lanes(self._ahead(), front, corners(ego, vehicle))
            self.pose = self._left_behind(ego, vehicle, place)
        if self.pose is not None:
            self._place(self.pose, max(ego.speed, 0.0), alive=alive)
            self._noted = True
        elif alive:
            self._sumo.vehicle.remove(self.id)
        # a step later: SUMO has the ego inside its lane too
        if not on_lanes or (self._noted and self.pose is None and not alive):
            self._noted = not _clear_note(self._sumo, self._ego_id)
        return place

    def _before_end(self, front: tuple[float, float]) -> tuple[float, float] | None:
        """Return where to put an ego that waits and that SUMO has in the junction.

        Args:
            front: Centre of its front bumper [m].

        Returns:
            A point of its lane [m]; None if SUMO does not have it in the junction.
        """
        lane_id = str(self._sumo.vehicle.getLaneID(self._ego_id))
        if not self._held and not lane_id.startswith(INSIDE_JUNCTION):
            return None
        last = self._strip
        while last > 0 and self._strips[last].inside_junction:
            last -= 1
        lanes = self._strips[last].lanes
        lane = min(lanes, key=lambda x: math.dist(front, x.foot(*front)))
        before = lane.length - lane.width / 2.0 - BEFORE_END
        station = min(lane.project(*front)[0], before)
        if math.dist(front, lane.at(lane.length)[:2]) > AT_END or station < 0.0:
            return None
        self._strip = last
        return lane.at(station)[:2]

    def _needed(
        self, ego: CartesianState, vehicle: Vehicle, front: tuple[float, float]
    ) -> GhostPose | None:
        """Decide where the ghost is needed, if it is."""
        strip = self._strips[self._strip]
        pose = _pose_in(strip, front, ego, vehicle)
        if pose is not None:
            return pose
        inside, place = strip.lanes[0].project(*front)[0], self._strip
        while place > 0 and self._strips[place].inside_junction:
            place -= 1
            if self._strips[place].inside_junction:
                inside += self._strips[place].lanes[0].length
        if place == self._strip or inside < vehicle.length:
            return None  # on a road, or SUMO itself has the rear before the junction
        return rear_pose(self._strips[place], ego, vehicle)

    def _left_behind(
        self, ego: CartesianState, vehicle: Vehicle, place: tuple[float, float]
    ) -> GhostPose | None:
        """Decide the same for an ego whose front has swung out of its lanes.

        Args:
            ego: Rear axle.
            vehicle: The ego's dimensions.
            place: Where SUMO is to have the front bumper [m].
        """
        last = self._strip
        while last > 0 and self._strips[last].inside_junction:
            last -= 1
        strip = self._strips[last]
        return rear_pose(strip, ego, vehicle, strip.lane_of(*place, LANE_GAP))

    def follow(self, route_id: str) -> None:
        """Give the ghost another route; one that is there is made anew."""
        self.remove()
        self._route_id = route_id

    def remove(self) -> None:
        """Take the ghost out of SUMO, where there is one."""
        if self.pose is not None:
            self._sumo.vehicle.remove(self.id)
            self.pose = None

    def _locate(self, front: tuple[float, float]) -> bool:
        """Find the strip that the ego is on, from the last one on, if it is on one."""
        for beyond in (0.0, LANE_GAP):
            for index, strip in enumerate(self._ahead(), start=self._strip):
                if strip.lane_of(*front, beyond) is not None:
                    self._strip = index
                    return True
        return False

    def _ahead(self) -> tuple[Strip, ...]:
        """Return the strips in which the ego may be now."""
        return self._strips[self._strip : self._strip + LOOK_AHEAD]

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


def _clear_note(sumo: Libsumo, ego_id: str) -> bool:
    """Make SUMO find anew which lanes the ego occupies; return whether it did."""
    name = str(sumo.vehicle.getLaneID(ego_id))
    if not name or name.startswith(INSIDE_JUNCTION):
        return False
    edge, index = edge_of(name), sumo.vehicle.getLaneIndex(ego_id)
    beside = index + 1 if index + 1 < sumo.edge.getLaneNumber(edge) else index - 1
    if beside >= 0:
        position = sumo.vehicle.getLanePosition(ego_id)
        other = f"{edge}_{beside}"
        # in a bend the lane beside may be shorter
        there = min(position, sumo.lane.getLength(other))
        sumo.vehicle.moveTo(ego_id, other, there)
        sumo.vehicle.moveTo(ego_id, name, position)
    return True
