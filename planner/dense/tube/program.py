"""The quadratic program of a path in its tube; [Thesis] eq. 5.26 to 5.32, corrected.

All methods of the chapter end in it: the lattices with the sides of their coarse path
and a reference near it, the side sequences with each sequence that is feasible.
"""

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from planner.dense.field import Cover, FrenetObstacles
from planner.dense.lattice.coarse_path import PathStart
from planner.dense.lattice.edge_check import road_along
from planner.dense.tube.corridor import (
    Passages,
    PathGuess,
    narrow,
    obstacle_rows,
    road_rows,
    second_bounds,
)
from planner.piecewise_jerk.problem import JerkProgram, PiecewiseJerkProblem
from planner.reference_path.road_turn import road_turn
from planner.states import FloatArray

CURVATURE_SHARE = 0.999  # of the bound is used, for what lies between knots
MIN_KNOTS = 4


class PathWeights(NamedTuple):
    """Prices of a path, each times an integral over s."""

    offset: float  # of l² [1/m²]
    slope: float  # of l'² [-]
    bend: float  # of l''² [m²]
    jerk: float  # of l'''² [m⁴]


@dataclass(frozen=True, slots=True, eq=False)
class Tube:
    """Room along a guess: on the road, and beside each obstacle on either side.

    Rows are low <= l + gain l' <= high; arrays are (n, n_discs). Nothing binds at knot
    0, where the ego is. Programs are about l + `turn`, see `in_plane`; bounds are, too.
    """

    guess: PathGuess
    gain: FloatArray
    low: FloatArray
    high: FloatArray
    passages: Passages
    second_low: FloatArray  # of l'', (n,) [1/m]
    second_high: FloatArray
    direct: bool  # the one row is l itself
    turn: FloatArray  # added to l, l', l'', (n, 3); zero about the road

    def between(self, sides: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return (low, high) for sides as `corridor.narrow` takes them."""
        low, high = self.low.copy(), self.high.copy()
        narrow(low, high, sides, self.passages)
        return low, high


def knots_between(start: float, end: float, step: float) -> FloatArray:
    """Place knots evenly, at most `step` apart, (n,) [m]."""
    n = max(math.ceil((end - start) / step - 1e-9) + 1, MIN_KNOTS)
    return np.linspace(start, end, n)


def tube_about(
    guess: PathGuess,
    field: FrenetObstacles,
    cover: Cover,
    margin: float,
    max_curvature: float | FloatArray,
    inset: float = 0.0,
    plane: bool = False,  # noqa: FBT001, FBT002 - what is priced
) -> Tube:
    """Compute the room about a guess.

    Args:
        guess: Knots and the path there.
        field: Obstacles and road.
        cover: Of the ego.
        margin: Kept beyond the discs [m].
        max_curvature: Of the path, everywhere or at each knot [1/m].
        inset: Kept from the road's edges [m].
        plane: Whether programs are about the plane, see `in_plane`, or the road.
    """
    discs = cover.discs(margin)
    road = road_along(guess.s, field.road_columns(), discs.offset)
    gain, low, high = road_rows(guess, road, discs)
    obstacles = field.obstacle_columns()
    passages = obstacle_rows(guess, gain, road, obstacles, discs)
    low += inset
    high -= inset
    low[0], high[0] = -np.inf, np.inf
    passages.window[:, 0] = np.maximum(passages.window[:, 0], 1)
    sharpest = np.full(guess.s.size, CURVATURE_SHARE) * max_curvature
    bounds = second_bounds(guess, road, sharpest)
    direct = discs.offset.size == 1 and discs.offset[0] == 0.0
    turn = np.zeros((guess.s.size, 3))
    tube = Tube(guess, gain, low, high, passages, *bounds, direct, turn)
    return in_plane(tube, road.curvature) if plane else tube


def in_plane(tube: Tube, curvature: FloatArray) -> Tube:
    """Write a tube's bounds for l plus the road's own turn, whose l'' is its curvature.

    The second derivative of the sum is the curvature in the plane, to first order, and
    its third that curvature's rate: with it a program prices what is felt, where l'' is
    the curvature about the road only.

    Args:
        tube: About the road.
        curvature: Of the road at the knots, (n,) [1/m].
    """
    turn = road_turn(tube.guess.s, curvature).turn[:, :3]
    shift = turn[:, :1] + tube.gain * turn[:, 1:2]
    left, right, window = tube.passages
    return Tube(
        tube.guess,
        tube.gain,
        tube.low + shift,
        tube.high + shift,
        Passages(left + shift, right + shift, window),
        tube.second_low + turn[:, 2],
        tube.second_high + turn[:, 2],
        tube.direct,
        turn,
    )


def tube_arrays(
    tube: Tube,
    low: FloatArray,
    high: FloatArray,
    start: PathStart,
    weights: PathWeights,
    wanted: tuple[FloatArray, float] | None = None,
) -> JerkProgram:
    """Write the program of a tube as compiled solvers take it.

    Args:
        tube: Gives knots, rows and bounds of l''.
        low: Of the rows, (n, n_discs) [m].
        high: As `low`.
        start: Where the path begins, fixed.
        weights: See there.
        wanted: A path to stay near, l at the knots (n,) [m], and its weight w6.
    """
    n, m = low.shape
    lower, upper = np.full((n, 3 + m), -np.inf), np.full((n, 3 + m), np.inf)
    lower[:, 2], upper[:, 2] = tube.second_low, tube.second_high
    if tube.direct:
        lower, upper = lower[:, :3].copy(), upper[:, :3].copy()
        lower[:, :1], upper[:, :1] = low, high
        row = np.zeros((n, 0, 3))
    else:
        lower[:, 3:], upper[:, 3:] = low, high
        row = np.zeros((n, m, 3))
        row[:, :, 0], row[:, :, 1] = 1.0, tube.gain
    weight, reference = np.empty((n, 3)), np.zeros((n, 3))
    weight[:] = weights.offset, weights.slope, weights.bend
    reference[:, :2] = tube.turn[:, :2]  # where l and l' are zero
    if wanted is not None:
        near, pull = wanted
        weight[:, 0] += pull
        total = float(weight[0, 0])
        reference[:, 0] += near * (pull / total if total > 0.0 else 0.0)
    s = tube.guess.s
    begin = np.array([start.l, start.slope, start.second]) + tube.turn[0]
    step = s[1:] - s[:-1]
    jerk = _implied_jerk(tube, float(begin[2]), float(step.min()))
    return JerkProgram(
        step,
        begin,
        weight,
        reference,
        weights.jerk,
        lower,
        upper,
        row,
        -jerk,
        jerk,
    )


def tube_program(
    tube: Tube,
    low: FloatArray,
    high: FloatArray,
    start: PathStart,
    weights: PathWeights,
    wanted: tuple[FloatArray, float] | None = None,
) -> PiecewiseJerkProblem:
    """Write the program of a tube as a record; arguments as for `tube_arrays`."""
    arrays = tube_arrays(tube, low, high, start, weights, wanted)
    return PiecewiseJerkProblem(
        step=arrays.step,
        start=arrays.start,
        weight=arrays.weight,
        reference=arrays.reference,
        jerk_weight=arrays.jerk_weight,
        lower=arrays.lower[:, :3],
        upper=arrays.upper[:, :3],
        jerk_lower=arrays.jerk_lower,
        jerk_upper=arrays.jerk_upper,
        row=arrays.row,
        row_lower=arrays.lower[:, 3:],
        row_upper=arrays.upper[:, 3:],
    )


def _implied_jerk(tube: Tube, start: float, step: float) -> float:
    """Bound l''' by what the bounds of l'' let it be: with it infeasibility is proven.

    It excludes nothing that the others allow.
    """
    lowest = min(float(tube.second_low.min()), start)
    highest = max(float(tube.second_high.max()), start)
    return 1.01 * (highest - lowest) / step + 1.0
