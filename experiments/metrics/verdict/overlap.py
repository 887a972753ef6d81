"""Overlap of rectangles, many at a time."""

from typing import NamedTuple

import numpy as np

from experiments.metrics.verdict.records import BodyTrack
from planner.states import BoolArray, FloatArray


class RectangleRows(NamedTuple):
    """Rectangles; arrays broadcast with each other."""

    x: FloatArray  # centre [m]
    y: FloatArray
    heading: FloatArray  # [rad]
    length: FloatArray  # [m]
    width: FloatArray


def rows_of(track: BodyTrack, rows: slice | int = slice(None)) -> RectangleRows:
    """Return the rectangles of a track in some steps."""
    return RectangleRows(
        track.x[rows],
        track.y[rows],
        track.heading[rows],
        np.asarray(track.length),
        np.asarray(track.width),
    )


def overlap(one: RectangleRows, other: RectangleRows) -> BoolArray:
    """Check which pairs of rectangles overlap, by separating axes; NaN never does."""
    dx, dy = other.x - one.x, other.y - one.y
    apart = ~np.isfinite(dx + dy)
    for angle in (one.heading, other.heading):
        for normal in (angle, angle + 0.5 * np.pi):
            gap = np.abs(dx * np.cos(normal) + dy * np.sin(normal))
            reach = _half(one, normal) + _half(other, normal)
            apart = apart | (gap > reach)
    return np.asarray(~apart)


def _half(body: RectangleRows, normal: FloatArray) -> FloatArray:
    """Return half the extent of rectangles along a direction [m]."""
    turned = body.heading - normal
    along, across = np.abs(np.cos(turned)), np.abs(np.sin(turned))
    half: FloatArray = 0.5 * (body.length * along + body.width * across)
    return half
