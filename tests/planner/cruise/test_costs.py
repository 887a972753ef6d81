import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planner.cruise.costs import (
    convolve,
    edge_clearance,
    gaussian_kernel,
    headway_lack,
    safety_kernel,
    size_kernel,
    speed_deviation,
)
from planner.cruise.settings import SafetyTerm

step = st.floats(0.1, 1.0)
sigma = st.floats(0.4, 4.0)
gap = st.floats(-5.0, 5.0)
positive = st.floats(0.1, 5.0)


@pytest.mark.parametrize("kernel", [size_kernel, gaussian_kernel])
@given(step=step, sigma=sigma)
def test_kernels_are_positive_symmetric_and_fall_from_the_centre(kernel, step, sigma):
    f = kernel(step, sigma)
    half = f.size // 2
    assert f.size % 2 == 1
    assert np.all(f >= 0.0)
    np.testing.assert_allclose(f, f[::-1], atol=1e-15)
    assert np.all(np.diff(f[half:]) < 0.0)
    assert math.isclose(f.sum(), 1.0, rel_tol=1e-12)


@given(step, st.integers(1, 8))
def test_the_size_kernel_is_zero_at_its_edge(step, n):
    sigma = n * step * (1.0 + 1e-12) / math.sqrt(3.0)
    f = size_kernel(step, sigma)
    assert f.size == 2 * n + 1
    assert abs(f[0]) < 1e-9 * f[n]


def test_the_size_kernel_has_the_shape_of_equation_4_18():
    step, sigma = 0.5, 1.0
    f = size_kernel(step, sigma)
    x = step * np.arange(-3, 4)  # sqrt(3) = 1.73 m
    g = np.exp(-0.5 * x**2 / sigma**2) * (sigma**2 - x**2) / sigma**4
    fine = np.linspace(-9.0, 9.0, 180_001)
    least = np.min(np.exp(-0.5 * fine**2) * (1.0 - fine**2))
    expected = (g - least) / (g - least).sum()
    np.testing.assert_allclose(f, expected, atol=1e-8)


def convolved_safety(sizes, term, step, sigma):
    binary = term is SafetyTerm.BINARY_CONVOLUTION
    return convolve(sizes, safety_kernel(term, step, sigma), binary)


@pytest.mark.parametrize(
    "term", [SafetyTerm.SIZE_CONVOLUTION, SafetyTerm.BINARY_CONVOLUTION]
)
@given(seed=st.integers(0, 2**32 - 1), sigma=st.floats(0.5, 3.0))
@settings(max_examples=30)
def test_convolved_safety_against_a_double_loop(term, seed, sigma):
    rng = np.random.default_rng(seed)
    sizes = rng.uniform(0.3, 2.0, (4, 21)) * (rng.random((4, 21)) < 0.3)
    binary = term is SafetyTerm.BINARY_CONVOLUTION
    f = gaussian_kernel(0.5, sigma) if binary else size_kernel(0.5, sigma)
    half = f.size // 2
    expected = np.zeros_like(sizes)
    for i in range(4):
        for j in range(21):
            for m in range(-half, half + 1):
                if 0 <= j - m < 21:
                    hit = float(sizes[i, j - m] > 0.0) if binary else sizes[i, j - m]
                    expected[i, j] += f[half + m] * hit
    found = convolved_safety(sizes, term, 0.5, sigma)
    np.testing.assert_allclose(found, expected, atol=1e-12)


def test_convolved_safety_of_nothing_is_zero():
    free = np.zeros((3, 21))
    assert not convolved_safety(free, SafetyTerm.SIZE_CONVOLUTION, 0.5, 1.0).any()


def test_only_the_size_kernel_knows_the_size():
    small, large = np.zeros((1, 21)), np.zeros((1, 21))
    small[0, 10], large[0, 10] = 0.5, 2.0
    size, binary = SafetyTerm.SIZE_CONVOLUTION, SafetyTerm.BINARY_CONVOLUTION
    np.testing.assert_allclose(
        convolved_safety(large, size, 0.5, 1.0),
        4.0 * convolved_safety(small, size, 0.5, 1.0),
    )
    np.testing.assert_array_equal(
        convolved_safety(large, binary, 0.5, 2.0),
        convolved_safety(small, binary, 0.5, 2.0),
    )


@given(gap, gap, positive, positive)
def test_edge_clearance_never_rises_with_the_gap(a, b, size, scale):
    near, far = (
        edge_clearance(min(a, b), size, scale),
        edge_clearance(max(a, b), size, scale),
    )
    assert near >= far >= 0.0


@given(gap, positive, positive, positive)
def test_edge_clearance_never_falls_with_the_size(gap, a, b, scale):
    small = edge_clearance(gap, min(a, b), scale)
    assert edge_clearance(gap, max(a, b), scale) >= small


def test_edge_clearance_between_contact_and_its_range():
    assert edge_clearance(0.0, 1.3, 1.5) == 1.3
    assert math.isclose(edge_clearance(0.75, 1.3, 1.5), 1.3 / 4.0)
    assert edge_clearance(1.5, 1.3, 1.5) == 0.0
    assert edge_clearance(-2.0, 1.3, 1.5) == 1.3


@given(gap, gap, positive)
def test_headway_lack_never_rises_with_the_gap(a, b, needed):
    near, far = headway_lack(min(a, b), needed), headway_lack(max(a, b), needed)
    assert 1.0 >= near >= far >= 0.0


@given(st.floats(0.0, 5.0), positive, positive)
def test_headway_lack_never_falls_with_what_is_needed(gap, a, b):
    assert headway_lack(gap, max(a, b)) >= headway_lack(gap, min(a, b))


def test_headway_lack_at_its_ends():
    assert headway_lack(0.0, 10.0) == 1.0
    assert headway_lack(5.0, 10.0) == 0.25
    assert headway_lack(10.0, 10.0) == 0.0


def test_speed_deviation_at_the_speed_asked_for_is_zero():
    grid, wanted = np.array([0.0, 50.0, 100.0]), np.array([10.0, 10.0, 4.0])
    s = np.array([np.linspace(0.0, 40.0, 9), np.full(9, 20.0), np.full(9, 75.0)])
    s_dot = np.array([np.full(9, 10.0), np.zeros(9), np.full(9, 7.0)])
    free, standing, slow = speed_deviation(s, s_dot, grid, wanted)
    assert abs(free) < 1e-15
    assert abs(slow) < 1e-15
    assert standing >= 1.0


def test_standing_costs_the_same_wherever_one_could_drive():
    grid, wanted = np.array([0.0, 100.0]), np.array([4.0, 14.0])
    s, still = np.repeat([[0.0], [50.0], [99.0]], 9, axis=1), np.zeros((3, 9))
    costs = speed_deviation(s, still, grid, wanted)
    np.testing.assert_allclose(costs, costs[0])


@given(st.floats(3.0, 20.0), st.floats(0.0, 1.0), st.floats(0.0, 1.0))
def test_speed_deviation_grows_with_the_distance_from_the_speed(wanted, a, b):
    grid, speeds = np.array([0.0, 100.0]), np.full(2, wanted)
    near, far = sorted((a, b))
    s = np.zeros((2, 5))
    for sign in (-1.0, 1.0):
        s_dot = wanted * (1.0 + sign * np.array([near, far]))[:, None] * np.ones(5)
        costs = speed_deviation(s, s_dot, grid, speeds)
        assert costs[0] <= costs[1] + 1e-12
