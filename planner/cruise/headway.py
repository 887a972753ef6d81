"""Time headway to the vehicle ahead, and the one left to the vehicle behind."""

import numpy as np

from planner.compiled import compiled
from planner.cruise.costs import headway_lack
from planner.states import BoolArray, FloatArray, IntArray

MIN_REAR_GAP = 1.0  # left to a vehicle behind at any speed [m]
STRIDE = 5  # steps between the moments looked at: headways change slowly


@compiled
def headway_pairs(
    s: FloatArray,
    s_dot: FloatArray,
    count: IntArray,
    body_s: FloatArray,
    body_speed: FloatArray,
    body_reach: FloatArray,
    considered: BoolArray,
    front_reach: float,
    rear_overhang: float,
    standstill_gap: float,
    time_headway: float,
    rear_time_headway: float,
) -> tuple[IntArray, IntArray, IntArray, FloatArray]:
    """List per profile where the gap to a vehicle ahead or behind would be too short.

    Ahead the ego keeps standstill_gap + time_headway · its speed; behind it leaves
    MIN_REAR_GAP + rear_time_headway · the other's speed. Whether a pair counts
    depends on the candidate's offset and is decided later.

    Args:
        s: Profiles, (n_profiles, n_steps) [m].
        s_dot: (n_profiles, n_steps) [m/s].
        count: Valid steps, (n_profiles,).
        body_s: Predicted centres, (n_bodies, n_steps) [m].
        body_speed: (n_bodies,) [m/s].
        body_reach: Half lengths, (n_bodies,) [m].
        considered: Bodies that count, (n_bodies,) bool.
        front_reach: Rear axle to front bumper [m].
        rear_overhang: Rear axle to rear bumper [m].
        standstill_gap: Kept ahead at any speed [m].
        time_headway: Kept ahead beyond it [s].
        rear_time_headway: Left behind beyond `MIN_REAR_GAP` [s].

    Returns:
        (first, step, body, lack): lack in 0 ... 1, pairs of profile p are
        first[p] ... first[p + 1] - 1.
    """
    n_profiles = s.shape[0]
    first = np.zeros(n_profiles + 1, np.int64)
    total = 0
    capacity = 256
    step = np.empty(capacity, np.int64)
    body = np.empty(capacity, np.int64)
    lack = np.empty(capacity, np.float64)
    for p in range(n_profiles):
        for i in range(STRIDE, count[p], STRIDE):
            for b in range(body_s.shape[0]):
                if not considered[b]:
                    continue
                apart = body_s[b, i] - s[p, i]
                if apart > 0.0:
                    gap = apart - body_reach[b] - front_reach
                    needed = standstill_gap + time_headway * s_dot[p, i]
                else:
                    gap = -apart - body_reach[b] - rear_overhang
                    needed = MIN_REAR_GAP + rear_time_headway * body_speed[b]
                if gap >= needed:
                    continue
                if total == capacity:
                    capacity *= 2
                    wider = np.empty(capacity, np.int64)
                    wider[:total] = step
                    step = wider
                    wider = np.empty(capacity, np.int64)
                    wider[:total] = body
                    body = wider
                    wider_lack = np.empty(capacity, np.float64)
                    wider_lack[:total] = lack
                    lack = wider_lack
                step[total] = i
                body[total] = b
                lack[total] = headway_lack(gap, needed)
                total += 1
        first[p + 1] = total
    return first, step[:total], body[:total], lack[:total]
