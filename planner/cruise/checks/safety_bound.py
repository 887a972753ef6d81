"""A lower bound of what the candidates of one profile pay for passing bodies.

The price of a body grows as the least gap over time falls, and the gap at any one step
is at least that: looking at a few steps about the one at which the profile is nearest
to each body is enough for a bound, and mostly for a tight one. What hits there, hits.
"""

import math
from typing import NamedTuple

from planner.cruise.candidate_motion import (
    COS,
    KAPPA,
    SIN,
    SLOPE,
    UNIT_L,
    UNIT_SLOPE,
    L,
    X,
    Y,
)
from planner.cruise.checks.body_frame import Body, body_of
from planner.cruise.checks.gaps_at_steps import square_apart
from planner.cruise.costs import SAFETY, edge_clearance
from planner.cruise.workspace import Surroundings
from planner.numerics.compiled import inlined
from planner.reference_path.frenet import cartesian_rates
from planner.states import BoolArray, FloatArray, IntArray

FAR_BEYOND = 1e300  # more than any square [m²]
ROUNDING = 1e-9  # by which the gaps and prices of the full check may differ [m], [-]


class Priced(NamedTuple):
    """What is known of the costs of the candidates of one profile."""

    own: FloatArray  # terms, (8, n)
    touched: BoolArray  # whether each surely hits a body, (n,)


@inlined
def bound_safety(
    count: int,
    rows: FloatArray,
    basis: FloatArray,
    delta_l: FloatArray,
    members: IntArray,
    around: Surroundings,
    priced: Priced,
) -> None:
    """Fill the bound as the safety of some candidates of one profile.

    Args:
        count: Its valid steps.
        rows: Of the profile and the road under it, (1, 15, n_steps).
        basis: Of its lateral motion.
        delta_l: Terminal offsets less the present one, (n,) [m].
        members: Numbers of the candidates.
        around: Bodies.
        priced: Safety is filled, and which of them surely hit a body.
    """
    own, touched = priced
    for o in members:
        own[SAFETY, o] = 0.0
        touched[o] = False
    reach = around.disc_radius + max(abs(around.discs[0]), abs(around.discs[2]))
    for b in range(around.size.size):
        if around.follower[b]:
            continue
        i, square = _nearest_step(count, rows, around.poses, b)
        l_low = abs(basis[L, i] + delta_l[members[0]] * basis[UNIT_L, i])
        l_high = abs(basis[L, i] + delta_l[members[-1]] * basis[UNIT_L, i])
        far = max(l_low, l_high) + reach + around.size[b] + around.range
        if square > far * far:
            continue
        body = body_of(b, around)
        for o in members:
            gap = _least_gap((i, count), rows, basis, delta_l[o], body, around)
            if gap < body.threshold - ROUNDING:
                touched[o] = True
                gap = 0.0
            own[SAFETY, o] += edge_clearance(gap + ROUNDING, body.size, around.range)


@inlined
def _nearest_step(
    count: int,
    rows: FloatArray,
    poses: FloatArray,
    b: int,
) -> tuple[int, float]:
    """Find the step at which a body is nearest to the path under the profile.

    Returns:
        (step, squared distance there [m²]).
    """
    nearest, least = 0, FAR_BEYOND
    for i in range(count):
        dx, dy = poses[b, 0, i] - rows[0, X, i], poses[b, 1, i] - rows[0, Y, i]
        square = dx * dx + dy * dy
        if square < least:
            nearest, least = i, square
    return nearest, least


@inlined
def _least_gap(
    start: tuple[int, int],
    rows: FloatArray,
    basis: FloatArray,
    change: float,
    body: Body,
    around: Surroundings,
) -> float:
    """Compute gaps from a step on to both sides for as long as they fall [m].

    Args:
        start: The step, and how many there are.
        rows: As in `bound_safety`.
        basis: Of the lateral motion.
        change: Of offset [m].
        body: Which body.
        around: Bodies.
    """
    middle, count = start
    least = _gap(middle, rows, basis, change, body, around)
    for way in (1, -1):
        i = middle + way
        while 0 <= i < count:
            gap = _gap(i, rows, basis, change, body, around)
            if not gap < least:
                break
            least = gap
            i += way
    return least


@inlined
def _gap(
    i: int,
    rows: FloatArray,
    basis: FloatArray,
    change: float,
    body: Body,
    around: Surroundings,
) -> float:
    """Compute the gap between one candidate and a body at step i [m]."""
    poses, b = around.poses, body.number
    l = basis[L, i] + change * basis[UNIT_L, i]
    slope = basis[SLOPE, i] + change * basis[UNIT_SLOPE, i]
    cos_e, sin_e, _, _, _ = cartesian_rates(
        l, rows[0, KAPPA, i], 0.0, 0.0, 0.0, slope, 0.0
    )
    cos_r, sin_r = rows[0, COS, i], rows[0, SIN, i]
    dx = rows[0, X, i] - sin_r * l - poses[b, 0, i]
    dy = rows[0, Y, i] + cos_r * l - poses[b, 1, i]
    cos, sin = cos_r * cos_e - sin_r * sin_e, sin_r * cos_e + cos_r * sin_e
    cos_b, sin_b = poses[b, 2, i], poses[b, 3, i]
    u, w = dx * cos_b + dy * sin_b, dy * cos_b - dx * sin_b
    ahead_u, ahead_w = cos * cos_b + sin * sin_b, sin * cos_b - cos * sin_b
    square = FAR_BEYOND
    for disc in around.discs:
        at_u, at_w = u + disc * ahead_u, w + disc * ahead_w
        square = min(
            square, square_apart(at_u, at_w, body.half_length, body.half_width)
        )
    return math.sqrt(square) - body.grown
