"""The compiled search on a path finds what numpy's interpolation does, bit by bit."""

import math

import numpy as np
import pytest

from planner.lane_change.place_on_path import place_on, rest_from
from planner.states import Path

COLUMNS = ("x", "y", "curvature", "s", "l")


def spiral(seed, n=60):
    """A path that turns more than once: its heading jumps by a full turn."""
    rng = np.random.default_rng(seed)
    distance = np.concatenate([[0.0], np.cumsum(rng.uniform(0.5, 1.5, n - 1))])
    angle = 0.2 * distance + rng.uniform(-3.0, 3.0)
    heading = np.arctan2(np.sin(angle), np.cos(angle))
    x, y = 5.0 * np.sin(angle), -5.0 * np.cos(angle)
    s = distance * 1.01 + 7.0
    return Path(distance, x, y, heading, np.full(n, 0.2), s, rng.normal(0.0, 1.0, n))


def place_by_numpy(path, s, x, y):
    place = float(np.interp(s, path.s, path.distance))
    for _ in range(2):
        at_x = float(np.interp(place, path.distance, path.x))
        at_y = float(np.interp(place, path.distance, path.y))
        angle = float(np.interp(place, path.distance, np.unwrap(path.heading)))
        place += (x - at_x) * math.cos(angle) + (y - at_y) * math.sin(angle)
    return min(max(place, 0.0), float(path.distance[-1]))


@pytest.mark.parametrize("seed", range(20))
def test_the_foot_point_is_that_of_numpy(seed):
    path, rng = spiral(seed), np.random.default_rng(100 + seed)
    k = int(rng.integers(0, path.x.size))
    x, y = path.x[k] + rng.normal(0.0, 0.1), path.y[k] + rng.normal(0.0, 0.1)
    s = float(path.s[k] + rng.normal(0.0, 2.0))
    place, (at_x, at_y) = place_on(path, s, float(x), float(y))
    assert place == place_by_numpy(path, s, x, y)
    assert at_x == np.interp(place, path.distance, path.x)
    assert at_y == np.interp(place, path.distance, path.y)


@pytest.mark.parametrize("seed", range(20))
def test_the_rest_is_that_of_numpy(seed):
    path = spiral(seed)
    place = float(np.random.default_rng(seed).uniform(0.0, 20.0))
    rest = rest_from(path, place)
    at = rest.distance + place
    for name in COLUMNS:
        column = np.interp(at, path.distance, getattr(path, name))
        np.testing.assert_array_equal(getattr(rest, name), column)
    heading = np.interp(at, path.distance, np.unwrap(path.heading))
    np.testing.assert_array_equal(rest.heading, heading)


def test_of_a_path_that_is_driven_hardly_anything_is_left():
    path = spiral(0)
    assert rest_from(path, float(path.distance[-1]) - 0.5) is None
