import numpy as np
import pytest

from planner.errors import InvalidInputError
from planner.tracking.error_model import SteeringDelay, error_model
from planner.tracking.lqr import (
    SPEEDS,
    LqrWeights,
    gain_table,
    lqr_feedback,
    lqr_gain,
    steering_of_curvature,
)

WEIGHTS = LqrWeights()
AUTOWARE = SteeringDelay(0.24, 0.27)


def by_value_iteration(a, b, weights, n=6000):
    """The cost-to-go of n steps, one after the other: no equation is solved."""
    q = np.zeros(a.shape)
    q[0, 0], q[1, 1] = weights.lateral, weights.heading
    p, r = q.copy(), np.array([[weights.steering]])
    for _ in range(n):
        gain = np.linalg.solve(r + b.T @ p @ b, b.T @ p @ a)
        p = q + a.T @ p @ (a - b @ gain)
    return gain[0]


@pytest.mark.parametrize("speed", [1.0, 7.0, 14.0, 35.0])
@pytest.mark.parametrize("delay", [SteeringDelay(), AUTOWARE])
def test_gains_are_those_of_brute_force(speed, delay):
    a, b = error_model(speed, 2.8, delay, 0.05)
    assert lqr_gain(a, b, WEIGHTS) == pytest.approx(
        by_value_iteration(a, b, WEIGHTS), rel=1e-6, abs=1e-8
    )


def slowest_pole(model, gain) -> float:
    a, b = model
    return float(np.abs(np.linalg.eigvals(a - b @ gain[None, :])).max())


@pytest.mark.parametrize("delay", [SteeringDelay(), SteeringDelay(0.1, 0.1), AUTOWARE])
def test_every_closed_loop_of_the_table_is_stable(delay):
    table = gain_table(2.8, 0.0, delay, 0.05, WEIGHTS)
    for speed, gain in zip(SPEEDS, table, strict=True):
        assert slowest_pole(error_model(speed, 2.8, delay, 0.05), gain) < 1.0


@pytest.mark.parametrize("delay", [SteeringDelay(0.1, 0.1), AUTOWARE])
def test_designed_without_its_delay_it_is_unstable_at_14_mps(delay):
    unaware = gain_table(2.8, 0.0, SteeringDelay(), 0.05, WEIGHTS)
    k = int(np.searchsorted(SPEEDS, 14.0))
    a, b = error_model(float(SPEEDS[k]), 2.8, delay, 0.05)
    gain = np.zeros(a.shape[0])
    gain[:3] = unaware[k]
    assert slowest_pole((a, b), gain) > 1.0


def test_feedback_interpolates_and_knows_the_newest_command_last():
    table = gain_table(2.8, 0.0, AUTOWARE, 0.05, WEIGHTS)
    on_their_way = 0.01 * np.arange(8.0)
    state = np.concatenate(
        [[0.3, -0.1, 0.02], on_their_way[::-1][: table.shape[1] - 3]]
    )
    errors = (0.3, -0.1, 0.02)
    for k in (0, 5, SPEEDS.size - 1):
        found = lqr_feedback(table, SPEEDS, float(SPEEDS[k]), errors, on_their_way)
        assert found == pytest.approx(-float(table[k] @ state))
    between = 0.5 * (SPEEDS[5] + SPEEDS[6])
    found = lqr_feedback(table, SPEEDS, float(between), errors, on_their_way)
    assert found == pytest.approx(-float((table[5] + table[6]) @ state) / 2)
    beyond = lqr_feedback(table, SPEEDS, 100.0, errors, on_their_way)
    assert beyond == pytest.approx(-float(table[-1] @ state))


def test_steady_steering():
    assert steering_of_curvature(0.02, 20.0, 2.8, 0.002) == pytest.approx(
        np.arctan(2.8 * 0.02) + 0.002 * 400 * 0.02
    )
    with pytest.raises(InvalidInputError, match="wheelbase is 0"):
        gain_table(0.0, 0.0, AUTOWARE, 0.05, WEIGHTS)
