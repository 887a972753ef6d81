"""The drive command: the plan's acceleration ahead of time, and two errors."""

from planner.numerics.compiled import inlined
from planner.states import FloatArray
from planner.tracking.reference import ACCELERATION, SPEED, T, value_at

STANDING = 0.05  # a plan and an ego that are slower stand [m/s]
HOLDING = -1.0  # braking that keeps a standing ego where it is [m/s²]
NEAR_ENOUGH = 0.5  # an ego that stands this far behind its plan stays there [m]


@inlined
def drive_command(
    plan: FloatArray,
    time: float,
    ego: tuple[float, float],
    lead: float,
    gains: tuple[float, float],
) -> float:
    """Return the acceleration to ask the drive for [m/s²].

    a(t + T + tau) of the plan, which is what the drive will then give, plus
    k_s (s_ref - s) + k_v (v_ref - v).

    Args:
        plan: Its table, (8, n).
        time: Since the plan's first point [s].
        ego: How far it is behind the plan [m], and its speed [m/s].
        lead: Dead time and lag of the drive, T + tau [s].
        gains: k_s [1/s²] and k_v [1/s].
    """
    behind, speed = ego
    wanted = value_at(plan, T, SPEED, time)
    ahead = value_at(plan, T, SPEED, time + lead)
    if max(wanted, ahead, speed) < STANDING and behind < NEAR_ENOUGH:
        return HOLDING
    feed_forward = value_at(plan, T, ACCELERATION, time + lead)
    return feed_forward + gains[0] * behind + gains[1] * (wanted - speed)
