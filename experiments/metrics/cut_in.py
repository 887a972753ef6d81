"""What a lane change asks of the vehicle behind in the lane it goes to.

Followers are attributed to the change from the first step in which the ego's body is
over the line to 5 s after its body is wholly in the new lane: braking before and later
has other causes.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from experiments.metrics.followers import FOLLOWING_RANGE
from experiments.metrics.pairs import neighbours
from experiments.metrics.without_ego import drive_of
from experiments.trace.schema import Table, Trace
from planner.states import FloatArray

AFTER = 5.0  # for which followers are attributed after the change [s]
MARKED = 0.5  # a lane narrower than this is none [m]


@dataclass(frozen=True, slots=True)
class CutIn:
    """The first change into another lane, by steps; places in the steps' table."""

    target: int  # lane, 0 is the rightmost
    begin: int  # first step with the body over the line
    end: int  # last step in which followers are attributed


@dataclass(frozen=True, slots=True, eq=False)
class Attributed:
    """One vehicle while it is the follower of a change; arrays are (n,)."""

    id: str
    index: NDArray[np.int64]  # steps
    acceleration: FloatArray  # [m/s²]


def cut_in(trace: Trace) -> CutIn | None:
    """Find the first change into another lane; None without one, or without lanes.

    It begins where the ego's body first reaches over a line of its lane, without coming
    back before it is wholly in a lane beside, and is attributed until `AFTER` after
    that, or until the end of the episode.
    """
    steps = trace.steps
    s, l, turned = (
        np.ma.filled(steps[name], np.nan)
        for name in ("centre_s_m", "centre_l_m", "heading_error_rad")
    )
    if not trace.lanes["lane"].size or not np.isfinite(s).all() or not s.size:
        return None
    length, width = (float(trace.fact(name)) for name in ("length_m", "width_m"))
    half = (length * np.abs(np.sin(turned)) + width * np.abs(np.cos(turned))) / 2.0
    right, left, there = lane_edges(trace, s)
    inside = there & (right <= l - half) & (l + half <= left)  # (n_lanes, n_steps)
    home = int(np.argmax(there[:, 0] & (right[:, 0] <= l[0]) & (l[0] <= left[:, 0])))
    wholly = [
        int(np.flatnonzero(row)[0]) if row.any() else s.size
        for lane, row in enumerate(inside)
        if lane != home
    ]
    lanes = [lane for lane in range(len(inside)) if lane != home]
    if not wholly or min(wholly) == s.size:
        return None
    arrived = min(wholly)
    target = lanes[wholly.index(arrived)]
    at_home = np.flatnonzero(inside[home, :arrived])
    begin = int(at_home[-1]) + 1 if at_home.size else 0
    last = arrived + round(AFTER / float(trace.fact("step_s")))
    return CutIn(target, begin, min(last, s.size - 1))


def lane_edges(
    trace: Trace, s: FloatArray
) -> tuple[FloatArray, FloatArray, NDArray[np.bool_]]:
    """Return right and left edges of the lanes and where they are, (n_lanes, n)."""
    table = trace.lanes
    n_lanes = int(table["lane"].max()) + 1
    place, centre, width = (
        np.ma.getdata(table[name]).reshape(n_lanes, -1)
        for name in ("s_m", "centre_m", "width_m")
    )
    centres = np.array([np.interp(s, place[0], row) for row in centre])
    widths = np.array([np.interp(s, place[0], row) for row in width])
    return centres - widths / 2.0, centres + widths / 2.0, widths > MARKED


def attributed(trace: Trace) -> list[Attributed] | None:
    """Return the followers of the change; None without a change.

    The follower in a step is the nearest same-direction vehicle that is wholly behind
    the ego's front, at most 80 m from bumper to bumper, its centre in the target lane.
    """
    found = cut_in(trace)
    if found is None:
        return None
    pairs = neighbours(trace)
    steps = trace.steps["index"]
    row = np.searchsorted(steps, pairs.index)
    s = np.ma.getdata(trace.steps["centre_s_m"])[row] + pairs.ds
    l = np.ma.getdata(trace.steps["centre_l_m"])[row] + pairs.dl
    right, left, there = lane_edges(trace, s)
    k = found.target
    half = (pairs.length + pairs.ego_length) / 2.0
    behind = (pairs.ds < 0.0) & (-pairs.ds - half <= FOLLOWING_RANGE)
    in_lane = there[k] & (right[k] <= l) & (l <= left[k])
    in_time = (row >= found.begin) & (row <= found.end)
    rows = np.flatnonzero(behind & in_lane & in_time & (np.cos(pairs.heading) > 0.0))
    nearest: dict[int, int] = {}
    for one in rows.tolist():
        step = int(pairs.index[one])
        if step not in nearest or pairs.ds[one] > pairs.ds[nearest[step]]:
            nearest[step] = one
    chosen = np.array(sorted(nearest.values()), dtype=np.int64)
    names = pairs.id[chosen].astype(str) if chosen.size else np.empty(0, str)
    return [
        Attributed(
            str(name),
            pairs.index[chosen[names == name]],
            pairs.acceleration[chosen[names == name]],
        )
        for name in dict.fromkeys(names.tolist())
    ]


def max_deceleration(trace: Trace) -> float | None:
    """Return the hardest braking of a follower of the change, >= 0 [m/s²].

    None without a change or without a follower.
    """
    found = attributed(trace)
    if not found:
        return None
    return max(0.0, *(float(-one.acceleration.min()) for one in found))


def hardest_braking_step(trace: Trace) -> int | None:
    """Return the index of the step of `max_deceleration`."""
    found = attributed(trace)
    if not found:
        return None
    one = min(found, key=lambda one: float(one.acceleration.min()))
    return int(one.index[one.acceleration.argmin()])


def added_deceleration(trace: Trace, without: Table | None) -> float | None:
    """Return the largest (braking attributed to the change - braking without the ego).

    Each follower of the change is compared with itself, in the run without the ego, on
    the stretch of road on which it is attributed; at least 0 [m/s²]. None without a
    change, without a follower that is in both runs, or without the second run.
    """
    found = attributed(trace)
    if not found or without is None:
        return None
    added = []
    for one in found:
        driven = drive_of(trace, trace.vehicles, one.id)
        free = drive_of(trace, without, one.id)
        step = float(trace.fact("step_s"))
        inside = np.isin(np.rint(driven.time / step).astype(np.int64), one.index)
        if free.time.size < 2 or not inside.any():  # noqa: PLR2004 - a drive takes two
            continue
        begin, end = float(driven.s[inside].min()), float(driven.s[inside].max())
        braking = max(0.0, float(-one.acceleration.min()))
        added.append(max(0.0, braking - free.hardest_braking(begin, end)))
    return max(added, default=None)
