"""Longitudinal profiles: how the candidates move along the road."""

import math
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from planner.bodies import Leader
from planner.cruise.candidate_motion import N_ROWS, S_DDDOT, S_DDOT, S_DOT, S, Tracks
from planner.cruise.costs import speed_deviation
from planner.cruise.feasibility import TOLERANCE, Check, squared_jerk
from planner.cruise.settings import CruiseSettings
from planner.numerics import polynomials
from planner.numerics.compiled import compiled, inlined
from planner.numerics.interpolation import interpolate
from planner.scene import Scene
from planner.states import FloatArray, freeze

SLOW = 3.0  # below it the ego may also creep [m/s]
REVERSE_TOLERANCE = 0.02  # rounding of profiles that end in a stand [m/s]
SPEED_EXCESS = 0.5  # over the largest speed that a profile may have [m/s]
EMPTY = freeze(())

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

    tracks: Tracks  # what lies under them is filled in where they are evaluated
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
        (float(ego.s), float(ego.s_dot), float(ego.s_ddot)),
        speed_ahead,
        (_row(settings.times), _row(settings.speed_fractions), _row(creep)),
        (_row(settings.stop_times), np.inf if stop is None else stop),
        _row(settings.follow_times),
        (EMPTY, EMPTY) if leader is None else (leader.s, leader.speed),
        (settings.standstill_gap, settings.time_headway, vehicle.front_reach),
        (settings.step, settings.horizon),
        (
            max(vehicle.limits.max_speed, ego.s_dot) + SPEED_EXCESS,
            front_limit(scene) - vehicle.front_reach,
        ),
    )


@lru_cache(maxsize=64)
def _row(values: tuple[float, ...]) -> FloatArray:
    """Make an array of settings, which may be empty, once."""
    return freeze(values)


@compiled
def _profiles(
    start: tuple[float, float, float],
    speed_ahead: tuple[FloatArray, FloatArray],
    keeping: tuple[FloatArray, FloatArray, FloatArray],
    stopping: tuple[FloatArray, float],
    follow_times: FloatArray,
    leader: tuple[FloatArray, FloatArray],
    room: tuple[float, float, float],
    grid: tuple[float, float],
    bounds: tuple[float, float],
) -> Profiles:
    """Solve for all profiles, evaluate and price them.

    Args:
        start: As in `_sample`, like the rest up to the room.
        speed_ahead: See start.
        keeping: See start.
        stopping: See start.
        follow_times: See start.
        leader: See start.
        room: See start.
        grid: As in `roll_out`.
        bounds: See grid.
    """
    coefficients, duration = _sample(
        start, speed_ahead, keeping, stopping, follow_times, leader, room, grid[0]
    )
    tracks = roll_out(coefficients, duration, grid, bounds)
    rows = tracks.rows
    grid_s, grid_speed = speed_ahead
    speed_term = speed_deviation(rows[:, S], rows[:, S_DOT], grid_s, grid_speed)
    farthest = -np.inf
    for p in range(rows.shape[0]):
        farthest = max(farthest, rows[p, S, -1])
    return Profiles(tracks, speed_term, farthest)


@inlined
def _sample(
    start: tuple[float, float, float],
    speed_ahead: tuple[FloatArray, FloatArray],
    keeping: tuple[FloatArray, FloatArray, FloatArray],
    stopping: tuple[FloatArray, float],
    follow_times: FloatArray,
    leader: tuple[FloatArray, FloatArray],
    room: tuple[float, float, float],
    step: float,
) -> tuple[FloatArray, FloatArray]:
    """Solve for all profiles.

    Args:
        start: s and its first two derivatives.
        speed_ahead: Arc lengths and the speed that the road asks for there.
        keeping: Times, fractions of that speed, and creeping speeds.
        stopping: Times, and where to stand; inf for nowhere.
        follow_times: Times to reach the following distance in.
        leader: Rearmost point and speed at each step; empty without one.
        room: Gap at a standstill, time headway, rear axle to front bumper.
        step: Between the leader's points [s].

    Returns:
        (coefficients, (n, 6), lowest order first; durations, (n,) [s]).
    """
    times, fractions, creep = keeping
    stop_times, stop = stopping
    leader_s, leader_speed = leader
    standstill_gap, time_headway, front_reach = room
    s, s_dot, s_ddot = start
    n_keeping = times.size * (fractions.size + creep.size)
    n = n_keeping + stop_times.size + follow_times.size
    rows, duration = np.zeros((n, 6)), np.empty(n)
    # The speed that the road allows about where each manoeuvre will end.
    allowed = np.empty(times.size)
    interpolate(s_dot * times, s, speed_ahead[0], speed_ahead[1], allowed)
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
    grid: tuple[float, float],
    bounds: tuple[float, float],
) -> Tracks:
    """Evaluate quintics s(t) on the time grid, at constant speed after their end.

    Args:
        coefficients: (n, 6), lowest order first.
        duration: (n,) [s].
        grid: Step, and the horizon where all profiles end, and to which the jerk is
            integrated; 0 ends each with its manoeuvre [s].
        bounds: Speed that none may exceed [m/s], and place that none may end beyond
            [m].
    """
    step, horizon = grid
    max_speed, stop_at = bounds
    n = coefficients.shape[0]
    end = horizon
    if horizon == 0.0:
        for p in range(n):
            end = max(end, duration[p])
    n_steps = int(np.rint(end / step)) + 1
    count = np.empty(n, np.int64)
    rows = np.empty((n, N_ROWS, n_steps))
    jerk, dropped = np.empty(n), np.full(n, PASSED)
    for p in range(n):
        c0, c1, c2 = coefficients[p, 0], coefficients[p, 1], coefficients[p, 2]
        c3, c4, c5 = coefficients[p, 3], coefficients[p, 4], coefficients[p, 5]
        jerk[p] = squared_jerk((c0, c1, c2, c3, c4, c5), min(duration[p], end))
        slowest, fastest = np.inf, -np.inf
        count[p] = n_steps if horizon > 0.0 else int(np.rint(duration[p] / step)) + 1
        for i in range(n_steps):
            t = min(i * step, duration[p])
            after = i * step - t
            moving = 1.0 if after <= 1e-9 else 0.0
            v = c1 + t * (2.0 * c2 + t * (3.0 * c3 + t * (4.0 * c4 + t * 5.0 * c5)))
            a = 2.0 * c2 + t * (6.0 * c3 + t * (12.0 * c4 + t * 20.0 * c5))
            s = c0 + t * (c1 + t * (c2 + t * (c3 + t * (c4 + t * c5))))
            rows[p, S, i] = s + v * after
            rows[p, S_DOT, i] = v
            rows[p, S_DDOT, i] = moving * a
            rows[p, S_DDDOT, i] = moving * (6.0 * c3 + t * (24.0 * c4 + t * 60.0 * c5))
            if i < count[p]:
                slowest, fastest = min(slowest, v), max(fastest, v)
        if rows[p, S, count[p] - 1] > stop_at:
            dropped[p] = STOP_LINE
        if fastest > max_speed:
            dropped[p] = SPEED
        if slowest < -REVERSE_TOLERANCE:
            dropped[p] = REVERSING
    return Tracks(rows, duration, count, jerk, dropped)
