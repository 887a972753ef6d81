"""Longitudinal profiles: how the candidates move along the road."""

import math
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from planner.bodies import Leader
from planner.cruise.candidate_motion import N_PROFILE, S_DDDOT, S_DDOT, S_DOT, S, Tracks
from planner.cruise.costs import speed_deviation
from planner.cruise.feasibility import TOLERANCE, Check, squared_jerk
from planner.cruise.sampling.driving import Driving, LeaderAhead, Wish, drive
from planner.cruise.settings import CruiseSettings
from planner.numerics import polynomials
from planner.numerics.compiled import compiled, inlined
from planner.numerics.interpolation import interpolate
from planner.scene import Scene
from planner.states import FloatArray, freeze
from planner.vehicle import body_scale

STANDING = 0.5  # a slower vehicle is one to steer round [m/s]
SLOW = 3.0  # below it the ego may also creep [m/s]
REVERSE_TOLERANCE = 0.02  # rounding of profiles that end in a stand [m/s]
SPEED_EXCESS = 0.5  # over the largest speed that a profile may have [m/s]
EMPTY = freeze(())
BRISK = 0.9  # of the limits that a driver uses: beside the path they are tighter [-]
LARGEST_JERK = 10.0  # of a driver without a limit [m/s³]
NO_LEADER = np.zeros(0)  # not frozen, as the arrays of a leader: one type, one kernel

# Plain numbers: numba compiles these in.
PASSED = int(Check.PASSED)
REVERSING = int(Check.REVERSING)
SPEED = int(Check.SPEED)
STOP_LINE = int(Check.STOP_LINE)


class Profiles(NamedTuple):
    """Longitudinal motions.

    After its manoeuvre a profile goes on at its terminal speed. Points from `n_valid`
    on are padding.
    """

    tracks: Tracks
    speed_term: FloatArray  # price of each one's speed, (n_profiles,) [-]
    farthest: float  # largest s at their ends [m]


def front_limit(scene: Scene) -> float:
    """Arc length that the front must not pass: a line just passed asks to stand."""
    here = scene.ego_frenet.s + scene.vehicle.front_reach
    return max(min(scene.stop_lines, default=math.inf), here + TOLERANCE)


def stop_target(scene: Scene, settings: CruiseSettings) -> float | None:
    """Arc length where the rear axle stands before the next closed stop line [m]."""
    ahead = [
        line - scene.vehicle.front_reach - settings.stop_gap
        for line in scene.stop_lines
    ]
    nearest = min(ahead, default=np.inf)
    return nearest if np.isfinite(nearest) else None


def longitudinal_profiles(
    scene: Scene,
    settings: CruiseSettings,
    speed_ahead: tuple[FloatArray, FloatArray],
    leader: Leader | None,
) -> Profiles:
    """Sample the longitudinal motions of one cycle; [Thesis] 4.4, eq. 4.6-4.10.

    Quartics to fractions of the speed that the road allows, quintics to a stand at
    the stop line, quintics to the following distance behind the leader.
    """
    ego, vehicle = scene.ego_frenet, scene.vehicle
    stop = stop_target(scene, settings)
    creep = settings.creep_speeds if ego.s_dot < SLOW else ()
    return _profiles(
        ProfileStart(float(ego.s), float(ego.s_dot), float(ego.s_ddot)),
        speed_ahead,
        Keeping(_row(settings.times), _row(settings.speed_fractions), _row(creep)),
        Stopping(_row(settings.stop_times), np.inf if stop is None else stop),
        Following(
            _row(settings.follow_times),
            NO_LEADER if leader is None else leader.s,
            NO_LEADER if leader is None else leader.speed,
            settings.standstill_gap * _gap_scale(scene, leader),
            settings.time_headway,
            vehicle.front_reach,
        ),
        Driving(
            _row(settings.drive_fractions),
            _row(settings.drive_times),
            BRISK * vehicle.limits.max_acceleration,
            min(settings.comfort.deceleration, BRISK * vehicle.limits.max_deceleration),
            BRISK * min(settings.comfort.jerk, LARGEST_JERK),
        ),
        TimeGrid(settings.step, settings.horizon),
        ProfileBounds(
            max(vehicle.limits.max_speed, ego.s_dot) + SPEED_EXCESS,
            front_limit(scene) - vehicle.front_reach,
        ),
    )


def _gap_scale(scene: Scene, leader: Leader | None) -> float:
    """Return the scale of the gap to a leader: a long body needs more to steer round.

    What will drive on, or waits at a closed line, is not steered round.
    """
    if leader is None or scene.stop_lines or leader.speed.max() > STANDING:
        return 1.0
    return body_scale(scene.vehicle)


@lru_cache(maxsize=64)
def _row(values: tuple[float, ...]) -> FloatArray:
    """Make an array of settings, which may be empty, once."""
    return freeze(values)


class ProfileStart(NamedTuple):
    """Where the profiles begin."""

    s: float  # [m]
    s_dot: float  # [m/s]
    s_ddot: float  # [m/s²]


class Keeping(NamedTuple):
    """Profiles to a speed; arrays of any size, also empty."""

    times: FloatArray  # [s]
    fractions: FloatArray  # of the speed that the road allows there
    creep: FloatArray  # and further speeds [m/s]


class Stopping(NamedTuple):
    """Profiles to a stand."""

    times: FloatArray  # [s]
    place: float  # of the rear axle, inf for nowhere [m]


class Following(NamedTuple):
    """Profiles to the following distance."""

    times: FloatArray  # [s]
    leader_s: FloatArray  # rearmost point at each step, empty without a leader [m]
    leader_speed: FloatArray  # [m/s]
    standstill_gap: float  # [m]
    time_headway: float  # [s]
    front_reach: float  # rear axle to front bumper [m]


class TimeGrid(NamedTuple):
    """Points in time."""

    step: float  # [s]
    horizon: float  # where all profiles end, and to which the jerk is integrated; 0
    # ends each with its manoeuvre [s]


class ProfileBounds(NamedTuple):
    """Limits beyond which a profile is ruled out."""

    max_speed: float  # that none may exceed [m/s]
    stop_at: float  # that none may end beyond [m]


@compiled
def _profiles(
    start: ProfileStart,
    speed_ahead: tuple[FloatArray, FloatArray],
    keeping: Keeping,
    stopping: Stopping,
    following: Following,
    driving: Driving,
    grid: TimeGrid,
    bounds: ProfileBounds,
) -> Profiles:
    """Solve for all profiles, evaluate and price them.

    Args:
        start: Of all.
        speed_ahead: Arc lengths and the speed that the road allows there.
        keeping: See there.
        stopping: See there.
        following: See there.
        driving: See there.
        grid: Where they are evaluated.
        bounds: See there.
    """
    coefficients, duration = _sample(
        start, speed_ahead, keeping, stopping, following, grid.step
    )
    n, leader = duration.size, LeaderAhead(*following[1:])
    nobody = LeaderAhead(leader.s[:0], leader.speed[:0], 0.0, 0.0, 0.0)
    free = driving.fractions.size * driving.times.size
    more = free + (driving.times.size if leader.s.size > 0 and free > 0 else 0)
    tracks = roll_out(coefficients, duration, grid, more)
    rows = tracks.rows
    for k in range(driving.fractions.size):
        p = n + k * driving.times.size
        wish = Wish(speed_ahead[0], speed_ahead[1], driving.fractions[k])
        drive(p, start, wish, driving, nobody, grid.step, tracks)
    if more > free:
        wish = Wish(speed_ahead[0], speed_ahead[1], 1.0)
        drive(n + free, start, wish, driving, leader, grid.step, tracks)
    for p in range(n + more):
        tracks.dropped[p] = _ruled_out(rows[p], tracks.n_valid[p], bounds)
    grid_s, grid_speed = speed_ahead
    speed_term = speed_deviation(rows[:, S], rows[:, S_DOT], grid_s, grid_speed)
    farthest = -np.inf
    for p in range(rows.shape[0]):
        farthest = max(farthest, rows[p, S, -1])
    return Profiles(tracks, speed_term, farthest)


@inlined
def _sample(
    start: ProfileStart,
    speed_ahead: tuple[FloatArray, FloatArray],
    keeping: Keeping,
    stopping: Stopping,
    following: Following,
    step: float,
) -> tuple[FloatArray, FloatArray]:
    """Solve for all profiles.

    Args:
        start: As in `_profiles`, like the rest.
        speed_ahead: See start.
        keeping: See start.
        stopping: See start.
        following: See start.
        step: Between the leader's points [s].

    Returns:
        (coefficients, (n, 6), lowest order first; durations, (n,) [s]).
    """
    times, fractions, creep = keeping
    stop_times, stop = stopping
    follow_times, leader_s, leader_speed, standstill_gap, _, front_reach = following
    time_headway = following.time_headway
    s, s_dot, s_ddot = start
    road_s, road_speed = speed_ahead
    n_keeping = times.size * (fractions.size + creep.size)
    n = n_keeping + stop_times.size + follow_times.size
    rows, duration = np.zeros((n, 6)), np.empty(n)
    # The speed that the road allows about where each manoeuvre will end.
    allowed = np.empty(times.size)
    interpolate(s_dot * times, s, road_s, road_speed, allowed)
    for j in range(times.size):
        for i in range(fractions.size + creep.size):
            if i < fractions.size:
                end_speed = fractions[i] * allowed[j]
            else:
                end_speed = min(creep[i - fractions.size], allowed[j])
            p = i * times.size + j
            duration[p] = times[j]
            quartic = polynomials.quartic_coefficients(
                s, s_dot, s_ddot, end_speed, 0.0, times[j]
            )
            _store(quartic, rows[p])
    n = n_keeping
    if s < stop < np.inf:
        for time in stop_times:
            duration[n] = time
            quintic = polynomials.quintic_coefficients(
                s, s_dot, s_ddot, stop, 0.0, 0.0, time
            )
            _store(quintic, rows[n])
            n += 1
    if leader_s.size > 0:
        for time in follow_times:
            k = min(int(np.rint(time / step)), leader_s.size - 1)
            speed = leader_speed[k]
            target = leader_s[k] - standstill_gap - time_headway * speed - front_reach
            if target > s:
                duration[n] = time
                quintic = polynomials.quintic_coefficients(
                    s, s_dot, s_ddot, target, speed, 0.0, time
                )
                _store(quintic, rows[n])
                n += 1
    return rows[:n].copy(), duration[:n].copy()


@inlined
def _store(coefficients: tuple[float, ...], row: FloatArray) -> None:
    """Copy a tuple one by one: a slice filled at once takes numba 2 s to compile."""
    for k in range(len(coefficients)):
        row[k] = coefficients[k]


@inlined
def roll_out(
    coefficients: FloatArray,
    duration: FloatArray,
    grid: TimeGrid,
    more: int,
) -> Tracks:
    """Evaluate quintics s(t) on the time grid, at constant speed after their end.

    Args:
        coefficients: (n, 6), lowest order first.
        duration: (n,) [s].
        grid: See there.
        more: Profiles after them that are left to be filled.
    """
    step, horizon = grid
    n = coefficients.shape[0]
    end = horizon
    if horizon == 0.0:
        for p in range(n):
            end = max(end, duration[p])
    n_steps = int(np.rint(end / step)) + 1
    count = np.empty(n + more, np.int64)
    rows = np.empty((n + more, N_PROFILE, n_steps))
    jerk, peak_jerk = np.empty(n + more), np.zeros(n + more)
    durations = np.empty(n + more)
    for p in range(n):
        c0, c1, c2 = coefficients[p, 0], coefficients[p, 1], coefficients[p, 2]
        c3, c4, c5 = coefficients[p, 3], coefficients[p, 4], coefficients[p, 5]
        jerk[p] = squared_jerk((c0, c1, c2, c3, c4, c5), min(duration[p], end))
        count[p] = n_steps if horizon > 0.0 else int(np.rint(duration[p] / step)) + 1
        ends = duration[p]  # what is read from an array would not become vector code
        durations[p] = ends
        for i in range(n_steps):
            t = min(i * step, ends)
            after = i * step - t
            moving = 1.0 if after <= 1e-9 else 0.0
            v = c1 + t * (2.0 * c2 + t * (3.0 * c3 + t * (4.0 * c4 + t * 5.0 * c5)))
            a = 2.0 * c2 + t * (6.0 * c3 + t * (12.0 * c4 + t * 20.0 * c5))
            s = c0 + t * (c1 + t * (c2 + t * (c3 + t * (c4 + t * c5))))
            rows[p, S, i] = s + v * after
            rows[p, S_DOT, i] = v
            rows[p, S_DDOT, i] = moving * a
            rows[p, S_DDDOT, i] = moving * (6.0 * c3 + t * (24.0 * c4 + t * 60.0 * c5))
        for i in range(count[p]):
            peak_jerk[p] = max(peak_jerk[p], abs(rows[p, S_DDDOT, i]))
    dropped = np.full(n + more, PASSED)
    return Tracks(rows, durations, count, jerk, dropped, peak_jerk)


@inlined
def _ruled_out(profile: FloatArray, count: int, bounds: ProfileBounds) -> int:
    """Return the check that rules a profile out, or PASSED."""
    max_speed, stop_at = bounds
    slowest, fastest = np.inf, -np.inf
    for i in range(count):
        v = profile[S_DOT, i]
        slowest, fastest = min(slowest, v), max(fastest, v)
    if slowest < -REVERSE_TOLERANCE:
        return REVERSING
    if fastest > max_speed:
        return SPEED
    return STOP_LINE if profile[S, count - 1] > stop_at else PASSED
