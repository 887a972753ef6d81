"""The dual active set against the interior point, cold and from a looser program."""

from dataclasses import replace

import numpy as np
import pytest

from planner.piecewise_jerk.active_set import (
    ABOVE_CUTOFF,
    INFEASIBLE,
    SOLVED,
    ActiveSet,
    ActiveSetOptions,
    Progress,
    dual_active_set,
    empty_response_cache,
    riccati_gains,
    unconstrained_minimum,
)
from planner.piecewise_jerk.solve import QpStatus, solve
from tests.planner.piecewise_jerk.programs import path_program

CAPACITY = 96
STATUS = {SOLVED: QpStatus.SOLVED, INFEASIBLE: QpStatus.INFEASIBLE}


def without_jerk_bounds(problem):
    """The active set knows bounds of states and rows; those of l'' imply this jerk."""
    implied = 1.01 * (problem.upper[:, 2].max() - problem.lower[:, 2].min()) / 0.5
    return replace(problem, jerk_lower=-implied - 1.0, jerk_upper=implied + 1.0)


class Run:
    """One program on its way; `tighten` goes on from where it stands."""

    def __init__(self, problem):
        self.program = problem.as_program()
        self.gain = riccati_gains(self.program)
        state, cost = unconstrained_minimum(self.program, self.gain)
        self.active = ActiveSet(
            state,
            *np.zeros((3, CAPACITY), dtype=np.int64),
            np.zeros(CAPACITY),
            np.zeros((CAPACITY, CAPACITY)),
        )
        self.at, self.steps = Progress(cost, 0), 0
        self.cache = empty_response_cache(*self.program.lower.shape)

    state = property(lambda self: self.active.state)
    dual = property(lambda self: self.active.dual)
    cost = property(lambda self: self.at.cost)
    count = property(lambda self: self.at.n_active)

    def tighten(self, lower, upper, cutoff=np.inf):
        verdict, self.at, self.steps = dual_active_set(
            self.program._replace(lower=lower, upper=upper),
            self.gain,
            self.cache,
            self.active,
            self.at,
            ActiveSetOptions(cutoff, 500, 1e-9),
        )
        return verdict


def columns(problem):
    return (
        np.concatenate([problem.lower, problem.row_lower], axis=1),
        np.concatenate([problem.upper, problem.row_upper], axis=1),
    )


def test_verdict_and_objective_are_those_of_the_interior_point():
    rng = np.random.default_rng(11)
    seen = []
    for _ in range(150):
        problem = without_jerk_bounds(path_program(rng))
        run = Run(problem)
        verdict = run.tighten(*columns(problem))
        expected = solve(problem)
        assert STATUS[verdict] is expected.status
        seen.append(verdict)
        if verdict == SOLVED:
            assert run.cost == pytest.approx(expected.objective, rel=1e-6)
            np.testing.assert_allclose(run.state, expected.state, atol=1e-4)
            assert np.all(run.dual[: run.count] >= 0.0)
    assert set(seen) == {SOLVED, INFEASIBLE}


def test_the_unconstrained_minimum_has_no_slope():
    problem = path_program(np.random.default_rng(3))
    wish = np.random.default_rng(4).uniform(-1.0, 1.0, (120, 3))
    free = replace(problem, reference=wish, lower=-1e20 * np.ones((120, 3)))
    free = replace(
        free, upper=1e20 * np.ones((120, 3)), jerk_lower=-1e20, jerk_upper=1e20
    )
    run, expected = Run(free), solve(free)
    assert run.cost == pytest.approx(expected.objective, rel=1e-10)
    np.testing.assert_allclose(run.state, expected.state, atol=1e-8)


def test_going_on_ends_where_starting_anew_ends():
    rng = np.random.default_rng(12)
    saved = []
    for _ in range(60):
        problem = without_jerk_bounds(path_program(rng))
        lower, upper = columns(problem)
        loose = lower.copy(), upper.copy()
        half = problem.lower.shape[0] // 2
        loose[0][half:, 0], loose[1][half:, 0] = -4.0, 4.0
        warm, cold = Run(problem), Run(problem)
        verdict = cold.tighten(lower, upper)
        if warm.tighten(*loose) != SOLVED:
            assert verdict == INFEASIBLE  # more bounds do not help
            continue
        assert warm.cost <= cold.cost * (1.0 + 1e-9) or verdict == INFEASIBLE
        assert warm.tighten(lower, upper) == verdict
        if verdict == SOLVED:
            assert warm.cost == pytest.approx(cold.cost, rel=1e-8)
            saved.append(warm.steps - cold.steps)
    assert np.mean(saved) < 0.0


def test_rows_bind_as_states_do():
    problem = without_jerk_bounds(path_program(np.random.default_rng(13)))
    n = problem.weight.shape[0]
    row = np.zeros((n, 1, 3))
    row[:, 0] = 1.0, 2.5, 0.0  # the front of a body
    bounded = replace(
        problem,
        row=row,
        row_lower=np.full((n, 1), -4.0),
        row_upper=np.full((n, 1), 2.6),
        lower=np.tile([-9.0, -1.0, -0.2], (n, 1)),
        upper=np.tile([9.0, 1.0, 0.2], (n, 1)),
        reference=np.tile([6.0, 0.0, 0.0], (n, 1)),
    )
    run, expected = Run(bounded), solve(bounded)
    assert run.tighten(*columns(bounded)) == SOLVED
    assert run.cost == pytest.approx(expected.objective, rel=1e-6)
    assert np.max(run.state[:, 0] + 2.5 * run.state[:, 1]) == pytest.approx(2.6)


def test_it_stops_where_it_is_known_to_exceed_the_cutoff():
    rng = np.random.default_rng(14)
    for _ in range(20):
        problem = without_jerk_bounds(path_program(rng))
        full = Run(problem)
        if full.tighten(*columns(problem)) != SOLVED or full.steps < 4:
            continue
        first = Run(problem).cost
        early = Run(problem)
        cutoff = first + 0.3 * (full.cost - first)
        assert early.tighten(*columns(problem), cutoff) == ABOVE_CUTOFF
        assert cutoff <= early.cost <= full.cost * (1.0 + 1e-9)
        assert early.steps < full.steps
