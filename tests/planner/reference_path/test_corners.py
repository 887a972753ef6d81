"""Corners of a line are cut by no more than is allowed, and bend less for it."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from planner.reference_path.corners import HEIGHT, MOST_TURN, rounded_corners
from planner.reference_path.path import ReferencePath
from planner.reference_path.segments import arc, line

TURNS = st.floats(0.04, 0.24).flatmap(lambda x: st.sampled_from((x, -x)))
CUTS = st.floats(0.05, 0.6)


def legs(lengths, turns, spacing=1.0):
    """Points about `spacing` apart on legs that turn between each other."""
    points, heading = [np.zeros(2)], 0.0
    for k, length in enumerate(lengths):
        n = max(round(length / spacing), 1)
        way = np.array([np.cos(heading), np.sin(heading)])
        points += [points[-1] + way * length / n * j for j in range(1, n + 1)]
        heading += turns[k] if k < len(turns) else 0.0
    return np.array(points)


def distances(points, line_points):
    """Distance of each point from a polyline."""
    a, b = line_points[:-1], line_points[1:]
    side = b - a
    share = np.sum((points[:, None] - a) * side, axis=2) / np.sum(side**2, axis=1)
    foot = a + np.clip(share, 0.0, 1.0)[:, :, None] * side
    return np.hypot(*(points[:, None] - foot).T).min(axis=0)


def bend(points):
    path = ReferencePath.from_polyline(points)
    return float(np.abs(path.at(np.arange(0.0, path.length, 0.1)).curvature).max())


@given(
    st.lists(st.floats(5.0, 60.0), min_size=2, max_size=5),
    st.lists(TURNS, min_size=4, max_size=4),
    CUTS,
)
def test_points_leave_the_line_by_no_more_than_allowed(lengths, turns, cut):
    points = legs(lengths, turns[: len(lengths) - 1])
    moved = rounded_corners(points, np.full(len(points), cut))
    assert moved.shape == points.shape
    assert np.array_equal(moved[[0, -1]], points[[0, -1]])
    assert distances(moved, points).max() <= cut + 1e-9
    sides = np.diff(moved, axis=0)
    assert np.all(np.sum(sides[1:] * sides[:-1], axis=1) > 0.0)  # goes on


@given(TURNS, CUTS, st.floats(0.0, 6.3))
def test_it_knows_neither_place_nor_direction(turn, cut, angle):
    points = legs((30.0, 25.0), (turn,))
    most = np.full(len(points), cut)
    moved = rounded_corners(points, most)
    rotation = np.array(
        [[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]]
    )
    elsewhere = points @ rotation + (300.0, -20.0)
    expected = moved @ rotation + (300.0, -20.0)
    assert np.allclose(rounded_corners(elsewhere, most), expected, atol=1e-6)
    assert np.allclose(rounded_corners(points[::-1], most)[::-1], moved, atol=1e-9)
    mirror = np.array([1.0, -1.0])
    assert np.allclose(rounded_corners(points * mirror, most), moved * mirror)


@pytest.mark.parametrize("turn", [0.06, 0.18, -0.24])
@pytest.mark.parametrize("cluster", [0.0, 1.5])
def test_a_corner_bends_as_its_curve_says(turn, cluster):
    """Whether it is one point or a short curve, as netconvert draws a joint."""
    parts = 1 if cluster == 0.0 else 5
    points = np.concatenate(
        [
            legs((60.0,), ()),
            legs(
                (*[cluster / (parts - 1) if parts > 1 else 0.0] * (parts - 1), 60.0),
                [turn / parts] * (parts - 1),
            )[1:]
            @ np.array(
                [
                    [np.cos(turn / parts), np.sin(turn / parts)],
                    [-np.sin(turn / parts), np.cos(turn / parts)],
                ]
            )
            + (60.0, 0.0),
        ]
    )
    cut = 0.4
    moved = rounded_corners(points, np.full(len(points), cut))
    half = 0.5 * abs(turn)
    reach = min(cut / (HEIGHT * np.tan(half)), 0.5 * 60.0 * np.cos(half))
    assert bend(moved) == pytest.approx(1.5 * np.tan(half) / reach, rel=0.12)
    assert bend(moved) < 0.75 * bend(points)


def test_curves_and_turns_stay_as_they_are():
    curve = ReferencePath.from_segments([line(20.0), arc(40.0, 0.04), line(20.0)])
    at = curve.at(np.arange(0.0, 80.0, 1.0))
    points = np.column_stack([at.x, at.y])
    for kept in (points, legs((30.0, 30.0), (MOST_TURN + 0.01,)), legs((30.0,), ())):
        assert rounded_corners(kept, np.full(len(kept), 0.4)) is kept
    corner = legs((30.0, 30.0), (0.2,))
    assert rounded_corners(corner, np.zeros(len(corner))) is corner
