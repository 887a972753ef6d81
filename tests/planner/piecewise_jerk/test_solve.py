from dataclasses import replace

import clarabel
import numpy as np
import pytest
import qpsolvers
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import sparse

from planner.errors import InvalidInputError
from planner.piecewise_jerk.interior_point import (
    ABOVE_CUTOFF,
    INFEASIBLE,
    SOLVED,
    solve_with_cutoff,
)
from planner.piecewise_jerk.solve import (
    OPTIONS,
    PiecewiseJerkProblem,
    QpStatus,
    judge,
    objective_of,
    solve,
    solve_soft,
)
from planner.piecewise_jerk.sparse_solvers import (
    HUGE,
    SOLVERS,
    program_of,
    solve_program,
)
from tests.planner.piecewise_jerk.programs import KINDS, path_program, speed_program

CLOSE = 1e-6  # of objectives, relative


def agree(problem: PiecewiseJerkProblem, others: tuple[str, ...]) -> QpStatus:
    """Check verdict and objective against other solvers, and the promises kept."""
    own = solve(problem)
    for name in others:
        other = solve(problem, name)
        assert own.status is other.status, (name, own.status, other.status)
        if own.status is QpStatus.SOLVED:
            assert own.objective == pytest.approx(other.objective, rel=CLOSE, abs=CLOSE)
    if own.status is QpStatus.SOLVED:
        kept = judge(problem, own)
        assert max(kept.dynamics, kept.bounds, kept.rows) < 1e-7
        assert kept.objective == pytest.approx(own.objective, rel=1e-9, abs=1e-9)
    return own.status


@pytest.mark.parametrize("kind", KINDS)
def test_verdicts_and_objectives_are_those_of_another_solver(kind):
    rng = np.random.default_rng(5)
    seen = [agree(KINDS[kind](rng), ("piqp",)) for _ in range(40)]
    assert set(seen) == {QpStatus.SOLVED, QpStatus.INFEASIBLE}


@pytest.mark.parametrize("kind", KINDS)
def test_an_active_set_method_says_the_same(kind):
    rng = np.random.default_rng(6)
    for _ in range(3):
        agree(KINDS[kind](rng), ("daqp",))


def clarabel_says(problem: PiecewiseJerkProblem) -> tuple[str, float]:
    """Ask clarabel itself, which proves infeasibility; the front end hides that."""
    program = program_of(problem)
    eye = sparse.identity(program.q.size, format="csc")
    rows, sides = [program.a], [program.b]
    for matrix, low, up in (
        (program.g, program.g_lower, program.g_upper),
        (eye, program.lower, program.upper),
    ):
        rows += [matrix[up < HUGE], -matrix[low > -HUGE]]
        sides += [up[up < HUGE], -low[low > -HUGE]]
    options = clarabel.DefaultSettings()
    options.verbose = False
    options.tol_gap_abs = options.tol_gap_rel = options.tol_feas = 1e-9
    n_equal = program.b.size
    right = np.concatenate(sides)
    cones = [
        clarabel.ZeroConeT(n_equal),
        clarabel.NonnegativeConeT(right.size - n_equal),
    ]
    matrix = sparse.csc_matrix(sparse.vstack(rows))
    found = clarabel.DefaultSolver(
        sparse.csc_matrix(program.p), program.q, matrix, right, cones, options
    ).solve()
    if str(found.status) != "Solved":
        return str(found.status), np.inf
    state, jerk = split(np.array(found.x), problem)
    return "Solved", objective_of(problem, state, jerk)


def split(z, problem):
    """Take a solver's variables apart: states (n, 3) and jerks (n - 1,)."""
    n = problem.weight.shape[0]
    return z[: 3 * n].reshape(n, 3), z[3 * n : 4 * n - 1]


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
def test_a_thousand_programs_against_two_solvers(kind, monkeypatch):
    asked = []

    def counted(program, solver):
        asked.append(solver)
        return solve_program(program, solver)

    monkeypatch.setattr("planner.piecewise_jerk.sparse_solvers.solve_program", counted)
    rng, verdicts = np.random.default_rng(7), []
    for _ in range(1000 if kind == "speed" else 500):
        problem = KINDS[kind](rng)
        asked.clear()
        own = solve(problem)
        assert not asked  # the compiled solver decided; piqp never had to
        verdicts.append(agree(problem, ("piqp",)))
        second, objective = clarabel_says(problem)
        if own.status is QpStatus.SOLVED:
            assert second == "Solved"
            assert own.objective == pytest.approx(objective, rel=CLOSE, abs=CLOSE)
        else:
            assert second == "PrimalInfeasible"
    infeasible = verdicts.count(QpStatus.INFEASIBLE)
    assert 0.3 * len(verdicts) < infeasible < 0.6 * len(verdicts)


def test_every_solver_that_is_offered_solves():
    problem = speed_program(np.random.default_rng(1))
    expected = solve(problem)
    assert expected.status is QpStatus.SOLVED
    for name in SOLVERS:
        found = solve(problem, name)
        assert found.status is QpStatus.SOLVED, name
        assert found.objective == pytest.approx(expected.objective, rel=1e-5)


def test_without_bounds_it_is_a_linear_system():
    rng = np.random.default_rng(2)
    bounded = speed_program(rng)
    none = np.full(bounded.lower.shape, np.inf)
    problem = replace(
        bounded,
        lower=-none,
        upper=none,
        jerk_lower=-np.inf,
        jerk_upper=np.inf,
        row_upper=np.full(bounded.row_upper.shape, np.inf),
    )
    n, h = 101, 0.1
    step = np.array([[1.0, h, h * h / 2], [0.0, 1.0, h], [0.0, 0.0, 1.0]])
    push = np.array([h**3 / 6, h * h / 2, h])
    free, effect = np.empty((n, 3)), np.zeros((n, 3, n - 1))
    free[0] = problem.start
    for k in range(n - 1):
        free[k + 1] = step @ free[k]
        effect[k + 1] = step @ effect[k]
        effect[k + 1][:, k] += push
    weight = np.sqrt(h * problem.weight).ravel()
    a = np.vstack(
        [
            weight[:, None] * effect.reshape(3 * n, n - 1),
            np.sqrt(h * problem.jerk_weight) * np.eye(n - 1),
        ]
    )
    b = np.concatenate([weight * (problem.reference - free).ravel(), np.zeros(n - 1)])
    jerk = np.linalg.lstsq(a, b, rcond=None)[0]
    np.testing.assert_allclose(solve(problem).jerk, jerk, atol=1e-6)


@settings(max_examples=15)
@given(st.integers(0, 2**20))
def test_left_and_right_are_alike(seed):
    problem = path_program(np.random.default_rng(seed))
    mirrored = replace(
        problem, start=-problem.start, lower=-problem.upper, upper=-problem.lower
    )
    one, other = solve(problem), solve(mirrored)
    assert one.status is other.status
    if one.status is QpStatus.SOLVED:
        np.testing.assert_allclose(one.state, -other.state, atol=1e-5)


@settings(max_examples=15)
@given(st.integers(0, 2**20), st.floats(0.1, 30.0))
def test_the_scale_of_the_weights_does_not_matter(seed, scale):
    problem = speed_program(np.random.default_rng(seed))
    scaled = replace(
        problem,
        weight=scale * problem.weight,
        jerk_weight=scale * problem.jerk_weight,
    )
    one, other = solve(problem), solve(scaled)
    assert one.status is other.status
    if one.status is QpStatus.SOLVED:
        np.testing.assert_allclose(one.state, other.state, atol=2e-3)
        assert other.objective == pytest.approx(scale * one.objective, rel=1e-5)


def test_the_number_of_knots_does_not_change_the_answer():
    def program(n: int) -> PiecewiseJerkProblem:
        t = np.linspace(0.0, 10.0, n)
        lower = np.tile([-np.inf, 0.0, -4.0], (n, 1))
        upper = np.tile([np.inf, 20.0, 2.5], (n, 1))
        upper[:, 0] = 30.0 + 8.0 * t
        reference = np.column_stack([11.0 * t, np.full(n, 11.0), np.zeros(n)])
        none = np.zeros((n, 0))
        return PiecewiseJerkProblem(
            np.diff(t),
            np.array([0.0, 9.0, 0.0]),
            np.tile([0.05, 1.0, 2.0], (n, 1)),
            reference,
            4.0,
            lower,
            upper,
            -5.0,
            5.0,
            np.zeros((n, 0, 3)),
            none,
            none,
        )

    coarse, fine = solve(program(51)), solve(program(401))
    np.testing.assert_allclose(coarse.state[::5, 1], fine.state[::40, 1], atol=0.05)
    assert coarse.objective == pytest.approx(fine.objective, rel=0.03)


def against(problem: PiecewiseJerkProblem, cutoff: float):
    """Give (objective, verdict) of the solver that gives up what costs too much."""
    found = solve_with_cutoff(problem.as_program(), cutoff, OPTIONS)
    return found.objective, found.verdict


@pytest.mark.parametrize("kind", KINDS)
def test_only_what_costs_too_much_is_given_up(kind):
    rng, given_up = np.random.default_rng(12), 0
    for _ in range(30):
        problem = KINDS[kind](rng)
        exact = solve(problem)
        if exact.status is QpStatus.INFEASIBLE:
            assert against(problem, 1e3)[1] in (INFEASIBLE, ABOVE_CUTOFF)
            continue
        objective, verdict = against(problem, 1.001 * exact.objective + 1e-3)
        assert verdict == SOLVED
        assert objective == pytest.approx(exact.objective, rel=CLOSE, abs=CLOSE)
        for share in (0.3, 0.9, 0.99):
            bound, verdict = against(problem, share * exact.objective)
            assert verdict in (SOLVED, ABOVE_CUTOFF)
            assert bound <= exact.objective * (1.0 + CLOSE) + CLOSE
            given_up += verdict == ABOVE_CUTOFF
    assert given_up > 15  # unless the free motion is the answer, nearly all


def test_soft_bounds_are_kept_where_they_can_be():
    rng = np.random.default_rng(11)
    for _ in range(20):
        problem = speed_program(rng)
        hard, soft = solve(problem), solve_soft(problem)
        assert soft.status is QpStatus.SOLVED
        if hard.status is QpStatus.SOLVED:
            assert soft.slack < 1e-4
            assert soft.objective == pytest.approx(hard.objective, rel=1e-3, abs=1e-3)
        else:
            assert soft.slack > 1e-4
            kept = judge(problem, soft)
            assert max(kept.bounds, kept.rows) == pytest.approx(soft.slack, rel=1e-2)


def test_the_judge_sees_what_is_broken():
    problem = speed_program(np.random.default_rng(1))
    good = solve(problem)
    moved = good.state.copy()
    moved[50, 0] += 0.3
    assert judge(problem, replace(good, state=moved)).dynamics > 0.2
    pushed = good.jerk.copy()
    pushed[3] = 9.0
    assert judge(problem, replace(good, jerk=pushed)).bounds >= 4.0
    assert objective_of(problem, moved, good.jerk) != good.objective


def test_crossed_bounds_are_infeasible_at_once():
    problem = speed_program(np.random.default_rng(1))
    lower = problem.lower.copy()
    lower[10, 1] = 30.0
    assert solve(replace(problem, lower=lower)).status is QpStatus.INFEASIBLE


def test_a_missing_solver_is_one_clear_line(monkeypatch):
    problem = speed_program(np.random.default_rng(1))
    monkeypatch.delitem(
        qpsolvers.solve_problem.__globals__["solve_function"], "clarabel"
    )
    with pytest.raises(InvalidInputError, match="pip install clarabel"):
        solve(problem, "clarabel")


def test_mistakes_are_named():
    problem = speed_program(np.random.default_rng(1))
    with pytest.raises(InvalidInputError, match="none of riccati"):
        solve(problem, "oracle")
    with pytest.raises(InvalidInputError, match="has shape"):
        replace(
            problem,
            reference=problem.reference,
            lower=problem.lower[:5],
            weight=problem.weight,
            upper=problem.upper,
            row=problem.row[:3],
        )
    with pytest.raises(InvalidInputError, match="positive"):
        replace(problem, jerk_weight=0.0)
