"""Intervals and tests of means and medians, each pair from the same inversion.

A mean is judged by two procedures at once: Student's t, which is exact for normal
values, and the studentised bootstrap (bootstrap-t), which follows skewness. The p
value is the larger of the two and the interval is the union of the two, so that the
interval leaves out 0 exactly where p is at most 1 - confidence. Alone, either falls
short somewhere: t on skewed values, the bootstrap on heavy tails and many zeros. Far
below 0.05, where corrections for many tests look, both are too bold with few skewed
values; p values below 0.05 are therefore raised, to 0.05 at most, by 1 + 60 / n, a
factor found by simulation (`experiments.comparison.calibration` measures the rest).

A median is judged by the sign test, whose inversion is an interval between order
statistics, for any distribution.

Sources: Student, Biometrika 6 (1908) 1. Efron, Canad. J. Statist. 9 (1981) 139. Hall,
Ann. Statist. 16 (1988) 927. Conover, Practical Nonparametric Statistics (1999) 3.4.
"""

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike
from scipy import stats

from planner.states import FloatArray

CONFIDENCE = 0.95
RESAMPLES = 9_999
TAIL = 0.01  # below this p is computed from
TAIL_RESAMPLES = 99_999  # resamples,
MOST_SHARES = 10_000_000  # or as many as make a table of this size: 80 MB
BOLDNESS = 60.0  # of p values below 0.05, over n
SEED = 0  # of the resampling: the same runs give the same interval
LEAST_VALUES = 6  # with fewer, neither a test nor an interval
# From here on t alone: the bootstrap would not differ, its table would be large.
MANY = 2000
_EQUAL = 1e-12  # relative; a resample with less variance is one value many times


@dataclass(frozen=True, slots=True)
class Interval:
    """An estimate and the interval that covers the true value."""

    value: float
    low: float
    high: float

    @property
    def known(self) -> bool:
        """Whether it has ends."""
        return math.isfinite(self.low) and math.isfinite(self.high)


@dataclass(frozen=True, slots=True)
class Located:
    """A mean or median with its interval, and whether it is 0."""

    interval: Interval
    p_value: float | None  # two-sided; None where nothing can be tested


@dataclass(frozen=True, slots=True, eq=False)
class Studentised:
    """Rows of values, studentised, beside what resampling gives; see `studentise`."""

    mean: FloatArray  # (k,)
    error: FloatArray  # standard error of the mean (k,)
    resampled: FloatArray  # ascending t values, nan last (k, b)
    count: FloatArray  # of those that are not nan (k,)


def mean(values: ArrayLike, confidence: float = CONFIDENCE) -> Located:
    """Estimate a mean, and test whether it is 0.

    Args:
        values: Independent of each other, at least one, finite (n,).
        confidence: Of the interval.

    Returns:
        The mean; without ends and p value for fewer than `LEAST_VALUES` values, and
        for equal ones, which say nothing about the spread.
    """
    data = np.asarray(values, dtype=np.float64)
    center = float(data.mean())
    if data.size < LEAST_VALUES or np.ptp(data) == 0.0:
        return Located(_unknown(center), None)
    one = studentise(data[np.newaxis])
    low, high = mean_ends(one, data.size, confidence)
    p_value = float(mean_p(one, data.size)[0])
    if p_value <= TAIL:
        rows = studentise(data[np.newaxis], TAIL_RESAMPLES)
        p_value = float(mean_p(rows, data.size)[0])
    p_value = raised(p_value, data.size)
    return Located(Interval(center, float(low[0]), float(high[0])), p_value)


def raised(p_value: float, n: int) -> float:
    """Raise a p value below 0.05 for what few values are too bold about."""
    level = 1.0 - CONFIDENCE
    return max(p_value, min(level, p_value * (1.0 + BOLDNESS / n)))


def median(values: ArrayLike, confidence: float = CONFIDENCE) -> Located:
    """Estimate a median, and test whether it is 0, by the sign test.

    Values of 0 count against either direction, so ties make it careful, not wrong.

    Args:
        values: As of `mean`.
        confidence: At least; order statistics do not give every level.
    """
    data = np.sort(np.asarray(values, dtype=np.float64))
    center = float(np.median(data))
    n = data.size
    if n < LEAST_VALUES or np.ptp(data) == 0.0:
        return Located(_unknown(center), None)
    counts = np.arange(n + 1)
    rank = int(np.sum(stats.binom.cdf(counts, n, 0.5) <= (1.0 - confidence) / 2.0))
    interval = Interval(center, float(data[rank - 1]), float(data[n - rank]))
    if rank == 0:
        interval = _unknown(center)
    rarer = min(int(np.sum(data <= 0.0)), int(np.sum(data >= 0.0)))
    p_value = min(1.0, 2.0 * float(stats.binom.cdf(rarer, n, 0.5)))
    return Located(interval, p_value)


def studentise(values: FloatArray, resamples: int | None = None) -> Studentised:
    """Compute means, errors and resampled t values of many rows at once.

    Args:
        values: (k, n), not all equal in a row.
        resamples: How many, fewer for many values; `RESAMPLES` if None.

    Returns:
        The t values of a resample are (its mean - the row's mean) / its own error; a
        resample without spread has none.
    """
    k, n = values.shape
    center = values.mean(axis=1)
    off = values - center[:, np.newaxis]
    variance = (off**2).mean(axis=1)
    error = np.sqrt(variance / (n - 1))
    if n >= MANY:
        return Studentised(center, error, np.empty((k, 0)), np.zeros(k))
    asked = RESAMPLES if resamples is None else resamples
    share = _resampled_shares(n, min(asked, MOST_SHARES // n))
    shift = off @ share.T
    spread = (off**2) @ share.T - shift**2
    spread[spread <= _EQUAL * variance[:, np.newaxis]] = np.nan
    t = np.sort(shift / np.sqrt(spread / (n - 1)), axis=1)
    return Studentised(center, error, t, np.sum(~np.isnan(t), axis=1).astype(float))


def mean_ends(
    rows: Studentised, n: int, confidence: float = CONFIDENCE
) -> tuple[FloatArray, FloatArray]:
    """Return the ends of the union of both intervals, (k,) each."""
    level = 1.0 - confidence
    t = float(stats.t.ppf(1.0 - level / 2.0, n - 1))
    low, high = np.full_like(rows.mean, -t), np.full_like(rows.mean, t)
    if rows.resampled.shape[1]:
        rank = np.maximum(1.0, np.floor((rows.count + 1.0) * level / 2.0))
        at = np.arange(len(low))
        low = np.minimum(low, rows.resampled[at, rank.astype(int) - 1])
        high = np.maximum(high, rows.resampled[at, (rows.count - rank).astype(int)])
    return rows.mean - high * rows.error, rows.mean - low * rows.error


def mean_p(rows: Studentised, n: int) -> FloatArray:
    """Return the larger of both two-sided p values of a mean of 0, (k,)."""
    t = rows.mean / rows.error
    student = student_p(t, n)
    if not rows.resampled.shape[1]:
        return student
    at = t[:, np.newaxis]
    beyond = np.minimum(
        np.sum(rows.resampled >= at, axis=1), np.sum(rows.resampled <= at, axis=1)
    )
    bootstrap = np.minimum(1.0, 2.0 * (beyond + 1.0) / (rows.count + 1.0))
    return np.asarray(np.maximum(student, bootstrap))


def student_p(t: FloatArray, n: int) -> FloatArray:
    """Return the two-sided p values of Student's t test of n values."""
    return np.asarray(2.0 * stats.t.sf(np.abs(t), n - 1))


@lru_cache(maxsize=3)
def _resampled_shares(n: int, resamples: int) -> FloatArray:
    """Return the share that each of n values has in each resample (resamples, n)."""
    rng = np.random.default_rng(SEED)
    return rng.multinomial(n, np.full(n, 1.0 / n), size=resamples) / n


def _unknown(value: float) -> Interval:
    """Return the interval that has no ends."""
    return Interval(value, -math.inf, math.inf)
