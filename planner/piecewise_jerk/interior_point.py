"""Compiled solver of the piecewise-jerk program: interior point, Riccati recursions.

Mehrotra's predictor-corrector, [NocedalWright2006] algorithm 16.4; its Newton step is
a recursion over the knots (`planner.piecewise_jerk.riccati`), its bounds are those of
`planner.piecewise_jerk.bounds`. Iterates always obey the dynamics, so that only slacks
and multipliers have residuals. A solve ends early where the multipliers prove that
there is no motion, or none below a cutoff.

It stands beside `active_set` because each is faster at its work: this one solves a
program from scratch, with bounds of the jerk; that one goes on from a program with a
few bounds less, which an interior point cannot.
"""

from typing import NamedTuple

import numpy as np

from planner.numerics.compiled import compiled, inlined
from planner.piecewise_jerk.bounds import (
    NO_BOUND,
    BoundBlocks,
    bound_blocks,
    bound_residuals,
    certifies_infeasibility,
    gather,
    gather_curvature,
    row_values,
    slack_steps,
)
from planner.piecewise_jerk.objective import (
    FreeMotion,
    Objective,
    add_linear_term,
    fill_gradient,
    fill_hessian,
    free_motion,
    objective_value,
)
from planner.piecewise_jerk.problem import JerkProgram, Verdict
from planner.piecewise_jerk.riccati import backward, backward_linear, forward
from planner.piecewise_jerk.vector_loops import (
    affine_dual_steps,
    centring,
    dot,
    dual_steps,
    inverses,
    largest,
    least,
    longest_step,
    move,
    move_table,
    products,
    shortfalls,
    slack_residuals,
)
from planner.states import FloatArray

PROOF_FROM = 2  # iterations before a proof of infeasibility is looked for
CUT_FROM = 1  # and one that the cutoff is exceeded
TO_THE_BOUND = 0.995  # share of the way to the nearest bound that a step may go
LEAST_SLACK = 1.0  # at the beginning
CUT_MARGIN = 1e-6  # by which a bound has to exceed the cutoff, relative

# Plain numbers: numba compiles these in.
SOLVED = int(Verdict.SOLVED)
INFEASIBLE = int(Verdict.INFEASIBLE)
UNDECIDED = int(Verdict.UNDECIDED)
ABOVE_CUTOFF = int(Verdict.ABOVE_CUTOFF)


class IpmOptions(NamedTuple):
    """When to stop."""

    max_iterations: int
    tolerance: float  # of the bounds, and of the gap relative to the objective


class IpmSolution(NamedTuple):
    """Outcome of a solve; `verdict` is a value of `Verdict`."""

    state: FloatArray  # (n, 3)
    jerk: FloatArray  # (n - 1,)
    objective: float  # or a lower bound of it above the cutoff; inf without a solution
    verdict: int
    iterations: int


class IpmState(NamedTuple):
    """The iterate; arrays over bounds are (n_blocks n,), block after block."""

    table: FloatArray  # motion, (4 + m, n)
    room: FloatArray  # of the motion to every bound
    residual: FloatArray  # slack less room
    slack: FloatArray  # > 0
    dual: FloatArray  # multipliers, > 0 where there is a bound


class IpmStep(NamedTuple):
    """A step of the iterate and what it is made of; shapes as in `IpmState`."""

    table: FloatArray
    slack: FloatArray
    dual: FloatArray
    push: FloatArray  # on the multipliers
    inverse: FloatArray  # 1 / slack
    ratio: FloatArray  # dual / slack


class Cutoff(NamedTuple):
    """The free motion that lower bounds start from, and what they have to exceed."""

    threshold: float  # cutoff and margin; inf without a cutoff
    free_objective: float  # of the motion without bounds
    free_room: FloatArray  # of that motion to every bound, (n_blocks n,)
    free_gain: FloatArray  # of its recursion, (4, n - 1)


class NewtonSystem(NamedTuple):
    """The quadratic program along the dynamics whose minimum is a step."""

    hessian: FloatArray  # (7, n)
    gradient: FloatArray  # (4, n)
    gain: FloatArray  # of the recursion, (4, n - 1)
    feedforward: FloatArray  # (n - 1,)
    barrier: FloatArray  # curvature that the bounds add by columns, (4 + m, n)
    linear_term: FloatArray  # and what they add to the gradient, (4 + m, n)


@compiled
def interior_point(program: JerkProgram, options: IpmOptions) -> IpmSolution:
    """Solve one program whatever it costs; see `solve_with_cutoff`."""
    return solve_with_cutoff(program, np.inf, options)


@compiled
def solve_with_cutoff(
    program: JerkProgram, cutoff: float, options: IpmOptions
) -> IpmSolution:
    """Solve one program with hard bounds, unless it is proven to exceed a cutoff.

    Args:
        program: To solve.
        cutoff: Where the multipliers prove that every motion within the bounds costs
            more, the verdict is ABOVE_CUTOFF and the objective that lower bound.
        options: When to stop.
    """
    free = free_motion(program)
    blocks = bound_blocks(program)
    state = _initial_state(program, free, blocks)
    objective = objective_value(free.objective, state.table)
    if least(state.room) >= 0.0 and np.isfinite(objective):  # bounds change nothing
        return _solution(state.table, objective, SOLVED, 0)

    step, system = _step_and_system(state, free)
    known = _cutoff(cutoff, objective, state.room.copy(), free.gain)
    if known.threshold < np.inf:  # what the free motion breaks may be proof enough
        shortfalls(state.room, state.dual)
        bound = dual_bound(program, blocks, state.dual, known, step.table, system)
        if bound > known.threshold:
            return _solution(state.table, bound, ABOVE_CUTOFF, 0)
    _start_inside(blocks, state)
    dual_residual = 1.0  # relative to the first one; falls with every step taken
    for iteration in range(options.max_iterations + 1):
        objective = objective_value(free.objective, state.table)
        slack_residuals(state.slack, blocks.active, state.room, state.residual)
        gap = dot(state.slack, state.dual)  # mu times the number of bounds
        violation = max(largest(state.residual), -least(state.residual))
        small = options.tolerance * (1.0 + abs(objective))
        broken = violation > options.tolerance
        if (
            violation < options.tolerance
            and gap < small
            and dual_residual < options.tolerance
        ):
            return _solution(state.table, objective, SOLVED, iteration)
        if iteration == options.max_iterations or not np.isfinite(objective + gap):
            break
        verdict, bound = _early_verdict(
            program, blocks, state, known, iteration, broken, step, system
        )
        if verdict != UNDECIDED:
            return _solution(state.table, bound, verdict, iteration)
        _predict(program, free.objective, blocks, state, step, system)
        sigma_mu = _centring_target(gap, blocks.n_bounds, step)
        _correct(program, sigma_mu, blocks, state, step, system)
        alpha = _step_length(state, step, gap, objective)
        _advance(alpha, blocks, state, step)
        dual_residual *= 1.0 - alpha
    return _solution(state.table, np.inf, UNDECIDED, options.max_iterations)


@inlined
def _cutoff(
    cutoff: float, free_objective: float, free_room: FloatArray, free_gain: FloatArray
) -> Cutoff:
    """Make the record; an infinite cutoff has an infinite threshold."""
    threshold = np.inf
    if cutoff < NO_BOUND:
        threshold = cutoff + CUT_MARGIN * (1.0 + abs(cutoff))
    return Cutoff(threshold, free_objective, free_room, free_gain)


@inlined
def _early_verdict(
    program: JerkProgram,
    blocks: BoundBlocks,
    state: IpmState,
    cutoff: Cutoff,
    iteration: int,
    broken: bool,  # noqa: FBT001 - a fact about the iterate
    step: IpmStep,
    system: NewtonSystem,
) -> tuple[int, float]:
    """Try the present multipliers as proofs: (verdict, bound of the objective)."""
    if broken and iteration >= PROOF_FROM:
        gather(state.dual, blocks, system.linear_term)
        if certifies_infeasibility(
            program, blocks, state.table, state.dual, state.room, system.linear_term
        ):
            return INFEASIBLE, np.inf
    if cutoff.threshold < np.inf and iteration >= CUT_FROM:
        bound = dual_bound(program, blocks, state.dual, cutoff, step.table, system)
        if bound > cutoff.threshold:
            return ABOVE_CUTOFF, bound
    return UNDECIDED, np.inf


@inlined
def _initial_state(
    program: JerkProgram, free: FreeMotion, blocks: BoundBlocks
) -> IpmState:
    """Begin at the motion without bounds; slacks and multipliers are not filled yet."""
    n, m, size = program.row.shape[0], program.row.shape[1], blocks.active.size
    table = np.empty((4 + m, n))
    table[:3], table[3 + m] = free.table[:3], free.table[3]
    row_values(program.row, table)
    room = np.empty(size)
    bound_residuals(table, blocks, room)
    return IpmState(table, room, np.empty(size), np.empty(size), np.empty(size))


@inlined
def _step_and_system(state: IpmState, free: FreeMotion) -> tuple[IpmStep, NewtonSystem]:
    """Allocate what every iteration fills; the gain of the free motion is kept."""
    size, shape = state.room.size, state.table.shape
    n = shape[1]
    step = IpmStep(
        np.zeros(shape),
        np.empty(size),
        np.empty(size),
        np.empty(size),
        np.empty(size),
        np.empty(size),
    )
    system = NewtonSystem(
        np.empty((7, n)),
        np.empty((4, n)),
        np.empty((4, n - 1)),
        free.feedforward,
        np.empty(shape),
        np.empty(shape),
    )
    return step, system


@inlined
def _start_inside(blocks: BoundBlocks, state: IpmState) -> None:
    """Begin inside every bound, with slack times multiplier 1 at each.

    Where there is no bound, the slack is 1 and the multiplier 0.
    """
    for i in range(state.room.size):
        if blocks.active[i] > 0.0:
            state.slack[i] = max(state.room[i], LEAST_SLACK)
            state.dual[i] = 1.0 / state.slack[i]
        else:
            state.slack[i], state.dual[i] = 1.0, 0.0


@compiled
def dual_bound(
    program: JerkProgram,
    blocks: BoundBlocks,
    dual: FloatArray,
    free: Cutoff,
    change: FloatArray,
    system: NewtonSystem,
) -> float:
    """Compute a lower bound of the objective of every motion within the bounds.

    For multipliers t z the dual function is f_free - t z'room + ½ t² z'J dx, where dx
    is the answer of the free motion to the push of the multipliers. It bounds the
    objective from below for every t >= 0 ([NocedalWright2006] theorem 12.11); here for
    the best t.

    Args:
        program: Gives dynamics and rows.
        blocks: Its bounds.
        dual: Multipliers z, (n_blocks n,).
        free: The motion without bounds.
        change: Overwritten, (4 + m, n).
        system: Overwritten: linear term, gradient, feedforward.
    """
    gather(dual, blocks, system.linear_term)
    room = dot(dual, free.free_room)
    if room >= 0.0:
        return free.free_objective
    gradient = system.gradient
    gradient[:] = 0.0
    add_linear_term(program.row, system.linear_term, gradient)
    backward_linear(program.step, gradient, free.free_gain, system.feedforward)
    forward(program.step, free.free_gain, system.feedforward, change)
    answer, last = 0.0, change.shape[0] - 1
    for k in range(change.shape[1]):
        answer += gradient[0, k] * change[0, k] + gradient[1, k] * change[1, k]
        answer += gradient[2, k] * change[2, k] + gradient[3, k] * change[last, k]
    return free.free_objective + 0.5 * room * room / max(-answer, 1e-300)


@inlined
def _predict(
    program: JerkProgram,
    objective: Objective,
    blocks: BoundBlocks,
    state: IpmState,
    step: IpmStep,
    system: NewtonSystem,
) -> None:
    """Fill the affine step, which aims at a gap of 0; the gains are kept."""
    inverses(state.slack, step.inverse)
    products(state.dual, step.inverse, step.ratio)
    gather_curvature(step.ratio, blocks, system.barrier)
    fill_hessian(objective, system.barrier, program.row, system.hessian)
    products(step.ratio, state.residual, step.push)
    gather(step.push, blocks, system.linear_term)
    fill_gradient(objective, state.table, system.gradient)
    add_linear_term(program.row, system.linear_term, system.gradient)
    backward(
        program.step, system.hessian, system.gradient, system.gain, system.feedforward
    )
    forward(program.step, system.gain, system.feedforward, step.table)
    row_values(program.row, step.table)
    slack_steps(step.table, blocks, state.residual, step.slack)
    products(step.slack, step.inverse, step.push)
    affine_dual_steps(step.ratio, step.slack, state.dual, step.dual)


@inlined
def _centring_target(gap: float, n_bounds: int, step: IpmStep) -> float:
    """Return sigma mu: how much gap the corrector aims at; sigma = (mu_aff / mu)³."""
    # of the affine step dz / z = -1 - ds / s
    nearest = max(-least(step.push), 1.0 + largest(step.push))
    alpha_affine = min(1.0 / nearest, 1.0)
    crossed = dot(step.slack, step.dual)
    gap_affine = (1.0 - alpha_affine) * gap + alpha_affine * alpha_affine * crossed
    return (gap_affine / gap) ** 3 * gap / n_bounds


@inlined
def _correct(
    program: JerkProgram,
    sigma_mu: float,
    blocks: BoundBlocks,
    state: IpmState,
    step: IpmStep,
    system: NewtonSystem,
) -> None:
    """Fill the step that centres and corrects the affine one to second order."""
    centring(sigma_mu, blocks.active, step.slack, step.dual, step.inverse, step.push)
    gather(step.push, blocks, system.linear_term)
    add_linear_term(program.row, system.linear_term, system.gradient)
    backward_linear(program.step, system.gradient, system.gain, system.feedforward)
    forward(program.step, system.gain, system.feedforward, step.table)
    row_values(program.row, step.table)
    slack_steps(step.table, blocks, state.residual, step.slack)
    dual_steps(step.push, step.ratio, step.slack, state.dual, step.dual)


@inlined
def _step_length(state: IpmState, step: IpmStep, gap: float, objective: float) -> float:
    """Return alpha, one for motion and multipliers: nearly to the nearest bound."""
    alpha = longest_step(state.slack, step.slack, step.inverse, state.dual, step.dual)
    # where the gap is small the bounds in reach are those that hold in the end
    share = max(TO_THE_BOUND, 1.0 - gap / (1.0 + abs(objective)))
    return min(1.0, share * alpha)


@inlined
def _advance(alpha: float, blocks: BoundBlocks, state: IpmState, step: IpmStep) -> None:
    """Apply a share of the step."""
    move_table(state.table, step.table, alpha)
    move(state.slack, step.slack, alpha)
    move(state.dual, step.dual, alpha)
    bound_residuals(state.table, blocks, state.room)


@compiled
def _solution(
    table: FloatArray, objective: float, verdict: int, iterations: int
) -> IpmSolution:
    """Make the record, with the states as rows."""
    state = np.empty((table.shape[1], 3))
    for k in range(table.shape[1]):
        state[k, 0], state[k, 1], state[k, 2] = table[0, k], table[1, k], table[2, k]
    jerk = table[table.shape[0] - 1, :-1].copy()
    return IpmSolution(state, jerk, objective, verdict, iterations)
