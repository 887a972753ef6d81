"""What a long vehicle sweeps over on its way through a junction.

As SUMO draws it, with both ends on its lanes: a chord of its way, which cuts corners.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely.geometry.base import BaseGeometry

from planner.states import FloatArray
from sumo_nets.net_records import NetLane

LONG: Final = 10.0  # [m]
HALF_WIDTH: Final = 1.25  # [m]
SPACING: Final = 0.5  # of the places at which it is looked at [m]
NOTHING: Final = 1e-6  # a shorter line is none [m]


@dataclass(frozen=True, slots=True, eq=False)
class LongWay:
    """Its body at places along its way, until its rear is out of the junction."""

    line: BaseGeometry  # its lanes
    fronts: FloatArray  # of the body from the line before the junction, (n,) [m]
    bodies: NDArray[np.object_]  # polygons, (n,)

    @classmethod
    def along(cls, lanes: Sequence[NetLane]) -> "LongWay | None":
        """Place it along the lane before a junction, those inside and that behind.

        Returns:
            None where these have no length.
        """
        lines = [shapely.LineString(x.points) for x in lanes if len(x.points) > 1]
        if not lines:
            return None
        points = np.concatenate([shapely.get_coordinates(x) for x in lines])
        kept = np.append(True, np.hypot(*np.diff(points, axis=0).T) > 0.0)
        if kept.sum() < 2:  # noqa: PLR2004 - corners of a line
            return None
        line = shapely.LineString(points[kept])
        begin, end = lines[0].length, line.length - lines[-1].length
        fronts = np.arange(begin, min(end + LONG, line.length) + SPACING, SPACING)
        ends = np.stack([fronts, np.maximum(fronts - LONG, 0.0)], axis=1)
        places = shapely.get_coordinates(shapely.line_interpolate_point(line, ends))
        chords = shapely.linestrings(places.reshape(-1, 2, 2))
        bodies = shapely.buffer(chords, HALF_WIDTH, cap_style="flat")
        return cls(line, fronts - begin, np.asarray(bodies))
