"""Statistics against published examples, brute force and simulation."""

import math
from itertools import product

import numpy as np
import pytest
from scipy import optimize, stats

from experiments.comparison import inference as st

# Darwin's maize, cross- minus self-fertilised; Fisher 1935, table 3
DARWIN = [6, 8, 14, 16, 23, 24, 28, 29, 41, -48, 49, 56, 60, -67, 75]
# Efron and Tibshirani 1993, table 14.1: spatial test data A
SPATIAL = [48, 36, 20, 29, 42, 42, 20, 42, 22, 41, 45, 14, 6]
SPATIAL += [0, 33, 28, 34, 4, 32, 24, 47, 41, 24, 26, 30, 41]


@pytest.mark.parametrize(
    ("successes", "trials", "low", "high"),
    [  # Newcombe 1998, Statist. Med. 17, 857, table I, method 3
        (81, 263, 0.2553, 0.3662),
        (15, 148, 0.0624, 0.1605),
        (0, 20, 0.0, 0.1611),
        (1, 29, 0.0061, 0.1718),
    ],
)
def test_wilson_as_published(successes, trials, low, high):
    interval = st.wilson(successes, trials)
    assert interval.value == successes / trials
    assert interval.low == pytest.approx(low, abs=5e-5)
    assert interval.high == pytest.approx(high, abs=5e-5)


def test_wilcoxon_as_published():
    """The example in the documentation of scipy.stats.wilcoxon: W = 24, exact."""
    assert st.wilcoxon(np.array(DARWIN, float)) == pytest.approx(0.041259765625)


@pytest.mark.parametrize("difference", [[1.5, 2.0, -0.5, 3.0], [1, -2, 3, 4, 5, 6.5]])
def test_wilcoxon_is_all_signs_tried(difference):
    difference = np.array(difference)
    ranks = stats.rankdata(np.abs(difference))
    middle = ranks.sum() / 2
    far = abs(ranks[difference > 0].sum() - middle)
    sums = [
        abs(ranks @ np.array(signs) - middle)
        for signs in product((0, 1), repeat=len(ranks))
    ]
    expected = np.mean(np.array(sums) >= far - 1e-9)
    assert st.wilcoxon(difference) == pytest.approx(expected)


def test_equal_pairs_are_no_difference():
    found = st.paired_difference([1.0, 2.0, 3.0], [1.0, 2.0, 3.0])
    assert (found.center.value, found.p_value) == (0.0, 1.0)
    assert found.effect is None


def test_effect_is_mean_over_spread():
    found = st.paired_difference(np.zeros(15), DARWIN)
    assert found.center.value == pytest.approx(20.9333, abs=1e-4)  # Fisher 1935
    assert found.effect * math.sqrt(15) == pytest.approx(2.148, abs=5e-4)  # his t
    assert found.center.low < 20.9333 < found.center.high
    middle = st.paired_difference(np.zeros(15), DARWIN, np.median)
    assert (middle.center.value, middle.effect) == (24.0, found.effect)
    assert middle.p_value == found.p_value


def test_bca_as_published():
    """Efron and Tibshirani 1993, table 14.2: 90 % of the variance, 2000 resamples."""
    found = st.bootstrap(SPATIAL, np.var, confidence=0.9)
    assert found.value == pytest.approx(171.5, abs=0.05)
    assert found.low == pytest.approx(115.8, abs=4.0)
    assert found.high == pytest.approx(259.6, abs=8.0)


def test_bootstrap_of_odd_data():
    assert st.bootstrap([3.0, 3.0, 3.0]) == st.Interval(3.0, 3.0, 3.0)
    single = st.bootstrap([3.0])
    assert (single.value, single.low, single.high) == (3.0, -math.inf, math.inf)
    median = st.bootstrap([1.0, 2.0, 2.0, 2.0, 2.0, 9.0], np.median)
    assert median.low <= 2.0 <= median.high


def test_bootstrap_of_many_is_the_normal_interval():
    data = np.random.default_rng(1).normal(5.0, 2.0, st.MANY)
    found = st.bootstrap(data)
    half = 1.96 * data.std(ddof=1) / math.sqrt(data.size)
    assert found.low == pytest.approx(data.mean() - half, abs=0.1 * half)
    assert found.high == pytest.approx(data.mean() + half, abs=0.1 * half)


@pytest.mark.parametrize(("b", "c"), [(1, 9), (5, 5), (0, 6), (12, 3), (0, 0)])
def test_mcnemar_is_all_outcomes_tried(b, c):
    n = b + c
    chance = [math.comb(n, k) / 2**n for k in range(n + 1)]
    as_far = sum(p for p in chance if p <= chance[b] * (1 + 1e-9))
    assert st.mcnemar(b, c) == pytest.approx(as_far)


@pytest.mark.parametrize(
    ("b", "c", "p"),
    [
        # Cavo 2012 in Fagerland, Lydersen and Laake, Statistical Analysis of
        # Contingency Tables, 2017, chapter 8; from the tests of their R package
        (6, 16, 0.052479),
        (11, 3, 0.05737304687500008),  # calcugator.com, chi2_mcnemar
    ],
)
def test_mcnemar_as_published(b, c, p):
    assert st.mcnemar(b, c) == pytest.approx(p, abs=5e-7)


def test_tango_as_published():
    """Cavo 2012, as above: -0.0621 (-0.1240 to -0.0054), 161 pairs."""
    interval = st.tango(6, 16, 161)
    assert interval.value == pytest.approx(-0.0621, abs=5e-5)
    assert interval.low == pytest.approx(-0.1240, abs=5e-5)
    assert interval.high == pytest.approx(-0.0054, abs=5e-5)


@pytest.mark.parametrize(("gained", "lost", "pairs"), [(8, 3, 40), (1, 6, 25)])
def test_tango_by_likelihood(gained, lost, pairs):
    """The ends are where the score test, its rates found by brute force, is at z."""
    interval = st.tango(gained, lost, pairs)
    for delta in (interval.low, interval.high):

        def unlikely(rate, delta=delta):
            more = rate + delta
            same = 1.0 - rate - more
            return -(
                gained * math.log(more)
                + lost * math.log(rate)
                + (pairs - gained - lost) * math.log(same)
            )

        low = max(0.0, -delta) + 1e-12
        high = (1.0 - delta) / 2.0 - 1e-12
        rate = optimize.minimize_scalar(
            unlikely, bounds=(low, high), method="bounded", options={"xatol": 1e-12}
        ).x
        variance = (2.0 * rate + delta - delta**2) * pairs
        score = (gained - lost - pairs * delta) / math.sqrt(variance)
        assert abs(score) == pytest.approx(1.959964, abs=1e-4)


def test_tango_without_any_difference_is_wilson():
    """With no discordant pair the score interval is that of z² / (n + z²)."""
    interval = st.tango(0, 0, 20)
    end = 1.959964**2 / (20 + 1.959964**2)
    assert interval.high == pytest.approx(end, abs=1e-5)
    assert interval.low == pytest.approx(-end, abs=1e-5)


def test_paired_rates_count_the_discordant_pairs():
    first = [True, True, False, False, True]
    second = [True, False, True, False, False]
    found = st.paired_rates(first, second)
    assert (found.only_first, found.only_second, found.pairs) == (2, 1, 5)
    assert found.difference.value == pytest.approx(-0.2)


def test_holm_as_published():
    """Wikipedia, Holm-Bonferroni method: at 5 % the first and the fourth stand."""
    assert st.holm([0.01, 0.04, 0.03, 0.005]) == pytest.approx([0.03, 0.06, 0.06, 0.02])
    assert st.holm([]) == []
    assert st.holm([0.9, 0.8]) == [1.0, 1.0]


@pytest.mark.parametrize(("effect", "pairs"), [(0.2, 199), (0.5, 34), (0.8, 15)])
def test_seeds_as_gpower(effect, pairs):
    """G*Power 3.1, paired t test, two-sided 5 %, power 0.8; then for Wilcoxon."""
    assert st.seeds_for_difference(effect) == math.ceil(pairs * math.pi / 3)
    assert st.seeds_for_difference(-effect) == st.seeds_for_difference(effect)


def test_very_large_effect_needs_few_seeds():
    assert st.seeds_for_difference(1e3) == 3


def test_tiny_effect_needs_many_seeds():
    """Beyond what can be counted pair by pair: (z / effect)², for Wilcoxon."""
    z = 1.959964 + 0.841621
    for effect in (0.03, 0.003, 1e-9):
        expected = (z / effect) ** 2 * math.pi / 3
        assert st.seeds_for_difference(effect) == pytest.approx(expected, rel=1e-3)


@pytest.mark.slow
def test_seeds_for_rates_give_the_power():
    """Simulated with the asymptotic test that Connor's formula is for."""
    gained, lost = 0.20, 0.08
    n = st.seeds_for_rates(gained, lost)
    rng = np.random.default_rng(3)
    b, c, _ = rng.multinomial(n, [lost, gained, 1 - lost - gained], 20_000).T
    z = np.abs(b - c) / np.sqrt(np.maximum(b + c, 1))
    assert np.mean(z > 1.959964) == pytest.approx(0.8, abs=0.02)


@pytest.mark.slow
def test_seeds_for_difference_give_the_power():
    effect = 0.5
    n = st.seeds_for_difference(effect)
    rng = np.random.default_rng(4)
    found = [st.wilcoxon(rng.normal(effect, 1.0, n)) < 0.05 for _ in range(3000)]
    assert 0.78 <= np.mean(found) <= 0.85


@pytest.mark.slow
@pytest.mark.parametrize("rate", [0.02, 0.3])
def test_wilson_covers(rate):
    n = 60
    chance = stats.binom.pmf(np.arange(n + 1), n, rate)
    intervals = [st.wilson(k, n) for k in range(n + 1)]
    covered = sum(
        p for p, i in zip(chance, intervals, strict=True) if i.low <= rate <= i.high
    )
    assert 0.92 <= covered <= 0.99


@pytest.mark.slow
def test_tango_covers():
    n, gained, lost = 50, 0.15, 0.05
    rng = np.random.default_rng(5)
    draws = rng.multinomial(n, [gained, lost, 1 - gained - lost], 4000)
    covered = [
        i.low <= gained - lost <= i.high
        for i in (st.tango(int(b), int(c), n) for b, c, _ in draws)
    ]
    assert 0.94 <= np.mean(covered) <= 0.97


@pytest.mark.slow
@pytest.mark.filterwarnings("error")
def test_wilcoxon_keeps_its_level():
    """Of equal planners one in twenty is told apart, with ties and zeros, too."""
    rng = np.random.default_rng(8)
    for n in (20, 60):  # up to 13 all signs are tried, which takes a second each
        data = np.round(rng.normal(0.0, 2.0, (2000, n)))
        found = np.mean([st.wilcoxon(row) < 0.05 for row in data])
        assert 0.03 <= found <= 0.06


@pytest.mark.slow
def test_median_bootstrap_covers(monkeypatch):
    """Percentile of a skewed median, 41 values."""
    monkeypatch.setattr(st, "RESAMPLES", 999)
    rng = np.random.default_rng(7)
    covered = [
        i.low <= 1.0 <= i.high
        for i in (
            st.bootstrap(rng.lognormal(0.0, 0.5, 41), np.median) for _ in range(1500)
        )
    ]
    assert 0.92 <= np.mean(covered) <= 0.98


@pytest.mark.slow
def test_bootstrap_covers(monkeypatch):
    """BCa of a skewed mean, 40 values: close to its level, as in the literature."""
    monkeypatch.setattr(st, "RESAMPLES", 999)
    rng = np.random.default_rng(6)
    truth = math.exp(0.125)
    covered = [
        i.low <= truth <= i.high
        for i in (st.bootstrap(rng.lognormal(0.0, 0.5, 40)) for _ in range(1500))
    ]
    assert 0.91 <= np.mean(covered) <= 0.97
