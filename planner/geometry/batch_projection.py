"""Foot points of many points on the whole path, a tile of points at a time.

The feet are those of `projection`, to the last digit. What every point goes through,
the distances to the blocks and Newton's method, runs over the tile in loops without
branches, which the compiler turns into vector instructions; in between each point finds
its piece by itself. A point with more than one foot in reach, or with none between the
ends of the path, is left to `projection`.

A tile is one flat array, so that the compiler knows that its rows do not overlap.
"""

import numpy as np

from planner.compiled import compiled, inlined
from planner.geometry.pieces import (
    COS,
    CURVATURE,
    RATE,
    SIN,
    IndexArray,
    S,
    X,
    Y,
)
from planner.geometry.projection import (
    EVERYWHERE,
    HALF_LENGTH,
    MIDDLE_X,
    MIDDLE_Y,
    NO_DIRECTION,
    PIECES_PER_BLOCK,
    SHARPEST,
    TIE,
    falling_piece,
    foot,
    lead,
    newton_step,
    squared_distance,
)
from planner.states import FloatArray

TILE = 64  # points; the rows below then stay in the nearest cache
FEW = 12  # a tile of fewer points is done one by one
# Where the rows of a tile begin. First the points, and the blocks of the path that may
# hold their feet (indices as numbers); then the start of the piece seen from the point,
# the first guess on it, and how far the foot may be; last what Newton's method finds.
N_ROWS = 18
(
    POINT_X,
    POINT_Y,
    APART,
    NEAREST,
    FIRST,
    LAST,
    PIECE,
    START_X,
    START_Y,
    START_COS,
    START_SIN,
    START_CURVATURE,
    START_RATE,
    LENGTH,
    GUESS,
    BOUND,
    FOOT_U,
    FOOT_L,
) = range(0, N_ROWS * TILE, TILE)
UNSURE = -1.0


@inlined
def find_blocks(blocks: FloatArray, tile: FloatArray) -> None:
    """Find the nearest block of each point, and the range of those that may be nearer.

    No point of the path is farther than the nearest middle; so no block counts whose
    middle is farther by more than half the block's length.
    """
    for i in range(TILE):
        tile[APART + i], tile[NEAREST + i] = np.inf, 0.0
        tile[FIRST + i], tile[LAST + i] = np.inf, -1.0
    for j in range(blocks.shape[0]):
        middle_x, middle_y, number = blocks[j, MIDDLE_X], blocks[j, MIDDLE_Y], float(j)
        for i in range(TILE):
            dx, dy = tile[POINT_X + i] - middle_x, tile[POINT_Y + i] - middle_y
            square = dx * dx + dy * dy
            nearer = square < tile[APART + i]
            tile[NEAREST + i] = number if nearer else tile[NEAREST + i]
            tile[APART + i] = square if nearer else tile[APART + i]
    for i in range(TILE):
        tile[APART + i] = np.sqrt(tile[APART + i])
    for j in range(blocks.shape[0]):
        middle_x, middle_y, number = blocks[j, MIDDLE_X], blocks[j, MIDDLE_Y], float(j)
        half = blocks[j, HALF_LENGTH]
        for i in range(TILE):
            dx, dy = tile[POINT_X + i] - middle_x, tile[POINT_Y + i] - middle_y
            reach = tile[APART + i] + half
            within = dx * dx + dy * dy <= reach * reach
            first = tile[FIRST + i]
            tile[FIRST + i] = number if within & (number < first) else first
            tile[LAST + i] = number if within else tile[LAST + i]


@inlined
def find_pieces(
    knots: FloatArray, blocks: FloatArray, count: int, tile: FloatArray
) -> None:
    """Find the piece on which each point has its only foot in reach, if it has one."""
    end = knots.shape[0] - 1
    for i in range(count):
        x, y = tile[POINT_X + i], tile[POINT_Y + i]
        sure = lead(knots, 0, x, y) >= 0.0 and lead(knots, end, x, y) < 0.0
        piece, bound = -1, np.inf
        nearest, first = int(tile[NEAREST + i]), int(tile[FIRST + i])
        # the nearest block comes first: it tells which others are out of reach
        for k in range(first - 1, int(tile[LAST + i]) + 1 if sure else 0):
            j = nearest if k < first else k
            square, half = squared_distance(blocks, j, x, y), blocks[j, HALF_LENGTH]
            if k == nearest or square > (bound + half) * (bound + half):
                continue
            falls = (np.sqrt(square) + half) * blocks[j, SHARPEST] < 1.0
            found = -1
            if falls:
                start = j * PIECES_PER_BLOCK
                stop = min(start + PIECES_PER_BLOCK, end)
                found = falling_piece(knots, start, stop, x, y)
            sure = sure and falls and (found < 0 or piece < 0)
            if found >= 0:
                piece = found
                bound = np.hypot(x - knots[piece, X], y - knots[piece, Y]) + TIE
        tile[PIECE + i] = float(piece) if sure else UNSURE
        tile[BOUND + i] = bound
        if piece >= 0:
            length = knots[piece + 1, S] - knots[piece, S]
            ahead, behind = lead(knots, piece, x, y), lead(knots, piece + 1, x, y)
            tile[START_X + i], tile[START_Y + i] = (
                knots[piece, X] - x,
                knots[piece, Y] - y,
            )
            tile[START_COS + i] = knots[piece, COS]
            tile[START_SIN + i] = knots[piece, SIN]
            tile[START_CURVATURE + i] = knots[piece, CURVATURE]
            tile[START_RATE + i] = knots[piece, RATE]
            tile[LENGTH + i] = length
            tile[GUESS + i] = length * ahead / (ahead - behind)


@inlined
def find_feet(tile: FloatArray) -> None:
    """Take the two steps of Newton's method that nearly all points need.

    A point that needs more, or whose foot is not the nearest one, becomes unsure.
    """
    for i in range(TILE):
        x, y = tile[START_X + i], tile[START_Y + i]
        cos, sin = tile[START_COS + i], tile[START_SIN + i]
        curvature, rate = tile[START_CURVATURE + i], tile[START_RATE + i]
        bracket = (0.0, tile[LENGTH + i], tile[GUESS + i])
        first, l_first, _, _, early = newton_step(
            x, y, cos, sin, curvature, rate, bracket
        )
        second, l_second, _, _, late = newton_step(
            x, y, cos, sin, curvature, rate, first
        )
        l = l_first if early else l_second
        tile[FOOT_U + i] = first[2] if early else second[2]
        tile[FOOT_L + i] = l
        sure = (early | late) & (abs(l) <= tile[BOUND + i])
        tile[PIECE + i] = tile[PIECE + i] if sure else UNSURE


@compiled
def feet_on_whole_path(
    knots: FloatArray,
    bins: IndexArray,
    blocks: FloatArray,
    x: FloatArray,
    y: FloatArray,
) -> tuple[FloatArray, FloatArray]:
    """Project many points, as `projection.feet` does without a guess or a heading."""
    s, l = np.empty(x.size), np.empty(x.size)
    tile = np.zeros(N_ROWS * TILE)
    tile[START_COS : START_COS + TILE] = 1.0
    for begin in range(0, x.size, TILE):
        count = min(TILE, x.size - begin)
        many = count >= FEW
        if many:
            for i in range(count):
                tile[POINT_X + i], tile[POINT_Y + i] = x[begin + i], y[begin + i]
            find_blocks(blocks, tile)
            find_pieces(knots, blocks, count, tile)
            find_feet(tile)
        for i in range(count):
            k = begin + i
            if many and tile[PIECE + i] >= 0.0:
                s[k] = knots[int(tile[PIECE + i]), S] + tile[FOOT_U + i]
                l[k] = tile[FOOT_L + i]
            else:
                s[k], l[k] = foot(
                    knots, bins, blocks, x[k], y[k], EVERYWHERE, NO_DIRECTION
                )
    return s, l
