"""Linear-quadratic steering that knows of its own delay, with curvature preview."""

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from planner.errors import InvalidInputError
from planner.numerics.compiled import inlined
from planner.states import FloatArray, freeze
from planner.tracking.error_model import N_MOTION, SteeringDelay, error_model

SPEEDS = freeze(np.geomspace(1.0, 70.0, 36))  # at which gains are computed [m/s]


@dataclass(frozen=True, slots=True)
class LqrWeights:
    """Price of errors and of steering, per sample."""

    lateral: float = 1.0  # [1/m²]
    heading: float = 2.0  # [1/rad²]
    steering: float = 8.0  # of a command beside the feed-forward [1/rad²]


def lqr_gain(a: FloatArray, b: FloatArray, weights: LqrWeights) -> FloatArray:
    """Return K of the command u = -K z that minimises the weighted squares, (n,).

    K = (R + B'PB)⁻¹ B'PA with P of the discrete algebraic Riccati equation.

    Args:
        a: Of the error model, (n, n).
        b: Of the error model, (n, 1).
        weights: Of the first two states and of the command.
    """
    from scipy.linalg import solve_discrete_are  # takes 0.2 s, see `error_model`

    prices = np.zeros(a.shape)
    prices[0, 0], prices[1, 1] = weights.lateral, weights.heading
    price = np.array([[weights.steering]])
    p = solve_discrete_are(a, b, prices, price)
    gain: FloatArray = np.linalg.solve(price + b.T @ p @ b, b.T @ p @ a)[0]
    return gain


@lru_cache(maxsize=32)
def gain_table(
    wheelbase: float,
    understeer: float,
    delay: SteeringDelay,
    period: float,
    weights: LqrWeights,
) -> FloatArray:
    """Return the gains at each of `SPEEDS`, (n_speeds, 3 + n commands on their way).

    Remembered: measuring a tube asks for the same table a hundred times.

    Args:
        wheelbase: [m].
        understeer: Gradient K of delta = (L + K v²) kappa [rad s²/m].
        delay: Of the steering, as the controller is to know it.
        period: Of the controller [s].
        weights: See there.

    Raises:
        InvalidInputError: If the wheelbase is not positive.
    """
    if not wheelbase > 0.0:
        raise InvalidInputError(f"wheelbase is {wheelbase:g}; allowed: positive")
    models = [
        error_model(v, wheelbase + understeer * v * v, delay, period)
        for v in SPEEDS.tolist()
    ]
    return freeze([lqr_gain(a, b, weights) for a, b in models])


@inlined
def lqr_feedback(
    gains: FloatArray,
    speeds: FloatArray,
    speed: float,
    errors: tuple[float, float, float],
    on_their_way: FloatArray,
) -> float:
    """Return the steering beside the feed-forward [rad].

    Args:
        gains: Of `gain_table`, (n_speeds, 3 + n).
        speeds: At which they hold, (n_speeds,) [m/s].
        speed: Now; gains between are interpolated, beyond they are held [m/s].
        errors: Lateral [m], of the heading [rad], of the steering angle [rad].
        on_their_way: Feedback parts of the commands before, newest last, (>= n,).
    """
    last = speeds.size - 1
    k = 0
    while k < last - 1 and speeds[k + 1] <= speed:
        k += 1
    share = (speed - speeds[k]) / (speeds[k + 1] - speeds[k])
    share = min(max(share, 0.0), 1.0)
    feedback = 0.0
    for i in range(gains.shape[1]):
        gain = gains[k, i] + share * (gains[k + 1, i] - gains[k, i])
        if i < N_MOTION:
            state = errors[i]
        else:
            state = on_their_way[on_their_way.size - 1 - (i - N_MOTION)]
        feedback -= gain * state
    return feedback


@inlined
def steering_of_curvature(
    curvature: float, speed: float, wheelbase: float, understeer: float
) -> float:
    """Return the steady steering angle on a curve, atan(L kappa) + K v² kappa [rad]."""
    return math.atan(wheelbase * curvature) + understeer * speed * speed * curvature
