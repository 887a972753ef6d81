"""Safety: contacts, clearance, time to collision, time headway, leaving the road."""

import json

import numpy as np
from numpy.typing import NDArray

from experiments.metrics.pairs import Neighbours, neighbours
from experiments.trace.schema import Trace
from planner.scene import OFF_ROAD_TOLERANCE
from planner.states import FloatArray

TTC_HORIZON = 10.0  # later contacts do not count [s]
MIN_HEADWAY_SPEED = 1.0  # below it a time headway is meaningless [m/s]
STILL = 1e-9  # bodies approaching more slowly never meet [m/s]
GRAZE = 1e-9  # what overlaps a corridor by less is beside it [m]
LEADER_RANGE = 100.0  # front bumper to rear bumper [m]


def contacts(trace: Trace) -> list[str]:
    """List the bodies that the ego's rectangle touched, in order, each once."""
    found: dict[str, None] = {}
    for cell in trace.steps["contacts"]:
        found.update(dict.fromkeys(json.loads(cell)))
    return list(found)


def min_clearance(trace: Trace) -> float | None:
    """Return the smallest distance between the ego's rectangle and any body [m].

    0 after a contact; None without bodies.
    """
    clearance = np.ma.compressed(trace.steps["clearance_m"])
    if contacts(trace):
        return 0.0
    return float(clearance.min()) if clearance.size else None


def min_time_to_collision(trace: Trace) -> float | None:
    """Return the smallest time to collision with any vehicle [s].

    In the Frenet plane of the ego's path, where the road is straight, both rectangles
    keep their current (s_dot, l_dot); the time is the first one at which they touch,
    computed exactly. None if no pair touches within 10 s.
    """
    pairs = neighbours(trace)
    times = time_to_contact(pairs)
    times = times[times <= TTC_HORIZON]
    return float(times.min()) if times.size else None


def time_to_contact(pairs: Neighbours) -> FloatArray:
    """Compute the first time at which two moving rectangles touch, by separating axes.

    On each of the four edge normals the projections overlap during one interval of
    time; the rectangles touch while all four intervals overlap.

    Args:
        pairs: Ego and vehicle, each row one pair.

    Returns:
        (n_pairs,) [s]; 0 if they overlap now, inf if they never will.
    """
    begin = np.zeros(pairs.ds.size)
    end = np.full(pairs.ds.size, np.inf)
    for angle in (pairs.ego_heading, pairs.heading):
        for normal in (angle, angle + np.pi / 2.0):
            cos, sin = np.cos(normal), np.sin(normal)
            distance = pairs.ds * cos + pairs.dl * sin
            rate = pairs.ds_dot * cos + pairs.dl_dot * sin
            reach = _half_extent(
                pairs.length, pairs.width, pairs.heading - normal
            ) + _half_extent(
                pairs.ego_length, pairs.ego_width, pairs.ego_heading - normal
            )
            enter, leave = overlap_times(distance, rate, reach)
            begin, end = np.maximum(begin, enter), np.minimum(end, leave)
    return np.where(begin <= end, begin, np.inf)


def min_time_headway(trace: Trace) -> float | None:
    """Return the smallest time headway to a leader [s].

    A leader travels in the ego's direction, its rear bumper is at most 100 m ahead of
    the ego's front bumper, and its footprint reaches into the ego's corridor: as wide
    as the ego, along the reference path at the ego's offset. The headway is the gap
    from the front bumper to that part of the footprint over the ego's speed, at 1 m/s
    and above. None without a leader.
    """
    headways = time_headways(neighbours(trace))
    leads = np.isfinite(headways)
    return float(headways[leads].min()) if leads.any() else None


def time_headways(pairs: Neighbours) -> FloatArray:
    """Compute the time headway of each pair as above; inf unless it is a leader.

    Returns:
        (n_pairs,) [s].
    """
    gap, leads = leader_gaps(pairs)
    leads &= pairs.ego_speed >= MIN_HEADWAY_SPEED
    headways = np.full(gap.size, np.inf)
    headways[leads] = gap[leads] / pairs.ego_speed[leads]
    return headways


def leader_gaps(pairs: Neighbours) -> tuple[FloatArray, NDArray[np.bool_]]:
    """Return the gap to each vehicle [m], and whether it is a leader, (n_pairs,) each.

    See `min_time_headway`; a gap is at least 0.
    """
    front = pairs.ego_length / 2.0 * np.cos(pairs.ego_heading)
    rear = pairs.ds - pairs.length / 2.0 * np.cos(pairs.heading)
    gap = _corridor_entry(pairs) - front
    leads = (rear >= front) & (np.cos(pairs.heading) > 0.0) & (gap <= LEADER_RANGE)
    return np.maximum(gap, 0.0), np.asarray(leads)


def _corridor_entry(pairs: Neighbours) -> FloatArray:
    """Return where each footprint begins in the ego's corridor, (n_pairs,) [m].

    From the ego's centre along the path; inf if it is beside the corridor. The first
    point of a convex footprint between two lines is a corner or lies on an edge that
    crosses one of them.
    """
    along, across = np.cos(pairs.heading), np.sin(pairs.heading)
    ends = [(1.0, 1.0), (1.0, -1.0), (-1.0, -1.0), (-1.0, 1.0)]
    half_length, half_width = pairs.length / 2.0, pairs.width / 2.0
    corners = [
        (
            pairs.ds + k * half_length * along - m * half_width * across,
            pairs.dl + k * half_length * across + m * half_width * along,
        )
        for k, m in ends
    ]
    reach = pairs.ego_width / 2.0 - GRAZE
    first = np.full(pairs.ds.size, np.inf)
    for (s, l), (next_s, next_l) in zip(
        corners, corners[1:] + corners[:1], strict=True
    ):
        first = np.minimum(first, np.where(np.abs(l) <= reach, s, np.inf))
        level = np.abs(next_l - l) < STILL
        slope = np.where(level, 1.0, next_l - l)
        for line in (-reach, reach):
            share = (line - l) / slope
            crosses = ~level & (share >= 0.0) & (share <= 1.0)
            place = s + share * (next_s - s)
            first = np.minimum(first, np.where(crosses, place, np.inf))
    return first


def off_road_steps(trace: Trace) -> int:
    """Count the steps in which the ego's body extended beyond the road edge.

    More than 1 cm counts, as in the loop's own check.
    """
    return int(
        np.count_nonzero(
            np.ma.filled(trace.steps["off_road_m"], 0.0) > OFF_ROAD_TOLERANCE
        )
    )


def _half_extent(
    length: FloatArray | float, width: FloatArray | float, angle: FloatArray
) -> FloatArray:
    """Project half of a rectangle on an axis at `angle` to its heading."""
    along, across = np.abs(np.cos(angle)), np.abs(np.sin(angle))
    extent: FloatArray = (length * along + width * across) / 2.0
    return extent


def overlap_times(
    distance: FloatArray, rate: FloatArray, reach: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Solve |distance + rate t| <= reach for t; (inf, -inf) if never."""
    still = np.abs(rate) < STILL
    safe = np.where(still, 1.0, rate)
    one, other = (-reach - distance) / safe, (reach - distance) / safe
    always = np.abs(distance) <= reach
    enter = np.where(still, np.where(always, -np.inf, np.inf), np.minimum(one, other))
    leave = np.where(still, np.where(always, np.inf, -np.inf), np.maximum(one, other))
    return enter, leave
