"""Reads packed columns as the scripts of a page do."""

import base64

import numpy as np

from experiments.report.run.packing import NOTHING, Packed
from planner.states import FloatArray


def unpack(packed: Packed) -> FloatArray:
    """Unpack a column, as the page does it."""
    data = base64.b64decode(packed["data"])
    if packed.get("whole"):
        return np.frombuffer(data, "<u4").astype(np.float64)
    if "step" not in packed:
        return np.frombuffer(data, "<f4").astype(np.float64)
    codes = np.frombuffer(data, "<u2")
    return np.where(
        codes == NOTHING, np.nan, packed["low"] + packed["step"] * codes.astype(float)
    )
