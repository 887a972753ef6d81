"""Traffic impact: braking and speed loss of the vehicle that follows the ego."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from experiments.metrics.pairs import Neighbours, neighbours
from experiments.trace.schema import Trace
from planner.states import FloatArray

LANE_HALF_WIDTH = 1.65  # half of a lane of 3.3 m, the corridor about the ego [m]
FOLLOWING_RANGE = 80.0  # rear bumper to front bumper; maximum for a follower [m]


@dataclass(frozen=True, slots=True, eq=False)
class Follower:
    """One uninterrupted stay of a vehicle behind the ego; arrays are (n_steps,)."""

    id: str
    index: NDArray[np.int64]  # of the steps
    speed: FloatArray  # [m/s]
    acceleration: FloatArray  # [m/s²]


def followings(trace: Trace) -> list[Follower]:
    """Find the followers of the ego and their speeds and accelerations.

    The follower in a step is the nearest same-direction vehicle behind the ego, at most
    80 m from bumper to bumper, whose width overlaps a corridor of one lane around the
    ego's centre.
    """
    pairs = neighbours(trace)
    rows = _follower_rows(pairs)
    result: list[Follower] = []
    start = 0
    for end in range(1, len(rows) + 1):
        if end < len(rows) and _goes_on(pairs, rows[end - 1], rows[end]):
            continue
        run = rows[start:end]
        result.append(
            Follower(
                str(pairs.id[run[0]]),
                pairs.index[run],
                pairs.speed[run],
                pairs.acceleration[run],
            )
        )
        start = end
    return result


def rear_max_deceleration(trace: Trace) -> float | None:
    """Return the hardest braking of any follower while following, >= 0 [m/s²].

    None without followers.
    """
    found = followings(trace)
    if not found:
        return None
    return max(0.0, *(float(-run.acceleration.min()) for run in found))


def rear_speed_loss(trace: Trace) -> float | None:
    """Return the largest drop of a follower's speed while following, >= 0 [m/s].

    The maximum of (highest speed so far - current speed). None without followers.
    """
    found = followings(trace)
    if not found:
        return None
    return max(
        float((np.maximum.accumulate(run.speed) - run.speed).max()) for run in found
    )


def _follower_rows(pairs: Neighbours) -> list[int]:
    """Return the row of the follower in each step that has one."""
    half_length = (pairs.length + pairs.ego_length) / 2.0
    behind = (pairs.ds < 0.0) & (-pairs.ds - half_length <= FOLLOWING_RANGE)
    inside = np.abs(pairs.dl) < LANE_HALF_WIDTH + pairs.width / 2.0
    rows = np.flatnonzero(behind & inside & (np.cos(pairs.heading) > 0.0))
    nearest: dict[int, int] = {}
    for row in rows.tolist():
        step = int(pairs.index[row])
        if step not in nearest or pairs.ds[row] > pairs.ds[nearest[step]]:
            nearest[step] = row
    return list(nearest.values())


def _goes_on(pairs: Neighbours, before: int, after: int) -> bool:
    """Check whether the same vehicle follows in the next step."""
    same = pairs.id[before] == pairs.id[after]
    return bool(same and pairs.index[after] == pairs.index[before] + 1)
