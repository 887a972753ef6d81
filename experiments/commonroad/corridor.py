"""The corridor of a route: rows of parallel lanelets, and the line through them.

A row holds all lanelets beside each other that lead in the route's direction. The line
follows the route's lanelets and moves over, smoothly, where the route changes lanes.
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Final

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from experiments.commonroad.records import Lanelet, RoadNetwork
from experiments.commonroad.route import Step
from planner.states import FloatArray

SPACING: Final = 1.0  # between points of lines [m]
BEHIND: Final = 15.0  # the corridor begins so far before the ego, if the map does [m]
CHANGE_TIME: Final = 4.0  # of moving over one lane [s]
CHANGE_LENGTHS: Final = (25.0, 90.0)  # least and most for one lane [m]
SHORTEST: Final = 0.6  # share of the wanted length; a shorter change is drawn anew
SEAM: Final = 0.05  # by which lanelets are grown until they touch [m]
CARRIED_ON: Final = 12.0  # of the area beyond both ends of the corridor [m]
CROSSING: Final = 1.0  # lanelets that share more of their area cross [m²]
TINY: Final = 1e-6  # [m]


@dataclass(frozen=True, slots=True)
class Row:
    """Lanelets beside each other, right to left."""

    lanelets: tuple[int, ...]
    entered: int  # place of the one on which the route comes
    left: int  # of the one on which it leaves


@dataclass(frozen=True, slots=True, eq=False)
class Corridor:
    """Rows of lanelets along a route and the line through them; arrays are (n,)."""

    rows: tuple[Row, ...]
    points: FloatArray  # of the line, (n, 2) [m]
    s: FloatArray  # arc length of the points [m]
    ends: FloatArray  # arc length where each row ends, (n_rows,) [m]
    area: BaseGeometry  # that a body on the route may use


@dataclass(frozen=True, slots=True)
class Extent:
    """What a corridor has to hold."""

    start: tuple[float, float]  # of the ego [m]
    goal: tuple[float, float] | None  # middle of the goal's area
    speed: float  # at the start [m/s]
    beyond: float  # length that is wanted behind the route's last lanelet [m]


def make_corridor(
    network: RoadNetwork, steps: Sequence[Step], extent: Extent
) -> Corridor:
    """Collect the rows along a route and draw the line through them."""
    lanelets = network.lanelets
    rows = _rows(lanelets, steps)
    rows = _with_room_behind(lanelets, rows, extent.start)
    rows = (*rows, *_rows_beyond(lanelets, rows[-1], extent.beyond))
    parts = [_row_line(lanelets, row, extent) for row in rows]
    points = np.concatenate([parts[0], *(part[1:] for part in parts[1:])])
    last = np.cumsum([len(part) - 1 for part in parts])
    marks = points[last]
    points = _without_doubles(points)
    points = _with_long_changes(points, rows, marks, extent)
    s = _along(points)
    line = shapely.LineString(points)
    ends = np.array([shapely.line_locate_point(line, shapely.Point(m)) for m in marks])
    ends = np.maximum.accumulate(ends)
    ends[-1] = s[-1]
    return Corridor(rows, points, s, ends, _area(network, rows, steps))


def _rows(lanelets: Mapping[int, Lanelet], steps: Sequence[Step]) -> tuple[Row, ...]:
    """Collect the rows of a route; lane changes stay in their row."""
    rows: list[Row] = []
    for step in steps:
        if step.how in ("start", "successor"):
            found = _beside(lanelets, step.lanelet)
            place = found.index(step.lanelet)
            rows.append(Row(found, place, place))
        else:
            row = rows[-1]
            rows[-1] = replace(row, left=row.lanelets.index(step.lanelet))
    return tuple(rows)


def _beside(lanelets: Mapping[int, Lanelet], name: int) -> tuple[int, ...]:
    """List the lanelets beside one that have its direction, right to left."""
    found = [name]
    for side in ("same_right", "same_left"):
        here = getattr(lanelets[name], side)
        while here is not None and here not in found:
            if lanelets[here].closed:
                break
            if side == "same_right":
                found.insert(0, here)
            else:
                found.append(here)
            here = getattr(lanelets[here], side)
    return tuple(found)


def _with_room_behind(
    lanelets: Mapping[int, Lanelet], rows: tuple[Row, ...], start: tuple[float, float]
) -> tuple[Row, ...]:
    """Put rows before the first one until the ego has road behind it."""
    first = lanelets[rows[0].lanelets[rows[0].entered]]
    room = first.place_of(*start)
    seen = set(rows[0].lanelets)
    while room < BEHIND:
        here = lanelets[rows[0].lanelets[rows[0].entered]]
        before = [
            x for x in here.predecessors if x not in seen and not lanelets[x].closed
        ]
        if not before:
            break
        name = min(before, key=lambda x: _bend(lanelets[x], here))
        found = _beside(lanelets, name)
        seen |= set(found)
        place = found.index(name)
        rows = (Row(found, place, place), *rows)
        room += lanelets[name].length
    return rows


def _rows_beyond(
    lanelets: Mapping[int, Lanelet], row: Row, wanted: float
) -> Iterator[Row]:
    """Yield rows straight on behind the last one until there is room."""
    seen = set(row.lanelets)
    name, room = row.lanelets[row.left], 0.0
    while room < wanted:
        here = lanelets[name]
        onward = [
            x for x in here.successors if x not in seen and not lanelets[x].closed
        ]
        if not onward:
            return
        name = min(onward, key=lambda x: _bend(here, lanelets[x]))
        found = _beside(lanelets, name)
        seen |= set(found)
        place = found.index(name)
        yield Row(found, place, place)
        room += lanelets[name].length


def _bend(before: Lanelet, after: Lanelet) -> float:
    """Return by how much the direction turns over two lanelets [rad]."""
    begin = before.centre[-1] - before.centre[0]
    end = after.centre[-1] - after.centre[0]
    turned = math.atan2(end[1], end[0]) - math.atan2(begin[1], begin[0])
    return abs(math.remainder(turned, 2.0 * math.pi))


def change_length(speed: float, lanes: int) -> float:
    """Return the length over which lanes are changed [m]."""
    least, most = CHANGE_LENGTHS
    return lanes * min(max(CHANGE_TIME * speed, least), most)


def _row_line(lanelets: Mapping[int, Lanelet], row: Row, extent: Extent) -> FloatArray:
    """Draw the line through one row, (n, 2) [m]."""
    first, second = (lanelets[row.lanelets[k]] for k in (row.entered, row.left))
    if row.entered == row.left:
        return _spread(first.centre, SPACING)
    n = max(math.ceil(max(first.length, second.length) / SPACING), 2) + 1
    begin, end = 0.0, first.length
    if first.area.distance(shapely.Point(extent.start)) < TINY:
        begin = min(first.place_of(*extent.start), end)
    if extent.goal is not None and second.area.covers(shapely.Point(extent.goal)):
        ahead = second.place_of(*extent.goal) / second.length * first.length
        end = ahead if ahead > begin + CHANGE_LENGTHS[0] else end
    wanted = change_length(extent.speed, abs(row.left - row.entered))
    length = min(wanted, end - begin)
    share = np.linspace(0.0, 1.0, n)
    x = np.clip((share * first.length - begin) / max(length, TINY), 0.0, 1.0)
    moved = x**3 * (10.0 - 15.0 * x + 6.0 * x**2)
    one, other = (_at_shares(line.centre, share) for line in (first, second))
    return one + moved[:, None] * (other - one)


def _with_long_changes(
    points: FloatArray, rows: Sequence[Row], marks: FloatArray, extent: Extent
) -> FloatArray:
    """Draw changes that are too short for the speed anew, beyond their rows."""
    for k, row in enumerate(rows):
        wanted = change_length(extent.speed, abs(row.left - row.entered))
        if row.entered == row.left:
            continue
        s = _along(points)
        line = shapely.LineString(points)
        begin = 0.0
        if k:
            begin = shapely.line_locate_point(line, shapely.Point(marks[k - 1]))
        end = shapely.line_locate_point(line, shapely.Point(marks[k]))
        start = shapely.line_locate_point(line, shapely.Point(extent.start))
        begin = max(begin, start)
        if end - begin >= SHORTEST * wanted:
            continue
        middle = 0.5 * (begin + end)
        first = max(middle - 0.5 * wanted, min(start, begin), 0.0)
        last = min(first + wanted, float(s[-1]))
        points = _bridged(points, s, first, last)
    return points


def _bridged(
    points: FloatArray, s: FloatArray, first: float, last: float
) -> FloatArray:
    """Replace a part of a line by a cubic with its directions at both ends."""
    if last - first < SPACING:
        return points
    ends, tangents = [], []
    for at, back in ((first, 0.0), (last, SPACING)):
        here, ahead = (
            np.array([np.interp(x, s, axis) for axis in points.T])
            for x in (at - back, at - back + SPACING)
        )
        side = ahead - here
        tangents.append(side / max(float(np.hypot(*side)), TINY) * (last - first))
        ends.append(np.array([np.interp(at, s, axis) for axis in points.T]))
    u = np.linspace(0.0, 1.0, max(math.ceil((last - first) / SPACING), 2) + 1)[:, None]
    curve = (
        (1.0 + 2.0 * u) * (1.0 - u) ** 2 * ends[0]
        + u * (1.0 - u) ** 2 * tangents[0]
        + u**2 * (3.0 - 2.0 * u) * ends[1]
        + u**2 * (u - 1.0) * tangents[1]
    )
    kept = (points[s < first - TINY], points[s > last + TINY])
    return _without_doubles(np.concatenate([kept[0], curve, kept[1]]))


def _along(points: FloatArray) -> FloatArray:
    """Return arc lengths of a polyline, (n,) [m]."""
    sides = np.hypot(*np.diff(points, axis=0).T)
    return np.concatenate([[0.0], np.cumsum(sides)])


def _at_shares(points: FloatArray, share: FloatArray) -> FloatArray:
    """Return points of a polyline at shares of its length, (n, 2) [m]."""
    s = _along(points)
    return np.column_stack([np.interp(share * s[-1], s, axis) for axis in points.T])


def _spread(points: FloatArray, spacing: float) -> FloatArray:
    """Insert points so that none are farther apart, (n, 2) [m]."""
    s = _along(points)
    at = np.union1d(s, np.linspace(0.0, s[-1], max(math.ceil(s[-1] / spacing), 1) + 1))
    return np.column_stack([np.interp(at, s, axis) for axis in points.T])


def _without_doubles(points: FloatArray) -> FloatArray:
    """Drop points that repeat, or turn back over less than the spacing, (m, 2)."""
    kept = [points[0]]
    for point in points[1:]:
        side = point - kept[-1]
        length = float(np.hypot(*side))
        if length < 1e-3:  # noqa: PLR2004 - a millimetre
            continue
        if len(kept) > 1 and length < SPACING:
            before = kept[-1] - kept[-2]
            if float(before @ side) < 0.0:
                continue
        kept.append(point)
    return np.array(kept)


def _area(
    network: RoadNetwork, rows: Sequence[Row], steps: Sequence[Step]
) -> BaseGeometry:
    """Unite what a body on the route may use: its rows, and junctions on its way."""
    lanelets = network.lanelets
    names = [name for row in rows for name in row.lanelets]
    parts = [lanelets[name].area for name in names]
    parts += [_carried_on(lanelets[name], 0) for name in rows[0].lanelets]
    parts += [_carried_on(lanelets[name], -1) for name in rows[-1].lanelets]
    every = [x for x in lanelets.values() if not x.closed]
    areas = np.array([lanelet.area for lanelet in every])
    for before, after in pairwise(steps):
        if (before.lanelet, after.lanelet) in network.turns:
            shared = shapely.area(
                shapely.intersection(areas, lanelets[after.lanelet].area)
            )
            parts += list(areas[shared > CROSSING])
    grown = [part.buffer(SEAM, join_style="mitre") for part in parts]
    return shapely.union_all(grown)


def _carried_on(lanelet: Lanelet, end: int) -> BaseGeometry:
    """Carry a lanelet straight on at one end (0 or -1)."""
    line = lanelet.centre
    ahead = line[0] - line[1] if end == 0 else line[-1] - line[-2]
    ahead = CARRIED_ON * ahead / max(float(np.hypot(*ahead)), TINY)
    left, right = lanelet.left[end], lanelet.right[end]
    outline = np.array([left, left + ahead, right + ahead, right])
    return shapely.make_valid(shapely.Polygon(outline))
