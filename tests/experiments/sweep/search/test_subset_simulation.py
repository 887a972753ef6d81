"""Subset simulation on problems with a known probability."""

import numpy as np
import pytest
from scipy import stats

from experiments.sweep.search.subset_simulation import SubsetSampler

N_KEYS = 4


def estimated(limit_state, seed, level_trials, budget=100_000, batch=64):
    """Estimate the probability that a function of (n, n_keys) is below zero."""
    sampler = SubsetSampler(N_KEYS, seed, level_trials)
    runs = 0
    while runs < budget:
        points = sampler.ask(min(batch, budget - runs))
        if not points:
            break
        runs += len(points)
        sampler.tell(limit_state(np.array(points)).tolist())
    return sampler.estimate(), runs


def plane(probability):
    """Return a limit state that fails beyond a plane in standard normal space."""
    away = -stats.norm.ppf(probability)

    def value(at):
        u = stats.norm.ppf(np.clip(at, 1e-300, 1.0 - 1e-16))
        return away - u.sum(axis=1) / np.sqrt(N_KEYS)

    return value


def corner(probability):
    """Return a limit state that fails in a corner of the cube."""
    side = probability ** (1.0 / N_KEYS)
    return lambda at: (1.0 - at).max(axis=1) - side


def two_ends(probability):
    """Return a limit state that fails at both ends of one key."""
    return lambda at: np.minimum(at[:, 0], 1.0 - at[:, 0]) - 0.5 * probability


@pytest.mark.parametrize("problem", [plane, corner, two_ends])
@pytest.mark.parametrize(
    "probability",
    [1e-2, 1e-3, *(pytest.param(p, marks=pytest.mark.slow) for p in (1e-4, 1e-5))],
)
def test_the_interval_covers_the_known_probability(problem, probability):
    repetitions = 60
    found = [
        estimated(problem(probability), seed, 500)[0] for seed in range(repetitions)
    ]
    covered = sum(one.low <= probability <= one.high for one in found)
    assert covered >= 0.85 * repetitions  # of 95 %; by chance 1 in 600 if it is 95
    mean = np.mean([one.probability for one in found])
    assert mean == pytest.approx(probability, rel=0.35)


def test_it_needs_far_fewer_runs_than_chance():
    found, runs = estimated(plane(1e-5), 1, 1000)
    assert runs < 6000  # at random 1 failure in 100,000
    assert found.low < 1e-5 < found.high
    assert len(found.levels) in (5, 6)


def test_what_never_fails_gives_an_upper_bound():
    found, _ = estimated(lambda at: at[:, 0] + 1.0, 0, 100)
    assert found.probability == 0.0
    assert found.low == 0.0
    assert found.high < 1e-6


def test_a_flat_objective_says_no_more_than_chance():
    found, runs = estimated(lambda at: np.ones(len(at)), 0, 300)
    assert runs == 300
    assert found.high == pytest.approx(0.01)  # rule of three


def test_a_budget_that_ends_in_a_level_gives_an_upper_bound():
    found, runs = estimated(plane(1e-5), 0, 200, budget=500)
    assert runs == 500
    assert found.probability == 0.0
    assert 1e-5 < found.high < 0.05


def test_points_that_cannot_be_are_no_failures():
    def half(at):
        return np.where(at[:, 1] < 0.5, np.inf, at[:, 0] - 0.02)

    found, _ = estimated(half, 3, 500)
    assert found.low < 0.01 < found.high


def test_the_same_answers_give_the_same_points_whatever_the_batch():
    value = plane(1e-3)
    one, other = SubsetSampler(N_KEYS, 7, 100), SubsetSampler(N_KEYS, 7, 100)
    seen = []
    for sampler, batch in ((one, 100), (other, 7)):
        points = []
        while len(points) < 190:
            asked = sampler.ask(batch)
            sampler.tell(value(np.array(asked)).tolist())
            points += [at.tolist() for at in asked]
        seen.append(points[:190])
    assert seen[0] == seen[1]
