"""Subset simulation: how probable a rare failure is, level by level.

Au and Beck, Probab. Eng. Mech. 16 (2001) 263; moves by conditional sampling with an
adapted step: Papaioannou et al., Probab. Eng. Mech. 41 (2015) 89. A level is the part
of the space with values up to a threshold, a tenth of the level before; the probability
of the failure is the product of all shares. Asked and told in batches, as any search.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy import stats

from planner.states import FloatArray, IntArray

SHARE = 0.1  # of a level that is in the next one
MOST_LEVELS = 12  # a failure that is rarer is not looked for
FIRST_STEP = 0.6  # of a move, of the standard deviation
ACCEPTED = 0.44  # share of moves that the step is adapted to
NEIGHBOURS = 0.3  # correlation of the errors of levels that follow each other
QUANTILE = 0.975


@dataclass(frozen=True, slots=True)
class SubsetLevel:
    """One level: how much of it is in the next one, or fails."""

    threshold: float  # values up to it are in the next level
    share: float  # of the samples up to the threshold; of the last level, that fail
    deviation: float  # standard deviation of the share over the share
    is_last: bool  # its share is that of the failures


@dataclass(frozen=True, slots=True)
class SubsetEstimate:
    """The probability of a failure with its 95 % interval.

    `levels` of which the last one is not complete, or has no failure, give an upper
    bound alone: `probability` is 0 and `low` 0 then.
    """

    probability: float
    low: float
    high: float
    levels: tuple[SubsetLevel, ...]


@dataclass(slots=True)
class _Population:
    """The samples of a level; arrays are (n,) and (n, n_keys)."""

    at: FloatArray  # in standard normal space
    value: FloatArray
    chain: IntArray
    family: IntArray  # chain of the level before from which a chain comes


class SubsetSampler:
    """Proposes points level by level; values below 0 are failures.

    Args:
        n_keys: Dimensions of the space, each uniform from 0 to 1.
        seed: Of everything that is drawn.
        level_trials: Samples of a level.
    """

    def __init__(self, n_keys: int, seed: int, level_trials: int) -> None:
        self._n_keys, self._size = n_keys, level_trials
        self._generator = np.random.default_rng(seed)
        self._step = FIRST_STEP
        self._threshold = np.inf
        self._levels: list[SubsetLevel] = []
        self._finished = False
        self._begin_first()

    def ask(self, count: int) -> list[FloatArray]:
        """Return at most so many next points; none when it is finished."""
        if self._finished:
            return []
        begin = len(self._answers)
        asked = self._proposed[begin : begin + count]
        return list(stats.norm.cdf(asked))

    def tell(self, values: Sequence[float | None]) -> None:
        """Take the values of the points asked for last; None: it cannot be there."""
        self._answers += [np.inf if value is None else value for value in values]
        if len(self._answers) == len(self._proposed):
            self._end_of_step()

    def estimate(self) -> SubsetEstimate:
        """Return what is known so far."""
        levels = list(self._levels)
        if levels and levels[-1].is_last:
            probability = float(np.prod([one.share for one in levels]))
            if probability > 0.0:
                return _interval(probability, levels)
        seen = [one for one in levels if one.share > 0.0]
        bound = _interval(float(np.prod([one.share for one in seen])), seen)
        rest = 3.0 / self._size if len(seen) < len(levels) else 1.0  # rule of three
        high = min(bound.high * rest, 1.0)
        return SubsetEstimate(0.0, 0.0, high, tuple(levels))

    def _begin_first(self) -> None:
        """Draw the first level, independent samples."""
        size, own = self._size, np.arange(self._size)
        self._proposed = self._generator.standard_normal((size, self._n_keys))
        self._answers: list[float] = []
        self._at = self._proposed.copy()
        self._value = np.full(size, np.inf)
        self._length = np.ones(size, dtype=int)
        self._moving = own
        self._family = own
        self._taken: list[_Population] = []
        self._done = 0  # states of each chain

    def _end_of_step(self) -> None:
        """Accept or reject the moves of all chains, and go on."""
        value, moving = np.array(self._answers), self._moving
        accepted = value <= self._threshold
        chosen = moving[accepted]
        self._at[chosen] = self._proposed[accepted]
        self._value[chosen] = value[accepted]
        if self._levels:
            change = (accepted.mean() - ACCEPTED) / np.sqrt(self._done)
            self._step = float(self._step * np.exp(change))
        self._take(moving)
        if not self._next_step():
            self._end_of_level()

    def _take(self, moving: IntArray) -> None:
        """Keep the present states of some chains as samples of the level."""
        self._taken.append(
            _Population(
                self._at[moving].copy(),
                self._value[moving].copy(),
                moving,
                self._family[moving],
            )
        )
        self._done += 1

    def _next_step(self) -> bool:
        """Propose the next move of every chain that is not long enough."""
        self._moving = np.flatnonzero(self._length > self._done)
        self._answers = []
        if not self._moving.size:
            return False
        width = min(self._step, 1.0)
        drawn = self._generator.standard_normal((self._moving.size, self._n_keys))
        kept = np.sqrt(1.0 - width**2)
        self._proposed = kept * self._at[self._moving] + width * drawn
        return True

    def _end_of_level(self) -> None:
        """Count the level and begin the next one, unless this was the last."""
        every = _Population(
            np.concatenate([one.at for one in self._taken]),
            np.concatenate([one.value for one in self._taken]),
            np.concatenate([one.chain for one in self._taken]),
            np.concatenate([one.family for one in self._taken]),
        )
        place = max(round(SHARE * self._size) - 1, 0)
        threshold = float(np.sort(every.value)[place])
        inside = every.value <= threshold
        # a level without end: the objective is flat, or cannot be computed
        last = threshold < 0.0 or not np.isfinite(threshold) or bool(inside.all())
        last |= len(self._levels) + 1 == MOST_LEVELS
        if last:
            threshold, inside = 0.0, every.value < 0.0
        deviation = _deviation(inside, every, first=not self._levels)
        share = float(inside.mean())
        self._levels.append(SubsetLevel(threshold, share, deviation, last))
        if last:
            self._finished = True
            return
        self._begin_level(every, np.flatnonzero(inside), threshold)

    def _begin_level(
        self, every: _Population, seeds: IntArray, threshold: float
    ) -> None:
        """Begin a chain at each sample that is in the next level."""
        self._threshold = threshold
        seeds = self._generator.permutation(seeds)
        self._at, self._value = every.at[seeds].copy(), every.value[seeds].copy()
        self._family = every.chain[seeds]
        count = seeds.size
        self._length = np.full(count, self._size // count)
        self._length[: self._size - int(self._length.sum())] += 1
        self._taken, self._done = [], 0
        self._take(np.arange(count))
        if not self._next_step():
            self._end_of_level()


def _deviation(
    inside: "np.ndarray[tuple[int], np.dtype[np.bool_]]",
    every: _Population,
    *,
    first: bool,
) -> float:
    """Return the standard deviation of a share over the share.

    The samples of a chain depend on each other, and so do chains of one family: the
    larger of both variances of cluster sums, and no less than that of independent ones.
    """
    share, size = float(inside.mean()), inside.size
    if share == 0.0:
        return 0.0
    least = (1.0 - share) / (size * share)
    if first:
        return float(np.sqrt(least))
    found = [least]
    for label in (every.chain, every.family):
        _, cluster = np.unique(label, return_inverse=True)
        sums = np.bincount(cluster, weights=inside - share)
        spread = float((sums**2).sum()) / (size * share) ** 2
        found.append(spread * sums.size / max(sums.size - 1, 1))
    return float(np.sqrt(max(found)))


def _interval(probability: float, levels: Sequence[SubsetLevel]) -> SubsetEstimate:
    """Return an estimate with the interval of a lognormal distribution."""
    each = np.array([one.deviation for one in levels])
    variance = float((each**2).sum() + 2.0 * NEIGHBOURS * (each[1:] * each[:-1]).sum())
    width = float(stats.norm.ppf(QUANTILE) * np.sqrt(np.log1p(variance)))
    low, high = probability * np.exp(-width), min(probability * np.exp(width), 1.0)
    return SubsetEstimate(probability, float(low), float(high), tuple(levels))
