"""Statistics against published examples, brute force and simulation."""

import math

import numpy as np
import pytest
from scipy import optimize, stats

from experiments.comparison import inference as st


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


@pytest.mark.parametrize("pairs", [8, 20, 100])
def test_interval_of_rates_leaves_out_zero_where_the_test_rejects(pairs):
    for gained in range(pairs // 2 + 1):
        for lost in range(pairs // 2 + 1):
            first = [True] * lost + [False] * (pairs - lost)
            second = (
                [False] * lost + [True] * gained + [False] * (pairs - lost - gained)
            )
            found = st.paired_rates(first, second)
            if found.p_value is None:
                assert gained == lost == 0
                continue
            inside = found.difference.low <= 0.0 <= found.difference.high
            assert inside == (found.p_value > 0.05), (gained, lost)


def test_equal_rates_are_rejected_as_often_as_the_level_says():
    """Exactly, over all counts of 40 pairs that do not depend on each other."""
    n = 40
    p_values = {
        (b, d - b): st.rates_p(b, d - b) for d in range(1, n + 1) for b in range(d + 1)
    }
    for rate in (0.02, 0.1, 0.3, 0.5):
        discordant = stats.binom.pmf(np.arange(n + 1), n, 2.0 * rate * (1.0 - rate))
        for level in (0.05, 0.005, 0.0005):
            wrong = sum(
                discordant[b + c] * math.comb(b + c, b) * 0.5 ** (b + c)
                for (b, c), p_value in p_values.items()
                if p_value <= level
            )
            assert wrong <= level


def test_rule_of_three():
    assert st.rule_of_three(100) == pytest.approx(0.0295, abs=5e-5)  # about 3 / n
    assert (1.0 - st.rule_of_three(7)) ** 7 == pytest.approx(0.05)


def test_holm_as_published():
    """Wikipedia, Holm-Bonferroni method: at 5 % the first and the fourth stand."""
    assert st.holm([0.01, 0.04, 0.03, 0.005]) == pytest.approx([0.03, 0.06, 0.06, 0.02])
    assert st.holm([]) == []
    assert st.holm([0.9, 0.8]) == [1.0, 1.0]


@pytest.mark.parametrize(("effect", "pairs"), [(0.2, 199), (0.5, 34), (0.8, 15)])
def test_seeds_as_gpower(effect, pairs):
    """G*Power 3.1, paired t test, two-sided 5 %, power 0.8."""
    assert st.seeds_for_difference(effect) == pairs
    assert st.seeds_for_difference(-effect) == st.seeds_for_difference(effect)


def test_very_large_effect_needs_few_seeds():
    assert st.seeds_for_difference(1e3) == 2


def test_tiny_effect_needs_many_seeds():
    """Beyond what can be counted pair by pair: (z / effect)²."""
    z = 1.959964 + 0.841621
    for effect in (0.03, 0.003, 1e-9):
        expected = (z / effect) ** 2
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
    found = stats.ttest_1samp(rng.normal(effect, 1.0, (3000, n)), 0.0, axis=1).pvalue
    assert np.mean(found < 0.05) == pytest.approx(0.8, abs=0.02)


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
