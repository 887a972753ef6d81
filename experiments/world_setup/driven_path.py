"""The path of the ego along a route: lanes as they lie where a car can follow them.

Where the lanes bend more sharply than the ego can turn, or where its body would leave
the road, the path is planned anew inside the area that the route has: lanes of its own
direction and junctions. Everywhere else it is the smoothed line of the lanes.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from experiments.world_setup.path_attempts import (
    ACROSS,
    ATTEMPTS,
    LAST_RESORT,
    LEAST_MARGIN,
    ROOM,
    Attempt,
    Attempts,
)
from experiments.world_setup.path_stretches import (
    LONGEST,
    STEP,
    TOLERANCE,
    Stretch,
    bad_places,
    body_polygons,
    heading,
    part_of_line,
    sharp_places,
    stretches_about,
)
from planner.errors import InvalidInputError
from planner.reference_path.corners import rounded_corners
from planner.reference_path.path import ReferencePath
from planner.reference_path.steerable import SHIFTS, SteerablePath, steerable_path
from planner.reference_path.steered_motion import SteeringLimits
from planner.states import BoolArray, FloatArray
from planner.vehicle import Vehicle
from sumo_nets.drivable_area import boundary_about
from sumo_nets.errors import NetworkError
from sumo_nets.route_path import RoutePath

SHARPEST = (0.97, 0.94, 0.91)  # most of it; smoothing may add to it
HELD = 0.985  # what the smooth path may have of it

CUT = 0.4  # a corner of the lanes is cut by no more than this [m] ...
CUT_SHARE = 0.5  # ... and this share of the room beside the body
HIGHER = (1.3, 1.8, 2.7)  # what a bend needs, for the message


class NoPathError(NetworkError):
    """There is no path for this body through a bend."""

    def __init__(self, message: str, lane: str = "") -> None:
        super().__init__(message)
        self.lane = lane  # where the line is sharpest; "" if it is on none


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
        bad = bad_places(found, smooth, vehicle)
    except InvalidInputError:
        bad = sharp_places(found, vehicle)
        if not bad.size:
            raise
    if smooth is not None and not bad.size:
        return DrivenPath(smooth, found.s, ())
    stretches = stretches_about(found, bad)
    attempts = [
        Attempts(part_of_line(found, stretch), vehicle) for stretch in stretches
    ]
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
    # only so far over the middle of the road, or the edge, that nobody has to wait
    for narrow in (*area.wider[:1], area.own):
        path = path or attempts.first(narrow, (ACROSS, last), share)
    for wider in area.wider[1:]:
        path = path or attempts.first(wider, (ACROSS,), share)
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
    turn = np.abs(heading(found, s + 2.0) - heading(found, s - 2.0))
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
