"""Linear interpolation in a table that is read in about its own order."""

import numpy as np

from planner.numerics.compiled import inlined
from planner.states import FloatArray


@inlined
def interpolate(
    x: FloatArray,
    shift: float,
    samples: FloatArray,
    values: FloatArray,
    out: FloatArray,
) -> None:
    """Fill `out` with the values at `x` + `shift`, held beyond both ends.

    As `numpy.interp`, but each interval is looked for from the one before.

    Args:
        x: Where to look, (n,), in about growing order.
        shift: Added to each of them.
        samples: Never falling, (m,), m >= 1.
        values: At the samples, (m,).
        out: Filled, (n,).
    """
    last = samples.size - 1
    k, begin, end, slope = -1, 0.0, 0.0, 0.0
    for i in range(x.size):
        at = x[i] + shift
        if at < begin or at >= end or k < 0:
            k = min(max(k, 0), max(last - 1, 0))
            while k < last and at >= samples[k + 1]:
                k += 1
            while k > 0 and at < samples[k]:
                k -= 1
            begin, end, slope = samples[k], samples[min(k + 1, last)], 0.0
            if end > begin:  # a plan that stands repeats its place
                slope = (values[k + 1] - values[k]) / (end - begin)
        out[i] = values[k] + slope * (max(at, begin) - begin)


@inlined
def interpolated(x: FloatArray, samples: FloatArray, values: FloatArray) -> FloatArray:
    """Return what `interpolate` fills, without a shift.

    Numba's own `numpy.interp` takes 2 s to compile for each kind of arrays.
    """
    out = np.empty(x.size)
    interpolate(x, 0.0, samples, values, out)
    return out
