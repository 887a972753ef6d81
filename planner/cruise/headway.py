"""Time headway to the vehicle ahead, and the one left to the vehicle behind."""

from planner.cruise.candidate_motion import S_DOT, UNIT_L, L, S
from planner.cruise.costs import headway_lack
from planner.cruise.workspace import Surroundings
from planner.numerics.compiled import inlined
from planner.states import FloatArray

MIN_REAR_GAP = 1.0  # left to a vehicle behind at any speed [m]
STRIDE = 5  # steps between the moments looked at: headways change slowly


@inlined
def lack_of_room(s: float, s_dot: float, b: int, i: int, around: Surroundings) -> float:
    """Squared share of the gap to a vehicle ahead or behind that is missing [-].

    Ahead the ego keeps standstill_gap + time_headway · its speed; behind it leaves
    MIN_REAR_GAP + rear_time_headway · the other's speed. What stands ahead is not
    followed: its price is the dead end.

    Args:
        s: Of the ego's rear axle at step i [m].
        s_dot: Its speed [m/s].
        b: Which vehicle.
        i: Which step.
        around: Bodies.

    Returns:
        0 ... 1; whether it counts depends on the offsets of both.
    """
    reach = around.extents[b, 0] + around.extents[b, 2]
    apart = around.s[b, i] - s
    if apart > 0.0 and around.turn_gap[b] > 0.0:
        gap, needed = 1.0, 0.0
    elif apart > 0.0:
        gap = apart - reach - around.front_reach
        needed = around.standstill_gap + around.time_headway * s_dot
    else:
        gap = -apart - reach - around.rear_overhang
        needed = MIN_REAR_GAP + around.rear_time_headway * around.speed[b]
    return headway_lack(gap, needed)


@inlined
def add_headway(
    p: int,
    count: int,
    rows: FloatArray,
    basis: FloatArray,
    delta_l: FloatArray,
    around: Surroundings,
    headway: FloatArray,
) -> None:
    """Sum the lack of room over time and vehicles in the way of each candidate.

    Args:
        p: Which profile.
        count: Its valid steps.
        rows: Of profiles and the road under them.
        basis: Of its lateral motion.
        delta_l: Terminal offsets less the present one, (n,) [m].
        around: Bodies.
        headway: Filled, (n,): mean over the horizon [-].
    """
    for o in range(delta_l.size):
        headway[o] = 0.0
    share = STRIDE / rows.shape[2]
    for i in range(STRIDE, count, STRIDE):
        s, s_dot = rows[p, S, i], rows[p, S_DOT, i]
        l, unit = basis[L, i], basis[UNIT_L, i]
        for b in range(around.n_static, around.size.size):
            lack = 0.0
            if not around.follower[b]:
                lack = share * lack_of_room(s, s_dot, b, i, around)
            if lack > 0.0:
                reach = around.corridor + around.extents[b, 1] + around.extents[b, 2]
                apart = around.l[b, i] - l
                for o in range(delta_l.size):
                    in_way = abs(apart - delta_l[o] * unit) < reach
                    headway[o] += lack if in_way else 0.0
