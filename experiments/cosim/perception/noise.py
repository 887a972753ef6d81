"""Noise that is the same for the same seed, vehicle and step, whoever else is there.

Numbers are hashes of (vehicle and seed, step, channel), by the finaliser of SplitMix64
([Steele2014]), so that no generator has a state that others could use up.
"""

import math

import numpy as np
from numpy.typing import NDArray

from planner.numerics.compiled import compiled, inlined
from planner.states import FloatArray, IntArray

KeyArray = NDArray[np.uint64]
# channels of correlated noise, then those that are drawn on their own
X, Y, HEADING, SPEED, ACCELERATION, SIDEWAYS = range(6)
N_CHANNELS = 6
MISSED, LENGTH, WIDTH = 6, 7, 8
FOREVER = 0  # step of what is drawn once
_GOLDEN = np.uint64(0x9E3779B97F4A7C15)
_FIRST = np.uint64(0xBF58476D1CE4E5B9)
_SECOND = np.uint64(0x94D049BB133111EB)
_STEP = np.uint64(0xD1342543DE82EF95)
_CHANNEL = np.uint64(0xAF251AF3B0F025B5)
_30, _27, _31, _11 = np.uint64(30), np.uint64(27), np.uint64(31), np.uint64(11)
_ONE = np.uint64(1)
_UNIT = 2.0**-53


@inlined
def _mixed(value: np.uint64) -> np.uint64:
    """Return 64 bits that all depend on all bits of the value."""
    value = value + _GOLDEN
    value = (value ^ (value >> _30)) * _FIRST
    value = (value ^ (value >> _27)) * _SECOND
    return value ^ (value >> _31)


@inlined
def uniform(key: np.uint64, step: int, channel: int) -> float:
    """Return a number above 0 and up to 1."""
    number = key + np.uint64(step) * _STEP + np.uint64(channel) * _CHANNEL
    return (float(_mixed(number) >> _11) + 1.0) * _UNIT


@inlined
def normal(key: np.uint64, step: int, channel: int) -> float:
    """Return a number of the standard normal distribution, by Box and Muller."""
    radius = math.sqrt(-2.0 * math.log(uniform(key, step, 2 * channel)))
    return radius * math.cos(2.0 * math.pi * uniform(key, step, 2 * channel + 1))


@compiled
def advance_noise(
    state: FloatArray, rows: IntArray, keys: KeyArray, step: int, memory: float
) -> None:
    """Move the noise of vehicles one step on, in place.

    An Ornstein-Uhlenbeck process of unit variance: n' = rho n + sqrt(1 - rho²) xi.

    Args:
        state: (capacity, 6); a row that holds NaN begins.
        rows: Of the vehicles, (n,).
        keys: Of the vehicles, (n,).
        step: Number of it, from 1 on.
        memory: rho.
    """
    fresh = math.sqrt(1.0 - memory * memory)
    for i in range(rows.size):
        for c in range(N_CHANNELS):
            drawn = normal(keys[i], step, c)
            before = state[rows[i], c]
            if math.isnan(before):
                state[rows[i], c] = drawn
            else:
                state[rows[i], c] = memory * before + fresh * drawn
