"""Loops over arrays of equal size, as the interior point needs them.

Each writes one array: so the compiler makes vector code of it. Sums and maxima run in
four lanes for the same reason; their order is fixed.
"""

from planner.numerics.compiled import compiled
from planner.states import FloatArray


@compiled
def slack_residuals(
    slack: FloatArray, active: FloatArray, room: FloatArray, residual: FloatArray
) -> None:
    """Fill slack less room: 0 where the slacks are those of the motion."""
    for i in range(slack.size):
        residual[i] = active[i] * slack[i] - room[i]


@compiled
def shortfalls(room: FloatArray, short: FloatArray) -> None:
    """Fill by how much bounds are broken."""
    for i in range(room.size):
        short[i] = max(-room[i], 0.0)


@compiled
def inverses(values: FloatArray, inverse: FloatArray) -> None:
    """Fill 1 / values."""
    for i in range(values.size):
        inverse[i] = 1.0 / values[i]


@compiled
def products(one: FloatArray, other: FloatArray, product: FloatArray) -> None:
    """Fill one times other."""
    for i in range(one.size):
        product[i] = one[i] * other[i]


@compiled
def affine_dual_steps(
    ratio: FloatArray, d_slack: FloatArray, dual: FloatArray, d_dual: FloatArray
) -> None:
    """Fill the predictor's steps of the multipliers, which aim at a gap of 0."""
    for i in range(ratio.size):
        d_dual[i] = -ratio[i] * d_slack[i] - dual[i]


@compiled
def centring(
    sigma_mu: float,
    active: FloatArray,
    d_slack: FloatArray,
    d_dual: FloatArray,
    inverse: FloatArray,
    push: FloatArray,
) -> None:
    """Fill what the corrector adds to the multipliers: centring, second order."""
    for i in range(active.size):
        push[i] = (sigma_mu * active[i] - d_slack[i] * d_dual[i]) * inverse[i]


@compiled
def dual_steps(
    push: FloatArray,
    ratio: FloatArray,
    d_slack: FloatArray,
    dual: FloatArray,
    d_dual: FloatArray,
) -> None:
    """Fill the corrector's steps of the multipliers."""
    for i in range(push.size):
        d_dual[i] = push[i] - ratio[i] * d_slack[i] - dual[i]


@compiled
def move(values: FloatArray, change: FloatArray, alpha: float) -> None:
    """Add a share of a change, in place."""
    for i in range(values.size):
        values[i] += alpha * change[i]


@compiled
def move_table(table: FloatArray, change: FloatArray, alpha: float) -> None:
    """Add a share of a change to a table of two dimensions, in place."""
    for i in range(table.shape[0]):
        for k in range(table.shape[1]):
            table[i, k] += alpha * change[i, k]


@compiled
def least(values: FloatArray) -> float:
    """Return the least of many numbers, at most 0."""
    m0, m1, m2, m3 = 0.0, 0.0, 0.0, 0.0
    whole = values.size - values.size % 4
    for i in range(0, whole, 4):
        m0 = values[i] if values[i] < m0 else m0
        m1 = values[i + 1] if values[i + 1] < m1 else m1
        m2 = values[i + 2] if values[i + 2] < m2 else m2
        m3 = values[i + 3] if values[i + 3] < m3 else m3
    for i in range(whole, values.size):
        m0 = min(m0, values[i])
    return min(m0, m1, m2, m3)


@compiled
def largest(values: FloatArray) -> float:
    """Return the greatest of many numbers, at least 0."""
    m0, m1, m2, m3 = 0.0, 0.0, 0.0, 0.0
    whole = values.size - values.size % 4
    for i in range(0, whole, 4):
        m0 = values[i] if values[i] > m0 else m0
        m1 = values[i + 1] if values[i + 1] > m1 else m1
        m2 = values[i + 2] if values[i + 2] > m2 else m2
        m3 = values[i + 3] if values[i + 3] > m3 else m3
    for i in range(whole, values.size):
        m0 = max(m0, values[i])
    return max(m0, m1, m2, m3)


@compiled
def dot(one: FloatArray, other: FloatArray) -> float:
    """Sum the products of two arrays, in four lanes."""
    s0, s1, s2, s3 = 0.0, 0.0, 0.0, 0.0
    whole = one.size - one.size % 4
    for i in range(0, whole, 4):
        s0 += one[i] * other[i]
        s1 += one[i + 1] * other[i + 1]
        s2 += one[i + 2] * other[i + 2]
        s3 += one[i + 3] * other[i + 3]
    for i in range(whole, one.size):
        s0 += one[i] * other[i]
    return (s0 + s1) + (s2 + s3)


@compiled
def longest_step(
    slack: FloatArray,
    d_slack: FloatArray,
    inverse: FloatArray,
    dual: FloatArray,
    d_dual: FloatArray,
) -> float:
    """Compute the share of a step at which the first slack or multiplier is 0."""
    of_slack, of_dual = 0.0, 0.0  # largest -ds / s and -dz / z
    for i in range(slack.size):
        if -d_slack[i] > of_slack * slack[i]:
            of_slack = -d_slack[i] * inverse[i]
        if -d_dual[i] > of_dual * dual[i]:
            of_dual = -d_dual[i] / dual[i]
    return 1.0 / max(of_slack, of_dual, 1e-9)
