"""The coarse path: a chain of quintic edges; [Thesis] 5.5.1."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from planner.dense.lattice.edges import quintic_at
from planner.numerics.compiled import compiled
from planner.numerics.polynomials import quintic_coefficients
from planner.states import FloatArray


class PathStart(NamedTuple):
    """Where a path begins: the ego's place and direction on the road."""

    s: float  # [m]
    l: float  # [m]
    slope: float  # dl/ds [-]
    second: float  # d²l/ds² [1/m]


@dataclass(frozen=True, slots=True, eq=False)
class CoarsePath:
    """The cheapest chain of edges; arrays are (n_nodes,), the ego's place first."""

    s: FloatArray  # [m]
    l: FloatArray  # [m]
    start: PathStart  # of the first edge; all others begin with l' = l'' = 0
    cost: float  # sum of eq. 5.19 over its edges

    def at(self, s: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return (l, l', l'') at `s`, (n,), inside the path's reach."""
        shape = evaluate_chain(self.s, self.l, self.start, np.asarray(s))
        return shape[0], shape[1], shape[2]


@compiled
def evaluate_chain(
    node_s: FloatArray,
    node_l: FloatArray,
    start: PathStart,
    s: FloatArray,
) -> FloatArray:
    """Evaluate l, l', l'' of a chain of edges at growing `s`, (3, n)."""
    out = np.empty((3, s.size))
    k, last = 0, node_s.size - 2
    for j in range(s.size):
        while k < last and s[j] > node_s[k + 1]:
            k += 1
        length = node_s[k + 1] - node_s[k]
        slope, second = (start.slope, start.second) if k == 0 else (0.0, 0.0)
        c = quintic_coefficients(
            node_l[k], slope, second, node_l[k + 1], 0.0, 0.0, length
        )
        at = quintic_at(c, s[j] - node_s[k])
        out[0, j], out[1, j], out[2, j] = at[0], at[1], at[2]
    return out
