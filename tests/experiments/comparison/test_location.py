"""Intervals and tests of means and medians: the same question, asked twice."""

import math

import numpy as np
import pytest
from scipy import stats

from experiments.comparison import calibration, location

# Darwin's maize, cross- minus self-fertilised; Fisher 1935, table 3
DARWIN = [6, 8, 14, 16, 23, 24, 28, 29, 41, -48, 49, 56, 60, -67, 75]


def test_mean_as_published():
    """Fisher 1935: mean 20.933, t = 2.148, 0.0497 by his t."""
    found = location.mean(DARWIN)
    assert found.interval.value == pytest.approx(20.9333, abs=1e-4)
    assert found.p_value >= 0.0497
    assert found.interval.low <= 0.03
    assert found.interval.high >= 41.83


def test_interval_is_at_least_that_of_t():
    rng = np.random.default_rng(1)
    for n in (6, 15, 80):
        data = rng.exponential(1.0, n)
        ends = stats.t.interval(0.95, n - 1, data.mean(), stats.sem(data))
        found = location.mean(data)
        assert found.interval.low <= ends[0] + 1e-12
        assert found.interval.high >= ends[1] - 1e-12
        assert found.interval.high > ends[1] + 0.01  # long tail to the right
        assert found.p_value >= stats.ttest_1samp(data, 0.0).pvalue


def test_resampled_t_values_are_those_of_resampled_data():
    """As scipy's bootstrap would: each resample's t, from the counts of its values."""
    data = np.random.default_rng(2).exponential(1.0, (1, 9))
    rows = location.studentise(data, 50)
    shares = location._resampled_shares(9, 50)
    expected = []
    for share in shares:
        drawn = np.repeat(data[0], np.round(share * 9).astype(int))
        expected.append((drawn.mean() - data.mean()) / stats.sem(drawn))
    assert rows.resampled[0] == pytest.approx(np.sort(expected))


@pytest.mark.parametrize("n", [6, 10, 33])
@pytest.mark.parametrize("name", calibration.SHAPES)
def test_p_and_interval_agree(n, name, monkeypatch):
    monkeypatch.setattr(location, "RESAMPLES", 999)
    monkeypatch.setattr(location, "TAIL_RESAMPLES", 9_999)
    rng = np.random.default_rng(n)
    for shift in np.linspace(-1.5, 1.5, 16):
        data = calibration.SHAPES[name].draw(rng, (n,)) + shift
        for located in (location.mean(data), location.median(data)):
            if located.p_value is None:
                assert not located.interval.known
                continue
            inside = located.interval.low <= 0.0 <= located.interval.high
            assert inside == (located.p_value > 0.05 - 1e-12) or math.isclose(
                located.p_value, 0.05
            )


def test_small_p_values_are_raised_by_more_for_fewer_values():
    assert location.raised(0.3, 10) == 0.3
    assert location.raised(0.04, 10) == pytest.approx(0.05)
    assert location.raised(0.001, 10) == pytest.approx(0.007)
    assert location.raised(0.001, 1000) == pytest.approx(0.00106)


def test_few_or_equal_values_are_not_tested():
    for data in ([1.0, 2.0, 3.0], [0.0] * 20, [2.5] * 20):
        for located in (location.mean(data), location.median(data)):
            assert located.p_value is None
            assert not located.interval.known
            assert located.interval.value == np.mean(data)


def test_many_values_are_those_of_t():
    data = np.random.default_rng(3).normal(5.0, 2.0, location.MANY)
    found = location.mean(data).interval
    ends = stats.t.interval(0.95, data.size - 1, data.mean(), stats.sem(data))
    assert (found.low, found.high) == pytest.approx(ends)


def test_median_by_order_statistics():
    """Conover 1999, table A3: of 20 values the 6th and the 15th, 95.9 %."""
    found = location.median(np.arange(1.0, 21.0))
    assert (found.interval.low, found.interval.high) == (6.0, 15.0)
    assert found.p_value == pytest.approx(2.0 * 0.5**20)


def test_zeros_speak_for_no_difference():
    assert location.median([0.0] * 10 + [1.0] * 10).p_value == 1.0
    assert location.median([-1.0] + [1.0] * 19).p_value == pytest.approx(
        stats.binomtest(1, 20).pvalue
    )


COVERED = ("normal", "skewed", "tied", "zero-inflated")


@pytest.mark.slow
@pytest.mark.parametrize("name", COVERED)
@pytest.mark.parametrize("pairs", calibration.PAIRS)
def test_intervals_cover(name, pairs):
    found = calibration.coverage(name, pairs)
    assert found.printed > 0.99
    # with ten pairs, ties and zeros make the interval longer than it had to be
    longer = 0.01 if pairs == 10 else 0.0
    assert 0.935 <= found.covered <= 0.965 + longer


@pytest.mark.slow
@pytest.mark.parametrize("pairs", [10, 30])
def test_claims_without_a_difference_rarely_have_a_finding(pairs):
    """500 of the 2,000 repetitions of the results page."""
    assert calibration.claim_error(pairs, calibration.CLAIMED, 3, 6, 500) <= 0.05
