"""The lanes along the ego's path, as its planner sees them."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from planner.scene import Lanes
from planner.states import BoolArray, FloatArray
from sumo_nets.route_path import LaneSpan, RoutePath

DRAWN_APART = 0.15  # of the path from its lane as drawn, from which it counts [m]

FARTHEST_APART = 1.2  # by which lanes beside the path are drawn apart from it [m]

BESIDE_PATH = 1.6  # from the line of the route, a lane is another one [m]

SEAM = 0.01  # behind the end of an edge other lanes than the onward ones are gone [m]


def route_lanes(found: RoutePath, s: FloatArray, l: FloatArray) -> Lanes:
    """Return the lanes of the route's edges along the reference path.

    A lane goes on from edge to edge as its connections lead, beside that of the route;
    where the route moves over to the next lane, the path leaves its lane for another.
    Where a lane is missing its width is 0. Inside junctions there are no markings:
    lanes that lead over it beside the route's are interpolated from one edge to the
    next, the others are missing. Where the path is not where its lane is drawn, as in
    tight bends, it is the middle of its lane all the same: a vehicle can follow it.
    """
    spans = [span for span in found.spans if not span.lane.startswith(":")]
    firsts, count = _first_lanes(spans)
    planned = bool(np.abs(l).max() > DRAWN_APART)
    if planned:
        l = np.clip(l, -FARTHEST_APART, FARTHEST_APART)
    kept = np.flatnonzero(growing(s))
    rows: list[_LaneRow] = []
    before = -1  # place of the span of the last row
    for k in kept:
        here = _span_at(spans, float(found.s[k]), before)
        if here is None:
            continue
        row = _lane_row(spans[here], float(found.left[k]), firsts[here], count)
        row = row.moved(float(s[k]), float(l[k]), on_path=planned)
        if here != before and before >= 0:
            rows += _over_junction(rows[-1], row, spans[before], firsts[before])
        if not rows or row.s > rows[-1].s:
            rows.append(row)
        before = here
    if not rows:
        return Lanes.none()
    at, centre, width, solid = zip(*rows, strict=True)
    lines = np.array(solid)
    return Lanes(
        np.array(at),
        np.array(centre).T,
        np.array(width).T,
        found.left_hand,
        lines[:, :, 0].T,
        lines[:, :, 1].T,
    )


def _first_lanes(spans: Sequence[LaneSpan]) -> tuple[list[int], int]:
    """Number the rightmost lane of each edge, and count all lanes of the route."""
    own = np.cumsum([span.changed for span in spans]).astype(int)
    right = own - [sum(x < 0.0 for x in span.lines) for span in spans]
    left = own + [sum(x > 0.0 for x in span.lines) for span in spans]
    lowest = int(right.min(initial=0)) if right.size else 0
    highest = int(left.max(initial=0)) if left.size else 0
    return (right - lowest).tolist(), highest - lowest + 1


class _LaneRow(NamedTuple):
    """The lanes at one place, right to left."""

    s: float  # [m]
    centre: FloatArray  # (n_lanes,) [m]
    width: FloatArray  # [m]
    solid: BoolArray  # may not be left to the left, to the right, (n_lanes, 2)

    def moved(self, s: float, l: float, *, on_path: bool) -> "_LaneRow":
        """Return the same lanes at `s`, and `l` to the left.

        With `on_path` the lane of the route stays on its line.
        """
        share = np.ones(self.centre.size)
        if on_path:
            share = np.minimum(np.abs(self.centre) / BESIDE_PATH, 1.0)
        return _LaneRow(s, self.centre + share * l, self.width, self.solid)


def _span_at(spans: Sequence[LaneSpan], at: float, first: int) -> int | None:
    """Find the edge at an arc length, from the edge `first` on; None in junctions."""
    numbers = range(max(first, 0), len(spans))
    return next((k for k in numbers if spans[k].begin <= at <= spans[k].end), None)


def _lane_row(span: LaneSpan, left: float, first: int, count: int) -> _LaneRow:
    """Return the lanes of an edge whose carriageway's left edge is `left`.

    Args:
        span: The edge.
        left: At the place [m].
        first: Number of the edge's rightmost lane.
        count: Of all lanes of the route.
    """
    edges = span.edges_at(left)
    centre, width = np.zeros(count), np.zeros(count)
    there = slice(first, first + edges.size - 1)
    centre[there] = 0.5 * (edges[1:] + edges[:-1])
    width[there] = np.diff(edges)
    centre[:first] = edges[0] - np.arange(first, 0, -1.0)
    beyond = centre.size - there.stop
    centre[there.stop :] = edges[-1] + np.arange(1.0, beyond + 1.0)
    solid = np.zeros((count, 2), dtype=bool)
    if len(span.solid) == edges.size - 1:
        solid[there] = span.solid
    return _LaneRow(0.0, centre, width, solid)


def _over_junction(
    last: _LaneRow, following: _LaneRow, span: LaneSpan, first: int
) -> list[_LaneRow]:
    """Return rows inside a junction, where the lanes that do not lead on are missing.

    Args:
        last: Lanes of the edge before.
        following: Lanes of the edge behind the junction.
        span: Of the edge before.
        first: Number of its rightmost lane.
    """
    onward = np.zeros(last.width.size, dtype=bool)
    onward[first : first + len(span.onward)] = span.onward
    begin, end = last.s + SEAM, following.s - SEAM
    if onward.all() or end <= begin:
        return []
    return [
        _LaneRow(at, row.centre, np.where(onward, row.width, 0.0), row.solid)
        for at, row in ((begin, last), (end, following))
    ]


def growing(s: FloatArray) -> NDArray[np.bool_]:
    """Mark the values that exceed all before them."""
    before = np.concatenate(([-np.inf], np.maximum.accumulate(s)[:-1]))
    return np.asarray(s > before + 1e-6)
