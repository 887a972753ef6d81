"""Random piecewise-jerk programs of both kinds, about half of them infeasible."""

import numpy as np

from planner.piecewise_jerk.solve import PiecewiseJerkProblem

INF = np.inf


def speed_program(rng: np.random.Generator) -> PiecewiseJerkProblem:
    """s over t: a vehicle to pass before or after, now and then a headway."""
    n, h = 101, 0.1
    t = h * np.arange(n)
    start = np.array([0.0, rng.uniform(0.0, 18.0), rng.uniform(-1.0, 1.0)])
    lower = np.tile([-INF, 0.0, -4.0], (n, 1))
    upper = np.tile([INF, 20.0, 2.5], (n, 1))
    on, ahead = t >= rng.uniform(1.0, 6.0), rng.uniform(-10.0, 60.0)
    other = ahead + rng.uniform(5.0, 14.0) * t
    if rng.random() < 0.5:
        upper[on, 0] = other[on]
    else:
        lower[on, 0] = np.minimum(other, 30.0 + other - ahead)[on]
    row, bound = np.zeros((n, 1, 3)), np.full((n, 1), INF)
    if rng.random() < 0.5:
        row[:] = 1.0, 1.0, 0.0
        bound[:, 0] = rng.uniform(10.0, 60.0) + 8.0 * t
    reference = np.column_stack([11.0 * t, np.full(n, 11.0), np.zeros(n)])
    return PiecewiseJerkProblem(
        np.full(n - 1, h),
        start,
        np.tile([0.05, 1.0, 2.0], (n, 1)),
        reference,
        4.0,
        lower,
        upper,
        -5.0,
        5.0,
        row,
        np.full((n, 1), -INF),
        bound,
    )


def path_program(rng: np.random.Generator) -> PiecewiseJerkProblem:
    """l over s: a tube with four gates and a bound of the second derivative."""
    n, h = 120, 0.5
    start = np.array([rng.uniform(-2.0, 2.0), rng.uniform(-0.1, 0.1), 0.0])
    lower = np.tile([-4.0, -1.0, -0.2], (n, 1))
    upper = -lower
    for _ in range(4):
        gate = int(rng.integers(20, 110))
        if rng.random() < 0.5:
            lower[gate - 4 : gate + 4, 0] = rng.uniform(-1.0, 2.5)
        else:
            upper[gate - 4 : gate + 4, 0] = rng.uniform(-2.5, 1.0)
    none = np.zeros((n, 0))
    return PiecewiseJerkProblem(
        np.full(n - 1, h),
        start,
        np.tile([0.1, 10.0, 500.0], (n, 1)),
        np.zeros((n, 3)),
        1000.0,
        lower,
        upper,
        -0.1,
        0.1,
        np.zeros((n, 0, 3)),
        none,
        none,
    )


KINDS = {"speed": speed_program, "path": path_program}
