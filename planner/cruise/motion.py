"""Profiles on the road, and the motion of one candidate along them."""

from typing import NamedTuple

import numpy as np

from planner.compiled import compiled
from planner.cruise.feasibility import lateral_at, lateral_quintic
from planner.geometry.frenet import cartesian_rates
from planner.geometry.pieces import point_at
from planner.states import FloatArray, IntArray

# Rows of a track: the profile, the last plan's offset, the path and the road under it.
S, S_DOT, S_DDOT, S_DDDOT, LAST_L = 0, 1, 2, 3, 4
X, Y, COS, SIN, KAPPA, KAPPA_RATE, LEFT, RIGHT = 5, 6, 7, 8, 9, 10, 11, 12
N_ROWS = 13


class Tracks(NamedTuple):
    """Longitudinal profiles and the road under them, as the kernel takes them."""

    rows: FloatArray  # (n_profiles, 13, n_steps), rows named above
    duration: FloatArray  # of the manoeuvre, (n_profiles,) [s]
    n_valid: IntArray  # valid steps, (n_profiles,)
    jerk: FloatArray  # integral of squared jerk, (n_profiles,) [m²/s⁵]


class Lateral(NamedTuple):
    """The lateral samples."""

    over_time: bool
    start: tuple[float, float, float]  # l and its first two derivatives
    offsets: FloatArray  # terminal offsets, (n_offsets,) [m]
    min_length: float  # of a motion over distance [m]
    step: float  # between points [s]


@compiled
def lay_road(
    rows: FloatArray,
    path: tuple[FloatArray, IntArray],
    road: tuple[FloatArray, FloatArray, FloatArray],
    front_reach: float,
) -> None:
    """Fill the rows of the path and the road under each profile.

    The bounds are the tighter ones of those under the rear axle and under the front.

    Args:
        rows: (n_profiles, 13, n_steps); s is given, X ... RIGHT are filled.
        path: Knots and bins of `ReferencePath.table`.
        road: s, left and right of the `RoadBounds`.
        front_reach: Rear axle to front bumper [m].
    """
    knots, bins = path
    road_s, road_left, road_right = road
    for p in range(rows.shape[0]):
        for i in range(rows.shape[2]):
            s = rows[p, S, i]
            x, y, cos, sin, kappa, rate, _ = point_at(knots, bins, s)
            rows[p, X, i] = x
            rows[p, Y, i] = y
            rows[p, COS, i] = cos
            rows[p, SIN, i] = sin
            rows[p, KAPPA, i] = kappa
            rows[p, KAPPA_RATE, i] = rate
        s = rows[p, S]
        rows[p, LEFT] = np.minimum(
            np.interp(s, road_s, road_left),
            np.interp(s + front_reach, road_s, road_left),
        )
        rows[p, RIGHT] = np.maximum(
            np.interp(s, road_s, road_right),
            np.interp(s + front_reach, road_s, road_right),
        )


@compiled
def lateral_length(
    rows: FloatArray, p: int, duration: float, lateral: Lateral
) -> float:
    """Extent of the lateral motion in its own variable [s] or [m]."""
    if lateral.over_time:
        return duration
    at = min(int(duration / lateral.step + 0.5), rows.shape[2] - 1)
    driven = float(rows[p, S, at] - rows[p, S, 0])
    return max(driven, lateral.min_length)


@compiled
def candidate_motion(
    p: int, offset: float, tracks: Tracks, lateral: Lateral
) -> FloatArray:
    """All points of one candidate.

    Returns:
        (8, n_steps): x, y, cos heading, sin heading, curvature, speed, acceleration, l.
        Columns from the profile's count on are undefined.
    """
    rows = tracks.rows
    out = np.empty((8, rows.shape[2]))
    length = lateral_length(rows, p, tracks.duration[p], lateral)
    c = lateral_quintic(lateral.start, offset, length)
    for i in range(tracks.n_valid[p]):
        s_dot, s_ddot = rows[p, S_DOT, i], rows[p, S_DDOT, i]
        done = lateral.step * i if lateral.over_time else rows[p, S, i] - rows[p, S, 0]
        l, slope, bend, _ = lateral_at(
            lateral.over_time, c, length, offset, done, s_dot, s_ddot, 0.0
        )
        cos_e, sin_e, curvature, speed, acceleration = cartesian_rates(
            l, rows[p, KAPPA, i], rows[p, KAPPA_RATE, i], s_dot, s_ddot, slope, bend
        )
        cos_r, sin_r = rows[p, COS, i], rows[p, SIN, i]
        out[0, i] = rows[p, X, i] - sin_r * l
        out[1, i] = rows[p, Y, i] + cos_r * l
        out[2, i] = cos_r * cos_e - sin_r * sin_e
        out[3, i] = sin_r * cos_e + cos_r * sin_e
        out[4, i] = curvature
        out[5, i] = speed
        out[6, i] = acceleration
        out[7, i] = l
    return out
