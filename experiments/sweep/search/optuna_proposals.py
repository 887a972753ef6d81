"""Proposals that learn from results: TPE and CMA-ES of optuna, asked and told.

Bergstra et al., NeurIPS 24 (2011); Hansen, arXiv 1604.00772. The study lives in memory:
a search that is resumed asks for the same points again and tells the recorded results.
"""

import math
import warnings
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any, Literal

import numpy as np

from experiments.errors import ConfigError
from experiments.sweep.search.space import SearchSpace
from planner.states import FloatArray

START = 10  # random points before TPE learns anything
RANDOM_SHARE = 4  # one point in so many is random, or a valley keeps all of them
PATIENCE = 48  # trials without a better one, after which the sampler begins anew
BETTER = 0.01  # of the spread of all values, by which a trial has to be better


class Valley:
    """Notices when a sampler stays where it finds nothing better any more."""

    def __init__(self) -> None:
        self._least, self._most = math.inf, -math.inf  # of all trials
        self._best = math.inf  # of this study
        self._waited = 0

    def is_explored(self, values: Sequence[float | None]) -> bool:
        """Take the values of a batch; return whether it is time to begin anew."""
        known = [value for value in values if value is not None]
        self._least = min([self._least, *known])
        self._most = max([self._most, *known])
        goal = self._best - BETTER * max(self._most - self._least, 0.0)
        self._waited += len(values)
        if known and (min(known) < goal or math.isinf(self._best)):
            self._best, self._waited = min(known), 0
        if self._waited < PATIENCE:
            return False
        self._best, self._waited = math.inf, 0
        return True


class OptunaProposer:
    """Asks a sampler of optuna; it minimises."""

    def __init__(
        self, method: Literal["tpe", "cma_es"], space: SearchSpace, seed: int
    ) -> None:
        optuna = _optuna(method)
        optuna.logging.set_verbosity(optuna.logging.ERROR)
        self._optuna, self._method, self._seed = optuna, method, seed
        self._space = space
        self._valley = Valley()
        self._asked: list[Any] = []  # trials of optuna
        self._count = 0
        self._generator = np.random.default_rng(seed)
        self._failed_state = optuna.trial.TrialState.FAIL
        self._distributions: dict[str, Any] = {
            key: optuna.distributions.CategoricalDistribution(range(count or 1))
            if choice
            else optuna.distributions.FloatDistribution(0.0, 1.0)
            for key, choice, count in zip(
                space.keys, space.is_choice, space.counts, strict=True
            )
        }
        self._begin()

    def _begin(self) -> None:
        """Begin a study that knows nothing yet; the next one has the next seed."""
        with _quietly():
            sampler = _sampler(self._optuna, self._method, self._seed)
            self._study = self._optuna.create_study(sampler=sampler)
        self._seed += 1

    def ask(self, count: int) -> list[FloatArray]:
        """Ask for the next points."""
        with _quietly():
            self._asked = [self._next() for _ in range(count)]
        return [self._coordinates(trial.params) for trial in self._asked]

    def tell(self, values: Sequence[float | None]) -> None:
        """Tell the results in the order of the points."""
        with _quietly():
            for trial, value in zip(self._asked, values, strict=True):
                if value is None:
                    self._study.tell(trial, state=self._failed_state)
                else:
                    self._study.tell(trial, value)
        if self._valley.is_explored(values):
            self._begin()

    def _next(self) -> Any:
        """Ask for one trial; every `RANDOM_SHARE`th is at random."""
        self._count += 1
        if self._count % RANDOM_SHARE == 0:
            shares = self._generator.random(len(self._space.keys))
            drawn = {
                key: int(share * (count or 1)) if choice else float(share)
                for key, share, choice, count in zip(
                    self._space.keys,
                    shares,
                    self._space.is_choice,
                    self._space.counts,
                    strict=True,
                )
            }
            self._study.enqueue_trial(drawn)
        return self._study.ask(self._distributions)

    def _coordinates(self, parameters: dict[str, Any]) -> FloatArray:
        """Return coordinates from 0 to 1: a choice lies in the middle of its part."""
        return np.array(
            [
                (parameters[key] + 0.5) / (count or 1) if choice else parameters[key]
                for key, choice, count in zip(
                    self._space.keys,
                    self._space.is_choice,
                    self._space.counts,
                    strict=True,
                )
            ]
        )


def _sampler(optuna: Any, method: str, seed: int) -> Any:
    """Make the sampler; points of one batch keep away from each other."""
    samplers = optuna.samplers
    if method == "tpe":
        return samplers.TPESampler(
            n_startup_trials=START, multivariate=True, constant_liar=True, seed=seed
        )
    return samplers.CmaEsSampler(
        seed=seed,
        independent_sampler=samplers.RandomSampler(seed=seed),
        warn_independent_sampling=False,
    )


def _optuna(method: str) -> Any:
    """Import optuna, and what CMA-ES needs beside it."""
    try:
        import optuna

        if method == "cma_es":
            import cmaes  # noqa: F401 - optuna imports it late
    except ImportError as error:
        raise ConfigError(
            f"method: {method} needs {error.name}: pip install 'rearview[search]'; "
            "allowed without it: random, sobol"
        ) from error
    return optuna


@contextmanager
def _quietly() -> Iterator[None]:
    """Leave out optuna's notes that a way to sample may still change."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        yield
