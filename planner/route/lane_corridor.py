"""What an ego that follows a lane may use: that, the one it leaves too, the road."""

from enum import StrEnum

import numpy as np

from planner.lane_change.lane_choice import GONE
from planner.route.lane_frame import LaneFrame
from planner.scene import Lanes, RoadBounds
from planner.states import FloatArray

SHORT = 0.1  # over which a bound steps [m]
OPEN_SIDE = 0.3  # beyond a lane's edge, where no lane is beside it [m]


class LaneCorridor(StrEnum):
    """Which part of the carriageway may be used."""

    LANE = "lane"
    CHANGE = "change"  # the lane and the one that is left
    ROAD = "road"


def corridor(
    lanes: Lanes,
    frame: LaneFrame,
    kind: LaneCorridor,
    origin: int | None,
    places: tuple[float, float] = (np.inf, np.inf),
) -> RoadBounds:
    """Return the bounds of what may be used.

    A body that needs more in a bend gets it. Inside junctions, however wide they are,
    the ego stays in its lane: beside it drive those of whom it knows nothing.

    Args:
        lanes: Along the reference path.
        frame: Of the lane that is followed.
        kind: What may be used.
        origin: Lane that is left, for `CHANGE`.
        places: Where it must be left, and from where on the whole road may be used, on
            the reference path [m].
    """
    until, opens = places
    if kind is LaneCorridor.ROAD or opens == -np.inf:
        return frame.road
    road = _refined(frame, lanes, places)
    at = frame.to_reference(road.s)
    left, right = _edges(lanes, frame.lane, at)
    if kind is LaneCorridor.CHANGE and origin is not None:
        other_left, other_right = _edges(lanes, origin, at)
        # nan, without one of the lanes, stays: the road's edge is the bound there
        both = np.maximum(left, other_left), np.minimum(right, other_right)
        left = np.where(at < until, both[0], left)
        right = np.where(at < until, both[1], right)
    moved = np.interp(at, frame.at, frame.offset)
    need = np.interp(at, frame.at, frame.need)
    left = np.minimum(road.left, np.maximum(left - moved, need))
    right = np.maximum(road.right, np.minimum(right - moved, -need))
    left = np.where(np.isnan(left), road.left, left)
    right = np.where(np.isnan(right), road.right, right)
    # whoever cuts a sharp bend, and has to stop in it, may not get out of it again
    left = np.minimum(left, np.interp(at, frame.at, frame.inner[0]))
    right = np.maximum(right, -np.interp(at, frame.at, frame.inner[1]))
    left = np.where(at < opens, left, road.left)
    right = np.where(at < opens, right, road.right)
    return RoadBounds(road.s, left, right)


def _refined(frame: LaneFrame, lanes: Lanes, places: tuple[float, ...]) -> RoadBounds:
    """Return a frame's road with knots where lanes, or other bounds, begin and end.

    Between knots bounds are straight: over a coarse road a line that goes on for less
    than the distance of two knots would be none.
    """
    road = frame.road
    steps = [
        x for place in places if np.isfinite(place) for x in (place - SHORT, place)
    ]
    more = frame.to_s(np.concatenate([lanes.s, steps]))
    inside = (more > road.s[0]) & (more < road.s[-1])
    s = np.union1d(road.s, more[inside])
    left, right = np.interp(s, road.s, road.left), np.interp(s, road.s, road.right)
    return RoadBounds(s, left, right)


def _edges(lanes: Lanes, lane: int, at: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return how far a lane goes to its sides, nan where it is missing, (n,) [m].

    Up to the lines beyond which there are other lanes; where there is none, as in
    junctions, a little farther.
    """
    centre = np.interp(at, lanes.s, lanes.centre[lane])
    width = np.interp(at, lanes.s, lanes.width[lane])
    sides = []
    for neighbour, sign in ((lane + 1, 0.5), (lane - 1, -0.5)):
        edge = np.where(width > GONE, centre + sign * width, np.nan)
        if 0 <= neighbour < lanes.width.shape[0]:
            beside = np.interp(at, lanes.s, lanes.width[neighbour]) > GONE
            sides.append(np.where(beside, edge, edge + 2.0 * sign * OPEN_SIDE))
        else:
            sides.append(edge + 2.0 * sign * OPEN_SIDE)
    return sides[0], sides[1]
