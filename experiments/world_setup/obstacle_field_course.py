"""A random course for the ego's body along a road without obstacles.

The course belongs to the rear axle: plateaus joined by quintic blends, flat enough for
the vehicle wherever the road bends.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from experiments.errors import ExperimentError
from experiments.world_setup.road import Layout
from planner.reference_path.path import ReferencePath
from planner.states import FloatArray
from planner.vehicle import Vehicle

STEP = 0.25  # between the poses of a course [m]
ATTEMPTS = 200  # to draw a course that keeps the body on the road
CALM_ATTEMPTS = 20  # more of them with each of `CALM_SWINGS`
# Shares of the vehicle's largest curvature: of what is drawn, of what is accepted.
DRAWN_SHARE, ACCEPTED_SHARE = 0.4, 0.5
PEAK = 10.0 / math.sqrt(3.0)  # of the blend's second derivative
BLEND_LENGTH = (15.0, 30.0)  # [m]
LONGEST_PLATEAU = 8.0  # [m]
LEAST_SHIFT = 1.5  # from plateau to plateau, where the road has the room [m]
SWING = 0.3  # kept free for the corners of a body at an angle [m]
CALM_SWINGS = (0.8, 1.6, 3.2)  # the same for long bodies: courses nearer the middle [m]


class FieldError(ExperimentError):
    """A field of obstacles is not possible; `key` of its section says why.

    Where only a try shows what is possible, `tried` is the largest value worth it.
    """

    def __init__(self, key: str, problem: str, tried: float | None = None) -> None:
        super().__init__(f"{key}: {problem}")
        self.key = key
        self.problem = problem
        self.tried = tried


@dataclass(frozen=True, slots=True, eq=False)
class Course:
    """Poses of the rear axle, `STEP` apart along the road; arrays are (n,)."""

    s: FloatArray  # along the reference path [m]
    l: FloatArray  # positive to the left of it [m]
    x: FloatArray  # [m]
    y: FloatArray  # [m]
    heading: FloatArray  # in the plane, unwrapped [rad]
    slant: FloatArray  # heading against that of the reference path [rad]

    @property
    def max_curvature(self) -> float:
        """Largest curvature in the plane [1/m]."""
        arc = np.hypot(np.diff(self.x), np.diff(self.y))
        return float(np.max(np.abs(np.diff(self.heading)) / arc))


def draw_course(
    layout: Layout, end: float, margin: float, rng: np.random.Generator
) -> Course:
    """Draw a course from the ego's start to `end`.

    Args:
        layout: Road and vehicle.
        end: Last s of the course [m].
        margin: Least distance of the body from the road's edges [m].
        rng: Source of all chance.

    Returns:
        A course on which the whole body keeps the margin and the curvature in the
        plane stays below `ACCEPTED_SHARE` of what the vehicle can drive.

    Raises:
        FieldError: If the road is too narrow or bends too much, or by bad luck.
    """
    stations = np.arange(layout.task.start.s, end + STEP, STEP)
    bend = _lateral_budget(layout, stations)
    limit = ACCEPTED_SHARE * layout.task.vehicle.limits.max_curvature
    swings = [SWING] * ATTEMPTS + [s for s in CALM_SWINGS for _ in range(CALM_ATTEMPTS)]
    for swing in swings:
        l, slope = _draw_offsets(layout, stations, (margin, swing), bend, rng)
        course = _in_the_plane(layout.road.path, stations, l, slope)
        if course.max_curvature <= limit and stays_on_road(layout, course, margin):
            return course
    body = f"{layout.task.vehicle.length:g} m x {layout.task.vehicle.width:g} m"
    problem = f"is {margin:g}; the road has no course with it for a body of {body}"
    raise FieldError("course_margin_m", problem, margin / 2.0)


def clearance(course: Course, vehicle: Vehicle, x: float, y: float) -> FloatArray:
    """Return the distance of a point from the body in each pose, 0 inside [m], (n,)."""
    dx, dy = x - course.x, y - course.y
    cos, sin = np.cos(course.heading), np.sin(course.heading)
    along = np.abs(dx * cos + dy * sin - vehicle.centre_offset) - vehicle.length / 2.0
    across = np.abs(dy * cos - dx * sin) - vehicle.width / 2.0
    return np.hypot(np.maximum(along, 0.0), np.maximum(across, 0.0))


def stays_on_road(layout: Layout, course: Course, margin: float) -> bool:
    """Check that corners and flanks of the body keep `margin` from the edges [m]."""
    vehicle = layout.task.vehicle
    cos, sin = np.cos(course.heading), np.sin(course.heading)
    for along in (-vehicle.rear_overhang, vehicle.centre_offset, vehicle.front_reach):
        for across in (-vehicle.width / 2.0, vehicle.width / 2.0):
            x = course.x + along * cos - across * sin
            y = course.y + along * sin + across * cos
            s, l = layout.road.path.project(x, y, near=course.s)
            left, right = layout.road.bounds.at(s)
            # At the start the body stands where the scenario says.
            free = s > layout.task.start.s + vehicle.length
            if np.any(free & ((l > left - margin) | (l < right + margin))):
                return False
    return True


def _lateral_budget(layout: Layout, stations: FloatArray) -> float:
    """Return how large l'' may be beside the curvature of the road [1/m]."""
    road = float(np.max(np.abs(layout.road.path.at(stations).curvature)))
    limit = layout.task.vehicle.limits.max_curvature
    budget = DRAWN_SHARE * limit - road
    if budget < 0.05 * limit:
        raise FieldError(
            "passable",
            f"the road bends with {road:.3g} 1/m; allowed: a road with at most "
            f"{(DRAWN_SHARE - 0.05) * limit:.3g} 1/m for a vehicle of {limit:g} 1/m",
        )
    return budget


def _draw_offsets(
    layout: Layout,
    stations: FloatArray,
    keep: tuple[float, float],
    bend: float,
    rng: np.random.Generator,
) -> tuple[FloatArray, FloatArray]:
    """Draw l and dl/ds at the stations, (n,) each; `keep` as `_room` takes it."""
    l = np.full(stations.size, layout.task.start.l)
    slope = np.zeros(stations.size)
    place, now = float(stations[0]), layout.task.start.l
    while place < stations[-1]:
        place += rng.uniform(0.0, LONGEST_PLATEAU)
        low, high = _room(layout, place, *keep)
        target = _next_plateau(now, low, high, rng)
        shift = target - now
        length = max(rng.uniform(*BLEND_LENGTH), math.sqrt(PEAK * abs(shift) / bend))
        t = np.clip((stations - place) / length, 0.0, 1.0)
        ahead = stations > place
        blend = t**3 * (10.0 - 15.0 * t + 6.0 * t**2)
        l[ahead] = (now + shift * blend)[ahead]
        slope[ahead] = (30.0 * shift / length * t**2 * (1.0 - t) ** 2)[ahead]
        place, now = place + length, target
    return l, slope


def _room(layout: Layout, s: float, margin: float, swing: float) -> tuple[float, float]:
    """Return least and most l of a plateau about `s`, `swing` from where it touches."""
    about = np.arange(s, s + BLEND_LENGTH[1], 1.0)
    left, right = layout.road.bounds.at(about)
    keep = layout.task.vehicle.width / 2.0 + margin
    low, high = float(right.max()) + keep, float(left.min()) - keep
    if low > high:
        raise FieldError(
            "course_margin_m",
            f"is {margin:g}; the road is {high - low + 2 * keep:.2f} m "
            f"wide at s = {s:.0f} m and the vehicle {layout.task.vehicle.width:g} m",
            margin - 0.5 * (low - high) - SWING,
        )
    swing = min(swing, 0.5 * (high - low))
    return low + swing, high - swing


def _next_plateau(
    now: float, low: float, high: float, rng: np.random.Generator
) -> float:
    """Draw the next offset, away from the present one if there is room [m]."""
    below, above = max(now - LEAST_SHIFT - low, 0.0), max(high - now - LEAST_SHIFT, 0.0)
    if below + above <= 0.0:
        return float(rng.uniform(low, high))
    drawn = rng.uniform(0.0, below + above)
    return float(low + drawn if drawn < below else high - (drawn - below))


def _in_the_plane(
    path: ReferencePath, s: FloatArray, l: FloatArray, slope: FloatArray
) -> Course:
    """Return the poses in the plane of a course that is given along the road."""
    foot = path.at(s)
    slant: NDArray[np.float64] = np.arctan2(slope, 1.0 - foot.curvature * l)
    return Course(
        s,
        l,
        foot.x - l * foot.sin_heading,
        foot.y + l * foot.cos_heading,
        np.unwrap(foot.heading + slant),
        slant,
    )
