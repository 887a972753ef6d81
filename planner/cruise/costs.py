"""Cost terms of the cruise planner; [Thesis] 4.6 as corrected, and what was added.

Every term is non-negative and grows with what it names.
"""

import math

import numpy as np

from planner.cruise.settings import SafetyTerm
from planner.numerics.compiled import inlined
from planner.numerics.interpolation import interpolate
from planner.states import FloatArray

MIN_SPEED_SCALE = 2.0  # near a stop line, where the reference speed is 0 [m/s]
TERMS = (
    "jerk",
    "safety",
    "offset",
    "speed",
    "headway",
    "consistency",
    "heading",
    "dead_end",
    "lane",
)
# The same as rows, for compiled code.
JERK, SAFETY, OFFSET, SPEED, HEADWAY, CONSISTENCY, HEADING, DEAD_END, LANE = range(9)
N_TERMS = 9


@inlined
def edge_clearance(gap: float, size: float, scale: float) -> float:
    """Price of passing one body at `gap` from its edge, additive over bodies [-].

    size · (1 - gap / scale)² below `scale`, 0 above. Without the factor `size` (r_ob
    of [Thesis] eq. 4.19) a larger obstacle would be passed more closely, since the
    way round it is farther from the centre line.

    Args:
        gap: Edge to edge [m].
        size: Radius of the body's circumscribed circle [m].
        scale: Gap from which on a body costs nothing [m].
    """
    if gap >= scale:
        return 0.0
    lack = 1.0 - max(gap, 0.0) / scale
    return size * lack * lack


@inlined
def headway_lack(gap: float, needed: float) -> float:
    """Squared share of the needed gap that is missing [-], 0 ... 1."""
    if gap >= needed:
        return 0.0
    lack = 1.0 - max(gap, 0.0) / needed
    return lack * lack


def size_kernel(step: float, sigma: float) -> FloatArray:
    """Kernel of [Thesis] eq. 4.17, 4.18 over terminal offsets, (2 m + 1,).

    Corrected: f = g + |min g|, cut at |x| <= sqrt(3) sigma, where g has its minimum;
    so f is positive, falls from the centre and ends at zero. Its sum is 1.
    """
    edge = math.sqrt(3.0) * sigma
    x = step * np.arange(-math.floor(edge / step), math.floor(edge / step) + 1)
    lowest = -2.0 / sigma**2 * math.exp(-1.5)
    shape = np.exp(-0.5 * (x / sigma) ** 2) * (1.0 - (x / sigma) ** 2) / sigma**2
    return np.asarray((shape - lowest) / np.sum(shape - lowest))


def gaussian_kernel(step: float, sigma: float) -> FloatArray:
    """Gaussian over terminal offsets, as in the method [100]; (2 m + 1,)."""
    x = step * np.arange(
        -math.ceil(4.0 * sigma / step), math.ceil(4.0 * sigma / step) + 1
    )
    shape = np.exp(-0.5 * (x / sigma) ** 2)
    return np.asarray(shape / shape.sum())


def safety_kernel(term: SafetyTerm, step: float, sigma: float) -> FloatArray:
    """Kernel of a safety term by convolution; empty for one that has none."""
    if term is SafetyTerm.BINARY_CONVOLUTION:
        return gaussian_kernel(step, sigma)
    if term is SafetyTerm.SIZE_CONVOLUTION:
        return size_kernel(step, sigma)
    return np.empty(0)


@inlined
def convolve(
    hit_size: FloatArray,
    kernel: FloatArray,
    binary: bool,  # noqa: FBT001 - a constant of the planner
) -> FloatArray:
    """Safety by convolution along the terminal offsets, for each profile.

    [Thesis] eq. 4.16, 4.19: zero padded. The conventional method [100] convolves the
    binary collision vector with a Gaussian.

    Args:
        hit_size: Largest obstacle that each candidate hits, 0 if none,
            (n_profiles, n_offsets) [m].
        kernel: Of `safety_kernel`, (2 m + 1,).
        binary: Whether each hit counts 1, whatever its size.

    Returns:
        (n_profiles, n_offsets).
    """
    n, half = hit_size.shape[1], kernel.size // 2
    out = np.zeros_like(hit_size)
    for p in range(hit_size.shape[0]):
        for o in range(n):
            for k in range(max(half - o, 0), min(kernel.size, n + half - o)):
                size = hit_size[p, o + k - half]
                out[p, o] += kernel[k] * (1.0 if binary and size > 0.0 else size)
    return out


@inlined
def speed_deviation(
    s: FloatArray, s_dot: FloatArray, s_grid: FloatArray, v_grid: FloatArray
) -> FloatArray:
    """Squared difference from the speed that the road asks for, relative to it.

    Mean over the plan, plus the value at its end for what comes after: else it would
    always be cheaper to slow down now and to pass an obstacle later. Relative, so that
    standing costs the same on a tight bend as on a straight: else the ego would rather
    wait in the bend for ever than pass an obstacle there.

    Args:
        s: Profiles, (n_profiles, n_steps) [m].
        s_dot: (n_profiles, n_steps) [m/s].
        s_grid: Where the reference speed is known, (n,) [m].
        v_grid: Reference speed there, (n,) [m/s].

    Returns:
        (n_profiles,) [-]; 2 for standing where one could drive.
    """
    out = np.empty(s.shape[0])
    wanted, square = np.empty(s.shape[1]), np.empty(s.shape[1])
    for p in range(s.shape[0]):
        interpolate(s[p], 0.0, s_grid, v_grid, wanted)
        for i in range(s.shape[1]):
            off = (s_dot[p, i] - wanted[i]) / max(wanted[i], MIN_SPEED_SCALE)
            square[i] = off * off
        total = 0.0
        for i in range(s.shape[1]):
            total += square[i]
        out[p] = total / s.shape[1] + square[-1]
    return out
