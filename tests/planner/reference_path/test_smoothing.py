import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planner.errors import InvalidInputError
from planner.reference_path.path import ReferencePath
from planner.reference_path.smoothing import smooth_polyline


def turn_polyline(radius, angle, leg=60.0, spacing=1.0):
    """Line, arc to the left, line; vertices on the true curve."""
    n = max(2, math.ceil(radius * angle / spacing))
    turn = np.linspace(0.0, angle, n + 1)
    curve = np.stack(
        [leg + radius * np.sin(turn), radius - radius * np.cos(turn)], axis=1
    )
    along = np.arange(0.0, leg, spacing)
    first = np.stack([along, np.zeros_like(along)], axis=1)
    direction = np.array([math.cos(angle), math.sin(angle)])
    last = curve[-1] + np.arange(spacing, leg, spacing)[:, None] * direction
    return np.concatenate([first, curve, last])


def distance_to_polyline(points, polyline):
    """Brute force: the least distance of each point from all segments."""
    a, b = polyline[:-1], polyline[1:]
    along = b - a
    share = ((points[:, None] - a) * along).sum(-1) / (along**2).sum(-1)
    foot = a + np.clip(share, 0.0, 1.0)[..., None] * along
    return np.linalg.norm(points[:, None] - foot, axis=-1).min(axis=1)


def test_straight_stays_straight():
    points = [(2e4, 1e4), (2e4 + 30, 1e4 + 40), (2e4 + 30, 1e4 + 40), (20060, 10080)]
    path = ReferencePath.from_polyline(points)
    assert path.length == pytest.approx(100.0, abs=1e-9)
    assert np.abs(path.curvature).max() < 1e-8
    np.testing.assert_allclose(path.heading, math.atan2(4, 3), atol=1e-8)


def test_clean_arc_keeps_its_curvature():
    path = ReferencePath.from_polyline(turn_polyline(15.0, math.pi / 2))
    assert smooth_polyline(turn_polyline(15.0, math.pi / 2), 0.1)[1] < 0.05
    assert np.abs(path.curvature).max() * 15.0 == pytest.approx(1.0, abs=0.07)
    middle = path.at(0.5 * path.length)
    assert float(middle.curvature) * 15.0 == pytest.approx(1.0, abs=0.03)
    assert path.heading[-1] == pytest.approx(math.pi / 2, abs=2e-3)


def test_arc_without_ends_keeps_its_curvature_everywhere():
    turn = np.linspace(0.0, math.pi, 48)
    points = 15.0 * np.stack([np.cos(turn), np.sin(turn)], axis=1)
    path = ReferencePath.from_polyline(points)
    np.testing.assert_allclose(path.curvature * 15.0, 1.0, atol=0.07)
    np.testing.assert_allclose(path.curvature[20:-20] * 15.0, 1.0, atol=0.01)
    assert path.heading[0] == pytest.approx(math.pi / 2, abs=0.05)


@pytest.mark.parametrize("degrees", [5, 15, 30, -30])
@pytest.mark.parametrize("bound", [0.05, 0.1, 0.3])
def test_corner_is_rounded_within_the_bound(degrees, bound):
    angle = math.radians(degrees)
    polyline = np.array(
        [[0, 0], [40, 0], [40 + 40 * math.cos(angle), 40 * math.sin(angle)]]
    )
    path = ReferencePath.from_polyline(polyline, max_deviation=bound)
    deviation = smooth_polyline(polyline, bound)[1]
    assert deviation <= bound
    points = path.at(np.linspace(0.0, path.length, 2000))
    gaps = distance_to_polyline(np.stack([points.x, points.y], axis=1), polyline)
    assert gaps.max() <= bound
    # the corner itself is what is cut most
    _, l = path.project_one(40.0, 0.0)
    assert abs(l) <= deviation + 1e-9


def test_only_the_corner_pays_for_the_corner():
    gentle = turn_polyline(40.0, 0.6)
    sharp = gentle[-1] + np.array([[10.0, 0.0], [20.0, 0.0]]) @ np.eye(2)
    alone = ReferencePath.from_polyline(gentle)
    joined = ReferencePath.from_polyline(np.concatenate([gentle, sharp]))
    before = np.linspace(0.0, 120.0, 300)
    np.testing.assert_allclose(
        joined.at(before).curvature, alone.at(before).curvature, atol=1e-3
    )


def test_curvature_integrates_to_the_shape():
    path = ReferencePath.from_polyline(turn_polyline(12.0, 2.0))
    ends = np.array([path.x[-1], path.y[-1]])
    np.testing.assert_allclose(ends, turn_polyline(12.0, 2.0)[-1], atol=5e-3)
    turned = np.trapezoid(path.curvature, path.s)
    assert turned == pytest.approx(path.heading[-1] - path.heading[0], abs=1e-9)


@settings(max_examples=25, deadline=None)
@given(
    angle=st.floats(-math.pi, math.pi),
    x=st.floats(-1e3, 1e3),
    y=st.floats(-1e3, 1e3),
)
def test_smoothing_does_not_depend_on_the_pose(angle, x, y):
    polyline = turn_polyline(20.0, 1.0, leg=20.0, spacing=3.0)
    cos, sin = math.cos(angle), math.sin(angle)
    moved = polyline @ np.array([[cos, sin], [-sin, cos]]) + np.array([x, y])
    path, other = (ReferencePath.from_polyline(p) for p in (polyline, moved))
    np.testing.assert_allclose(other.curvature, path.curvature, atol=1e-6)
    mirrored = ReferencePath.from_polyline(polyline * np.array([1.0, -1.0]))
    np.testing.assert_allclose(mirrored.curvature, -path.curvature, atol=1e-9)


@settings(max_examples=30, deadline=None)
@given(
    steps=st.lists(
        st.tuples(st.floats(0.1, 50.0), st.floats(-0.35, 0.35)),
        min_size=1,
        max_size=12,
    )
)
def test_any_lane_like_polyline_is_met(steps):
    lengths, turns = np.array(steps).T
    headings = np.cumsum(turns)
    moves = lengths[:, None] * np.stack([np.cos(headings), np.sin(headings)], axis=1)
    polyline = np.concatenate([[[0.0, 0.0]], np.cumsum(moves, axis=0)])
    path = ReferencePath.from_polyline(polyline)
    assert 0.0 <= smooth_polyline(polyline, 0.1)[1] <= 0.10
    assert path.length == pytest.approx(lengths.sum(), rel=0.02, abs=0.1)
    assert np.isfinite(path.curvature).all()


@pytest.mark.parametrize(
    ("points", "message"),
    [
        ([(0, 0)], "two distinct points, got 1"),
        ([(1, 1), (1, 1), (1, 1)], "two distinct points, got 1"),
        ([(0, 0), (np.nan, 1)], "point 1 is not finite"),
        ([0, 1, 2], "must be"),
        ([(0, 0), (50, 0), (10, 0.01)], r"turns back at \(4"),
    ],
)
def test_bad_polylines_are_refused(points, message):
    with pytest.raises(InvalidInputError, match=message):
        ReferencePath.from_polyline(points)


def test_a_bound_that_cannot_be_met_names_the_place():
    with pytest.raises(InvalidInputError, match=r"0\.001 m .* at \(20\.\d+, "):
        ReferencePath.from_polyline([(0, 0), (20, 0), (20, 20)], max_deviation=0.001)
