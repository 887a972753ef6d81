"""The piecewise-jerk quadratic program: path over s, speed over t.

One program serves both of [Thesis] eq. 5.24-5.32 (p = l over s) and 6.19-6.20
(p = s over t):

    min  sum_k h_k (sum_d w[k, d] (x[k, d] - r[k, d])² + w_j j_k²)
    s.t. x[k + 1] = A(h_k) x[k] + B(h_k) j_k,  x[0] = start,
         lower <= x <= upper,  row_lower <= rows x <= row_upper,  |j| bounded,

x = (p, p', p''), with the jerk constant between knots. The sums carry h_k, so that the
number of knots does not change the answer ([Thesis] eq. 5.29 lacks it). Building,
solving and judging are separate.
"""

from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from planner.errors import InvalidInputError
from planner.piecewise_jerk.bounds import NO_BOUND
from planner.piecewise_jerk.interior_point import IpmOptions, interior_point
from planner.piecewise_jerk.problem import PiecewiseJerkProblem, Verdict
from planner.states import FloatArray

OPTIONS = IpmOptions(max_iterations=40, tolerance=1e-9)  # 8-12 iterations are usual
VIOLATION = 1e-6  # that a solution may have


class QpStatus(StrEnum):
    """How a program ended."""

    SOLVED = "solved"
    INFEASIBLE = "infeasible"  # proven
    NOT_CONVERGED = "not_converged"  # no solver could decide


@dataclass(frozen=True, slots=True, eq=False)
class PiecewiseJerkSolution:
    """Outcome of a solver; `state` and `jerk` are its best guess unless SOLVED."""

    status: QpStatus
    state: FloatArray  # (n, 3)
    jerk: FloatArray  # (n - 1,)
    objective: float
    slack: float  # the most by which a soft bound is exceeded, 0 for hard ones
    iterations: int
    solver: str


@dataclass(frozen=True, slots=True)
class Residuals:
    """By how much a solution breaks its constraints; all >= 0."""

    dynamics: float  # largest jump between the knots
    bounds: float  # largest violation of a bound of state or jerk
    rows: float  # largest violation of a row
    objective: float  # recomputed


def solve(
    problem: PiecewiseJerkProblem, solver: str = "riccati"
) -> PiecewiseJerkSolution:
    """Solve a program.

    Args:
        problem: Checked.
        solver: "riccati" is this project's own; where it does not converge, "piqp"
            decides. Others: a name of `SOLVERS`.

    Returns:
        The solution; its status is INFEASIBLE only where that is proven.

    Raises:
        InvalidInputError: If there is no such solver.
    """
    if solver != "riccati":
        return _by_matrices(problem, solver)
    program = problem.as_program()
    crossed = (program.lower[1:] > program.upper[1:]).any()
    if crossed or program.jerk_lower > program.jerk_upper:
        return _infeasible(problem, 0, "bounds")
    found = interior_point(program, OPTIONS)
    if found.verdict == Verdict.INFEASIBLE:
        return _infeasible(problem, found.iterations, solver)
    if found.verdict != Verdict.SOLVED:
        return _by_matrices(problem, "piqp")
    return PiecewiseJerkSolution(
        QpStatus.SOLVED,
        found.state,
        found.jerk,
        found.objective,
        0.0,
        found.iterations,
        solver,
    )


def solve_soft(
    problem: PiecewiseJerkProblem, linear: float = 1e3, quadratic: float = 1e2
) -> PiecewiseJerkSolution:
    """Solve with soft bounds on the position and soft rows.

    Each of them may be exceeded at a cost of h (linear e + quadratic e²). Bounds of
    p', p'' and jerk stay hard: they are what the vehicle can do.

    Args:
        problem: Checked.
        linear: Price of the first bit; where it exceeds the multipliers of the hard
            program the result is the same as that one's.
        quadratic: Of larger ones.

    Returns:
        The solution with the largest slack that it needed; its objective is that of
        the hard program, without the price of the slack.
    """
    return _by_matrices(problem, "piqp", (linear, quadratic))


def judge(problem: PiecewiseJerkProblem, solution: PiecewiseJerkSolution) -> Residuals:
    """Recompute the residuals of a solution from its numbers alone."""
    x, j, h = solution.state, solution.jerk, problem.step
    p, v, a = x[:-1].T
    after = np.column_stack(
        [
            p + h * v + h**2 * a / 2.0 + h**3 * j / 6.0,
            v + h * a + h**2 * j / 2.0,
            a + h * j,
        ]
    )
    dynamics = max(
        float(np.abs(after - x[1:]).max()), float(np.abs(x[0] - problem.start).max())
    )
    state = np.maximum(problem.lower - x, x - problem.upper)[1:]
    jerk = np.maximum(problem.jerk_lower - j, j - problem.jerk_upper)
    value = np.einsum("kmd,kd->km", problem.row, x)
    row = np.maximum(problem.row_lower - value, value - problem.row_upper)[1:]
    return Residuals(
        dynamics,
        max(float(state.max()), float(jerk.max()), 0.0),
        float(row.max(initial=0.0)),
        objective_of(problem, x, j),
    )


def objective_of(
    problem: PiecewiseJerkProblem, state: FloatArray, jerk: FloatArray
) -> float:
    """Price a motion, without its constraints."""
    h = np.append(problem.step, problem.step[-1])
    of_state = (problem.weight * (state - problem.reference) ** 2).sum(axis=1) @ h
    return float(of_state + problem.jerk_weight * (jerk**2 @ problem.step))


def _infeasible(
    problem: PiecewiseJerkProblem, iterations: int, solver: str
) -> PiecewiseJerkSolution:
    """Make the record of a program without a solution."""
    n = problem.weight.shape[0]
    return PiecewiseJerkSolution(
        QpStatus.INFEASIBLE,
        np.tile(problem.start, (n, 1)),
        np.zeros(n - 1),
        np.inf,
        0.0,
        iterations,
        solver,
    )


def _by_matrices(
    problem: PiecewiseJerkProblem,
    solver: str,
    price: tuple[float, float] | None = None,
) -> PiecewiseJerkSolution:
    """Solve by a general solver and check its result.

    Args:
        problem: Checked.
        solver: A name of `SOLVERS`.
        price: Linear and quadratic one of soft bounds; None for hard ones.
    """
    # imports scipy and all solvers, for 0.2 s: few runs need them
    from planner.piecewise_jerk import sparse_solvers as general

    if solver not in general.SOLVERS:
        raise InvalidInputError(
            f"solver {solver} is none of riccati, {', '.join(general.SOLVERS)}"
        )
    if price is None:
        program = general.program_of(problem)
    else:
        program = general.relaxed_program(problem, *price)
    found, z, iterations = general.solve_program(program, solver)
    n = problem.weight.shape[0]
    if z is None or not np.isfinite(z).all():
        missing = _infeasible(problem, iterations, solver)
        status = (
            QpStatus.INFEASIBLE if found == "infeasible" else QpStatus.NOT_CONVERGED
        )
        return PiecewiseJerkSolution(
            status, missing.state, missing.jerk, np.inf, 0.0, iterations, solver
        )
    state, jerk = z[: 3 * n].reshape(n, 3), z[3 * n : 4 * n - 1]
    slack = float(z[4 * n - 1 :].max(initial=0.0))
    residuals = judge(
        problem,
        PiecewiseJerkSolution(QpStatus.SOLVED, state, jerk, 0.0, slack, 0, solver),
    )
    allowed = VIOLATION + slack
    kept = residuals.dynamics < VIOLATION and max(residuals.bounds, residuals.rows) < (
        allowed * (1.0 + np.abs(state).max())
    )
    if found == "solved" and not kept:
        found = "not_converged"
    return PiecewiseJerkSolution(
        QpStatus(found), state, jerk, residuals.objective, slack, iterations, solver
    )


__all__ = [
    "NO_BOUND",
    "PiecewiseJerkProblem",
    "PiecewiseJerkSolution",
    "QpStatus",
    "Residuals",
    "judge",
    "objective_of",
    "solve",
    "solve_soft",
]
