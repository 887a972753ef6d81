"""The road of a route over lanelets: path, edges, lanes, limits and lights."""

import logging
from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from experiments.commonroad.corridor import Corridor, Row
from experiments.commonroad.records import Lanelet, RoadNetwork, TrafficLight
from experiments.cosim.road import Road
from experiments.world_setup.driven_path import DrivenPath, driven_path
from experiments.world_setup.road_bounds import road_bounds
from planner.errors import InvalidInputError
from planner.reference_path.path import ReferencePath
from planner.scene import Lanes, RoadBounds, SpeedLimits
from planner.states import FloatArray
from planner.vehicle import Vehicle
from sumo_nets.errors import NetworkError
from sumo_nets.route_areas import OneArea, RouteArea
from sumo_nets.route_path import RoutePath, StopLine

SPACING = 2.0  # between places where edges and lanes are measured [m]
BOUND_STEP = 1.0  # between points of bounds that are projected [m]
SEAM = 0.02  # from the end of a row to where the next one holds [m]
# from the lanelets' line to the path where there is no path that the ego can drive [m]
DEVIATIONS = (0.1, 0.3, 0.6, 1.0, 2.0)
POLE = 0.9  # share of the way to the centre of curvature that may be road
APART = 1e-3  # of the centres of two lanes at least [m]
LEAST_ROOM = 0.05  # between the edges of a road [m]

log = logging.getLogger(__name__)


class _Strip(NamedTuple):
    """One lanelet beside the path at the places of its row, (n,) each [m]."""

    left: FloatArray
    right: FloatArray


class _RowOnPath(NamedTuple):
    """A row of lanelets, right to left, along the path."""

    row: Row
    s: FloatArray  # (n,) [m]
    strips: tuple[_Strip, ...]
    number: int  # of the lane of the first strip; the path enters on lane 0


def lanelet_road(
    network: RoadNetwork, corridor: Corridor, vehicle: Vehicle, *, left_hand: bool
) -> Road:
    """Build the road of a corridor.

    Args:
        network: Of the file.
        corridor: Of the route.
        vehicle: The ego, whose path it is.
        left_hand: Whether traffic keeps to the left.

    Raises:
        InvalidInputError: If the route's line makes no path.
    """
    nothing = np.zeros(corridor.s.size)
    found = RoutePath(
        corridor.points,
        corridor.s,
        nothing,
        nothing,
        (),
        (),
        OneArea(RouteArea(corridor.area)),
        left_hand,
    )
    driven = _path_along(found, vehicle)
    path = driven.path
    near, _ = path.project(corridor.points[:, 0], corridor.points[:, 1], driven.near)
    near = np.maximum.accumulate(near)
    ends = np.interp(corridor.ends, corridor.s, near)
    ends[-1] = path.length
    rows = list(_rows_on_path(network, corridor, path, ends))
    carriageway = _edges(path, rows)
    bounds = road_bounds(found, driven, carriageway, vehicle)
    stops = tuple(
        StopLine(str(light.id), 0, s) for light, s in lights(network, corridor, path)
    )
    limits = _speed_limits(network, rows)
    return Road(path, bounds, _lanes(rows, left_hand), stops, speed_limits=limits)


def _path_along(found: RoutePath, vehicle: Vehicle) -> DrivenPath:
    """Draw a path that the ego can drive; else one as near to the line as it goes."""
    try:
        return driven_path(found, vehicle)
    except (NetworkError, InvalidInputError) as error:
        log.warning("the ego cannot drive along the lanelets: %s", error)
    for deviation in DEVIATIONS:
        try:
            path = ReferencePath.from_polyline(found.points, deviation)
        except InvalidInputError as error:
            last = error
            continue
        return DrivenPath(path, found.s, ())
    raise last


def _rows_on_path(
    network: RoadNetwork, corridor: Corridor, path: ReferencePath, ends: FloatArray
) -> Iterator[_RowOnPath]:
    """Yield rows with the offsets of their lanelets from the path."""
    begin, entered = 0.0, 0
    for row, end in zip(corridor.rows, ends.tolist(), strict=True):
        if end > begin + 2.0 * SEAM:
            n = max(int((end - begin) / SPACING), 1) + 1
            s = np.linspace(begin + SEAM, end, n)
            strips = tuple(
                _strip(network.lanelets[name], path, s) for name in row.lanelets
            )
            yield _RowOnPath(row, s, strips, entered - row.entered)
            begin = end
        entered += row.left - row.entered


def _strip(lanelet: Lanelet, path: ReferencePath, s: FloatArray) -> _Strip:
    """Measure the bounds of a lanelet from the path at places (n,) of it [m]."""
    return _Strip(
        *(_offsets(bound, path, s) for bound in (lanelet.left, lanelet.right))
    )


def _offsets(bound: FloatArray, path: ReferencePath, s: FloatArray) -> FloatArray:
    """Return the offsets of a polyline at places of the path, (n,) [m]."""
    along = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(bound, axis=0).T))])
    n = max(int(along[-1] / BOUND_STEP), 1) + 1
    at = np.union1d(along, np.linspace(0.0, along[-1], n))
    x, y = (np.interp(at, along, axis) for axis in bound.T)
    near = np.interp(at, [0.0, max(along[-1], SEAM)], [s[0], s[-1]])
    foot, l = path.project(x, y, near)
    order = np.argsort(foot, kind="stable")
    return np.asarray(np.interp(s, foot[order], l[order]))


def _edges(path: ReferencePath, rows: Sequence[_RowOnPath]) -> RoadBounds:
    """Return the outermost edges of the rows, short of the centre of curvature."""
    s = np.concatenate([row.s for row in rows])
    left = np.concatenate(
        [np.max([x.left for x in row.strips], axis=0) for row in rows]
    )
    right = np.concatenate(
        [np.min([x.right for x in row.strips], axis=0) for row in rows]
    )
    curvature = path.at(s).curvature
    pole = POLE / np.where(np.abs(curvature) < APART, APART, np.abs(curvature))
    left = np.where(curvature > 0.0, np.minimum(left, pole), left)
    right = np.where(curvature < 0.0, np.maximum(right, -pole), right)
    return RoadBounds(s, np.maximum(left, right + LEAST_ROOM), right)


def _lanes(rows: Sequence[_RowOnPath], left_hand: bool) -> Lanes:  # noqa: FBT001
    """Return the lanes along the path; one that is missing somewhere has no width."""
    first = min(row.number for row in rows)
    last = max(row.number + len(row.strips) for row in rows)
    n_lanes = last - first
    centres, widths = [], []
    for row in rows:
        own = slice(row.number - first, row.number - first + len(row.strips))
        centre = np.zeros((n_lanes, row.s.size))
        width = np.zeros_like(centre)
        edges = np.array([(x.right, x.left) for x in row.strips])
        centre[own] = edges.mean(axis=1)
        width[own] = np.maximum(edges[:, 1] - edges[:, 0], 0.0)
        below = np.arange(own.start, 0, -1.0)[:, None]
        above = np.arange(1.0, n_lanes - own.stop + 1.0)[:, None]
        centre[: own.start] = centre[own.start] - 0.5 * width[own.start] - below
        centre[own.stop :] = centre[own.stop - 1] + 0.5 * width[own.stop - 1] + above
        for k in range(1, n_lanes):
            centre[k] = np.maximum(centre[k], centre[k - 1] + APART)
        centres.append(centre)
        widths.append(width)
    s = np.concatenate([row.s for row in rows])
    centre, width = (np.concatenate(x, axis=1) for x in (centres, widths))
    return Lanes(s, centre, width, left_hand)


def _speed_limits(network: RoadNetwork, rows: Sequence[_RowOnPath]) -> SpeedLimits:
    """Return what the signs of the route's lanelets allow."""
    begins, limits = [], []
    for on_path in rows:
        lanelet = network.lanelets[on_path.row.lanelets[on_path.row.left]]
        allowed = [
            network.speed_limits[sign]
            for sign in lanelet.signs
            if sign in network.speed_limits
        ]
        begins.append(float(on_path.s[0]))
        limits.append(min(allowed, default=np.inf))
    return SpeedLimits(np.array(begins), np.array(limits))


def lights(
    network: RoadNetwork, corridor: Corridor, path: ReferencePath
) -> list[tuple[TrafficLight, float]]:
    """List the lights that the route has to obey, with their lines on the path [m]."""
    names = [row.lanelets[row.left] for row in corridor.rows]
    found: dict[tuple[int, float], tuple[TrafficLight, float]] = {}
    for k, name in enumerate(names):
        lanelet = network.lanelets[name]
        following = None
        if k + 1 < len(names):  # the lanelet that is entered, not the one that is left
            row = corridor.rows[k + 1]
            following = row.lanelets[row.entered]
        turn = None if following is None else network.turns.get((name, following))
        stop = lanelet.stop
        refs = (*lanelet.lights, *(() if stop is None else stop.lights))
        for ref in refs:
            light = network.lights.get(ref)
            if light is None or not _applies(light, turn):
                continue
            if stop is None or stop.points is None:
                place = lanelet.centre[-1]
            else:
                place = stop.points.mean(axis=0)
            end = float(corridor.ends[k])
            s, _ = path.project_one(float(place[0]), float(place[1]), near=end)
            found[light.id, round(s, 1)] = (light, s)
    return sorted(found.values(), key=lambda item: item[1])


def _applies(light: TrafficLight, turn: str | None) -> bool:
    """Tell whether a light is for the way that the route takes."""
    direction = light.direction.lower()
    return turn is None or direction in ("", "all") or turn in direction
