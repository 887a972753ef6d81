import math
import pickle

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.special import fresnel

from planner.errors import InvalidInputError
from planner.reference_path.linear_curvature import trace
from planner.reference_path.path import ReferencePath
from planner.reference_path.segments import Segment, SegmentKind, arc, clothoid, line

MIXED = [line(20.0), clothoid(15.0, 0.0, 0.1), arc(12.0, 0.1), clothoid(9.0, 0.1, -0.2)]


def brute_force_point(segments, s):
    """Position by adaptive quadrature of the heading, segment by segment."""
    x = y = heading = 0.0
    for part in segments:
        u = min(s, part.length)
        rate = (part.end_curvature - part.curvature) / part.length

        def turn(v, part=part, rate=rate, heading=heading):
            return heading + part.curvature * v + 0.5 * rate * v * v

        x += quad(lambda v: math.cos(turn(v)), 0.0, u, epsabs=1e-13, epsrel=1e-13)[0]
        y += quad(lambda v: math.sin(turn(v)), 0.0, u, epsabs=1e-13, epsrel=1e-13)[0]
        heading = turn(u)
        s -= u
        if s <= 0.0:
            break
    return x, y, heading


def test_line_is_exact():
    path = ReferencePath.from_segments([line(100.0)], start=(3.0, -2.0, 0.7))
    s = np.linspace(-20.0, 130.0, 301)
    points = path.at(s)
    np.testing.assert_allclose(points.x, 3.0 + s * math.cos(0.7), atol=1e-12)
    np.testing.assert_allclose(points.y, -2.0 + s * math.sin(0.7), atol=1e-12)
    assert np.all(points.curvature == 0.0)


@pytest.mark.parametrize("curvature", [0.5, -0.5, 0.05, 1e-9])
def test_arc_is_exact(curvature):
    path = ReferencePath.from_segments([arc(12.0, curvature)])
    s = np.linspace(0.0, 12.0, 1777)
    points = path.at(s)
    half = 0.5 * curvature * s
    chord = s * np.sinc(half / np.pi)
    np.testing.assert_allclose(points.x, chord * np.cos(half), atol=1e-12)
    np.testing.assert_allclose(points.y, chord * np.sin(half), atol=1e-12)
    np.testing.assert_allclose(points.heading, curvature * s, atol=1e-12)
    np.testing.assert_allclose(points.cos_heading, np.cos(curvature * s), atol=1e-12)
    np.testing.assert_allclose(points.sin_heading, np.sin(curvature * s), atol=1e-12)
    np.testing.assert_allclose(points.curvature, curvature, atol=1e-15)


@pytest.mark.parametrize("end", [0.5, -0.4])
def test_clothoid_matches_fresnel_integrals(end):
    path = ReferencePath.from_segments([clothoid(10.0, 0.0, end)])
    s = np.linspace(0.0, 10.0, 1009)
    scale = math.sqrt(math.pi * 10.0 / abs(end))
    across, along = fresnel(s / scale)
    points = path.at(s)
    np.testing.assert_allclose(points.x, scale * along, atol=1e-12)
    np.testing.assert_allclose(points.y, math.copysign(scale, end) * across, atol=1e-12)


@pytest.mark.parametrize("s", [7.3, 20.0, 31.41, 35.0, 40.02, 47.0, 55.999, 56.0])
def test_chain_matches_quadrature(s):
    path = ReferencePath.from_segments(MIXED)
    points = path.at(s)
    x, y, heading = brute_force_point(MIXED, s)
    assert points.x.shape == ()
    assert points.x == pytest.approx(x, abs=1e-11)
    assert points.y == pytest.approx(y, abs=1e-11)
    assert points.heading == pytest.approx(heading, abs=1e-12)


def test_derivatives_agree_with_finite_differences():
    path = ReferencePath.from_segments(MIXED)
    s = np.array([5.03, 24.1, 31.7, 40.3, 50.1])
    step = 1e-4
    before, here, after = path.at(s - step), path.at(s), path.at(s + step)
    np.testing.assert_allclose(
        (after.x - before.x) / (2 * step), here.cos_heading, atol=1e-8
    )
    np.testing.assert_allclose(
        (after.y - before.y) / (2 * step), here.sin_heading, atol=1e-8
    )
    np.testing.assert_allclose(
        (after.heading - before.heading) / (2 * step), here.curvature, atol=1e-8
    )
    np.testing.assert_allclose(
        (after.curvature - before.curvature) / (2 * step),
        here.curvature_rate,
        atol=1e-8,
    )


def test_path_goes_straight_on_beyond_both_ends():
    path = ReferencePath.from_segments([arc(10.0, 0.1)])
    points = path.at([-3.0, 13.0])
    np.testing.assert_array_equal(points.curvature, 0.0)
    np.testing.assert_allclose(points.x[0], -3.0)
    np.testing.assert_allclose(points.x[1], 10 * math.sin(1.0) + 3 * math.cos(1.0))
    np.testing.assert_allclose(points.y[1], 10 - 10 * math.cos(1.0) + 3 * math.sin(1.0))
    ends = path.at([0.0, path.length])
    np.testing.assert_allclose(ends.curvature, 0.1)


def test_at_keeps_the_shape_and_equals_single_evaluations():
    path = ReferencePath.from_segments(MIXED)
    s = np.random.default_rng(0).uniform(-5.0, 70.0, (4, 3, 5))
    points = path.at(s)
    assert points.curvature_rate.shape == (4, 3, 5)
    for index in np.ndindex(s.shape):
        one = path.at(s[index])
        assert (one.x, one.y) == (points.x[index], points.y[index])
        x, y, heading = path.pose(s[index])
        assert (x, y, heading) == (one.x, one.y, one.heading)


def test_knots_describe_the_path():
    path = ReferencePath.from_segments(MIXED, start=(1.0, 2.0, 3.0))
    points = path.at(path.s)
    np.testing.assert_allclose(points.x, path.x, atol=1e-12)
    np.testing.assert_allclose(points.heading, path.heading, atol=1e-12)
    assert path.length == pytest.approx(56.0)
    assert np.diff(path.s).max() <= 0.5 + 1e-12
    with pytest.raises(ValueError, match="read-only"):
        path.x[0] = 1.0


def test_path_survives_pickling():
    path = ReferencePath.from_segments(MIXED)
    copy = pickle.loads(pickle.dumps(path))
    np.testing.assert_array_equal(copy.at([3.0, 30.0]).x, path.at([3.0, 30.0]).x)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: ReferencePath.from_segments([]), "at least one segment"),
        (lambda: line(0.0), "length = 0.0"),
        (lambda: line(math.nan), "length = nan"),
        (lambda: Segment(SegmentKind.ARC, 1.0, math.inf, 0.0), "finite"),
        (lambda: ReferencePath.from_segments([line(1.0)], (0, math.nan, 0)), "start"),
    ],
)
def test_bad_segments_are_refused(make, message):
    with pytest.raises(InvalidInputError, match=message):
        make()


def test_tracing_gives_the_same_points_to_the_last_bit():
    """In any order, on knots, and beyond both ends."""
    path = ReferencePath.from_segments(
        [line(20.0), clothoid(15.0, 0.0, 0.05), arc(25.0, 0.05), line(10.0)]
    )
    rng = np.random.default_rng(0)
    anywhere = rng.uniform(-5.0, path.length + 5.0, 200)
    s = np.concatenate([anywhere, path.s, path.s[::-1]])
    out = np.empty((6, s.size))
    trace(path.table.knots, path.table.bins, s, out)
    at = path.at(s)
    for row, wanted in zip(
        out,
        (at.x, at.y, at.cos_heading, at.sin_heading, at.curvature, at.curvature_rate),
        strict=True,
    ):
        np.testing.assert_array_equal(row, wanted)
