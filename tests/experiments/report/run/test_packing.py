"""Columns packed into a page come back as they were, to their resolution."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from experiments.report.run.packing import pack, pack_counts, pack_exact
from tests.experiments.report.unpacking import unpack

NUMBERS = hnp.arrays(
    np.float64,
    st.integers(0, 40),
    elements=st.one_of(
        st.floats(-1e5, 1e5, allow_subnormal=False), st.just(float("nan"))
    ),
)


@given(values=NUMBERS, resolution=st.floats(1e-4, 10.0))
def test_numbers_come_back_to_their_resolution(values, resolution):
    back = unpack(pack(values, resolution))
    assert back.shape == values.shape
    np.testing.assert_array_equal(np.isnan(back), np.isnan(values))
    largest = np.nanmax(np.abs(values), initial=0.0)
    np.testing.assert_allclose(back, values, rtol=0, atol=resolution + 1e-7 * largest)


def test_the_ends_are_exact_and_nothing_stays_nothing():
    values = np.array([-3.25, np.nan, 100.5, np.inf])
    back = unpack(pack(values, 1.0))
    np.testing.assert_allclose(back[[0, 2]], [-3.25, 100.5], atol=1e-9)
    assert np.isnan(back[[1, 3]]).all()
    assert np.isnan(unpack(pack(np.full(3, np.nan), 0.1))).all()


def test_sixteen_bits_unless_they_are_too_coarse():
    values = np.linspace(0.0, 100.0, 50)
    assert "step" in pack(values, 0.01)
    assert "step" not in pack(values, 0.001)


@given(st.lists(st.integers(0, 2**32 - 1), max_size=30))
def test_counts_are_exact(counts):
    assert unpack(pack_counts(np.array(counts, dtype=np.int64))).tolist() == counts


def test_exact_ones_have_seven_digits():
    values = np.array([46882.3, 2.28, np.nan])
    np.testing.assert_allclose(unpack(pack_exact(values)), values, rtol=1e-7)
