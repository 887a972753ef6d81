"""Where an ego waits before a junction: at its line, or short of it.

Long vehicles that turn sweep over more than their lanes, often over the corner of the
one beside which they come out. Whoever waits there at its line is hit, and so is one
that has swung out over the middle of the road before a turn of its own.
"""

from collections.abc import Sequence
from typing import Final

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from experiments.world_setup.long_vehicles import LongWay
from experiments.world_setup.path_stretches import body_polygons
from planner.reference_path.path import ReferencePath
from planner.vehicle import Vehicle
from sumo_nets.net_records import NetLane

BETWEEN: Final = 0.2  # a long vehicle and the ego that waits [m]
OVER: Final = 0.1  # so far over the edge of its lanes it waits in nobody's way [m]
SHORT_BY: Final = 0.25  # the ego tries to wait shorter of its line in such steps ...
MOST_SHORT: Final = 8.0  # ... up to this; if that is no help it waits at the line [m]
ABOUT: Final = 6.0  # movements farther from the ego at its line do not matter [m]


def waiting_place(
    lane: tuple[float, float],
    turning: Sequence[Sequence[NetLane]],
    own: BaseGeometry,
    path: ReferencePath,
    vehicle: Vehicle,
) -> float:
    """Find where the ego's front waits before a junction [m].

    Args:
        lane: Where its lane begins and ends, on the path [m].
        turning: Of each movement of others the lane before the junction, those inside
            and the one behind it.
        own: Area of the route there.
        path: Of the ego.
        vehicle: The ego.
    """
    begin, line = lane
    short = np.arange(0.0, MOST_SHORT + SHORT_BY, SHORT_BY)
    # with its rear on the lane: in the junction before it would be in others' way
    short = short[line - short - vehicle.length >= begin]
    if not short.size:
        return line
    bodies = body_polygons(path, line - short - vehicle.front_reach, vehicle)
    areas = [_swept(lanes, bodies[0]) for lanes in turning]
    swept = shapely.union_all([area for area in areas if area is not None])
    if swept.is_empty:
        return line
    free = shapely.distance(bodies, swept) >= BETWEEN
    within = shapely.covers(own.buffer(OVER), bodies)
    for good in (free & within, free):
        if good.any():
            return line - float(short[good.argmax()])
    return line


def _swept(lanes: Sequence[NetLane], ego: BaseGeometry) -> BaseGeometry | None:
    """Return what a long vehicle sweeps over; None far from the ego at its line."""
    before, *inside, behind = lanes
    way = LongWay.along(before, inside, behind)
    if way is None or way.line.distance(ego) > ABOUT:
        return None
    return shapely.union_all(way.bodies)
