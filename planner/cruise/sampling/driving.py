"""Profiles of a driver who follows the reference speed and the vehicle ahead.

The acceleration follows what is wanted with bounded jerk, from step to step: so the
ego moves off briskly, keeps the speed that a bend allows all along it, and comes up
behind a leader or to a line without overshoot, none of which one polynomial can do.
"""

import math
from typing import NamedTuple

from planner.cruise.candidate_motion import S_DDDOT, S_DDOT, S_DOT, S, Tracks
from planner.numerics.compiled import inlined
from planner.states import FloatArray

ANTICIPATION = 0.8  # in which the driver corrects the speed [s]
GAP_TIME = 1.5  # in which the driver corrects the gap to a leader [s]
LEADER_BRAKING = 1.5  # with which a gap is closed [m/s²]


class Driving(NamedTuple):
    """How the driver drives; arrays of any size, also empty."""

    fractions: FloatArray  # of the reference speed
    times: FloatArray  # of the lateral motions [s]
    acceleration: float  # at most [m/s²]
    deceleration: float  # at most, positive [m/s²]
    jerk: float  # at most [m/s³]


class LeaderAhead(NamedTuple):
    """Whom the driver follows; empty arrays without one."""

    s: FloatArray  # rearmost point at each step [m]
    speed: FloatArray  # [m/s]
    standstill_gap: float  # [m]
    time_headway: float  # [s]
    front_reach: float  # rear axle to front bumper [m]


class Wish(NamedTuple):
    """The speed to drive at where nobody is ahead."""

    s: FloatArray  # evenly spaced, (n,) [m]
    speed: FloatArray  # that the road asks for there, (n,) [m/s]
    fraction: float  # of it [-]


@inlined
def speed_at(wish: Wish, s: float) -> float:
    """Return the reference speed at a place."""
    road_s, road_speed, _ = wish
    last = road_s.size - 1
    place = (s - road_s[0]) / (road_s[1] - road_s[0])
    k = min(max(int(place), 0), last - 1)
    share = min(max(place - k, 0.0), 1.0)
    return float(road_speed[k] + share * (road_speed[k + 1] - road_speed[k]))


@inlined
def wanted_speed(
    at: tuple[float, float],
    i: int,
    wish: Wish,
    leader: LeaderAhead,
) -> float:
    """Return the speed to have `ANTICIPATION` later [m/s].

    Args:
        at: s [m] and speed [m/s] at step i.
        i: The step.
        wish: The speed to drive at.
        leader: Whom to follow.
    """
    s, v = at
    wanted = wish.fraction * speed_at(wish, s + ANTICIPATION * v)
    if leader.s.size > 0:
        k = min(i, leader.s.size - 1)
        lead = leader.speed[k]
        spare = leader.s[k] - leader.front_reach - s
        spare -= leader.standstill_gap + leader.time_headway * v
        spare += ANTICIPATION * (lead - v)
        closing = lead + spare / GAP_TIME
        if spare > 0.0:
            closing = min(
                closing, math.sqrt(lead * lead + 2.0 * LEADER_BRAKING * spare)
            )
        wanted = min(wanted, max(closing, 0.0))
    return wanted


@inlined
def drive(
    first: int,
    start: tuple[float, float, float],
    wish: Wish,
    driving: Driving,
    leader: LeaderAhead,
    step: float,
    tracks: Tracks,
) -> None:
    """Fill profiles of one drive, one for each time of its lateral motion.

    Args:
        first: Number of the first one.
        start: s, its rate and acceleration.
        wish: The speed to drive at.
        driving: How to drive.
        leader: Whom to follow.
        step: Between points [s].
        tracks: Filled; `dropped` is left to the bounds.
    """
    rows, n_steps = tracks.rows, tracks.rows.shape[2]
    s, v, a = start
    total, peak = 0.0, 0.0
    for i in range(n_steps):
        aim = (wanted_speed((s, v), i, wish, leader) - v) / ANTICIPATION
        aim = min(max(aim, -driving.deceleration), driving.acceleration)
        j = min(max((aim - a) / step, -driving.jerk), driving.jerk)
        rows[first, S, i], rows[first, S_DOT, i] = s, v
        rows[first, S_DDOT, i], rows[first, S_DDDOT, i] = a, j
        ahead = v + step * (a + 0.5 * step * j)
        if ahead <= 0.0:  # it stands
            s += 0.5 * step * v
            v, a = 0.0, 0.0
            rows[first, S_DDDOT, i] = 0.0
            continue
        s += step * (v + step * (0.5 * a + step * j / 6.0))
        v, a = ahead, a + step * j
        total += step * j * j
        peak = max(peak, abs(j))
    for t in range(driving.times.size):
        p = first + t
        if t > 0:
            for row in range(rows.shape[1]):
                for i in range(n_steps):
                    rows[p, row, i] = rows[first, row, i]
        tracks.duration[p], tracks.n_valid[p] = driving.times[t], n_steps
        tracks.jerk[p], tracks.peak_jerk[p] = total, peak
