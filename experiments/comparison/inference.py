"""Statistical inference: intervals, paired tests, required numbers of seeds.

Rates, means, paired differences; on scipy where it has the method. Pairs are runs of
two planners in the same scenario with the same seed.

Sources: Wilson, JASA 22 (1927) 209. Wilcoxon, Biometrics Bulletin 1 (1945) 80. McNemar,
Psychometrika 12 (1947) 153. Pratt, JASA 54 (1959) 655. Holm, Scand. J. Statist. 6
(1979) 65. Connor, Biometrics 43 (1987) 207. Efron, JASA 82 (1987) 171. Tango, Statist.
Med. 17 (1998) 891. Hodges and Lehmann, Ann. Math. Statist. 27 (1956) 324.
"""

import math
import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike
from scipy import optimize, stats

from planner.states import FloatArray

CONFIDENCE = 0.95
RESAMPLES = 9999
SEED = 0  # of the resampling: the same runs give the same interval
# Relative efficiency of Wilcoxon's signed ranks against the t test on normal
# differences, 3 / pi (Hodges and Lehmann 1956): it needs correspondingly more pairs.
WILCOXON_EFFICIENCY = 3.0 / math.pi
LEAST_PAIRS = 2
# From here on the normal approximation of the power is accurate to about 0.1 %.
MANY_PAIRS = 10_000
# From here on the percentile interval: BCa needs n² numbers for a correction of order
# 1 / sqrt(n).
MANY = 5000
BATCH = 10_000_000  # numbers resampled at a time: 80 MB


@dataclass(frozen=True, slots=True)
class Interval:
    """An estimate and the interval that covers the true value."""

    value: float
    low: float
    high: float


@dataclass(frozen=True, slots=True)
class PairedDifference:
    """Difference of a quantity between two planners on common seeds."""

    pairs: int
    center: Interval  # mean or median of the differences, second minus first
    effect: float | None  # Cohen's d of paired differences; None without any spread
    p_value: float  # Wilcoxon's signed ranks, two-sided; 1 if all pairs are equal


@dataclass(frozen=True, slots=True)
class PairedRates:
    """Difference of a rate between two planners on common seeds."""

    pairs: int
    difference: Interval  # second minus first
    only_first: int  # pairs in which the event occurred for the first only
    only_second: int
    p_value: float  # McNemar, exact, two-sided


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


def bootstrap(
    values: ArrayLike,
    statistic: Callable[..., float] = np.mean,
    confidence: float = CONFIDENCE,
) -> Interval:
    """Estimate a mean or median with a bootstrap interval, BCa (Efron 1987).

    Where BCa is not defined (a statistic that does not change when one value is left
    out) or there are very many values, the percentile interval stands in.

    Args:
        values: At least one, finite.
        statistic: `numpy.mean` or `numpy.median`.
        confidence: Of the interval.

    Returns:
        The estimate and its interval.
    """
    data = np.asarray(values, dtype=np.float64)
    value = float(statistic(data))
    if data.size < LEAST_PAIRS or np.ptp(data) == 0.0:
        return Interval(value, value, value) if data.size > 1 else _unknown(value)
    methods: tuple[Literal["BCa", "percentile"], ...] = ("BCa", "percentile")
    for method in methods if data.size < MANY else methods[1:]:
        with np.errstate(all="ignore"):
            low, high = _resampled(data, statistic, confidence, method)
        if math.isfinite(low) and math.isfinite(high):
            return Interval(value, low, high)
    return _unknown(value)


def paired_difference(
    first: ArrayLike,
    second: ArrayLike,
    statistic: Callable[..., float] = np.mean,
    confidence: float = CONFIDENCE,
) -> PairedDifference:
    """Compare a quantity on common seeds.

    Args:
        first: Of the baseline, one value a seed.
        second: Of the other planner, in the same order.
        statistic: `numpy.mean` or `numpy.median`, of the differences.
        confidence: Of the interval.

    Returns:
        That of the differences with bootstrap interval, effect size, Wilcoxon test
        (Wilcoxon 1945, zeros kept by Pratt 1959).
    """
    difference = np.asarray(second, np.float64) - np.asarray(first, np.float64)
    spread = float(difference.std(ddof=1)) if difference.size > 1 else 0.0
    center = bootstrap(difference, statistic, confidence)
    effect = float(difference.mean()) / spread if spread > 0.0 else None
    return PairedDifference(difference.size, center, effect, wilcoxon(difference))


def wilcoxon(difference: FloatArray) -> float:
    """Test whether differences are symmetric about 0; the two-sided p."""
    if not difference.any():
        return 1.0
    return float(stats.wilcoxon(difference, zero_method="pratt").pvalue)


def paired_rates(
    first: Sequence[bool], second: Sequence[bool], confidence: float = CONFIDENCE
) -> PairedRates:
    """Compare a rate on common seeds.

    Args:
        first: Of the baseline, one value a seed.
        second: Of the other planner, in the same order.
        confidence: Of the interval.

    Returns:
        Difference of the rates with its interval (Tango 1998), McNemar's exact test.
    """
    pairs = list(zip(first, second, strict=True))
    only_first = sum(1 for a, b in pairs if a and not b)
    only_second = sum(1 for a, b in pairs if b and not a)
    return PairedRates(
        len(pairs),
        tango(only_second, only_first, len(pairs), confidence),
        only_first,
        only_second,
        mcnemar(only_first, only_second),
    )


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
        The least number of pairs for the paired t test (noncentral t), enlarged by
        the efficiency of Wilcoxon's test.
    """
    z = float(stats.norm.ppf(1.0 - level / 2.0) + stats.norm.ppf(power))
    normal = math.floor((z / effect) ** 2)  # a little too small
    pairs = max(LEAST_PAIRS, normal)
    while pairs < MANY_PAIRS and _power_of_t(abs(effect), pairs, level) < power:
        pairs += 1
    return math.ceil(pairs / WILCOXON_EFFICIENCY)


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
        Pairs for McNemar's test (Connor 1987).
    """
    both = rate_gained + rate_lost
    difference = abs(rate_gained - rate_lost)
    z_level = float(stats.norm.ppf(1.0 - level / 2.0))
    z_power = float(stats.norm.ppf(power))
    root = z_level * math.sqrt(both) + z_power * math.sqrt(both - difference**2)
    return math.ceil((root / difference) ** 2)


def _resampled(
    data: FloatArray,
    statistic: Callable[..., float],
    confidence: float,
    method: Literal["BCa", "percentile"],
) -> tuple[float, float]:
    """Return the ends of a bootstrap interval; NaN where it is undefined."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # a degenerate BCa warns and gives nan
        result = stats.bootstrap(
            [data],
            statistic,
            n_resamples=RESAMPLES,
            batch=max(1, BATCH // data.size),
            confidence_level=confidence,
            method=method,
            rng=np.random.default_rng(SEED),
        )
    return float(result.confidence_interval.low), float(result.confidence_interval.high)


def _unknown(value: float) -> Interval:
    """Return the unbounded interval of a single value."""
    return Interval(value, -math.inf, math.inf)


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
