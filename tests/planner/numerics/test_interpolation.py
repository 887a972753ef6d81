import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from planner.numerics.interpolation import interpolate
from planner.reference_path.linear_curvature import curvature_at, point_at
from planner.reference_path.path import ReferencePath
from planner.reference_path.segments import arc, clothoid, line


@given(st.integers(0, 2**32 - 1), st.integers(1, 6), st.floats(-3.0, 3.0))
def test_interpolation_is_that_of_numpy(seed, n_samples, shift):
    rng = np.random.default_rng(seed)
    samples = np.cumsum(rng.uniform(0.1, 4.0, n_samples))
    values = rng.uniform(-5.0, 5.0, n_samples)
    x = np.concatenate([np.cumsum(rng.uniform(-0.5, 2.0, 20)), samples - shift])
    out = np.empty(x.size)
    interpolate(x, shift, samples, values, out)
    np.testing.assert_allclose(out, np.interp(x + shift, samples, values), atol=1e-12)


@given(st.integers(0, 2**32 - 1), st.integers(2, 8))
def test_samples_that_repeat_are_jumps(seed, n_samples):
    rng = np.random.default_rng(seed)
    samples = np.cumsum(rng.integers(0, 2, n_samples) * rng.uniform(0.5, 2.0))
    values = rng.uniform(-5.0, 5.0, n_samples)
    x = np.sort(np.concatenate([rng.uniform(-1.0, 9.0, 20), samples, samples - 1e-14]))
    out = np.empty(x.size)
    interpolate(x, 0.0, samples, values, out)
    between = ~np.isin(x, samples) & (x > samples[0])
    expected = np.interp(x, samples, values)
    np.testing.assert_allclose(out[between], expected[between], atol=1e-9)
    assert ((out >= values.min() - 1e-12) & (out <= values.max() + 1e-12)).all()


@pytest.mark.parametrize("s", [-5.0, 0.0, 3.0, 10.0, 17.3, 29.9, 31.0, 45.0, 60.0])
def test_the_curvature_alone_is_that_of_the_point(s):
    path = ReferencePath.from_segments(
        [line(10.0), clothoid(20.0, 0.0, 0.05), arc(15.0, 0.05)]
    )
    knots, bins, _ = path.table
    assert curvature_at(knots, bins, s) == pytest.approx(point_at(knots, bins, s)[4])
