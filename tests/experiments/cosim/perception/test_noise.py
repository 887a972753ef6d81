import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from experiments.cosim.perception.noise import N_CHANNELS, advance_noise

KEYS = np.arange(1, 2001, dtype=np.uint64) * np.uint64(0x9E3779B97F4A7C15)


def noise(keys, steps, memory):
    """Noise of vehicles in each step, (n_steps, n, 6)."""
    state = np.full((len(keys), N_CHANNELS), np.nan)
    rows = np.arange(len(keys))
    out = []
    for step in range(1, steps + 1):
        advance_noise(state, rows, keys, step, memory)
        out.append(state.copy())
    return np.array(out)


@given(st.permutations(range(6)), st.integers(1, 6))
def test_noise_of_a_vehicle_is_the_same_whoever_else_is_there(order, count):
    everybody = noise(KEYS[:6], 3, 0.7)
    some = list(order)[:count]
    assert np.array_equal(noise(KEYS[some], 3, 0.7), everybody[:, some])


@pytest.mark.parametrize("memory", [0.0, 0.5, 0.95])
def test_noise_is_standard_normal_and_remembers_as_much_as_it_should(memory):
    """12,000 numbers: bounds of five standard errors."""
    drawn = noise(KEYS, 4, memory).reshape(4, -1)
    n = drawn.shape[1]
    assert abs(drawn[-1].mean()) < 5.0 / np.sqrt(n)
    assert abs(drawn[-1].var() - 1.0) < 5.0 * np.sqrt(2.0 / n)
    for lag in (1, 2, 3):
        correlation = np.corrcoef(drawn[0], drawn[lag])[0, 1]
        assert abs(correlation - memory**lag) < 5.0 / np.sqrt(n)


def test_channels_do_not_depend_on_each_other():
    drawn = noise(KEYS, 1, 0.0)[0]
    off = np.corrcoef(drawn.T) - np.eye(N_CHANNELS)
    assert np.abs(off).max() < 5.0 / np.sqrt(len(KEYS))
