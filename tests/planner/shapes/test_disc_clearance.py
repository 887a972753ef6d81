import math

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from planner.shapes.disc_clearance import (
    gaps_to,
    segment_to_rectangle,
)

coordinate = st.floats(-8.0, 8.0)
half = st.one_of(st.just(0.0), st.floats(0.05, 4.0))
DISCS = np.array([-0.2, 1.4, 3.0])
RADIUS = 1.24


def outside(u, w, half_length, half_width):
    """Distance of points from an upright box, by clamping them into it."""
    nearest_u = np.clip(u, -half_length, half_length)
    nearest_w = np.clip(w, -half_width, half_width)
    return np.hypot(u - nearest_u, w - nearest_w)


@given(coordinate, coordinate, coordinate, coordinate, half, half)
def test_segment_to_rectangle_against_dense_sampling(u0, w0, u1, w1, a, b):
    share = np.linspace(0.0, 1.0, 4001)
    sampled = outside(u0 + share * (u1 - u0), w0 + share * (w1 - w0), a, b).min()
    spacing = math.hypot(u1 - u0, w1 - w0) / 4000.0
    exact = segment_to_rectangle(u0, w0, u1, w1, a, b)
    assert exact <= sampled + 1e-9
    assert exact >= sampled - spacing - 1e-9


def test_segment_through_a_rectangle_without_an_end_inside_touches_it():
    assert segment_to_rectangle(-9.0, 0.3, 9.0, -0.2, 0.05, 2.0) == 0.0


@given(coordinate, coordinate, coordinate, coordinate, half, half)
def test_segment_to_rectangle_does_not_depend_on_the_direction(u0, w0, u1, w1, a, b):
    forth = segment_to_rectangle(u0, w0, u1, w1, a, b)
    back = segment_to_rectangle(u1, w1, u0, w0, a, b)
    assert math.isclose(forth, back, abs_tol=1e-9)


def random_motion(rng, n_steps):
    """An ego on a gently turning path, (4, n_steps), 0.1 s a step."""
    speed = rng.uniform(0.0, 14.0)
    heading = rng.uniform(-math.pi, math.pi) + np.cumsum(
        np.full(n_steps, rng.uniform(-0.03, 0.03))
    )
    x = np.cumsum(0.1 * speed * np.cos(heading))
    y = np.cumsum(0.1 * speed * np.sin(heading))
    return np.stack([x, y, np.cos(heading), np.sin(heading)]), heading


def random_bodies(rng, points, n_bodies):
    """Bodies that come near `points`, some moving and turning: poses, headings."""
    n_steps = points.shape[1]
    poses = np.empty((n_bodies, 4, n_steps))
    headings = np.empty((n_bodies, n_steps))
    for b in range(n_bodies):
        meet = rng.integers(n_steps)
        speed = rng.choice([0.0, rng.uniform(0.0, 15.0)])
        turn = rng.choice([0.0, rng.uniform(-0.03, 0.03)])
        headings[b] = rng.uniform(-math.pi, math.pi) + turn * np.arange(n_steps)
        x = np.cumsum(0.1 * speed * np.cos(headings[b]))
        y = np.cumsum(0.1 * speed * np.sin(headings[b]))
        poses[b, 0] = x - x[meet] + points[0, meet] + rng.uniform(-8.0, 8.0)
        poses[b, 1] = y - y[meet] + points[1, meet] + rng.uniform(-8.0, 8.0)
        poses[b, 2], poses[b, 3] = np.cos(headings[b]), np.sin(headings[b])
    extents = rng.uniform(0.0, 3.0, (n_bodies, 3))
    extents[rng.random(n_bodies) < 0.4, :2] = 0.0  # discs
    extents[rng.random(n_bodies) < 0.4, 2] = 0.0  # plain rectangles
    return poses, headings, extents


def sampled_gap(points, heading, poses, body_heading, extents, n_between=40):
    """Smallest gap at `n_between` times a step; poses linear in time."""
    steps = points.shape[1] - 1
    t = np.linspace(0.0, steps, n_between * steps + 1)
    k = np.arange(steps + 1)

    def at(row):
        return np.interp(t, k, row)

    own, other = at(heading), at(body_heading)
    gaps = []
    for disc in DISCS:
        dx = at(points[0]) + disc * np.cos(own) - at(poses[0])
        dy = at(points[1]) + disc * np.sin(own) - at(poses[1])
        u = dx * np.cos(other) + dy * np.sin(other)
        w = dy * np.cos(other) - dx * np.sin(other)
        gaps.append(outside(u, w, extents[0], extents[1]) - extents[2] - RADIUS)
    return np.array(gaps).min()


@given(st.integers(0, 2**32 - 1))
@settings(max_examples=60)
def test_gaps_to_against_fine_time_sampling(seed):
    rng = np.random.default_rng(seed)
    points, heading = random_motion(rng, 21)
    poses, headings, extents = random_bodies(rng, points, 5)
    gaps = gaps_to(points, poses, extents, DISCS, RADIUS)
    for b in range(5):
        sampled = sampled_gap(points, heading, poses[b], headings[b], extents[b])
        # In the turning body's frame the way between two steps is not quite straight;
        # 40 samples of a relative speed of 29 m/s are 0.07 m apart.
        assert gaps[b] <= sampled + 0.025
        assert gaps[b] >= sampled - 0.05


@given(st.integers(0, 2**32 - 1), st.floats(0.4, 3.0))
@settings(max_examples=60)
def test_gaps_are_exact_below_the_cutoff(seed, cutoff_gap):
    rng = np.random.default_rng(seed)
    points, _ = random_motion(rng, 31)
    poses, _, extents = random_bodies(rng, points, 4)
    exact = gaps_to(points, poses, extents, DISCS, RADIUS)
    gaps = gaps_to(points, poses, extents, DISCS, RADIUS, cutoff_gap)
    near = exact < cutoff_gap
    np.testing.assert_allclose(gaps[near], exact[near], atol=1e-9)
    assert np.all(gaps[~near] >= cutoff_gap - 1e-9)


def test_a_body_that_jumps_through_the_ego_in_one_step_is_seen():
    points = np.array([[0.0, 0.0], [0.0, 0.0], [1.0, 1.0], [0.0, 0.0]])
    poses = np.array([[[1.4, 1.4], [-6.0, 6.0], [0.0, 0.0], [1.0, 1.0]]])
    extents = np.array([[0.5, 0.2, 0.0]])
    assert gaps_to(points, poses, extents, DISCS, RADIUS)[0] < 0.0


def test_gaps_of_a_single_moment():
    points = np.array([[0.0], [0.0], [1.0], [0.0]])
    poses = np.zeros((2, 4, 5))
    poses[0, 0], poses[1, 1] = 10.0, 3.0
    poses[:, 2] = 1.0
    extents = np.array([[0.0, 0.0, 1.0], [2.4, 1.0, 0.0]])
    gaps = gaps_to(points, poses, extents, DISCS, RADIUS)
    np.testing.assert_allclose(gaps, [10.0 - 3.0 - 1.0 - RADIUS, 2.0 - RADIUS])
