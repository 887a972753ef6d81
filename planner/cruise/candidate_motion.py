"""Profiles on the road, and the motion of the candidates along them.

All candidates of a profile drive over the same road at the same time and differ by
their terminal offset only. The lateral quintic is linear in that offset, so that the
offset of a candidate and its derivatives are those of one motion back to the present
offset plus its change times those of a change by one metre: the *lateral basis*.
"""

from typing import NamedTuple

import numpy as np

from planner.cruise.feasibility import lateral_at, lateral_motion
from planner.numerics.compiled import inlined
from planner.numerics.interpolation import interpolate
from planner.reference_path.frenet import cartesian_rates
from planner.reference_path.linear_curvature import trace
from planner.reference_path.road_turn import RoadTurn
from planner.states import FloatArray, IntArray

# Rows of a profile, and, where one is laid on the road, of the last plan's offset, the
# path and the road under it.
S, S_DOT, S_DDOT, S_DDDOT, LAST_L = 0, 1, 2, 3, 4
X, Y, COS, SIN, KAPPA, KAPPA_RATE, LEFT, RIGHT = 5, 6, 7, 8, 9, 10, 11, 12
TO_FRONT, TO_REAR = 13, 14  # circles that lead as far aside as the road does
N_PROFILE = 4
N_ROWS = 15

# Rows of the lateral basis: l, l', l'' and d³l/dt³ of the motion to the present offset,
# then the same of a change by one metre.
L, SLOPE, BEND, L_JERK, UNIT_L, UNIT_SLOPE, UNIT_BEND, UNIT_JERK = range(8)
N_BASIS = 8


class Tracks(NamedTuple):
    """Longitudinal profiles, as the kernel takes them."""

    rows: FloatArray  # (n_profiles, 4, n_steps), rows named above
    duration: FloatArray  # of the manoeuvre, (n_profiles,) [s]
    n_valid: IntArray  # valid steps, (n_profiles,)
    jerk: FloatArray  # integral of squared jerk, (n_profiles,) [m²/s⁵]
    dropped: IntArray  # check that rules the whole profile out, or 0, (n_profiles,)
    peak_jerk: FloatArray  # largest |jerk| of each, (n_profiles,) [m/s³]


class Lateral(NamedTuple):
    """The lateral samples."""

    over_time: bool
    start: tuple[float, float, float]  # l and its first two derivatives
    offsets: FloatArray  # terminal offsets, growing, (n_offsets,) [m]
    min_length: float  # of a motion over distance [m]
    min_speed: float  # at which it takes its duration [m/s]
    step: float  # between points [s]
    lead: float  # of the point that is led, ahead of the axle; 0: the axle [m]


class RoadTables(NamedTuple):
    """Tables of the path, the road and the last plan under the profiles."""

    knots: FloatArray  # of the path, see `ReferencePath.table`
    bins: IntArray
    road_s: FloatArray  # of the road bounds, (n,) [m]
    road_left: FloatArray  # [m]
    road_right: FloatArray  # [m]
    last_s: FloatArray  # the last plan, (m,), empty without one [m]
    last_l: FloatArray  # [m]
    front_reach: float  # rear axle to front bumper [m]
    turn: RoadTurn  # of the road along the profiles
    circles: FloatArray  # to the body's front and rear at its points, (2, n) [1/m]


@inlined
def copy_profile(tracks: Tracks, p: int, rows: FloatArray) -> None:
    """Fill the rows of the profile, (1, 15, n_steps), with those of profile `p`."""
    for row in range(N_PROFILE):
        for i in range(tracks.n_valid[p]):
            rows[0, row, i] = tracks.rows[p, row, i]


@inlined
def sample_road(rows: FloatArray, p: int, count: int, road: RoadTables) -> None:
    """Fill the rows of the path and the road under profile `p`.

    The bounds are the tighter ones of those under the rear axle and under the front.

    Args:
        rows: (n_profiles, 15, n_steps); s is given, X ... TO_REAR are filled.
        p: Which profile.
        count: Its valid steps.
        road: Its tables.
    """
    trace(road.knots, road.bins, rows[p, S, :count], rows[p, X : KAPPA_RATE + 1])
    s, left, right = rows[p, S, :count], rows[p, LEFT], rows[p, RIGHT]
    front = np.empty(count)
    road_s = road.road_s
    interpolate(s, 0.0, road_s, road.road_left, left)
    interpolate(s, road.front_reach, road_s, road.road_left, front)
    for i in range(count):
        left[i] = min(left[i], front[i])
    interpolate(s, 0.0, road_s, road.road_right, right)
    interpolate(s, road.front_reach, road_s, road.road_right, front)
    for i in range(count):
        right[i] = max(right[i], front[i])
    interpolate(s, 0.0, road.turn.s, road.circles[0], rows[p, TO_FRONT])
    interpolate(s, 0.0, road.turn.s, road.circles[1], rows[p, TO_REAR])


@inlined
def sample_last_plan(rows: FloatArray, p: int, count: int, road: RoadTables) -> None:
    """Fill the row of the last plan's offset under profile `p`, 0 without a plan."""
    if road.last_s.size > 0:
        s = rows[p, S, :count]
        interpolate(s, 0.0, road.last_s, road.last_l, rows[p, LAST_L])
    else:
        rows[p, LAST_L] = 0.0


@inlined
def lateral_length(
    rows: FloatArray, p: int, duration: float, lateral: Lateral
) -> float:
    """Return the extent of the lateral motion in its own variable [s] or [m]."""
    if lateral.over_time:
        return duration
    at = min(int(duration / lateral.step + 0.5), rows.shape[2] - 1)
    driven = float(rows[p, S, at] - rows[p, S, 0])
    return max(driven, lateral.min_length, lateral.min_speed * duration)


@inlined
def fill_basis(
    basis: FloatArray, p: int, count: int, tracks: Tracks, lateral: Lateral
) -> None:
    """Fill the lateral basis (8, n_steps) of profile `p`; [Thesis] eq. 4.1-4.5."""
    rows, over_time = tracks.rows, lateral.over_time
    length = lateral_length(rows, p, tracks.duration[p], lateral)
    here = lateral.start[0]
    back = lateral_motion(lateral.start, here, length, lateral.lead)
    unit = lateral_motion((0.0, 0.0, 0.0), 1.0, length, lateral.lead)
    s0 = rows[p, S, 0]
    for i in range(count):
        s_dot, s_ddot, s_dddot = (
            rows[p, S_DOT, i],
            rows[p, S_DDOT, i],
            rows[p, S_DDDOT, i],
        )
        done = lateral.step * i if over_time else rows[p, S, i] - s0
        l, slope, bend, jerk = lateral_at(over_time, back, done, s_dot, s_ddot, s_dddot)
        basis[L, i] = l
        basis[SLOPE, i] = slope
        basis[BEND, i] = bend
        basis[L_JERK, i] = jerk
        l, slope, bend, jerk = lateral_at(over_time, unit, done, s_dot, s_ddot, s_dddot)
        basis[UNIT_L, i] = l
        basis[UNIT_SLOPE, i] = slope
        basis[UNIT_BEND, i] = bend
        basis[UNIT_JERK, i] = jerk


@inlined
def candidate_motion(
    p: int, offset: float, tracks: Tracks, lateral: Lateral, road: RoadTables
) -> FloatArray:
    """Compute all points of one candidate.

    Returns:
        (9, n): rows in the order of the fields of `Trajectory`; n is the profile's
        count.
    """
    count = tracks.n_valid[p]
    out, rows = np.empty((9, count)), np.empty((1, N_ROWS, count))
    copy_profile(tracks, p, rows)
    sample_road(rows, 0, count, road)
    length = lateral_length(tracks.rows, p, tracks.duration[p], lateral)
    motion = lateral_motion(lateral.start, offset, length, lateral.lead)
    for i in range(count):
        s_dot, s_ddot = rows[0, S_DOT, i], rows[0, S_DDOT, i]
        done = lateral.step * i if lateral.over_time else rows[0, S, i] - rows[0, S, 0]
        l, slope, bend, _ = lateral_at(
            lateral.over_time, motion, done, s_dot, s_ddot, 0.0
        )
        cos_e, sin_e, curvature, speed, acceleration = cartesian_rates(
            l, rows[0, KAPPA, i], rows[0, KAPPA_RATE, i], s_dot, s_ddot, slope, bend
        )
        cos_r, sin_r = rows[0, COS, i], rows[0, SIN, i]
        out[0, i] = lateral.step * i
        out[1, i] = rows[0, X, i] - sin_r * l
        out[2, i] = rows[0, Y, i] + cos_r * l
        out[3, i] = np.arctan2(
            sin_r * cos_e + cos_r * sin_e, cos_r * cos_e - sin_r * sin_e
        )
        out[4, i] = curvature
        out[5, i] = max(speed, 0.0)
        out[6, i] = acceleration
        out[7, i] = rows[0, S, i]
        out[8, i] = l
    return out
