"""Paths of bounded curvature through narrow bends, the whole body inside an area.

Lane centre lines of road networks turn corners that no vehicle can follow. Here such a
stretch is planned anew: the curvature at even stations is the unknown, the pose follows
by integration, and a sequence of quadratic programs (linearised anew in each round)
keeps the outline of the body inside a polygon, the curvature and its rate within the
limits of the steering, and the path near its guide.
"""

import math
from dataclasses import dataclass

import numpy as np

from planner.errors import InvalidInputError
from planner.reference_path.body_in_area import (
    body_box,
    body_outline,
    corner_distances,
    depths,
    outline_points,
)
from planner.reference_path.steered_motion import (
    SteeringLimits,
    SteeringTask,
    integrate,
    missed_end,
)
from planner.states import FloatArray
from planner.vehicle import Vehicle

STATION = 0.75  # [m], between unknowns
SHIFTS = (0.0, 3.0, -3.0, 6.0, -6.0)  # of first guesses along the guide [m]
END_TOLERANCE = 0.02  # [m] and [rad]


@dataclass(frozen=True, slots=True, eq=False)
class SteerablePath:
    """A planned stretch; arrays are (n,).

    `outside` is how far the outline of the body reaches over the margin, 0 where the
    path is drivable; `end_error` how far the end misses the pose asked for.
    """

    x: FloatArray  # rear axle [m]
    y: FloatArray
    heading: FloatArray  # [rad]
    curvature: FloatArray  # [1/m]
    outside: float  # [m]
    end_error: float  # [m], [rad], the larger one

    @property
    def fault(self) -> float:
        """How far from drivable [m]."""
        return self.outside + (
            self.end_error if self.end_error > END_TOLERANCE else 0.0
        )

    @property
    def drivable(self) -> bool:
        """Whether the whole body stays inside and the end is met."""
        return self.outside <= 0.0 and self.end_error <= END_TOLERANCE


def steerable_path(
    guide: FloatArray,
    boundary: FloatArray,
    vehicle: Vehicle,
    limits: SteeringLimits,
    shifts: tuple[float, ...] = SHIFTS,
) -> SteerablePath:
    """Plan a path from the begin of a guide to its end, with their directions.

    Args:
        guide: Polyline, (m, 2) [m]; its first and last sides are straight for some
            metres. It may have corners.
        boundary: Sides of the polygons that enclose the area, (k, 4) as x, y of both
            ends [m].
        vehicle: Whose body stays inside; the path is that of its rear axle.
        limits: Of the path.
        shifts: By how much the first guesses turn later than the guide; they are
            tried in turn until a path is drivable [m].

    Returns:
        The path. It need not be drivable: see `SteerablePath.drivable`.

    Raises:
        InvalidInputError: If the guide is too short for a path.
    """
    best = _planned(guide, boundary, vehicle, limits, shifts[0])
    for shift in shifts[1:]:
        if best.fault <= limits.margin:
            break
        found = _planned(guide, boundary, vehicle, limits, shift)
        if found.fault < best.fault:
            best = found
    return best


def _planned(
    guide: FloatArray,
    boundary: FloatArray,
    vehicle: Vehicle,
    limits: SteeringLimits,
    shift: float,
) -> SteerablePath:
    """Plan from one first guess, which turns `shift` metres later than the guide."""
    # it imports scipy and qpsolvers, for 0.3 s, which most roads need not pay
    from planner.reference_path.steering_program import improve

    points, s = _even_points(guide)
    heading = _smooth_heading(points, s, limits.curvature)
    heading = np.interp(s - shift, s, heading)
    curvature = np.gradient(heading, s[1])
    curvature = np.clip(curvature, -limits.curvature, limits.curvature)
    curvature[[0, -1]] = 0.0
    task = SteeringTask(
        guide,
        boundary,
        body_outline(vehicle, limits.margin),
        body_box(vehicle, limits.margin),
        limits,
        (float(points[0, 0]), float(points[0, 1]), float(heading[0])),
        (float(points[-1, 0]), float(points[-1, 1]), float(heading[-1])),
    )
    curvature, spacing = improve(task, curvature, float(s[1]))
    motion = integrate(curvature, spacing, task.start)
    outline = outline_points(motion.x, motion.y, motion.heading, task.outline)
    corners, _, _ = corner_distances(motion.poses, boundary[:, :2], task.box)
    least = min(float(depths(*outline, boundary)[0].min()), float(corners.min()))
    missed = missed_end(task, motion)
    return SteerablePath(
        motion.x,
        motion.y,
        motion.heading,
        curvature,
        max(0.0, -least),
        float(max(np.hypot(missed[0], missed[1]), abs(missed[2]))),
    )


def _even_points(guide: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Space points evenly along the guide; (points, arc lengths)."""
    sides = np.hypot(*np.diff(guide, axis=0).T)
    along = np.concatenate([[0.0], np.cumsum(sides)])
    if not along[-1] > 4.0 * STATION:
        raise InvalidInputError(f"the guide is {along[-1]:.2f} m long: too short")
    s = np.linspace(0.0, along[-1], math.ceil(along[-1] / STATION) + 1)
    return np.column_stack([np.interp(s, along, axis) for axis in guide.T]), s


def _smooth_heading(points: FloatArray, s: FloatArray, curvature: float) -> FloatArray:
    """Average the headings of the guide over a window that takes a right angle."""
    sides = np.diff(points, axis=0)
    raw = np.unwrap(np.arctan2(sides[:, 1], sides[:, 0]))
    width = max(1, round(0.5 * math.pi / curvature / s[1] / 2.0))
    padded = np.pad(raw, width, mode="edge")
    kernel = np.ones(2 * width + 1) / (2 * width + 1)
    middle = np.convolve(padded, kernel, mode="valid")
    return np.concatenate([[raw[0]], 0.5 * (middle[1:] + middle[:-1]), [raw[-1]]])
