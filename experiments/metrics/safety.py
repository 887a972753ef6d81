"""Safety: contacts, clearance, time to collision, time headway, leaving the road."""

import json

import numpy as np

from experiments.metrics.pairs import Neighbours, neighbours
from experiments.trace.schema import Trace
from planner.scene import OFF_ROAD_TOLERANCE
from planner.states import FloatArray

TTC_HORIZON = 10.0  # later contacts do not count [s]
MIN_HEADWAY_SPEED = 1.0  # below it a time headway is meaningless [m/s]
STILL = 1e-9  # bodies approaching more slowly never meet [m/s]
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
            enter, leave = _overlap_times(distance, rate, reach)
            begin, end = np.maximum(begin, enter), np.minimum(end, leave)
    return np.where(begin <= end, begin, np.inf)


def min_time_headway(trace: Trace) -> float | None:
    """Return the smallest time headway to the leader [s].

    The leader is the nearest same-direction vehicle ahead within 100 m that overlaps
    the ego's width in l; headway = bumper-to-bumper gap / ego speed, at 1 m/s and
    above. None without a leader.
    """
    pairs = neighbours(trace)
    across = np.abs(pairs.dl) < (
        pairs.ego_width / 2.0
        + _half_extent(pairs.length, pairs.width, pairs.heading - np.pi / 2.0)
    )
    gap = (
        pairs.ds
        - pairs.ego_length / 2.0
        - _half_extent(pairs.length, pairs.width, pairs.heading)
    )
    leads = (
        across
        & (pairs.ds > 0.0)
        & (np.cos(pairs.heading) > 0.0)
        & (gap <= LEADER_RANGE)
        & (pairs.ego_speed >= MIN_HEADWAY_SPEED)
    )
    if not leads.any():
        return None
    return float((np.maximum(gap[leads], 0.0) / pairs.ego_speed[leads]).min())


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


def _overlap_times(
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
