"""The records of a piecewise-jerk program; see `planner.piecewise_jerk.solve`."""

from dataclasses import dataclass
from enum import IntEnum
from typing import NamedTuple

import numpy as np

from planner.errors import InvalidInputError
from planner.states import FloatArray, freeze


class Verdict(IntEnum):
    """How a compiled solver ended."""

    SOLVED = 0
    INFEASIBLE = 1  # proven
    UNDECIDED = 2
    ABOVE_CUTOFF = 3  # proven to cost more than the cutoff


class JerkProgram(NamedTuple):
    """One program as the compiled solvers take it, with n knots and m rows a knot.

    Bounds do not apply to knot 0. Bounds of states and rows share a table whose columns
    are p, p', p'' and the rows.
    """

    step: FloatArray  # (n - 1,)
    start: FloatArray  # (3,)
    weight: FloatArray  # (n, 3)
    reference: FloatArray  # (n, 3)
    jerk_weight: float  # > 0
    lower: FloatArray  # (n, 3 + m)
    upper: FloatArray  # (n, 3 + m)
    row: FloatArray  # (n, m, 3)
    jerk_lower: float  # of every interval
    jerk_upper: float


@dataclass(frozen=True, slots=True, eq=False)
class PiecewiseJerkProblem:
    """One program with n knots and m rows a knot.

    Bounds do not apply to knot 0: it is where the ego is. An infinite bound is none.
    """

    step: FloatArray  # (n - 1,) distance of the knots, > 0 [m or s]
    start: FloatArray  # (3,) p, p', p'' at knot 0
    weight: FloatArray  # (n, 3), not negative
    reference: FloatArray  # (n, 3)
    jerk_weight: float  # > 0
    lower: FloatArray  # (n, 3)
    upper: FloatArray  # (n, 3)
    jerk_lower: float
    jerk_upper: float
    row: FloatArray  # (n, m, 3)
    row_lower: FloatArray  # (n, m)
    row_upper: FloatArray  # (n, m)

    def __post_init__(self) -> None:
        """Copy, check and freeze the arrays."""
        n = np.shape(self.weight)[0]
        m = np.shape(self.row)[1]
        shapes = {
            "step": (n - 1,),
            "start": (3,),
            "weight": (n, 3),
            "reference": (n, 3),
            "lower": (n, 3),
            "upper": (n, 3),
            "row": (n, m, 3),
            "row_lower": (n, m),
            "row_upper": (n, m),
        }
        for name, shape in shapes.items():
            array = freeze(getattr(self, name))
            if array.shape != shape:
                raise InvalidInputError(f"{name} has shape {array.shape}, not {shape}")
            object.__setattr__(self, name, array)
        if n < 2 or not (self.step > 0.0).all():
            raise InvalidInputError("a program needs two knots and positive steps")
        if not (self.jerk_weight > 0.0 and (self.weight >= 0.0).all()):
            raise InvalidInputError("weights must not be negative, the jerk's positive")

    def as_program(self) -> JerkProgram:
        """Return the arrays as the compiled solvers take them."""
        return JerkProgram(
            self.step,
            self.start,
            self.weight,
            self.reference,
            self.jerk_weight,
            np.concatenate([self.lower, self.row_lower], axis=1),
            np.concatenate([self.upper, self.row_upper], axis=1),
            self.row,
            self.jerk_lower,
            self.jerk_upper,
        )
