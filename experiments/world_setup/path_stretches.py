"""The stretches of a route where its line is no path: too sharp, or off its area.

They begin and end where the line is straight, so that a planned path joins it well.
"""

import math
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from experiments.world_setup.path_attempts import EASY
from planner.reference_path.path import ReferencePath
from planner.states import BoolArray, FloatArray, IntArray
from planner.vehicle import Vehicle
from sumo_nets.route_path import RoutePath

STEP = 0.5  # [m], between the places that are checked
CHECKED = 100.0  # of the path at once, against the area there [m]
TOLERANCE = 0.15  # how far the body may reach over the area [m]
ABRUPT = 0.06  # a lane's curvature that changes faster needs one [1/m²]
LEAD = 20.0  # a planned stretch begins so far before the place that needs it [m] ...
LOOK_BACK = 10.0  # ... or up to this earlier, where the road is straight [m]
APART = 5.0  # stretches nearer than this to each other are planned as one [m]
LONGEST = 160.0  # of one planned stretch [m]
# A stretch longer than the first is cut in two between places that need a plan, if
# these are as far apart as the second [m].
CUTS = ((70.0, 30.0), (LONGEST, 16.0))
SEAM = 2.0  # that is left between the two [m]
TURN_BASE = 3.0  # length over which a bend of the raw line is measured [m]
SHARP = 0.75  # share of the ego's curvature that counts as sharp on the raw line


class Stretch(NamedTuple):
    """From where to where along a line [m]."""

    begin: float
    end: float


def bad_places(found: RoutePath, path: ReferencePath, vehicle: Vehicle) -> FloatArray:
    """List arc lengths of the route where the ego cannot follow the path [m]."""
    s = np.arange(0.0, path.length, STEP)
    own, _ = path.project(found.points[:, 0], found.points[:, 1], near=found.s)
    along = np.interp(s, np.maximum.accumulate(own), found.s)
    bad = np.zeros(s.size, dtype=bool)
    for rows, area in areas_along(found, along):
        bad[rows] = _is_bad(path, s[rows], area, vehicle)
    return np.asarray(along[bad])


def sharp_places(found: RoutePath, vehicle: Vehicle) -> FloatArray:
    """List arc lengths where the raw line of a route bends sharply [m]."""
    s = np.arange(0.0, found.s[-1], STEP)
    bend = heading(found, s + TURN_BASE / 2.0) - heading(found, s - TURN_BASE / 2.0)
    most = SHARP * vehicle.limits.max_curvature
    return np.asarray(s[np.abs(bend) / TURN_BASE > most])


def stretches_about(found: RoutePath, bad: FloatArray) -> list[Stretch]:
    """Gather places to stretches that begin and end where the line is straight."""
    length = float(found.s[-1])
    grown: list[Stretch] = []
    for place in bad:
        begin, end = float(place) - LEAD, float(place) + LEAD
        if grown and begin < grown[-1].end + APART:
            grown[-1] = Stretch(grown[-1].begin, end)
        else:
            grown.append(Stretch(begin, end))
    merged: list[Stretch] = []
    for begin, end in grown:
        first = _straightest(found, max(begin - LOOK_BACK, 0.0), max(begin, 0.0))
        last = _straightest(found, min(end, length), min(end + LOOK_BACK, length))
        if merged and first < merged[-1].end + APART:
            merged[-1] = Stretch(merged[-1].begin, last)
        else:
            merged.append(Stretch(first, last))
    whole = [
        Stretch(
            0.0 if x.begin < APART else x.begin,
            length if x.end > length - APART else x.end,
        )
        for x in merged
    ]
    return [part for x in whole for part in _cut(found, bad, x)]


def part_of_line(found: RoutePath, stretch: Stretch) -> FloatArray:
    """Cut a stretch out of the raw line, (m, 2) [m]."""
    inside = (found.s > stretch.begin + STEP) & (found.s < stretch.end - STEP)
    ends = [
        [float(np.interp(s, found.s, axis)) for axis in found.points.T] for s in stretch
    ]
    return np.vstack([ends[0], found.points[inside], ends[1]])


def areas_along(
    found: RoutePath, along: FloatArray
) -> Iterator[tuple[IntArray, BaseGeometry]]:
    """Yield the area about some places of a route at a time.

    Args:
        found: The route.
        along: Arc lengths of the places on the route, growing, (n,) [m].
    """
    count = math.ceil((along[-1] - along[0]) / CHECKED)
    for rows in np.array_split(np.arange(along.size), max(count, 1)):
        yield rows, found.areas.between(along[rows[0]], along[rows[-1]]).own


def body_polygons(path: ReferencePath, s: FloatArray, vehicle: Vehicle) -> BaseGeometry:
    """Place the ego's rectangle with its rear axle at arc lengths `s`, (n,)."""
    at = path.at(s)
    back, front, half = -vehicle.rear_overhang, vehicle.front_reach, vehicle.width / 2.0
    corners = np.array([[back, -half], [front, -half], [front, half], [back, half]])
    along, across = corners[:, 0], corners[:, 1]
    cos, sin = at.cos_heading[:, None], at.sin_heading[:, None]
    x = at.x[:, None] + cos * along - sin * across
    y = at.y[:, None] + sin * along + cos * across
    return shapely.polygons(np.stack([x, y], axis=-1))


def heading(found: RoutePath, s: FloatArray) -> FloatArray:
    """Read the direction of the raw line [rad], unwrapped."""
    sides = np.diff(found.points, axis=0)
    angle = np.unwrap(np.arctan2(sides[:, 1], sides[:, 0]))
    middles = (found.s[:-1] + found.s[1:]) / 2.0
    return np.asarray(np.interp(s, middles, angle))


def _is_bad(
    path: ReferencePath, s: FloatArray, area: BaseGeometry, vehicle: Vehicle
) -> BoolArray:
    """Mark the places that are too sharp, or where the body leaves the area."""
    at = path.at(s)
    curved = np.abs(at.curvature) > EASY * vehicle.limits.max_curvature
    curved |= np.abs(at.curvature_rate) > ABRUPT
    allowed = area.buffer(TOLERANCE)
    shapely.prepare(allowed)
    outside = ~shapely.covers(allowed, body_polygons(path, s, vehicle))
    return np.asarray(curved | outside)


def _cut(found: RoutePath, bad: FloatArray, stretch: Stretch) -> list[Stretch]:
    """Cut a stretch that is too long for one plan, where the line is straight.

    It is cut in the widest gap between the places that need a plan, again and again;
    one without gaps stays as it is.
    """
    inside = np.sort(bad[(bad >= stretch.begin) & (bad <= stretch.end)])
    gaps = np.diff(inside, prepend=inside[:1])
    widest = int(np.argmax(gaps)) if gaps.size else 0
    length, gap = stretch.end - stretch.begin, float(gaps.max(initial=0.0))
    least = next((room for most, room in CUTS if length > most and gap >= room), None)
    if least is None:
        return [stretch]
    low, high = inside[widest - 1] + least / 2.0, inside[widest] - least / 2.0
    at = _straightest(found, float(low), float(high))
    first = Stretch(stretch.begin, at - SEAM / 2.0)
    second = Stretch(at + SEAM / 2.0, stretch.end)
    return [*_cut(found, bad, first), *_cut(found, bad, second)]


def _straightest(found: RoutePath, begin: float, end: float) -> float:
    """Find the place between two where the line turns least about it [m]."""
    at = np.arange(begin, end + 1e-9, 1.0)
    turn = np.abs(heading(found, at + 2.0) - heading(found, at - 2.0))
    middle = 0.5 * (begin + end)
    return float(at[np.argmin(turn + 1e-4 * np.abs(at - middle))])
