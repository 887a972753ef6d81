"""Attempts to plan a stretch of the ego's path, from roomy ones to the last resort."""

from collections.abc import Sequence
from typing import NamedTuple

from shapely.geometry.base import BaseGeometry

from planner.reference_path.steerable import SHIFTS, SteerablePath, steerable_path
from planner.reference_path.steered_motion import SteeringLimits
from planner.states import FloatArray
from planner.vehicle import Vehicle
from sumo_nets.drivable_area import boundary_about

EASY = 0.85  # share of the ego's curvature that needs no plan; the rest is for control
LEAST_MARGIN = 0.1  # from the body to the area's edge, where it does not fit [m]
LAST_RESORT = 0.2  # how far the body may be planned over the area, if need be [m]


class Attempt(NamedTuple):
    """How a stretch is planned; the first one that comes out is taken."""

    share: float  # of the ego's curvature
    margin: float  # from the body to the area's edge [m]
    beyond: float  # how far the body may reach over the edge [m]
    shifts: tuple[float, ...]  # of the first guesses [m]

    @property
    def accepted(self) -> float:
        """Largest fault of a path that is taken [m]."""
        return self.margin + self.beyond


# The first two leave room and steering to an ego that is beside the path or stops in
# the bend; without them a planner finds no motion there that keeps the limits.
ATTEMPTS = (
    Attempt(0.65, 0.4, -0.35, SHIFTS[:1]),
    Attempt(0.78, 0.25, -0.2, SHIFTS[:1]),
    Attempt(EASY, LEAST_MARGIN, 0.0, SHIFTS[:1]),
    Attempt(0.91, LEAST_MARGIN, 0.1, SHIFTS[:3]),
)

ACROSS = Attempt(0.88, LEAST_MARGIN, 0.05, SHIFTS[:2])  # over the middle of the road

ROOM = 15.0  # about a stretch, for the area that is looked at [m]


class Attempts:
    """Plans of one stretch; what was tried once is known.

    Args:
        guide: Part of the raw line.
        vehicle: The ego.
    """

    def __init__(self, guide: FloatArray, vehicle: Vehicle) -> None:
        self.guide = guide
        self.vehicle = vehicle
        self._known: dict[tuple[int, Attempt], SteerablePath] = {}

    def plan(self, area: BaseGeometry, attempt: Attempt) -> SteerablePath:
        """Plan inside an area, which has to live as long as this."""
        found = self._known.get((id(area), attempt))
        if found is None:
            curvature = attempt.share * self.vehicle.limits.max_curvature
            limits = SteeringLimits(curvature, margin=attempt.margin)
            sides = boundary_about(area, self.guide, ROOM)
            found = steerable_path(
                self.guide, sides, self.vehicle, limits, attempt.shifts
            )
            self._known[id(area), attempt] = found
        return found

    def first(
        self, area: BaseGeometry, attempts: Sequence[Attempt], share: float
    ) -> SteerablePath | None:
        """Return the first path that comes out with at most a share; None without."""
        for attempt in attempts:
            held = attempt._replace(share=min(attempt.share, share))
            path = self.plan(area, held)
            if path.fault <= held.accepted:
                return path
        return None
