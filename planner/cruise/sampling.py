"""Longitudinal profiles and lateral targets: what the candidates are made of."""

from dataclasses import dataclass

import numpy as np

from planner.bodies import Leader
from planner.cruise.settings import CruiseSettings
from planner.motion import polynomials
from planner.scene import RoadBounds, Scene
from planner.states import FloatArray, FrenetState

PREVIEW = 90.0  # how far ahead the road sets the speed: 20 m/s stop at 2.2 m/s² [m]
PREVIEW_STEP = 1.0  # [m]


@dataclass(frozen=True, slots=True, eq=False)
class Profiles:
    """Longitudinal motions; arrays are (n_profiles, n_steps) unless said otherwise.

    After its manoeuvre a profile goes on at its terminal speed. Points from `count`
    on are padding.
    """

    s: FloatArray  # [m]
    s_dot: FloatArray  # [m/s]
    s_ddot: FloatArray  # [m/s²]
    s_dddot: FloatArray  # [m/s³]
    duration: FloatArray  # of the manoeuvre, (n_profiles,) [s]
    count: FloatArray  # valid points, (n_profiles,) int64
    jerk: FloatArray  # integral of squared jerk, (n_profiles,) [m²/s⁵]


def reference_speed(
    scene: Scene, settings: CruiseSettings
) -> tuple[FloatArray, FloatArray]:
    """Speed that the road ahead asks for.

    The target speed, lowered where curvature would exceed the comfortable lateral
    acceleration or a stop line is closed, and before such places so far that they
    are reached with the comfortable deceleration: v(s)² = min over s' >= s of
    v_limit(s')² + 2 b (s' - s).

    Returns:
        (s, v), both (n,); s grows by 1 m from the ego on [m], v [m/s].
    """
    s = scene.ego_frenet.s + np.arange(0.0, PREVIEW, PREVIEW_STEP)
    curvature = np.abs(scene.path.at(s).curvature)
    limit = np.full_like(s, scene.target_speed**2)
    curved = curvature > 1e-6
    limit[curved] = np.minimum(
        limit[curved], settings.comfort_lateral_acceleration / curvature[curved]
    )
    for stop_line in scene.stop_lines:
        at = stop_line - settings.stop_gap - scene.vehicle.front_reach
        limit[s >= at] = 0.0
    slope = 2.0 * settings.comfort_deceleration * s
    reachable = np.minimum.accumulate((limit + slope)[::-1])[::-1] - slope
    return s, np.sqrt(np.maximum(reachable, 0.0))


def terminal_offsets(
    road: RoadBounds, s: FloatArray, half_width: float, settings: CruiseSettings
) -> FloatArray:
    """Terminal offsets, multiples of the lateral step inside the widest road ahead.

    Args:
        road: Lateral room.
        s: Arc lengths that the horizon covers [m].
        half_width: Of the body [m].
        settings: Step and limit; with an infinite road they alone decide.

    Returns:
        Offsets in growing order, (n,) [m].
    """
    left, right = road.at(s)
    step = settings.lateral_step
    high = min(settings.lateral_limit, float(left.max()) - half_width)
    low = max(-settings.lateral_limit, float(right.min()) + half_width)
    return step * np.arange(np.ceil(low / step - 1e-9), np.floor(high / step + 1e-9) + 1)


def stop_target(scene: Scene, settings: CruiseSettings) -> float | None:
    """Arc length where the rear axle stands before the next closed stop line [m]."""
    ahead = [
        line - scene.vehicle.front_reach - settings.stop_gap
        for line in scene.stop_lines
    ]
    return min(ahead) if ahead else None


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
    ego = scene.ego_frenet
    coefficients, durations = _speed_keeping(ego, settings, speed_ahead)
    stop = stop_target(scene, settings)
    if stop is not None and stop > ego.s:
        rows = _arrivals(ego, stop, 0.0, np.array(settings.stop_times))
        coefficients.append(rows)
        durations.append(np.array(settings.stop_times))
    if leader is not None:
        times = np.array(settings.follow_times)
        k = np.minimum(np.rint(times / scene.step).astype(int), leader.s.size - 1)
        gap = settings.standstill_gap + settings.time_headway * leader.speed[k]
        target = leader.s[k] - gap - scene.vehicle.front_reach
        valid = target > ego.s
        if valid.any():
            rows = _arrivals(ego, target[valid], leader.speed[k][valid], times[valid])
            coefficients.append(rows)
            durations.append(times[valid])
    return _evaluate(np.vstack(coefficients), np.concatenate(durations), settings)


def _speed_keeping(
    ego: FrenetState,
    settings: CruiseSettings,
    speed_ahead: tuple[FloatArray, FloatArray],
) -> tuple[list[FloatArray], list[FloatArray]]:
    """Quartics over the grid times x terminal speeds, coefficients padded to six."""
    times = np.array(settings.times)
    # The speed that the road allows about where each manoeuvre will end.
    reach = ego.s + ego.s_dot * times
    allowed = np.interp(reach, *speed_ahead)
    time, fraction = np.meshgrid(times, np.array(settings.speed_fractions))
    end_speed = fraction * np.interp(time, times, allowed)
    quartics = polynomials.quartic(
        (ego.s, ego.s_dot, ego.s_ddot), (end_speed.ravel(), 0.0), time.ravel()
    )
    padded = np.hstack([quartics, np.zeros((quartics.shape[0], 1))])
    return [padded], [time.ravel()]


def _arrivals(
    ego: FrenetState,
    s_end: float | FloatArray,
    speed_end: float | FloatArray,
    times: FloatArray,
) -> FloatArray:
    """Quintics that reach `s_end` at `speed_end` without acceleration, (n, 6)."""
    return polynomials.quintic(
        (ego.s, ego.s_dot, ego.s_ddot), (s_end, speed_end, 0.0), times
    )


def _evaluate(
    coefficients: FloatArray, duration: FloatArray, settings: CruiseSettings
) -> Profiles:
    """Evaluate (n, 6) coefficients on the time grid, straight on after the end."""
    end = settings.horizon or float(duration.max())
    n_steps = round(end / settings.step) + 1
    t = settings.step * np.arange(n_steps)
    inside = np.minimum(t, duration[:, None])  # (n, n_steps)
    after = t - inside
    rows = coefficients[:, None, :]
    s_dot = polynomials.evaluate(rows, inside, 1)
    s = polynomials.evaluate(rows, inside, 0) + s_dot * after
    moving = after <= 1e-9
    if settings.horizon:
        count = np.full(duration.size, n_steps)
    else:
        count = np.rint(duration / settings.step).astype(np.int64) + 1
    return Profiles(
        s,
        s_dot,
        np.where(moving, polynomials.evaluate(rows, inside, 2), 0.0),
        np.where(moving, polynomials.evaluate(rows, inside, 3), 0.0),
        duration,
        count.astype(np.int64),
        polynomials.integral_of_squared_jerk(coefficients, np.minimum(duration, end)),
    )
