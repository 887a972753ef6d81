"""Where a ghost has to be: beside the ego over a line, or for the rear that is left.

Geometry only; `ghost_vehicle` puts the ghost there.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from experiments.cosim.sumo.lanes import INSIDE_JUNCTION, Lane, Strip
from planner.states import CartesianState, FloatArray
from planner.vehicle import Vehicle

REACHES_IN = 0.3  # a body that reaches less into a lane leaves it to others [m]
SHORTEST = 0.5  # of a ghost that stands for what is left before a junction [m]
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

    def centre(self) -> CartesianState:
        """Return where the middle of the ghost is."""
        half = self.length / 2.0
        x = self.x - half * math.cos(self.heading)
        y = self.y - half * math.sin(self.heading)
        return CartesianState(x, y, self.heading, 0.0, 0.0, 0.0)


def ghost_pose(
    strip: Strip, front: tuple[float, float], ego: CartesianState, vehicle: Vehicle
) -> GhostPose | None:
    """Decide whether the ego needs a ghost, and in which lane.

    Args:
        strip: The lanes that the ego's front bumper is on.
        front: Centre of the front bumper [m].
        ego: Rear axle.
        vehicle: The ego's dimensions.

    Returns:
        The ghost's pose, or None where the body stays inside its own lane, would only
        reach off the edge, or is not on this edge at all.
    """
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
