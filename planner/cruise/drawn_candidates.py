"""Some of a cycle's candidates to be drawn: a few of each verdict, spread evenly."""

import numpy as np

from planner.cruise.candidate_motion import (
    COS,
    S_DDOT,
    S_DOT,
    SIN,
    Lateral,
    S,
    Tracks,
    X,
    Y,
    lateral_length,
)
from planner.cruise.cycle import Cycle
from planner.cruise.feasibility import Check, lateral_at, lateral_quintic
from planner.interface import KEPT, Alternative
from planner.numerics.compiled import compiled, inlined
from planner.states import FloatArray, IntArray

MOST_KEPT = 16  # drawn of those that passed
MOST_REMOVED = 6  # drawn of those that one check removed
SPACING = 0.4  # between the points drawn [s]
PASSED, DOMAIN = int(Check.PASSED), int(Check.DOMAIN)
CHECKS = np.array([int(check) for check in Check if check is not Check.DOMAIN])
NAMES = {int(c): KEPT if c is Check.PASSED else c.name.lower() for c in Check}


def alternatives_of(cycle: Cycle, verdict: IntArray) -> tuple[Alternative, ...]:
    """Return the thinned candidates.

    Args:
        cycle: What was evaluated.
        verdict: `Check` of each candidate, (n,).

    Returns:
        In the order of the checks, the ones that passed first; candidates whose
        profile cannot be driven at all have no trajectory and are left out, as are
        those that leave the domain of the path.
    """
    every = max(round(SPACING / cycle.tables.lateral.step), 1)
    drawn = _drawn(
        verdict, cycle.tables.tracks.dropped, cycle.tables.lateral.offsets.size
    )
    x, y, ends = _thinned(drawn, cycle.tables.tracks, cycle.tables.lateral, every)
    stops = ends.tolist()
    return tuple(
        Alternative(NAMES[check], x[begin:end], y[begin:end])
        for check, begin, end in zip(
            verdict[drawn].tolist(), stops[:-1], stops[1:], strict=True
        )
    )


@compiled
def _drawn(verdict: IntArray, dropped: IntArray, n_offsets: int) -> IntArray:
    """Choose the candidates, a few of each verdict, evenly over their order."""
    chosen = np.empty(CHECKS.size * MOST_KEPT, np.int64)
    n = 0
    members = np.empty(verdict.size, np.int64)
    for check in CHECKS:
        count = 0
        for k in range(verdict.size):
            if verdict[k] == check and dropped[k // n_offsets] == PASSED:
                members[count] = k
                count += 1
        most = MOST_KEPT if check == PASSED else MOST_REMOVED
        number = min(count, most)
        pitch = (count - 1) / (most - 1) if count > most else 1.0
        for k in range(number):
            last = k == number - 1
            chosen[n] = members[count - 1 if last else int(np.rint(k * pitch))]
            n += 1
    return chosen[:n]


@inlined
def _thinned_size(count: int, every: int) -> int:
    """Count every so many of some points, and the last."""
    return (count - 2) // every + 2


@compiled
def _thinned(
    drawn: IntArray, tracks: Tracks, lateral: Lateral, every: int
) -> tuple[FloatArray, FloatArray, IntArray]:
    """Compute every so many points, and the last, of some candidates.

    Returns:
        (x, y, ends): candidate k has the points from ends[k] to ends[k + 1] [m].
    """
    n_offsets = lateral.offsets.size
    ends = np.zeros(drawn.size + 1, np.int64)
    for d in range(drawn.size):
        count = tracks.n_valid[drawn[d] // n_offsets]
        ends[d + 1] = ends[d] + _thinned_size(count, every)
    x, y = np.empty(ends[-1]), np.empty(ends[-1])
    rows = tracks.rows
    for d in range(drawn.size):
        p, offset = drawn[d] // n_offsets, lateral.offsets[drawn[d] % n_offsets]
        length = lateral_length(rows, p, tracks.duration[p], lateral)
        shape = lateral_quintic(lateral.start, offset, length)
        last = tracks.n_valid[p] - 1
        for k in range(ends[d], ends[d + 1]):
            i = min((k - ends[d]) * every, last)
            s_dot, s_ddot = rows[p, S_DOT, i], rows[p, S_DDOT, i]
            along = rows[p, S, i] - rows[p, S, 0]
            done = lateral.step * i if lateral.over_time else along
            l, _, _, _ = lateral_at(
                lateral.over_time, shape, length, offset, done, s_dot, s_ddot, 0.0
            )
            x[k] = rows[p, X, i] - rows[p, SIN, i] * l
            y[k] = rows[p, Y, i] + rows[p, COS, i] * l
    return x, y, ends
