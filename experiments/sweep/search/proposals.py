"""What a search tries next: at random, spread evenly, or by a method that learns."""

from collections.abc import Sequence
from typing import Protocol

import numpy as np

from experiments.config.search import Method, Search
from experiments.sweep.search.directed_proposals import DirectedProposer
from experiments.sweep.search.space import SearchSpace
from experiments.sweep.search.subset_simulation import (
    SubsetEstimate,
    SubsetSampler,
)
from planner.states import FloatArray


class Proposer(Protocol):
    """Proposes points; the same seed and the same answers give the same points."""

    def ask(self, count: int) -> list[FloatArray]:
        """Return coordinates of the next points, (n_keys,) each from 0 to 1.

        At most `count`; none where the method has come to its end.
        """
        ...

    def tell(self, values: Sequence[float | None]) -> None:
        """Take the values of the points asked for last, in their order."""
        ...


class RandomProposer:
    """Independent points, uniform over the space: what others are compared with."""

    def __init__(self, space: SearchSpace, seed: int) -> None:
        self._n_keys = len(space.keys)
        self._generator = np.random.default_rng(seed)

    def ask(self, count: int) -> list[FloatArray]:
        """Draw the next points."""
        return [self._generator.random(self._n_keys) for _ in range(count)]

    def tell(self, values: Sequence[float | None]) -> None:
        """Learn nothing."""


class SobolProposer:
    """A scrambled Sobol sequence: spread more evenly than chance does."""

    def __init__(self, space: SearchSpace, seed: int, budget: int) -> None:
        from scipy.stats import qmc  # takes half a second to load

        power = max(budget - 1, 0).bit_length()
        drawn = qmc.Sobol(len(space.keys), rng=seed).random_base2(power)
        self._points = list(drawn)

    def ask(self, count: int) -> list[FloatArray]:
        """Return the next points of the sequence."""
        asked, self._points = self._points[:count], self._points[count:]
        return asked

    def tell(self, values: Sequence[float | None]) -> None:
        """Learn nothing."""


def make_proposer(
    search: Search,
    space: SearchSpace,
    mild: FloatArray,
    method: Method | None = None,
    seed: int | None = None,
) -> Proposer:
    """Return the proposer of a search.

    Args:
        search: With its method, seed and budget.
        space: Where to propose.
        mild: Coordinates of the mild point.
        method: Instead of the search's own.
        seed: Instead of the search's own.

    Raises:
        ConfigError: If the method needs a package that is not there.
    """
    method = method or search.method
    seed = search.seed if seed is None else seed
    if method == "random":
        return RandomProposer(space, seed)
    if method == "sobol":
        return SobolProposer(space, seed, search.budget)
    if method == "directed":
        return DirectedProposer(space, seed, mild)
    if method == "subset":
        return SubsetSampler(len(space.keys), seed, search.level_trials)
    from experiments.sweep.search.optuna_proposals import OptunaProposer

    return OptunaProposer(method, space, seed)


def estimate_of(proposer: Proposer) -> SubsetEstimate | None:
    """Return the probability that a method has estimated; None of the others."""
    return proposer.estimate() if isinstance(proposer, SubsetSampler) else None
