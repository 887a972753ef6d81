import math

import numpy as np
import pytest

from planner.reference_path.frenet import (
    cartesian_to_frenet,
    cartesian_to_frenet_one,
    frenet_to_cartesian,
    frenet_to_cartesian_one,
)
from planner.reference_path.path import ReferencePath
from planner.reference_path.segments import arc, clothoid, line
from planner.shapes.rectangles import Rectangle, Rectangles, distances, swept_contacts
from planner.states import CartesianState, FrenetState, FrenetStates

pytestmark = pytest.mark.bench

N = 20_000


@pytest.fixture(scope="module")
def path():
    """A road of 158 m with about 320 knots."""
    return ReferencePath.from_segments(
        [line(50.0), clothoid(20.0, 0.0, 0.05), arc(10 * math.pi, 0.05), line(57.0)]
    )


@pytest.fixture(scope="module")
def states(path):
    rng = np.random.default_rng(0)
    s, l = rng.uniform(0.0, path.length, N), rng.uniform(-10.0, 10.0, N)
    speed, slope = rng.uniform(0.0, 15.0, N), rng.uniform(-0.3, 0.3, N)
    zero = np.zeros(N)
    return FrenetStates(s, speed, zero, l, zero, zero, slope, zero)


@pytest.fixture(scope="module")
def plane(path, states):
    return frenet_to_cartesian(path, states)


def test_project(benchmark, path, plane):
    benchmark.extra_info["points"] = N
    s, _ = benchmark(path.project, plane.x, plane.y)
    assert s.shape == (N,)


def test_project_near(benchmark, path, plane, states):
    benchmark.extra_info["points"] = N
    s, _ = benchmark(path.project, plane.x, plane.y, states.s)
    np.testing.assert_allclose(s, states.s, atol=1e-9)


def test_project_one(benchmark, path, plane):
    x, y = float(plane.x[0]), float(plane.y[0])
    benchmark(path.project_one, x, y)


def test_at(benchmark, path, states):
    benchmark.extra_info["points"] = 2000
    assert benchmark(path.at, states.s[:2000]).x.shape == (2000,)


def test_cartesian_to_frenet(benchmark, path, plane):
    benchmark.extra_info["points"] = N
    benchmark(cartesian_to_frenet, path, plane)


def test_frenet_to_cartesian(benchmark, path, states):
    benchmark.extra_info["points"] = N
    benchmark(frenet_to_cartesian, path, states)


def test_cartesian_to_frenet_one(benchmark, path):
    state = CartesianState(30.0, 1.0, 0.1, 0.01, 8.0, 0.5)
    benchmark(cartesian_to_frenet_one, path, state, 29.0)


def test_frenet_to_cartesian_one(benchmark, path):
    state = FrenetState(80.0, 8.0, 0.1, 1.0, 0.0, 0.0, 0.05, 0.0)
    benchmark(frenet_to_cartesian_one, path, state)


def test_smoothing_of_a_route(benchmark):
    turn = np.linspace(0.0, 6 * math.pi, 600)
    polyline = np.stack([50.0 * turn, 40.0 * np.sin(turn)], axis=1)
    path = benchmark(ReferencePath.from_polyline, polyline)
    assert path.length > 6 * math.pi * 50.0


@pytest.fixture(scope="module")
def traffic():
    rng = np.random.default_rng(1)
    x, y, heading = rng.uniform(-60.0, 60.0, (3, 200))
    return Rectangles(x, y, heading, *(np.full(200, v) for v in (4.8, 1.9, 0.0)))


def test_distances(benchmark, traffic):
    benchmark.extra_info["bodies"] = 200
    benchmark(distances, Rectangle(0.0, 0.0, 0.3, 4.8, 1.9), traffic)


def test_swept_contacts(benchmark, traffic):
    benchmark.extra_info["bodies"] = 200
    before, after = Rectangle(0, 0, 0.3, 4.8, 1.9), Rectangle(2, 0, 0.35, 4.8, 1.9)
    benchmark(swept_contacts, before, after, traffic, traffic)
