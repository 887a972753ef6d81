"""The path of the ego along a route: lanes as they lie where a car can follow them.

Where the lanes bend more sharply than the ego can turn, or where its body would leave
the road, the path is planned anew inside the area that the route has: lanes of its own
direction and junctions. Everywhere else it is the smoothed line of the lanes.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from experiments.world_setup.path_attempts import (
    ACROSS,
    ATTEMPTS,
    EASY,
    LAST_RESORT,
    LEAST_MARGIN,
    ROOM,
    Attempt,
    Attempts,
)
from planner.errors import InvalidInputError
from planner.reference_path.corners import rounded_corners
from planner.reference_path.path import ReferencePath
from planner.reference_path.steerable import SHIFTS, SteerablePath, steerable_path
from planner.reference_path.steered_motion import SteeringLimits
from planner.states import BoolArray, FloatArray, IntArray
from planner.vehicle import Vehicle
from sumo_nets.drivable_area import boundary_about
from sumo_nets.errors import NetworkError
from sumo_nets.route_path import RoutePath

STEP = 0.5  # [m], between the places that are checked
CHECKED = 100.0  # of the path at once, against the area there [m]
TOLERANCE = 0.15  # how far the body may reach over the area [m]
ABRUPT = 0.06  # a lane's curvature that changes faster needs one [1/m²]
SHARPEST = (0.97, 0.94, 0.91)  # most of it; smoothing may add to it
HELD = 0.985  # what the smooth path may have of it


CUT = 0.4  # a corner of the lanes is cut by no more than this [m] ...
CUT_SHARE = 0.5  # ... and this share of the room beside the body
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
HIGHER = (1.3, 1.8, 2.7)  # what a bend needs, for the message


class NoPathError(NetworkError):
    """There is no path for this body through a bend."""

    def __init__(self, message: str, lane: str = "") -> None:
        super().__init__(message)
        self.lane = lane  # where the line is sharpest; "" if it is on none


class Stretch(NamedTuple):
    """From where to where along a line [m]."""

    begin: float
    end: float


@dataclass(frozen=True, slots=True, eq=False)
class DrivenPath:
    """A path that the ego can drive."""

    path: ReferencePath
    near: FloatArray  # about where the route's points lie on the path, (n,) [m]
    planned: tuple[Stretch, ...]  # on the path

    def is_planned(self, s: FloatArray) -> BoolArray:
        """Mark the places that lie in a planned stretch, (n,)."""
        marked = np.zeros(s.size, dtype=bool)
        for stretch in self.planned:
            marked |= (s >= stretch.begin) & (s <= stretch.end)
        return marked


def driven_path(found: RoutePath, vehicle: Vehicle) -> DrivenPath:
    """Smooth the line of a route, and plan it anew where no car can follow it.

    Args:
        found: The route.
        vehicle: The ego.

    Raises:
        NoPathError: If there is no path for this body; without the file's name.
        InvalidInputError: If the points make no line.
    """
    found = _with_rounded_corners(found, vehicle)
    smooth: ReferencePath | None = None
    try:
        smooth = ReferencePath.from_polyline(found.points)
        bad = _bad_places(found, smooth, vehicle)
    except InvalidInputError:
        bad = _sharp_places(found, vehicle)
        if not bad.size:
            raise
    if smooth is not None and not bad.size:
        return DrivenPath(smooth, found.s, ())
    stretches = _stretches(found, bad)
    attempts = [Attempts(_part(found, stretch), vehicle) for stretch in stretches]
    faults: list[NoPathError] = []
    for share in SHARPEST:
        planned = [
            (x, _planned(found, x, attempt, share))
            for x, attempt in zip(stretches, attempts, strict=True)
        ]
        driven = _joined(found, planned)
        fault = _fault(found, driven, stretches, vehicle)
        if fault is None:
            return driven
        faults.append(fault)
    raise faults[-1]


def _with_rounded_corners(found: RoutePath, vehicle: Vehicle) -> RoutePath:
    """Cut the corners of the route's line by what its lanes leave beside the body."""
    most = np.minimum(CUT, CUT_SHARE * _spare(found, vehicle.width))
    return replace(found, points=rounded_corners(found.points, most))


def _spare(found: RoutePath, width: float) -> FloatArray:
    """Measure the room on either side of a body in the middle of its lane, (n,) [m].

    Inside junctions, which have no lanes, it is that of the edges about them. Without
    any lanes, as along lanelets, none is known of.
    """
    s, spare = [], []
    for span in found.spans:
        if span.lane.startswith(":"):
            continue
        for k in np.flatnonzero((found.s >= span.begin) & (found.s <= span.end)):
            edges = span.edges_at(float(found.left[k]))
            lane = edges[edges > 0.0].min(initial=np.inf)
            lane -= edges[edges < 0.0].max(initial=-np.inf)
            s.append(float(found.s[k]))
            spare.append(max(0.5 * (lane - width), 0.0))
    return np.asarray(np.interp(found.s, s, spare) if s else np.zeros(found.s.size))


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


def _bad_places(found: RoutePath, path: ReferencePath, vehicle: Vehicle) -> FloatArray:
    """List arc lengths of the route where the ego cannot follow the path [m]."""
    s = np.arange(0.0, path.length, STEP)
    own, _ = path.project(found.points[:, 0], found.points[:, 1], near=found.s)
    along = np.interp(s, np.maximum.accumulate(own), found.s)
    bad = np.zeros(s.size, dtype=bool)
    for rows, area in areas_along(found, along):
        bad[rows] = _is_bad(path, s[rows], area, vehicle)
    return np.asarray(along[bad])


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


def _sharp_places(found: RoutePath, vehicle: Vehicle) -> FloatArray:
    """List arc lengths where the raw line of a route bends sharply [m]."""
    s = np.arange(0.0, found.s[-1], STEP)
    heading = _heading(found, s)
    bend = _heading(found, s + TURN_BASE / 2.0) - _heading(found, s - TURN_BASE / 2.0)
    most = SHARP * vehicle.limits.max_curvature
    return np.asarray(s[np.abs(bend) / TURN_BASE > most]) if heading.size else s


def _heading(found: RoutePath, s: FloatArray) -> FloatArray:
    """Read the direction of the raw line [rad], unwrapped."""
    sides = np.diff(found.points, axis=0)
    angle = np.unwrap(np.arctan2(sides[:, 1], sides[:, 0]))
    middles = (found.s[:-1] + found.s[1:]) / 2.0
    return np.asarray(np.interp(s, middles, angle))


def _stretches(found: RoutePath, bad: FloatArray) -> list[Stretch]:
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
    turn = np.abs(_heading(found, at + 2.0) - _heading(found, at - 2.0))
    middle = 0.5 * (begin + end)
    return float(at[np.argmin(turn + 1e-4 * np.abs(at - middle))])


def _part(found: RoutePath, stretch: Stretch) -> FloatArray:
    """Cut a stretch out of the raw line, (m, 2) [m]."""
    inside = (found.s > stretch.begin + STEP) & (found.s < stretch.end - STEP)
    ends = [
        [float(np.interp(s, found.s, axis)) for axis in found.points.T] for s in stretch
    ]
    return np.vstack([ends[0], found.points[inside], ends[1]])


def _planned(
    found: RoutePath, stretch: Stretch, attempts: Attempts, share: float
) -> SteerablePath:
    """Plan one stretch with a share of the ego's curvature.

    Raises:
        NoPathError: If there is no path.
    """
    lane, place = _place(found, stretch)
    if stretch.end - stretch.begin > LONGEST:
        raise NoPathError(
            f"{place}: no car of this width can drive this: the body would leave the "
            f"lanes over {stretch.end - stretch.begin:.0f} m",
            lane,
        )
    area = found.areas.between(*stretch)
    first = area.narrower[0] if area.narrower else area.own
    path = attempts.first(first, ATTEMPTS[:2], share)
    if path is not None:
        return path
    # what does not go with all the room there is goes nowhere
    last = Attempt(share, LEAST_MARGIN, LAST_RESORT, SHIFTS)
    somehow = attempts.first(area.widest, (last,), share)
    if somehow is None:
        raise NoPathError(_impossible(area.own, place, attempts, last), lane)
    path = _beside_others(area.narrower, attempts, share)
    path = path or attempts.first(area.own, ATTEMPTS, share)
    for wider in area.wider:
        path = path or attempts.first(wider, (ACROSS,), share)
    path = path or attempts.first(area.own, (last,), share)
    return path or somehow


def _impossible(
    area: BaseGeometry, place: str, attempts: Attempts, last: Attempt
) -> str:
    """Say what a bend asks for that has no path."""
    guide, vehicle = attempts.guide, attempts.vehicle
    needed = _needed(guide, boundary_about(area, guide, ROOM), vehicle)
    reach = attempts.plan(area, last).fault - LEAST_MARGIN
    return (
        f"{place}: a bend that this body cannot take: it needs a "
        f"curvature of {needed} 1/m, the ego has {vehicle.limits.max_curvature:g} and "
        f"would be {reach:.2f} m beside the road"
    )


def _beside_others(
    areas: Sequence[BaseGeometry], attempts: Attempts, share: float
) -> SteerablePath | None:
    """Plan inside the narrowest area that has a path; None if there is none.

    Where the first one does not leave room to spare, the widest is tried first: what
    does not go there goes nowhere.
    """
    if not areas:
        return None
    best = attempts.first(areas[0], ATTEMPTS[:2], share)
    if best is not None:
        return best
    for area in areas[::-1]:
        path = attempts.first(area, ATTEMPTS[2:3], share)
        if path is None:
            break
        best = path
    return best


def _needed(guide: FloatArray, boundary: FloatArray, vehicle: Vehicle) -> str:
    """Find about which curvature would do, for a message."""
    for factor in HIGHER:
        limits = SteeringLimits(factor * vehicle.limits.max_curvature, 4.0 * factor)
        path = steerable_path(guide, boundary, vehicle, limits, shifts=(0.0, 3.0))
        if path.fault <= limits.margin + LAST_RESORT:
            return f"{limits.curvature:.2f}"
    return f"more than {HIGHER[-1] * vehicle.limits.max_curvature:.1f}"


def _place(found: RoutePath, stretch: Stretch) -> tuple[str, str]:
    """Find the lane of the sharpest place of a stretch, and name the place."""
    s = np.arange(stretch.begin, stretch.end, STEP)
    turn = np.abs(_heading(found, s + 2.0) - _heading(found, s - 2.0))
    worst = float(s[np.argmax(turn)])
    for span in found.spans:
        if span.begin <= worst <= span.end:
            return span.lane, f'lane "{span.lane}", s = {worst:.0f} m'
    return "", f"s = {worst:.0f} m"


def _joined(
    found: RoutePath, planned: Sequence[tuple[Stretch, SteerablePath]]
) -> DrivenPath:
    """Put the planned stretches into the line and smooth the whole."""
    parts, at, before = [], [], 0.0
    for stretch, path in planned:
        kept = (found.s >= before) & (found.s < stretch.begin - STEP)
        parts += [found.points[kept], np.column_stack([path.x, path.y])]
        at += [found.s[kept], np.linspace(*stretch, path.x.size)]
        before = stretch.end + STEP
    kept = found.s >= before
    parts.append(found.points[kept])
    at.append(found.s[kept])
    points = np.concatenate(parts)
    along = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(points, axis=0).T))])
    near = np.interp(found.s, np.concatenate(at), along)
    spans = [np.interp(stretch, found.s, near) for stretch, _ in planned]
    return DrivenPath(
        ReferencePath.from_polyline(points),
        near,
        tuple(Stretch(float(begin), float(end)) for begin, end in spans),
    )


def _fault(
    found: RoutePath, driven: DrivenPath, stretches: list[Stretch], vehicle: Vehicle
) -> NoPathError | None:
    """Find what is wrong with the planned stretches once they are smooth."""
    most = vehicle.limits.max_curvature
    for stretch, span in zip(stretches, driven.planned, strict=True):
        s = np.arange(span.begin, span.end, STEP / 2.0)
        sharpest = float(np.abs(driven.path.at(s).curvature).max())
        lane, where = _place(found, stretch)
        if sharpest > HELD * most:
            needs = f"needs a curvature of {sharpest:.3f} 1/m, not {most:g}"
            return NoPathError(f"{where}: {needs}", lane)
        allowed = found.areas.between(*stretch).widest.buffer(2.0 * TOLERANCE)
        shapely.prepare(allowed)
        if not shapely.covers(allowed, body_polygons(driven.path, s, vehicle)).all():
            return NoPathError(f"{where}: the body would leave the road", lane)
    return None
