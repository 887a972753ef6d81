import math
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from planner.errors import InvalidInputError
from planner.tracking.error_model import (
    SteeringDelay,
    commands_on_their_way,
    error_model,
)

PERIOD = 0.05


@given(
    speed=st.floats(0.5, 40.0),
    dead_time=st.floats(0.0, 0.4),
    lag=st.floats(0.02, 0.5),
    seed=st.integers(0, 2**16),
)
def test_the_sampled_model_is_the_continuous_one(speed, dead_time, lag, seed):
    draw = np.random.default_rng(seed)
    n = commands_on_their_way(dead_time, PERIOD)
    steps = 6
    commands = draw.uniform(-0.1, 0.1, n + steps)  # the first n are on their way
    start = draw.uniform(-0.2, 0.2, 3)
    a, b = error_model(speed, 2.7, SteeringDelay(dead_time, lag), PERIOD)
    z = np.concatenate([start, commands[:n][::-1]])
    for k in range(steps):
        z = a @ z + b[:, 0] * commands[n + k]

    def command(t):
        k = math.floor((t - dead_time) / PERIOD + 1e-9)
        return commands[min(max(n + k, 0), n + steps - 1)]

    x = start
    edges = np.union1d(
        PERIOD * np.arange(steps + 1),
        dead_time + PERIOD * np.arange(-n, steps + 1),
    )
    edges = edges[(edges >= 0.0) & (edges <= steps * PERIOD + 1e-12)]
    for first, last in pairwise(edges):
        if last - first < 1e-12:
            continue
        held = command(0.5 * (first + last))
        x = solve_ivp(
            lambda t, y, held=held: [
                speed * y[1],
                speed * y[2] / 2.7,
                (held - y[2]) / lag,
            ],
            (first, last),
            x,
            rtol=1e-10,
            atol=1e-12,
        ).y[:, -1]
    assert z[:3] == pytest.approx(x, abs=1e-7)


def test_a_delay_has_to_be_one():
    with pytest.raises(InvalidInputError, match=r"-0.1"):
        SteeringDelay(-0.1, 0.0)
    with pytest.raises(InvalidInputError, match="at most 60"):
        commands_on_their_way(4.0, PERIOD)
