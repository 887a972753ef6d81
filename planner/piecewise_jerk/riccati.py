"""Riccati recursions along the knots of a piecewise-jerk program: the Newton step.

The step is itself a program without bounds, the minimum of a quadratic form along the
dynamics of three states and one input; a recursion over the knots solves it in O(n).
All tables are stored by columns, (3, n) for states, so that loops over knots run over
neighbours in memory.
"""

from planner.numerics.compiled import compiled
from planner.states import FloatArray

THIRD = 1.0 / 3.0  # a product is faster than a quotient


@compiled
def roll_out(step: FloatArray, jerk: FloatArray, state: FloatArray) -> None:
    """Fill `state`, (3, n), from its first column on."""
    p, v, a = state[0, 0], state[1, 0], state[2, 0]
    for k in range(step.size):
        h, j = step[k], jerk[k]
        p += h * (v + h * (0.5 * a + h * j / 6.0))
        v += h * (a + 0.5 * h * j)
        a += h * j
        state[0, k + 1], state[1, k + 1], state[2, k + 1] = p, v, a


@compiled
def backward(
    step: FloatArray,
    hessian: FloatArray,
    gradient: FloatArray,
    gain: FloatArray,
    feedforward: FloatArray,
) -> None:
    """Compute the cost-to-go ½ x'P x + g'x from the last knot to the first.

    Args:
        step: (n - 1,).
        hessian: (7, n): 00, 01, 02, 11, 12, 22 of the states, and the jerk's.
        gradient: (4, n): of the states and the jerk.
        gain: Filled, (4, n - 1): A'P B and 1 / (R + B'P B).
        feedforward: Filled, (n - 1,): the jerk's step where the state's is zero.
    """
    last = hessian.shape[1] - 1
    p00, p01, p02 = hessian[0, last], hessian[1, last], hessian[2, last]
    p11, p12, p22 = hessian[3, last], hessian[4, last], hessian[5, last]
    for k in range(last - 1, -1, -1):
        h = step[k]
        half = 0.5 * h * h
        b = THIRD * h * half  # B = (b, half, h)
        curvature = (
            (hessian[6, k] + b * b * p00)
            + (2.0 * b * half * p01 + 2.0 * b * h * p02)
            + (half * half * p11 + (2.0 * half * h * p12 + h * h * p22))
        )
        inverse = 1.0 / curvature
        m0 = b * p00 + (half * p01 + h * p02)  # A' P B
        c1 = b * p01 + (half * p11 + h * p12)
        c2 = b * p02 + (half * p12 + h * p22)
        m1 = h * m0 + c1
        m2 = half * m0 + (h * c1 + c2)
        gain[0, k], gain[1, k], gain[2, k], gain[3, k] = m0, m1, m2, inverse
        q01 = h * p00 + p01  # A' P A
        q02 = half * p00 + (h * p01 + p02)
        q11 = h * (q01 + p01) + p11
        r12 = half * p01 + (h * p11 + p12)
        q12 = h * q02 + r12
        q22 = (half * (q02 + p02) + h * (r12 + p12)) + p22
        p00 = (hessian[0, k] + p00) - m0 * m0 * inverse
        p01 = (hessian[1, k] + q01) - m0 * m1 * inverse
        p02 = (hessian[2, k] + q02) - m0 * m2 * inverse
        p11 = (hessian[3, k] + q11) - m1 * m1 * inverse
        p12 = (hessian[4, k] + q12) - m1 * m2 * inverse
        p22 = (hessian[5, k] + q22) - m2 * m2 * inverse
    backward_linear(step, gradient, gain, feedforward)


@compiled
def backward_linear(
    step: FloatArray,
    gradient: FloatArray,
    gain: FloatArray,
    feedforward: FloatArray,
) -> None:
    """Repeat the recursion of the gradient alone, with the gains of `backward`."""
    last = gradient.shape[1] - 1
    g0, g1, g2 = gradient[0, last], gradient[1, last], gradient[2, last]
    for k in range(last - 1, -1, -1):
        h = step[k]
        half = 0.5 * h * h
        slope = (gradient[3, k] + THIRD * h * half * g0) + (half * g1 + h * g2)
        push = -slope * gain[3, k]
        feedforward[k] = push
        g2 = ((gradient[2, k] + half * g0) + (h * g1 + g2)) + gain[2, k] * push
        g1 = ((gradient[1, k] + h * g0) + g1) + gain[1, k] * push
        g0 = (gradient[0, k] + g0) + gain[0, k] * push


@compiled
def forward(
    step: FloatArray, gain: FloatArray, feedforward: FloatArray, change: FloatArray
) -> None:
    """Roll the step out: rows 0-2 of `change` are the states, the last is the jerk."""
    p, v, a = 0.0, 0.0, 0.0
    jerk = change.shape[0] - 1
    change[0, 0], change[1, 0], change[2, 0] = 0.0, 0.0, 0.0
    for k in range(step.size):
        h, inverse = step[k], gain[3, k]
        half = 0.5 * h * h
        b = THIRD * h * half
        back = gain[0, k] * inverse * p
        back += gain[1, k] * inverse * v + gain[2, k] * inverse * a
        j = feedforward[k] - back
        change[jerk, k] = j
        p = ((p + h * v) + half * a) + b * j
        v = (v + h * a) + half * j
        a += h * j
        change[0, k + 1], change[1, k + 1], change[2, k + 1] = p, v, a
