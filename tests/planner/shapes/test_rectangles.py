import math

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from scipy.optimize import lsq_linear

from planner.errors import InvalidInputError
from planner.shapes.rectangles import (
    CONTACT_TOLERANCE,
    Rectangle,
    Rectangles,
    corners,
    distance,
    distances,
    swept_contacts,
)

CAR = Rectangle(0.0, 0.0, 0.0, 4.8, 1.9)
COLUMNS = ("x", "y", "heading", "length", "width", "radius")

bodies = st.builds(
    Rectangle,
    x=st.floats(-8, 8),
    y=st.floats(-8, 8),
    heading=st.floats(-7, 7),
    length=st.floats(0, 8),
    width=st.floats(0, 3),
    radius=st.sampled_from([0.0, 0.0, 0.5, 2.0]),
)
poses = st.tuples(st.floats(-12, 12), st.floats(-12, 12), st.floats(-4, 4))


def many(*rectangles):
    return Rectangles(*([getattr(r, c) for r in rectangles] for c in COLUMNS))


def at_pose(body, pose):
    return Rectangle(*pose, body.length, body.width, body.radius)


def by_optimisation(a, b):
    """Least distance of a point of a and a point of b: bounded linear least squares."""

    def half_axes(body):
        cos, sin = math.cos(body.heading), math.sin(body.heading)
        along = 0.5 * body.length * np.array([cos, sin])
        return np.stack([along, 0.5 * body.width * np.array([-sin, cos])], axis=1)

    matrix = np.hstack([half_axes(a), -half_axes(b)])
    apart = np.array([b.x - a.x, b.y - a.y])
    found = lsq_linear(matrix, apart, bounds=(-1.0, 1.0), method="bvls", tol=1e-14)
    return max(math.sqrt(2.0 * found.cost) - a.radius - b.radius, 0.0)


def test_known_distances():
    others = many(
        Rectangle(10.0, 0.0, 0.0, 4.8, 1.9),
        Rectangle(0.0, 3.5, math.pi, 4.8, 1.9),
        Rectangle(5.4, 4.95, 0.0, 0.0, 0.0, 1.0),
        Rectangle(0.0, 5.0, math.pi / 2, 6.0, 2.0),
        Rectangle(0.5, 0.3, 0.7, 4.0, 2.0),
    )
    np.testing.assert_allclose(
        distances(CAR, others), [5.2, 1.6, 4.0, 1.05, 0.0], atol=1e-12
    )


def test_a_cross_without_a_corner_inside_overlaps():
    assert distance(Rectangle(0, 0, 0, 10, 1), Rectangle(0, 0, math.pi / 2, 10, 1)) == 0


def test_touching_bodies_overlap():
    assert distance(CAR, Rectangle(4.8, 0.0, 0.0, 4.8, 1.9)) == 0.0
    assert distance(CAR, Rectangle(4.8 + 1e-9, 0.0, 0.0, 4.8, 1.9)) > 0.0


@settings(max_examples=150, deadline=None)
@given(a=bodies, b=bodies)
@example(a=Rectangle(0, 2, 2.0, 5, 2, 0), b=Rectangle(6.25, 2, -1.34375, 4, 2, 0))
def test_distance_matches_an_optimiser(a, b):
    assert distance(a, b) == pytest.approx(by_optimisation(a, b), abs=1e-7)


@settings(max_examples=100, deadline=None)
@given(a=bodies, b=bodies, pose=poses)
def test_distance_is_symmetric_and_invariant(a, b, pose):
    x, y, angle = pose
    cos, sin = math.cos(angle), math.sin(angle)

    def moved(r):
        place = (x + cos * r.x - sin * r.y, y + sin * r.x + cos * r.y)
        return at_pose(r, (*place, r.heading + angle))

    def mirrored(r):
        return at_pose(r, (r.x, -r.y, -r.heading))

    here = distance(a, b)
    assert distance(b, a) == pytest.approx(here, abs=1e-12)
    assert distance(moved(a), moved(b)) == pytest.approx(here, abs=1e-9)
    assert distance(mirrored(a), mirrored(b)) == pytest.approx(here, abs=1e-12)


@settings(max_examples=80, deadline=None)
@given(one=bodies, others=st.lists(bodies, min_size=1, max_size=6))
def test_batch_equals_loop_of_singles(one, others):
    batch = many(*others)
    assert distances(one, batch).tolist() == [distance(one, b) for b in others]


@settings(max_examples=150, deadline=None)
@given(a=bodies, b=bodies, a_end=poses, b_end=poses)
def test_sweep_misses_nothing_and_invents_nothing(a, b, a_end, b_end):
    a_end, b_end = at_pose(a, a_end), at_pose(b, b_end)
    touched = bool(swept_contacts(a, a_end, many(b), many(b_end))[0])

    def between(start, end, t):
        turn = math.remainder(end.heading - start.heading, math.tau)
        return at_pose(
            start,
            (
                start.x + t * (end.x - start.x),
                start.y + t * (end.y - start.y),
                start.heading + t * turn,
            ),
        )

    times = np.linspace(0.0, 1.0, 401)
    gaps = [distance(between(a, a_end, t), between(b, b_end, t)) for t in times]
    if min(gaps) == 0.0:
        assert touched
    # between two samples the gap changes by no more than the relative motion
    relative = math.hypot(a_end.x - b_end.x - a.x + b.x, a_end.y - b_end.y - a.y + b.y)
    for start, end in ((a, a_end), (b, b_end)):
        turn = math.remainder(end.heading - start.heading, math.tau)
        relative += abs(turn) * 0.5 * math.hypot(start.length, start.width)
    if min(gaps) > relative / 800 + CONTACT_TOLERANCE:
        assert not touched


def test_fast_and_thin_bodies_do_not_slip_through():
    wall = Rectangle(0.0, 0.0, math.pi / 2, 6.0, 0.0)
    before = many(
        Rectangle(-50.0, 1.0, 0.0, 0.01, 0.01),
        Rectangle(-50.0, 3.1, 0.0, 0.01, 0.01),
        Rectangle(-50.0, -2.9, 0.0, 0.0, 0.0, 0.001),
    )
    after = many(
        Rectangle(50.0, 1.0, 0.0, 0.01, 0.01),
        Rectangle(50.0, 3.1, 0.0, 0.01, 0.01),
        Rectangle(50.0, -2.9, 0.0, 0.0, 0.0, 0.001),
    )
    assert swept_contacts(wall, wall, before, after).tolist() == [True, False, True]


def test_a_contact_at_the_very_end_counts():
    before, after = (
        many(Rectangle(14.8, 0, 0, 4.8, 1.9)),
        many(Rectangle(4.8, 0, 0, 4.8, 1.9)),
    )
    assert swept_contacts(CAR, CAR, before, after)[0]
    assert not swept_contacts(CAR, CAR, before, many(Rectangle(4.9, 0, 0, 4.8, 1.9)))[0]


def test_a_turning_body_sweeps_its_corner():
    before, after = Rectangle(0, 0, 3.0, 10.0, 1.0), Rectangle(0, 0, -3.0, 10.0, 1.0)
    posts = many(Rectangle(-4.8, 0.0, 0, 0, 0), Rectangle(4.8, 0.0, 0, 0, 0))
    # the shorter way from 3 to -3 rad leads over pi
    assert swept_contacts(before, after, posts, posts).tolist() == [True, True]
    aside = many(Rectangle(0.0, 4.0, 0, 0, 0))
    assert not swept_contacts(before, after, aside, aside)[0]


def test_vehicles_that_pass_in_their_lanes_do_not_touch():
    before = many(Rectangle(40.0, 3.5, math.pi, 4.8, 1.9))
    after = many(Rectangle(-40.0, 3.5, math.pi, 4.8, 1.9))
    end = Rectangle(30.0, 0.0, 0.0, 4.8, 1.9)
    assert not swept_contacts(CAR, end, before, after)[0]


def test_corners_lie_on_the_rectangle():
    batch = many(CAR, Rectangle(1.0, 2.0, math.pi / 2, 4.0, 2.0))
    expected = [[2.4, 0.95], [2.4, -0.95], [-2.4, -0.95], [-2.4, 0.95]]
    np.testing.assert_allclose(corners(batch)[0], expected)
    np.testing.assert_allclose(corners(CAR), expected)
    turned = [[0, 4], [2, 4], [2, 0], [0, 0]]
    np.testing.assert_allclose(corners(batch)[1], turned, atol=1e-12)


def test_no_bodies_give_no_distances():
    empty = Rectangles(*([] for _ in COLUMNS))
    assert distances(CAR, empty).shape == (0,)
    assert swept_contacts(CAR, CAR, empty, empty).shape == (0,)


@pytest.mark.parametrize(
    "make",
    [
        lambda: Rectangle(0, 0, 0, -1.0, 1.0),
        lambda: Rectangle(math.nan, 0, 0, 1.0, 1.0),
        lambda: Rectangles([0], [0], [0], [1], [1], [-0.1]),
        lambda: Rectangles([0, 1], [0], [0], [1], [1], [0]),
        lambda: swept_contacts(CAR, CAR, many(CAR), many(CAR, CAR)),
    ],
)
def test_bad_bodies_are_refused(make):
    with pytest.raises(InvalidInputError):
        make()
