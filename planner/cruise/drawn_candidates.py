"""Some of a cycle's candidates to be drawn: a few of each verdict, spread evenly."""

from typing import NamedTuple

import numpy as np

from planner.cruise.candidate_motion import (
    S_DDOT,
    S_DOT,
    Lateral,
    RoadTables,
    S,
    Tracks,
    lateral_length,
)
from planner.cruise.cycle import Cycle
from planner.cruise.feasibility import Check, lateral_at, lateral_motion
from planner.interface import KEPT, Alternative
from planner.numerics.compiled import compiled, inlined
from planner.reference_path.linear_curvature import point_at
from planner.states import FloatArray, IntArray

MOST_KEPT = 16  # drawn of those that passed
MOST_REMOVED = 6  # drawn of those that one check removed
SPACING = 0.4  # between the points drawn [s]
NAMES = tuple(
    KEPT if check is Check.PASSED else check.name.lower() for check in sorted(Check)
)

# Plain numbers: numba compiles these in.
PASSED = int(Check.PASSED)
DOMAIN = int(Check.DOMAIN)
N_CHECKS = len(Check)


class DrawnPoints(NamedTuple):
    """Points of the candidates that are drawn."""

    check: IntArray  # that removed each, (n,)
    points: FloatArray  # x and y, (n, 2, most points) [m]
    size: IntArray  # points of each, (n,)


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
    tables = cycle.tables
    every = max(round(SPACING / tables.lateral.step), 1)
    drawn = drawn_points(verdict, every, tables.tracks, tables.lateral, tables.road)
    return tuple(
        Alternative(NAMES[check], both[0, :size], both[1, :size])
        for check, both, size in zip(
            drawn.check.tolist(), drawn.points, drawn.size.tolist(), strict=True
        )
    )


@compiled
def drawn_points(
    verdict: IntArray, every: int, tracks: Tracks, lateral: Lateral, road: RoadTables
) -> DrawnPoints:
    """Choose candidates and compute the points that are drawn of them.

    Args:
        verdict: `Check` of each candidate, (n_profiles n_offsets,).
        every: Which points: every so many, and the last.
        tracks: Profiles.
        lateral: Lateral samples.
        road: Gives the path.
    """
    chosen = _choose(verdict, tracks.dropped, lateral.offsets.size)
    most = (tracks.rows.shape[2] + every - 2) // every + 1
    drawn = DrawnPoints(
        np.empty(chosen.size, np.int64),
        np.empty((chosen.size, 2, most)),
        np.empty(chosen.size, np.int64),
    )
    for j in range(chosen.size):
        drawn.check[j] = verdict[chosen[j]]
        drawn.size[j] = _fill_points(
            chosen[j], every, tracks, lateral, road, drawn.points[j]
        )
    return drawn


@inlined
def _choose(verdict: IntArray, dropped: IntArray, n_offsets: int) -> IntArray:
    """List the candidates drawn, check by check, of each first and last included."""
    chosen, count = np.empty(MOST_KEPT + N_CHECKS * MOST_REMOVED, np.int64), 0
    members = np.empty(verdict.size, np.int64)
    for check in range(N_CHECKS):
        n = 0
        for k in range(verdict.size):
            if verdict[k] == check and dropped[k // n_offsets] == PASSED:
                members[n] = k
                n += 1
        most = MOST_KEPT if check == PASSED else MOST_REMOVED
        if check == DOMAIN:
            continue
        for i in range(min(n, most)):
            place = i if n <= most else int(np.rint(i * ((n - 1) / (most - 1))))
            chosen[count] = members[place]
            count += 1
    return chosen[:count]


@inlined
def _fill_points(
    index: int,
    every: int,
    tracks: Tracks,
    lateral: Lateral,
    road: RoadTables,
    points: FloatArray,
) -> int:
    """Fill the points of one candidate as `candidate_motion` has them; their number."""
    p, offset = (
        index // lateral.offsets.size,
        lateral.offsets[index % lateral.offsets.size],
    )
    rows, last = tracks.rows, int(tracks.n_valid[p]) - 1
    length = lateral_length(rows, p, tracks.duration[p], lateral)
    motion = lateral_motion(lateral.start, offset, length, lateral.lead)
    n = (last + every - 1) // every + 1
    for k in range(n):
        i = min(k * every, last)
        s = rows[p, S, i]
        done = lateral.step * i if lateral.over_time else s - rows[p, S, 0]
        l, _, _, _ = lateral_at(
            lateral.over_time,
            motion,
            done,
            rows[p, S_DOT, i],
            rows[p, S_DDOT, i],
            0.0,
        )
        x, y, cos, sin, _, _, _ = point_at(road.knots, road.bins, s)
        points[0, k], points[1, k] = x - sin * l, y + cos * l
    return n
