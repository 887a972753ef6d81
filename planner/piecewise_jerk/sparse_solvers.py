"""The piecewise-jerk program as sparse matrices, for general solvers.

Variables z = (x_0 ... x_{n-1}, j_0 ... j_{n-2}, slacks). This is the slower way: it
decides where the compiled solver does not converge, softens bounds, and is what the
compiled solver is tested against.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import piqp
import qpsolvers
from scipy import sparse

from planner.errors import InvalidInputError
from planner.piecewise_jerk.problem import PiecewiseJerkProblem
from planner.states import FloatArray, IntArray

HUGE = 1e30  # stands for infinity in solvers that know none
TIGHT = 1e-9  # tolerance asked of every solver


@dataclass(frozen=True, slots=True, eq=False)
class Program:
    """min ½ z'P z + q'z, A z = b, g_lower <= G z <= g_upper, lower <= z <= upper."""

    p: sparse.csc_matrix
    q: FloatArray
    a: sparse.csc_matrix
    b: FloatArray
    g: sparse.csc_matrix
    g_lower: FloatArray
    g_upper: FloatArray
    lower: FloatArray
    upper: FloatArray


def program_of(problem: PiecewiseJerkProblem) -> Program:
    """Write a problem with hard bounds as matrices."""
    n, m = problem.row.shape[:2]
    size = 4 * n - 1
    h = np.append(problem.step, problem.step[-1])
    weight = 2.0 * h[:, None] * problem.weight
    hessian = np.concatenate([weight.ravel(), 2.0 * problem.step * problem.jerk_weight])
    linear = np.zeros(size)
    linear[: 3 * n] = -(weight * problem.reference).ravel()
    lower, upper = np.full(size, -HUGE), np.full(size, HUGE)
    lower[3 : 3 * n] = np.maximum(problem.lower[1:], -HUGE).ravel()
    upper[3 : 3 * n] = np.minimum(problem.upper[1:], HUGE).ravel()
    lower[3 * n :] = max(problem.jerk_lower, -HUGE)
    upper[3 * n :] = min(problem.jerk_upper, HUGE)
    low = np.maximum(problem.row_lower[1:], -HUGE).ravel()
    up = np.minimum(problem.row_upper[1:], HUGE).ravel()
    bounded = (low > -HUGE) | (up < HUGE)
    knots = np.repeat(np.arange(1, n), m)[bounded]
    rows = sparse.csc_matrix(
        (
            problem.row[1:].reshape(-1, 3)[bounded].ravel(),
            (
                np.repeat(np.arange(knots.size), 3),
                (3 * knots[:, None] + np.arange(3)).ravel(),
            ),
        ),
        shape=(knots.size, size),
    )
    right = np.zeros(3 * n)
    right[:3] = problem.start
    return Program(
        sparse.diags(hessian).tocsc(),
        linear,
        _dynamics(problem.step),
        right,
        rows,
        low[bounded],
        up[bounded],
        lower,
        upper,
    )


def relaxed_program(
    problem: PiecewiseJerkProblem, linear: float, quadratic: float
) -> Program:
    """Write a problem whose position bounds and rows may be exceeded at a price.

    Every position and every row gets a slack e >= 0 for both of its bounds.
    """
    hard = program_of(problem)
    n = problem.row.shape[0]
    size = 4 * n - 1
    row_knots = _bounded_row_knots(problem)
    n_slack = n - 1 + row_knots.size
    place = np.arange(n - 1)
    positions = sparse.csc_matrix(
        (np.ones(n - 1), (place, 3 * (place + 1))), shape=(n - 1, size)
    )
    both = sparse.vstack([positions, hard.g]).tocsr()
    low = np.concatenate([hard.lower[3 : 3 * n : 3], hard.g_lower])
    up = np.concatenate([hard.upper[3 : 3 * n : 3], hard.g_upper])
    above, below = np.flatnonzero(up < HUGE), np.flatnonzero(low > -HUGE)
    eye = sparse.identity(n_slack, format="csr")
    h = problem.step
    price = np.concatenate([h, h[row_knots]])
    lower, upper = hard.lower.copy(), hard.upper.copy()
    lower[3 : 3 * n : 3], upper[3 : 3 * n : 3] = -HUGE, HUGE
    return Program(
        sparse.csc_matrix(
            sparse.block_diag([hard.p, sparse.diags(2.0 * quadratic * price)])
        ),
        np.concatenate([hard.q, linear * price]),
        sparse.csc_matrix(sparse.hstack([hard.a, sparse.csc_matrix((3 * n, n_slack))])),
        hard.b,
        sparse.csc_matrix(
            sparse.vstack(
                [
                    sparse.hstack([both[above], -eye[above]]),
                    sparse.hstack([both[below], eye[below]]),
                ]
            )
        ),
        np.concatenate([np.full(above.size, -HUGE), low[below]]),
        np.concatenate([up[above], np.full(below.size, HUGE)]),
        np.concatenate([lower, np.zeros(n_slack)]),
        np.concatenate([upper, np.full(n_slack, HUGE)]),
    )


def _bounded_row_knots(problem: PiecewiseJerkProblem) -> IntArray:
    """Return the interval before the knot of every row that has a bound."""
    bounded = (problem.row_lower[1:] > -HUGE) | (problem.row_upper[1:] < HUGE)
    return np.nonzero(bounded)[0]


def _dynamics(step: FloatArray) -> sparse.csc_matrix:
    """Write x_0 = start and x_{k+1} = A(h) x_k + B(h) j_k as rows, (3 n, 4 n - 1)."""
    n = step.size + 1
    h, one = step, np.ones(step.size)
    k = np.arange(step.size)
    entries = [  # row in the block, column, value
        (0, 3 * k, -one),
        (0, 3 * k + 1, -h),
        (0, 3 * k + 2, -0.5 * h**2),
        (1, 3 * k + 1, -one),
        (1, 3 * k + 2, -h),
        (2, 3 * k + 2, -one),
        (0, 3 * n + k, -(h**3) / 6.0),
        (1, 3 * n + k, -0.5 * h**2),
        (2, 3 * n + k, -h),
    ]
    rows = [3 * (k + 1) + row for row, _, _ in entries]
    every = np.arange(3 * n)
    return sparse.csc_matrix(
        (
            np.concatenate([np.ones(3 * n), *(value for _, _, value in entries)]),
            (
                np.concatenate([every, *rows]),
                np.concatenate([every, *(column for _, column, _ in entries)]),
            ),
        ),
        shape=(3 * n, 4 * n - 1),
    )


Outcome = tuple[str, FloatArray | None, int]


def solve_program(program: Program, solver: str) -> Outcome:
    """Solve matrices by name; gives ("solved" | "infeasible" | "not_converged", z, n).

    Args:
        program: As written above.
        solver: A name of `SOLVERS`.
    """
    return SOLVERS[solver](program)


def _by_piqp(program: Program) -> Outcome:
    """Solve by piqp's own interface, which tells infeasible from not converged."""
    solver = piqp.SparseSolver()
    solver.settings.eps_abs = solver.settings.eps_rel = TIGHT
    solver.settings.verbose = False
    solver.setup(
        program.p,
        program.q,
        program.a,
        program.b,
        program.g,
        program.g_lower,
        program.g_upper,
        program.lower,
        program.upper,
    )
    status = solver.solve()
    verdicts = {
        piqp.PIQP_SOLVED: "solved",
        piqp.PIQP_PRIMAL_INFEASIBLE: "infeasible",
    }
    verdict = verdicts.get(status, "not_converged")
    z = np.array(solver.result.x) if verdict == "solved" else None
    return verdict, z, int(solver.result.info.iter)


def _by_front_end(name: str, **settings: Any) -> Callable[[Program], Outcome]:
    """Make a solver that goes through qpsolvers; dense solvers get dense matrices."""

    def run(program: Program) -> Outcome:
        keep_up, keep_low = program.g_upper < HUGE, program.g_lower > -HUGE
        g = sparse.vstack([program.g[keep_up], -program.g[keep_low]])
        h = np.concatenate([program.g_upper[keep_up], -program.g_lower[keep_low]])
        shape = sparse.csc_matrix if name == "clarabel" else np.asarray
        dense = (lambda x: x.toarray()) if shape is np.asarray else shape
        problem = qpsolvers.Problem(
            dense(program.p),
            program.q,
            dense(g) if h.size else None,
            h if h.size else None,
            dense(program.a),
            program.b,
            np.where(program.lower > -HUGE, program.lower, -np.inf),
            np.where(program.upper < HUGE, program.upper, np.inf),
        )
        try:
            solution = qpsolvers.solve_problem(problem, solver=name, **settings)
        except qpsolvers.SolverNotFound as error:
            raise InvalidInputError(
                f"solver {name} is not installed: pip install {name}"
            ) from error
        except qpsolvers.SolverError:
            return "not_converged", None, 0
        if solution.found:
            return "solved", np.asarray(solution.x), 0
        return "infeasible" if name in EXACT else "not_converged", None, 0

    return run


EXACT = ("daqp",)  # when it finds no solution there is none: an active-set method

SOLVERS: Mapping[str, Callable[[Program], Outcome]] = {
    "piqp": _by_piqp,
    "daqp": _by_front_end("daqp"),
    "proxqp": _by_front_end("proxqp", eps_abs=TIGHT, eps_rel=0.0),
    "clarabel": _by_front_end("clarabel", tol_gap_abs=TIGHT, tol_gap_rel=TIGHT),
}
