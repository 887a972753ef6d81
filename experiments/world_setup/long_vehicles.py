"""What a long vehicle sweeps over on its way through a junction.

As SUMO draws it, with both ends on its lanes: a chord of its way, which cuts corners.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
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
ENDS: Final = 2  # of a line


@dataclass(frozen=True, eq=False)
class LongWay:
    """Its way over a junction, until its rear is out of it."""

    line: BaseGeometry  # its lanes, carried on straight at both ends
    begin: float  # of the junction along the line [m]
    end: float  # [m]

    @classmethod
    def along(
        cls, before: NetLane, inside: Sequence[NetLane], behind: NetLane
    ) -> "LongWay | None":
        """Join the lane before a junction, those inside and that behind.

        Returns:
            None where these have no length.
        """
        parts = [_line(before), *(_line(lane) for lane in inside), _line(behind)]
        points = np.concatenate([x for x in parts if len(x)])
        kept = np.append(True, np.hypot(*np.diff(points, axis=0).T) > 0.0)
        points = points[kept]
        if len(points) < ENDS:
            return None
        points = np.vstack([_on(points[1::-1]), points, _on(points[-2:])])
        begin = LONG + _length(parts[0])
        end = begin + sum(_length(part) for part in parts[1:-1])
        return cls(shapely.LineString(points), begin, end)

    @cached_property
    def fronts(self) -> FloatArray:
        """Places of its front from the line before the junction, (n,) [m]."""
        return np.arange(0.0, self.end - self.begin + LONG + SPACING, SPACING)

    @cached_property
    def bodies(self) -> NDArray[np.object_]:
        """Its body with its front at these places, polygons, (n,)."""
        fronts = self.begin + self.fronts
        ends = np.stack([fronts, fronts - LONG], axis=1)
        places = shapely.line_interpolate_point(self.line, ends)
        chords = shapely.linestrings(
            shapely.get_coordinates(places).reshape(-1, ENDS, 2)
        )
        return np.asarray(shapely.buffer(chords, HALF_WIDTH, cap_style="flat"))


def _line(lane: NetLane) -> FloatArray:
    """Return the centre line of a lane, (n, 2); empty for one without length."""
    return lane.points if len(lane.points) >= ENDS else np.empty((0, 2))


def _length(points: FloatArray) -> float:
    """Return the length of a line [m]."""
    return float(np.hypot(*np.diff(points, axis=0).T).sum()) if len(points) else 0.0


def _on(last: FloatArray) -> FloatArray:
    """Carry a line on straight beyond the second of its last two points, (2,)."""
    along = last[1] - last[0]
    return np.asarray(last[1] + LONG * along / np.hypot(*along))
