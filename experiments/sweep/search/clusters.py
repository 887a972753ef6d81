"""Failures of a search grouped: of one kind, and close to each other in the space."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from experiments.sweep.search.exploration import SearchTrial
from experiments.sweep.search.space import SearchSpace
from planner.states import FloatArray

LINK = 0.15  # root mean square of coordinate differences up to which two are linked


@dataclass(frozen=True, slots=True, eq=False)
class FailureCluster:
    """Failures of one kind in one part of the space."""

    kind: str
    trials: tuple[SearchTrial, ...]  # worst first

    @property
    def worst(self) -> SearchTrial:
        """The trial with the least robustness."""
        return self.trials[0]


def cluster_failures(
    space: SearchSpace, trials: Sequence[SearchTrial]
) -> list[FailureCluster]:
    """Group the failed trials, the largest group first.

    Two are linked if they are of one kind, have the same choices and lie within `LINK`
    of each other; a group is what links connect.
    """
    kinds: dict[str, list[SearchTrial]] = {}
    for trial in trials:
        if trial.failed:
            kinds.setdefault(trial.judgement.kind, []).append(trial)
    found = [
        FailureCluster(kind, tuple(sorted((members[k] for k in group), key=_badness)))
        for kind, members in kinds.items()
        for group in linked_groups(
            np.array([one.coordinates for one in members]), space.is_choice
        )
    ]
    return sorted(found, key=lambda one: (-len(one.trials), one.worst.number))


def linked_groups(points: FloatArray, is_choice: Sequence[bool]) -> list[list[int]]:
    """Return the rows of each connected group of points, (n, n_keys)."""
    from scipy.sparse.csgraph import connected_components  # takes time to load

    choice = np.array(is_choice, dtype=bool)
    apart = points[:, None, :] - points[None, :, :]
    other = (np.abs(apart[:, :, choice]) > 0.0).any(axis=2)
    numbers = apart[:, :, ~choice]
    spread = np.zeros(other.shape)
    if numbers.shape[2]:
        spread = np.sqrt((numbers**2).mean(axis=2))
    _, label = connected_components((spread <= LINK) & ~other, directed=False)
    return [np.flatnonzero(label == k).tolist() for k in range(int(label.max()) + 1)]


def _badness(trial: SearchTrial) -> tuple[float, int]:
    """Sort the least robust first."""
    value = trial.judgement.robustness
    return (np.inf if value is None else value, trial.number)
