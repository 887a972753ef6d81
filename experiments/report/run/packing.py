"""Columns of numbers packed into a page: quantised, little-endian, base64.

A number in JSON takes about ten characters, a quantised one less than three. A browser
unpacks a million of them in some ten milliseconds.
"""

import base64
from typing import Any

import numpy as np

from planner.states import FloatArray

NOTHING = 65535  # code of a missing value
CODES = 65534  # steps between the least and the largest value

Packed = dict[str, Any]


def pack(values: FloatArray, resolution: float) -> Packed:
    """Pack a column.

    Args:
        values: (n,); NaN where there is nothing.
        resolution: Largest step between neighbouring codes that still will do, in the
            column's unit. Where 16 bits cannot give it, float32 stands in.

    Returns:
        `{"low", "step", "data"}` with 16-bit codes, or `{"data"}` with float32.
    """
    there = values[np.isfinite(values)]
    low, high = (float(there.min()), float(there.max())) if there.size else (0.0, 0.0)
    if high - low > resolution * CODES:
        return pack_exact(values)
    step = (high - low) / CODES or 1.0  # any step if all values are equal
    with np.errstate(invalid="ignore"):
        codes = np.where(np.isfinite(values), np.rint((values - low) / step), NOTHING)
    return {
        "low": low,
        "step": step,
        "data": _base64(codes.astype("<u2").tobytes()),
    }


def pack_counts(counts: Any) -> Packed:
    """Pack whole numbers from 0 to 2³² - 1, exactly."""
    array = np.asarray(counts)
    if array.size == 0 or array.max() < NOTHING:
        return {"low": 0, "step": 1, "data": _base64(array.astype("<u2").tobytes())}
    return {"whole": True, "data": _base64(array.astype("<u4").tobytes())}


def pack_exact(values: FloatArray) -> Packed:
    """Pack numbers as float32: seven digits, wherever they lie."""
    with np.errstate(over="ignore"):  # beyond its range is as good as infinite
        return {"data": _base64(values.astype("<f4").tobytes())}


def _base64(data: bytes) -> str:
    """Encode bytes as base64."""
    return base64.b64encode(data).decode("ascii")
