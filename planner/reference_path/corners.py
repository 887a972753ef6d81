"""Corners of a polyline, taken as a driver does: inside the lane, not on its line.

Roads that were drawn by hand or come from maps are straight legs that meet at a corner.
A path that keeps to the line bends there as sharply as its smoothing allows, and has to
be driven slowly; one that cuts the corner by a few decimetres hardly bends at all.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from planner.states import FloatArray

LEAST_TURN = 0.03  # a smaller one is no corner [rad]
MOST_TURN = 0.25  # a larger one is a turn, not a bend of the lane [rad]
STRAIGHT = 0.004  # points that turn the line by less lie on a leg [rad]
TOGETHER = 2.0  # points no farther apart than this may make one corner ...
WIDEST = 4.0  # ... of no more than this; longer ones are curves [m]
LEAST_REACH = 2.0  # a corner between shorter legs belongs to a curve [m]
# Of the height of the corner over its curve, whose second derivative is a parabola.
HEIGHT = 0.375


@dataclass(frozen=True, slots=True)
class _Bend:
    """A few neighbouring points at which the polyline turns."""

    first: int  # of the points
    last: int


def rounded_corners(points: FloatArray, most: FloatArray) -> FloatArray:
    """Move the points about each corner onto a curve that cuts it.

    In the frame of the corner, x across its bisector, the legs are y = tan(a) |x| with
    a half the turn. Between -r and r the curve has y'' = 1.5 tan(a) / r (1 - (x/r)²):
    it leaves the legs without a jump of curvature and lies 0.375 r tan(a) above the
    corner. r is as long as that and half the shorter leg allow.

    Args:
        points: Of the polyline, dense enough for the curve, (n, 2) [m].
        most: By which a corner may be cut at each point, (n,) [m].

    Returns:
        The points, (n, 2) [m]; the same array where nothing is to be rounded.
    """
    sides = np.diff(points, axis=0)
    lengths = np.hypot(*sides.T)
    s = np.concatenate([[0.0], np.cumsum(lengths)])
    heading = np.unwrap(np.arctan2(sides[:, 1], sides[:, 0]))
    bends = list(_bends(s, np.diff(heading)))
    ends = [0.0, *(s[x.last] for x in bends)]
    begins = [*(s[x.first] for x in bends), s[-1]]
    moved = points
    for number, bend in enumerate(bends):
        before, after = sides[bend.first - 1], sides[bend.last]
        half = 0.5 * abs(float(heading[bend.last] - heading[bend.first - 1]))
        if not LEAST_TURN <= 2.0 * half <= MOST_TURN:
            continue
        if s[bend.last] - s[bend.first] > WIDEST:
            continue
        legs = min(begins[k] - ends[k] for k in (number, number + 1))
        cut = float(most[bend.first : bend.last + 1].min())
        reach = min(0.5 * legs * np.cos(half), cut / (HEIGHT * np.tan(half)))
        if reach < LEAST_REACH:
            continue
        if moved is points:
            moved = points.copy()
        corner = _meeting(points[bend.first], before, points[bend.last], after)
        axes = _axes(before, after)
        near = np.abs(s - 0.5 * (s[bend.first] + s[bend.last])) < 2.0 * reach + WIDEST
        x, _ = axes @ (points[near] - corner).T
        on = np.abs(x) < reach
        y = _curve(x[on], reach, np.tan(half))
        moved[np.flatnonzero(near)[on]] = corner + np.stack([x[on], y], axis=1) @ axes
    return moved


def _bends(s: FloatArray, turn: FloatArray) -> Iterator[_Bend]:
    """Gather the points at which the polyline turns; `turn` is that at s[1:-1]."""
    turning = 1 + np.flatnonzero(np.abs(turn) >= STRAIGHT)
    if not turning.size:
        return
    parts = np.split(turning, 1 + np.flatnonzero(np.diff(s[turning]) > TOGETHER))
    for part in parts:
        yield _Bend(int(part[0]), int(part[-1]))


def _meeting(
    first: FloatArray, before: FloatArray, last: FloatArray, after: FloatArray
) -> FloatArray:
    """Find where the line through `first` meets that through `last`, (2,) [m]."""
    cross = before[0] * after[1] - before[1] * after[0]
    apart = last - first
    share = (apart[0] * after[1] - apart[1] * after[0]) / cross
    return np.asarray(first + share * before)


def _axes(before: FloatArray, after: FloatArray) -> FloatArray:
    """Return the unit vectors across the bisector and along it, inwards, (2, 2)."""
    into, out = before / np.hypot(*before), after / np.hypot(*after)
    along, inwards = into + out, out - into
    return np.stack([along / np.hypot(*along), inwards / np.hypot(*inwards)])


def _curve(x: FloatArray, reach: float, slope: float) -> FloatArray:
    """Return the height of the curve over the corner at x [m]."""
    bent = 1.5 * (x**2 / 2.0 - x**4 / (12.0 * reach**2)) / reach
    return np.asarray(slope * (HEIGHT * reach + bent))
