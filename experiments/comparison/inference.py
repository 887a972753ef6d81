"""Statistical inference about rates, families of tests, required numbers of seeds.

Means and medians are in `experiments.comparison.location`.

Sources: Wilson, JASA 22 (1927) 209. McNemar, Psychometrika 12 (1947) 153. Holm, Scand.
J. Statist. 6 (1979) 65. Hanley and Lippman-Hand, JAMA 249 (1983) 1743. Connor,
Biometrics 43 (1987) 207. Tango, Statist. Med. 17 (1998) 891.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy import optimize, stats

from experiments.comparison.location import CONFIDENCE, Interval

LEAST_PAIRS = 2
# From here on the normal approximation of the power is accurate to about 0.1 %.
MANY_PAIRS = 10_000


@dataclass(frozen=True, slots=True)
class PairedRates:
    """Difference of a rate between two planners on common seeds."""

    pairs: int
    difference: Interval  # second minus first
    only_first: int  # pairs in which the event occurred for the first only
    only_second: int
    p_value: float | None  # two-sided; None if no pair differs


def wilson(successes: int, trials: int, confidence: float = CONFIDENCE) -> Interval:
    """Estimate a rate with Wilson's score interval (Wilson 1927).

    Args:
        successes: Of the trials.
        trials: At least 1.
        confidence: Of the interval.

    Returns:
        The rate and its interval.
    """
    result = stats.binomtest(successes, trials)
    interval = result.proportion_ci(confidence, method="wilson")
    return Interval(successes / trials, float(interval.low), float(interval.high))


def rule_of_three(trials: int, confidence: float = CONFIDENCE) -> float:
    """Return the largest rate that n trials without an event leave likely.

    1 - (1 - confidence)^(1 / n), about 3 / n (Hanley and Lippman-Hand 1983).
    """
    return float(-np.expm1(np.log1p(-confidence) / trials))


def paired_rates(
    first: Sequence[bool], second: Sequence[bool], confidence: float = CONFIDENCE
) -> PairedRates:
    """Compare a rate on common seeds.

    Args:
        first: Of the baseline, one value a seed.
        second: Of the other planner, in the same order.
        confidence: Of the interval.

    Returns:
        Difference of the rates. It is 0 unless both Tango's score test and McNemar's
        exact test say otherwise: p is the larger of the two, and the interval is
        Tango's (1998), stretched to 0 where only the exact test holds it possible. The
        score test alone rejects up to 5.5 % of equal rates.
    """
    pairs = list(zip(first, second, strict=True))
    only_first = sum(1 for a, b in pairs if a and not b)
    only_second = sum(1 for a, b in pairs if b and not a)
    found = tango(only_second, only_first, len(pairs), confidence)
    p_value = None
    if only_first + only_second:
        p_value = rates_p(only_first, only_second)
        if p_value > 1.0 - confidence:
            low, high = min(found.low, 0.0), max(found.high, 0.0)
            found = Interval(found.value, low, high)
    return PairedRates(len(pairs), found, only_first, only_second, p_value)


def rates_p(only_first: int, only_second: int) -> float:
    """Return the larger p value of the score test and of McNemar's exact test."""
    apart = abs(only_first - only_second) / math.sqrt(only_first + only_second)
    return max(2.0 * float(stats.norm.sf(apart)), mcnemar(only_first, only_second))


def mcnemar(only_first: int, only_second: int) -> float:
    """Test two paired rates (McNemar 1947), exact and two-sided."""
    discordant = only_first + only_second
    if discordant == 0:
        return 1.0
    return float(stats.binomtest(only_first, discordant, 0.5).pvalue)


def tango(
    gained: int, lost: int, pairs: int, confidence: float = CONFIDENCE
) -> Interval:
    """Estimate the difference of two paired rates with Tango's score interval.

    Args:
        gained: Pairs in which it happened to the second only.
        lost: Pairs in which it happened to the first only.
        pairs: All.
        confidence: Of the interval.

    Returns:
        (gained - lost) / pairs and its interval.
    """
    value = (gained - lost) / pairs
    z = float(stats.norm.ppf(0.5 + confidence / 2.0))

    def score(delta: float) -> float:
        # restricted estimate of the rate of `lost`, Tango 1998, eq. 3
        a = 2.0 * pairs
        b = -gained - lost + (2.0 * pairs - gained + lost) * delta
        c = -lost * delta * (1.0 - delta)
        rate = (math.sqrt(max(b * b - 4.0 * a * c, 0.0)) - b) / (2.0 * a)
        variance = pairs * (2.0 * rate + delta * (1.0 - delta))
        return (gained - lost - pairs * delta) / math.sqrt(max(variance, 1e-300))

    low = _crossing(score, z, -1.0, value)
    high = _crossing(score, -z, value, 1.0)
    return Interval(value, low, high)


def holm(p_values: Sequence[float]) -> list[float]:
    """Correct p values of several tests (Holm 1979); in the order given."""
    order = np.argsort(p_values, kind="stable")
    corrected = [0.0] * len(p_values)
    largest = 0.0
    for rank, index in enumerate(order):
        largest = max(largest, (len(p_values) - rank) * p_values[index])
        corrected[index] = min(1.0, largest)
    return corrected


def seeds_for_difference(effect: float, power: float = 0.8, level: float = 0.05) -> int:
    """Compute the number of seeds needed to detect a paired difference.

    Args:
        effect: Cohen's d of the paired differences, not 0.
        power: Chance to find it.
        level: Of the two-sided test.

    Returns:
        The least number of pairs for the paired t test (noncentral t).
    """
    z = float(stats.norm.ppf(1.0 - level / 2.0) + stats.norm.ppf(power))
    normal = math.floor((z / effect) ** 2)  # a little too small
    pairs = max(LEAST_PAIRS, normal)
    while pairs < MANY_PAIRS and _power_of_t(abs(effect), pairs, level) < power:
        pairs += 1
    return pairs


def seeds_for_rates(
    rate_gained: float, rate_lost: float, power: float = 0.8, level: float = 0.05
) -> int:
    """Compute the number of seeds needed to detect a difference of paired rates.

    Args:
        rate_gained: Share of pairs in which it happens to the second only.
        rate_lost: Share of pairs in which it happens to the first only; another.
        power: Chance to find it.
        level: Of the two-sided test.

    Returns:
        Pairs for McNemar's test without correction (Connor 1987).
    """
    both = rate_gained + rate_lost
    difference = abs(rate_gained - rate_lost)
    z_level = float(stats.norm.ppf(1.0 - level / 2.0))
    z_power = float(stats.norm.ppf(power))
    root = z_level * math.sqrt(both) + z_power * math.sqrt(both - difference**2)
    return math.ceil((root / difference) ** 2)


def _crossing(
    score: Callable[[float], float], level: float, low: float, high: float
) -> float:
    """Find where a falling score crosses a level; an end if it does not."""
    if score(low) <= level:
        return low
    if score(high) >= level:
        return high
    root = optimize.brentq(lambda at: score(at) - level, low, high, xtol=1e-15)
    return float(root)


def _power_of_t(effect: float, pairs: int, level: float) -> float:
    """Compute the power of the two-sided paired t test."""
    freedom = pairs - 1
    critical = float(stats.t.ppf(1.0 - level / 2.0, freedom))
    shift = effect * math.sqrt(pairs)
    above = stats.nct.sf(critical, freedom, shift)
    below = stats.nct.cdf(-critical, freedom, shift)
    return float(np.nan_to_num(above) + np.nan_to_num(below))
