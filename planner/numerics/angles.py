"""Angles brought into one turn."""

import math

import numpy as np

from planner.states import FloatArray


def wrapped(heading: float) -> float:
    """Return a heading in (-pi, pi] [rad]."""
    turned = math.remainder(heading, math.tau)
    return math.pi if turned == -math.pi else turned


def wrapped_all(heading: FloatArray) -> FloatArray:
    """Return headings in (-pi, pi] [rad]."""
    turned = heading - math.tau * np.rint(heading / math.tau)
    return np.where(turned <= -math.pi, math.pi, turned)
