"""Errors of a vehicle beside its path, with the lag and dead time of its steering.

To first order about a path, with steering deviation d from what the path asks for,
e' = v theta, theta' = v d / L, d' = (u(t - T) - d) / tau. Sampled with the period of
the controller, the state is (e, theta, d) and the commands still on their way.
"""

import math
from dataclasses import dataclass

import numpy as np

from planner.errors import InvalidInputError
from planner.states import FloatArray

SHORTEST_LAG = 1e-3  # a quicker actuator is taken as this quick [s]
MOST_COMMANDS = 60  # on their way at a time
N_MOTION = 3  # states before the commands: e [m], theta [rad], d [rad]


@dataclass(frozen=True, slots=True)
class SteeringDelay:
    """How a steering command becomes a steering angle."""

    dead_time: float = 0.0  # [s]
    lag: float = 0.0  # time constant [s]

    def __post_init__(self) -> None:
        """Raise unless both are finite and at least 0."""
        for value in (self.dead_time, self.lag):
            if not 0.0 <= value < math.inf:
                raise InvalidInputError(f"a delay of {value:g} s is not one")


def commands_on_their_way(dead_time: float, period: float) -> int:
    """Return how many commands are on their way at a time.

    Raises:
        InvalidInputError: If there are more than `MOST_COMMANDS`.
    """
    n = math.ceil(dead_time / period - 1e-9)
    if n > MOST_COMMANDS:
        raise InvalidInputError(
            f"a dead time of {dead_time:g} s holds {n} commands; allowed: at most "
            f"{MOST_COMMANDS}"
        )
    return max(n, 0)


def error_model(
    speed: float, wheelbase: float, delay: SteeringDelay, period: float
) -> tuple[FloatArray, FloatArray]:
    """Return (A, B) of z_(k+1) = A z_k + B u_k.

    Args:
        speed: Held [m/s].
        wheelbase: L, with the understeer gradient L + K v² [m].
        delay: Of the steering.
        period: Of the controller [s].

    Returns:
        A, (3 + n, 3 + n), and B, (3 + n, 1): z is (e, theta, d, u_(k-1), ..., u_(k-n)).
    """
    from scipy.linalg import expm  # takes 0.2 s, which a perfect vehicle need not pay

    n = commands_on_their_way(delay.dead_time, period)
    lag = max(delay.lag, SHORTEST_LAG)
    motion = np.zeros((N_MOTION + 1, N_MOTION + 1))  # last row: a held command
    motion[0, 1] = speed
    motion[1, 2] = speed / wheelbase
    motion[2, 2], motion[2, 3] = -1.0 / lag, 1.0 / lag

    def held(time: float) -> tuple[FloatArray, FloatArray]:
        moved = expm(motion * time)
        return moved[:N_MOTION, :N_MOTION], moved[:N_MOTION, N_MOTION]

    # in each period the older of two commands acts first, then the younger one
    younger = (n - delay.dead_time / period) * period if n else period
    free, _ = held(period)
    late, by_younger = held(younger)
    _, early = held(period - younger)
    by_older = late @ early
    a = np.zeros((N_MOTION + n, N_MOTION + n))
    b = np.zeros((N_MOTION + n, 1))
    a[:N_MOTION, :N_MOTION] = free
    if n == 0:
        b[:N_MOTION, 0] = by_younger
        return a, b
    a[:N_MOTION, N_MOTION + n - 1] = by_older
    if n == 1:
        b[:N_MOTION, 0] = by_younger
    else:
        a[:N_MOTION, N_MOTION + n - 2] = by_younger
    b[N_MOTION, 0] = 1.0
    for i in range(1, n):
        a[N_MOTION + i, N_MOTION + i - 1] = 1.0
    return a, b
