"""Nearest foot point on a path of linear-curvature pieces.

The pieces are grouped into blocks. The path is 1-Lipschitz in arc length, so a block
whose middle is farther away than the best distance so far plus half the block's length
cannot hold the nearest point. In the blocks that are left, foot points lie where
(p - r) . t changes its sign from one knot to the next; Newton's method finishes them.
"""

import numpy as np

from planner.numerics.compiled import compiled, inlined
from planner.reference_path.linear_curvature import (
    COS,
    CURVATURE,
    RATE,
    SIN,
    IndexArray,
    S,
    X,
    Y,
    follow,
    follow_bent,
    index_bins,
    piece_index,
    points_at,
)
from planner.states import FloatArray, freeze

PIECES_PER_BLOCK = 64
# Columns of the block table; ALONE is how near blocks but its neighbours come to its
# middle [m].
MIDDLE_X, MIDDLE_Y, HALF_LENGTH, SHARPEST, ALONE = range(5)

CHUNK = 128  # points of a batch whose Newton steps are taken together
VECTOR_STEPS = 2  # of Newton's method, enough for nearly all

STEP_DONE = 1e-7  # [m]; Newton's next step is then below 1e-13 m
STEP_LIMIT = 60  # bisection alone needs 45 steps from 1 m
TIE = 1e-9  # [m]; of feet equally near, the first along the path is taken
HEADING_WEIGHT = 3.0  # [m], that a foot at a right angle counts as farther away

EVERYWHERE = (-np.inf, np.inf)  # limits of s [m]
NO_DIRECTION = (0.0, 0.0, 0.0)

Foot = tuple[float, float, float, bool]  # cost [m], s [m], l [m], found


@inlined
def lead(knots: FloatArray, i: int, x: float, y: float) -> float:
    """Return how far a point lies ahead of knot `i`, along its tangent [m]."""
    dx, dy = x - knots[i, X], y - knots[i, Y]
    return float(dx * knots[i, COS] + dy * knots[i, SIN])


@inlined
def squared_distance(blocks: FloatArray, j: int, x: float, y: float) -> float:
    """Return the squared distance of a point from the middle of block `j` [m²]."""
    dx, dy = x - blocks[j, MIDDLE_X], y - blocks[j, MIDDLE_Y]
    return float(dx * dx + dy * dy)


@inlined
def newton_step(
    x: float,
    y: float,
    cos: float,
    sin: float,
    curvature: float,
    rate: float,
    bracket: tuple[float, float, float],
) -> tuple[tuple[float, float, float], float, float, float, bool]:
    """Compute one step of Newton's method to the foot of the origin on a piece.

    The root sought is that of (p - r) . t, whose derivative is -(1 - kappa l).

    Args:
        x: Start of the piece, seen from the point to project [m].
        y: See x [m].
        cos: Direction of the piece at its start.
        sin: See cos.
        curvature: At the start [1/m].
        rate: d(curvature)/ds [1/m²].
        bracket: (least, greatest, present) arc length from the start [m].

    Returns:
        (the next bracket; l, cos_heading, sin_heading at the present place; whether the
        next place is the foot).
    """
    place = follow(x, y, cos, sin, curvature, rate, bracket[2])
    return improved_bracket(place, curvature, rate, bracket)


@inlined
def improved_bracket(
    place: tuple[float, float, float, float],
    curvature: float,
    rate: float,
    bracket: tuple[float, float, float],
) -> tuple[tuple[float, float, float], float, float, float, bool]:
    """Compute what `newton_step` returns from the (x, y, cos, sin) at its place."""
    low, high, u = bracket
    px, py, foot_cos, foot_sin = place
    along = -px * foot_cos - py * foot_sin
    l = px * foot_sin - py * foot_cos
    slope = 1.0 - (curvature + rate * u) * l
    low, high = (u, high) if along >= 0.0 else (low, u)
    u += along / slope
    u = u if (low <= u) & (u <= high) else 0.5 * (low + high)
    return (low, high, u), l, foot_cos, foot_sin, abs(along) < STEP_DONE * slope


@inlined
def converge(
    x: float,
    y: float,
    cos: float,
    sin: float,
    curvature: float,
    rate: float,
    bracket: tuple[float, float, float],
) -> tuple[float, float, float, float]:
    """Find the foot of the origin on a piece, kept inside a bracket.

    Args:
        x: As in `newton_step`, like the rest.
        y: See x.
        cos: See x.
        sin: See x.
        curvature: See x.
        rate: See x.
        bracket: (least, greatest, first guess) of the arc length from the start [m].

    Returns:
        (u, l, cos_heading, sin_heading) of the foot, u from the start of the piece.
    """
    l, foot_cos, foot_sin = 0.0, 1.0, 0.0
    done, steps = False, 0
    while not done and steps < STEP_LIMIT:
        steps += 1
        bracket, l, foot_cos, foot_sin, done = newton_step(
            x, y, cos, sin, curvature, rate, bracket
        )
    return bracket[2], l, foot_cos, foot_sin


@inlined
def falling_piece(knots: FloatArray, start: int, stop: int, x: float, y: float) -> int:
    """Find the piece on which the lead changes its sign, where it falls all along.

    Args:
        knots: Table of `pieces`.
        start: First knot.
        stop: Last knot.
        x: Of the point, finite [m].
        y: See x [m].

    Returns:
        The piece, -1 if there is none between the two knots.
    """
    ahead, behind = lead(knots, start, x, y), lead(knots, stop, x, y)
    i = -1
    if ahead >= 0.0 and behind < 0.0:
        i = start + int((stop - start) * (ahead / (ahead - behind)))
        while lead(knots, i, x, y) < 0.0:
            i -= 1
        while lead(knots, i + 1, x, y) >= 0.0:
            i += 1
    return i


@inlined
def foot_in_piece(
    knots: FloatArray, i: int, x: float, y: float
) -> tuple[float, float, float, float]:
    """Find the foot point in piece `i`, where the lead changes its sign.

    Returns:
        (s, l, cos_heading, sin_heading).
    """
    start, length = knots[i, S], knots[i + 1, S] - knots[i, S]
    ahead, behind = lead(knots, i, x, y), lead(knots, i + 1, x, y)
    dx, dy = knots[i, X] - x, knots[i, Y] - y
    cos, sin = knots[i, COS], knots[i, SIN]
    curvature, rate = knots[i, CURVATURE], knots[i, RATE]
    bracket = (0.0, length, length * ahead / (ahead - behind))
    u, l, cos, sin = converge(dx, dy, cos, sin, curvature, rate, bracket)
    return start + u, l, cos, sin


@inlined
def better_of(
    best: Foot,
    candidate: tuple[float, float, float, float],
    limits: tuple[float, float],
    direction: tuple[float, float, float],
) -> Foot:
    """Compare a foot (s, l, cos, sin) with the best one so far."""
    s, l, cos, sin = candidate
    cost = abs(l) + direction[2] * (1.0 - direction[0] * cos - direction[1] * sin)
    better = cost < best[0] - TIE or (cost < best[0] + TIE and s < best[1])
    if better and limits[0] <= s <= limits[1]:
        best = (cost, s, l, True)
    return best


@inlined
def better_foot_in_block(
    knots: FloatArray,
    blocks: FloatArray,
    j: int,
    x: float,
    y: float,
    limits: tuple[float, float],
    direction: tuple[float, float, float],
    best: Foot,
) -> Foot:
    """Compare the feet in block `j` with the best one so far."""
    start = j * PIECES_PER_BLOCK
    stop = min(start + PIECES_PER_BLOCK, knots.shape[0] - 1)
    farthest = np.sqrt(squared_distance(blocks, j, x, y)) + blocks[j, HALF_LENGTH]
    if farthest * blocks[j, SHARPEST] < 1.0:
        # 1 - kappa l > 0 all along: the lead falls and changes its sign at most once
        piece = falling_piece(knots, start, stop, x, y)
        start, stop = (piece, piece + 1) if piece >= 0 else (0, 0)
    along = lead(knots, start, x, y)
    for i in range(start, stop):
        along_next = lead(knots, i + 1, x, y)
        if along >= 0.0 and along_next < 0.0:
            candidate = foot_in_piece(knots, i, x, y)
            best = better_of(best, candidate, limits, direction)
        along = along_next
    return best


@inlined
def foot_on_extensions(
    knots: FloatArray,
    x: float,
    y: float,
    limits: tuple[float, float],
    direction: tuple[float, float, float],
) -> Foot:
    """Find the foot on the straight extensions of both ends.

    It competes with the distance of the end itself, so that an extension across the
    road attracts nothing.
    """
    best = (np.inf, 0.0, 0.0, False)
    end = knots.shape[0] - 1
    for k in (0, end):
        along = lead(knots, k, x, y)
        s = knots[k, S] + along
        beyond = along < 0.0 if k == 0 else along >= 0.0
        if beyond and limits[0] <= s <= limits[1]:
            cos, sin = knots[k, COS], knots[k, SIN]
            l = (y - knots[k, Y]) * cos - (x - knots[k, X]) * sin
            turn = 1.0 - direction[0] * cos - direction[1] * sin
            cost = np.sqrt(along * along + l * l) + direction[2] * turn
            if cost < best[0] - TIE:
                best = (cost, s, l, True)
    return best


@inlined
def foot_within(
    knots: FloatArray,
    bins: IndexArray,
    blocks: FloatArray,
    x: float,
    y: float,
    limits: tuple[float, float],
    direction: tuple[float, float, float],
) -> Foot:
    """Find the cheapest foot point with limits[0] <= s <= limits[1].

    Args:
        knots: Table of `pieces`.
        bins: Look-up of `pieces`.
        blocks: Groups of pieces, from `search_tables`.
        x: Of the point [m].
        y: Of the point [m].
        limits: Range of arc length [m].
        direction: (cos, sin, weight [m]) of a heading that feet are preferred along;
            weight 0 for none.

    Returns:
        (cost, s, l, found); the cost is the distance plus that of the direction.
    """
    best = foot_on_extensions(knots, x, y, limits, direction)
    nearest, _ = nearest_block(knots, bins, blocks, x, y, limits)
    best = better_foot_in_block(knots, blocks, nearest, x, y, limits, direction, best)
    return best_of_the_rest(
        knots, bins, blocks, (x, y), limits, direction, nearest, best
    )


@inlined
def nearest_block(
    knots: FloatArray,
    bins: IndexArray,
    blocks: FloatArray,
    x: float,
    y: float,
    limits: tuple[float, float],
) -> tuple[int, float]:
    """Find the block whose middle is nearest, and its squared distance [m²]."""
    first = piece_index(knots, bins, limits[0]) // PIECES_PER_BLOCK
    last = piece_index(knots, bins, limits[1]) // PIECES_PER_BLOCK
    nearest, least = first, np.inf
    for j in range(first, last + 1):
        squared = squared_distance(blocks, j, x, y)
        if squared < least:
            nearest, least = j, squared
    return nearest, least


@inlined
def best_of_the_rest(
    knots: FloatArray,
    bins: IndexArray,
    blocks: FloatArray,
    point: tuple[float, float],
    limits: tuple[float, float],
    direction: tuple[float, float, float],
    nearest: int,
    best: Foot,
) -> Foot:
    """Compare the feet in all other blocks with the best one of the nearest block."""
    x, y = point
    first = piece_index(knots, bins, limits[0]) // PIECES_PER_BLOCK
    last = piece_index(knots, bins, limits[1]) // PIECES_PER_BLOCK
    least = squared_distance(blocks, nearest, x, y)
    if best[0] + np.sqrt(least) < blocks[nearest, ALONE]:
        first, last = max(first, nearest - 1), min(last, nearest + 1)
    for j in range(first, last + 1):
        reach = best[0] + blocks[j, HALF_LENGTH]
        if j != nearest and squared_distance(blocks, j, x, y) <= reach * reach:
            best = better_foot_in_block(knots, blocks, j, x, y, limits, direction, best)
    return best


@inlined
def foot(
    knots: FloatArray,
    bins: IndexArray,
    blocks: FloatArray,
    x: float,
    y: float,
    limits: tuple[float, float],
    direction: tuple[float, float, float],
) -> tuple[float, float]:
    """Find the foot point within `limits`; of the whole path, where there is none.

    Every finite point has a foot on the whole path; nan gives nan.
    """
    _, s, l, found = foot_within(knots, bins, blocks, x, y, limits, direction)
    if not found:
        _, s, l, found = foot_within(knots, bins, blocks, x, y, EVERYWHERE, direction)
    if not found:
        return np.nan, np.nan
    return s, l


@inlined
def likely_piece(
    knots: FloatArray, blocks: FloatArray, j: int, x: float, y: float
) -> int:
    """Find the piece of block `j` with the foot, -1 where that takes a closer look."""
    start = j * PIECES_PER_BLOCK
    stop = min(start + PIECES_PER_BLOCK, knots.shape[0] - 1)
    farthest = np.sqrt(squared_distance(blocks, j, x, y)) + blocks[j, HALF_LENGTH]
    piece = -1
    if farthest * blocks[j, SHARPEST] < 1.0:
        piece = falling_piece(knots, start, stop, x, y)
    return piece


@inlined
def begin_newton(
    knots: FloatArray, i: int, x: float, y: float, table: FloatArray, k: int
) -> None:
    """Fill column `k` of the table of `newton_steps` as `foot_in_piece` begins."""
    length = knots[i + 1, S] - knots[i, S]
    ahead, behind = lead(knots, i, x, y), lead(knots, i + 1, x, y)
    table[0, k], table[1, k] = knots[i, X] - x, knots[i, Y] - y
    table[2, k], table[3, k] = knots[i, COS], knots[i, SIN]
    table[4, k], table[5, k] = knots[i, CURVATURE], knots[i, RATE]
    table[6, k] = length
    table[7, k] = length * ahead / (ahead - behind)


@inlined
def newton_steps(table: FloatArray, n: int) -> None:
    """Take the steps of `converge` for many points at once, without a branch.

    Args:
        table: (12, >= n). Rows 0 to 5: the arguments of `converge`; 6: the length of
            the piece; 7: the first guess, which becomes u. Rows 8 to 10 are filled with
            l and the direction at the foot, row 11 with 1 where it is found.
        n: Points.
    """
    for k in range(n):
        curvature, rate = table[4, k], table[5, k]
        bracket = (0.0, table[6, k], table[7, k])
        l, foot_cos, foot_sin, done = 0.0, 1.0, 0.0, False
        for _ in range(VECTOR_STEPS):
            place = follow_bent(
                table[0, k],
                table[1, k],
                table[2, k],
                table[3, k],
                curvature,
                rate,
                bracket[2],
            )
            after, new_l, new_cos, new_sin, found = improved_bracket(
                place, curvature, rate, bracket
            )
            bracket = (
                bracket[0] if done else after[0],
                bracket[1] if done else after[1],
                bracket[2] if done else after[2],
            )
            l = l if done else new_l
            foot_cos = foot_cos if done else new_cos
            foot_sin = foot_sin if done else new_sin
            done = done | found
        table[7, k] = bracket[2]
        table[8, k], table[9, k], table[10, k] = l, foot_cos, foot_sin
        table[11, k] = 1.0 if done else 0.0


@compiled
def feet(
    knots: FloatArray,
    bins: IndexArray,
    blocks: FloatArray,
    x: FloatArray,
    y: FloatArray,
    near: FloatArray,
    reach: float,
    heading: FloatArray,
) -> tuple[FloatArray, FloatArray]:
    """Project many points; an empty `near` or `heading` stands for none."""
    s, l = np.empty(x.size), np.empty(x.size)
    limits, direction = EVERYWHERE, NO_DIRECTION
    table = np.empty((12, CHUNK))
    pieces, nearby = np.empty(CHUNK, np.int64), np.empty(CHUNK, np.int64)
    for begin in range(0, x.size, CHUNK):
        n = min(CHUNK, x.size - begin)
        for k in range(n):
            i = begin + k
            if near.size > 0:
                limits = (near[i] - reach, near[i] + reach)
            nearby[k], _ = nearest_block(knots, bins, blocks, x[i], y[i], limits)
            pieces[k] = likely_piece(knots, blocks, nearby[k], x[i], y[i])
            begin_newton(knots, max(pieces[k], 0), x[i], y[i], table, k)
        newton_steps(table, n)
        for k in range(n):
            i = begin + k
            if near.size > 0:
                limits = (near[i] - reach, near[i] + reach)
            if heading.size > 0:
                direction = (np.cos(heading[i]), np.sin(heading[i]), HEADING_WEIGHT)
            best = foot_on_extensions(knots, x[i], y[i], limits, direction)
            if pieces[k] >= 0 and table[11, k] == 1.0:
                at = knots[pieces[k], S] + table[7, k]
                candidate = (at, table[8, k], table[9, k], table[10, k])
                best = better_of(best, candidate, limits, direction)
            else:
                best = better_foot_in_block(
                    knots, blocks, nearby[k], x[i], y[i], limits, direction, best
                )
            point = (x[i], y[i])
            _, s[i], l[i], found = best_of_the_rest(
                knots, bins, blocks, point, limits, direction, nearby[k], best
            )
            if not found:
                s[i], l[i] = foot(
                    knots, bins, blocks, x[i], y[i], EVERYWHERE, direction
                )
    return s, l


def search_tables(knots: FloatArray) -> tuple[FloatArray, IndexArray, FloatArray]:
    """Build the tables that the search reads; (knots, bins, blocks)."""
    bins = index_bins(knots[:, S])
    first = np.arange(0, knots.shape[0] - 1, PIECES_PER_BLOCK)
    last = np.minimum(first + PIECES_PER_BLOCK, knots.shape[0] - 1)
    start, end = knots[first, S], knots[last, S]
    x, y, *_ = points_at(knots, bins, freeze(0.5 * (start + end)))
    # the curvature is linear in between, so its extremes are at the knots; at a jump
    # a knot shows only the curvature after it, the end of a piece shows the other
    ends = knots[:-1, CURVATURE] + knots[:-1, RATE] * np.diff(knots[:, S])
    sharpest = np.maximum(np.abs(knots[:-1, CURVATURE]), np.abs(ends))
    half = 0.5 * (end - start) + TIE
    number = np.arange(x.size)
    alone = [
        np.min(
            np.hypot(x - x[j], y - y[j]) - half,
            where=np.abs(number - j) > 1,
            initial=np.inf,
        )
        for j in number
    ]
    columns = (x, y, half, np.maximum.reduceat(sharpest, first), alone)
    return knots, bins, freeze(np.stack(columns, axis=1))
