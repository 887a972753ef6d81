"""A field of obstacles with a way through, or with none, drawn from a seed.

First a course for the ego's body is drawn, then discs are set beside it, so near that
only similar courses get through. A field without a way through also has a row of discs
across the road, with gaps too narrow for the body.
"""

import math
from collections.abc import Iterable, Iterator
from copy import deepcopy

import numpy as np

from experiments.config import Obstacle, ObstacleField
from experiments.world_setup.obstacle_field_advice import with_advice
from experiments.world_setup.obstacle_field_course import (
    STEP,
    Course,
    FieldError,
    clearance,
    draw_course,
)
from experiments.world_setup.road import Layout

TRIES = 200  # to find a place for one disc
MEAN_EXTRA = 0.4  # beyond the margin of the course [m]
INSIDE_SHARE = 0.75  # of the discs on the side of the road's middle
WIDEST_GAP = 0.25  # in the row across the road, in widths of the vehicle
NARROWEST_GAP = 0.05  # there [m]


def draw_field(
    section: ObstacleField, layout: Layout, rng: np.random.Generator
) -> tuple[Obstacle, ...]:
    """Draw the discs of a field.

    Args:
        section: What the scenario asks for.
        layout: Road, vehicle, start and goal.
        rng: Source of all chance.

    Returns:
        The obstacles in the order of s, all of `section.count` of them. If passable,
        there is a course from the start to beyond the goal and the last disc, below
        half of the vehicle's curvature, on which the body keeps
        `section.course_margin_m` from every disc and from the road's edges.

    Raises:
        FieldError: If there is no room for the course or for the discs; it says what
            there is room for.
    """
    before = deepcopy(rng)
    try:
        return _draw(section, layout, rng)
    except FieldError as error:
        raise with_advice(
            error, section, lambda other: _draw(other, layout, deepcopy(before))
        ) from error


def _draw(
    section: ObstacleField, layout: Layout, rng: np.random.Generator
) -> tuple[Obstacle, ...]:
    """Draw the discs of a field; see `draw_field`."""
    if section.first_m <= layout.task.start.s + layout.task.vehicle.front_reach:
        front = layout.task.start.s + layout.task.vehicle.front_reach
        problem = f"is {section.first_m:g}; allowed: more than {front:g}, the ego's"
        raise FieldError("first_m", f"{problem} front at the start")
    course = _draw_course(section, layout, rng)
    least, most = section.counts
    count = int(rng.integers(least, most, endpoint=True))
    row = () if section.passable else _draw_row(section, layout, count, rng)
    placed = _Placed(layout, row)
    for stretch in _stretches(section, count - len(row)):
        # Where a stretch is full, another place in the field will do.
        for where in (stretch, (section.first_m, section.last_m)):
            proposed = _beside(section, layout, course, where, rng)
            if placed.add_first(proposed, section, course):
                break
        else:
            raise _full(section, count, len(placed.discs))
    return tuple(sorted(placed.discs, key=lambda disc: (disc.s_m, disc.l_m)))


def _full(section: ObstacleField, count: int, placed: int) -> FieldError:
    """Make the error that there is no place for all discs, or for any."""
    kept = f"course_margin_m = {section.course_margin_m:g}, gap_m = {section.gap_m:g}"
    length = section.last_m - section.first_m
    if placed:
        problem = (
            f"is {count}; {length:g} m have not the room with {kept} and this seed"
        )
        return FieldError("count", problem, placed)
    radii = list(section.radii_m)
    problem = f"is {radii}; not one finds a place in {length:g} m with {kept}"
    return FieldError("radii_m", problem, min(radii))


class _Placed:
    """The discs that stand, with their places in the plane."""

    def __init__(self, layout: Layout, discs: Iterable[Obstacle]) -> None:
        self._layout = layout
        self._rows: list[tuple[float, float, float]] = []
        self.discs: list[Obstacle] = []
        for disc in discs:
            self.add(disc)

    def add(self, disc: Obstacle) -> None:
        """Add a disc."""
        self.discs.append(disc)
        self._rows.append((*_place(self._layout, disc), _radius(disc)))

    def add_first(
        self, proposed: Iterable[Obstacle], section: ObstacleField, course: Course
    ) -> bool:
        """Add the first disc that keeps all distances; return whether one does."""
        for disc in proposed:
            margin = _margin(self._layout, course, disc)
            if margin >= section.course_margin_m and self.gap(disc) >= section.gap_m:
                self.add(disc)
                return True
        return False

    def gap(self, disc: Obstacle) -> float:
        """Distance of a disc from those that stand [m]."""
        if not self._rows:
            return math.inf
        x, y = _place(self._layout, disc)
        rows = np.array(self._rows)
        centre = np.hypot(rows[:, 0] - x, rows[:, 1] - y)
        return float((centre - rows[:, 2]).min()) - _radius(disc)


def _draw_course(
    section: ObstacleField, layout: Layout, rng: np.random.Generator
) -> Course:
    """Draw the course to where both the goal and the last disc lie behind."""
    beyond = max(layout.task.goal, section.last_m + max(section.radii_m)) + STEP
    last = layout.road.path.length - layout.task.vehicle.front_reach - STEP
    if section.last_m > last:
        problem = f"is {section.last_m:g}; allowed: at most {last:.1f}, with a way on"
        raise FieldError("last_m", problem)
    end = min(beyond + layout.task.vehicle.rear_overhang, last)
    return draw_course(layout, end, section.course_margin_m, rng)


def _stretches(section: ObstacleField, count: int) -> Iterator[tuple[float, float]]:
    """Yield a stretch for each disc, which overlaps those of its neighbours [m]."""
    length = section.last_m - section.first_m
    for number in range(count):
        low = max(number - 0.5, 0.0) / count
        high = min(number + 1.5, count) / count
        yield section.first_m + length * low, section.first_m + length * high


def _beside(
    section: ObstacleField,
    layout: Layout,
    course: Course,
    stretch: tuple[float, float],
    rng: np.random.Generator,
) -> Iterable[Obstacle]:
    """Propose discs beside the course, mostly between it and the road's middle."""
    for _ in range(TRIES):
        radius = float(rng.choice(section.radii_m))
        s = float(rng.uniform(*stretch))
        extra = rng.exponential(MEAN_EXTRA)
        row = int(np.searchsorted(course.s, s))
        left, right = (float(edge[0]) for edge in layout.road.bounds.at(np.array([s])))
        inwards = 1.0 if course.l[row] < 0.5 * (left + right) else -1.0
        side = inwards if rng.random() < INSIDE_SHARE else -inwards
        away = (
            layout.task.vehicle.width / 2.0 + section.course_margin_m + radius + extra
        )
        l = float(course.l[row]) + side * away / math.cos(float(course.slant[row]))
        if right <= l <= left:
            yield Obstacle(s_m=round(s, 3), l_m=round(l, 3), radius_m=radius)


def _draw_row(
    section: ObstacleField, layout: Layout, count: int, rng: np.random.Generator
) -> tuple[Obstacle, ...]:
    """Close the road at a place in the last two thirds of the field."""
    first = section.first_m + (section.last_m - section.first_m) / 3.0
    s = round(float(rng.uniform(first, section.last_m)), 3)
    left, right = (float(edge[0]) for edge in layout.road.bounds.at(np.array([s])))
    widest = WIDEST_GAP * layout.task.vehicle.width
    sizes = {
        radius: math.ceil((left - right - widest) / (2.0 * radius + widest))
        for radius in section.radii_m
    }
    fitting = [radius for radius in section.radii_m if sizes[radius] <= count]
    if not fitting:
        fewest = min(sizes.values())
        problem = f"is {count}; allowed: at least {fewest}, to close the road"
        raise FieldError("count", problem)
    radius = float(rng.choice(fitting))
    number = max(sizes[radius], 1)
    gap = (left - right - 2.0 * radius * number) / (number + 1)
    pitch = 2.0 * radius + max(gap, NARROWEST_GAP)
    ranks = np.arange(number) - (number - 1) / 2.0
    offsets = 0.5 * (left + right) + pitch * ranks
    return tuple(
        Obstacle(s_m=s, l_m=round(float(l), 3), radius_m=radius) for l in offsets
    )


def _margin(layout: Layout, course: Course, disc: Obstacle) -> float:
    """Least distance of the body on its course from a disc [m]."""
    x, y = _place(layout, disc)
    return float(clearance(course, layout.task.vehicle, x, y).min()) - _radius(disc)


def _place(layout: Layout, disc: Obstacle) -> tuple[float, float]:
    """Return the centre of a disc in the plane [m]."""
    x, y, heading = layout.road.path.pose(disc.s_m)
    return x - disc.l_m * math.sin(heading), y + disc.l_m * math.cos(heading)


def _radius(disc: Obstacle) -> float:
    """Return the radius of a disc [m]."""
    return disc.radius_m or 0.0
