"""Longitudinal profiles and lateral targets: what the candidates are made of."""

from dataclasses import dataclass, fields

import numpy as np

from planner.bodies import Leader
from planner.compiled import compiled
from planner.cruise.feasibility import squared_jerk
from planner.cruise.settings import CruiseSettings
from planner.motion import polynomials
from planner.scene import RoadBounds, Scene
from planner.states import BoolArray, FloatArray, FrenetState, IntArray

PREVIEW = 90.0  # how far ahead the road sets the speed: 20 m/s stop at 2.2 m/s² [m]
PREVIEW_STEP = 1.0  # [m]
SLOW = 3.0  # below it the ego may also creep [m/s]


@dataclass(frozen=True, slots=True, eq=False)
class Profiles:
    """Longitudinal motions.

    After its manoeuvre a profile goes on at its terminal speed. Points from `count`
    on are padding.
    """

    motion: FloatArray  # (n_profiles, 4, n_steps): s [m] and its three derivatives
    duration: FloatArray  # of the manoeuvre, (n_profiles,) [s]
    count: IntArray  # valid points, (n_profiles,)
    jerk: FloatArray  # integral of squared jerk, (n_profiles,) [m²/s⁵]
    slowest: FloatArray  # smallest s_dot, (n_profiles,) [m/s]
    fastest: FloatArray  # largest s_dot, (n_profiles,) [m/s]

    def only(self, keep: BoolArray) -> "Profiles":
        """Leave the others out."""
        return Profiles(*(getattr(self, field.name)[keep] for field in fields(self)))


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
    wanted = min(scene.target_speed, scene.vehicle.limits.max_speed)
    limit = np.full_like(s, wanted**2)
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
    road: RoadBounds,
    s: tuple[float, float],
    half_width: float,
    settings: CruiseSettings,
) -> FloatArray:
    """Terminal offsets: multiples of the lateral step inside the widest road ahead.

    The outermost places that the body can take are added: between an obstacle and the
    road's edge there may be room for the body but not for a multiple of the step.

    Args:
        road: Lateral room.
        s: First and last arc length that the horizon covers [m].
        half_width: Of the body [m].
        settings: Step and limit.

    Returns:
        Offsets in growing order, (n,) [m].
    """
    inside = (road.s > s[0]) & (road.s < s[1])
    left, right = road.at(np.concatenate([s, road.s[inside]]))
    step = settings.lateral_step
    high = min(settings.lateral_limit, float(left.max()) - half_width)
    low = max(-settings.lateral_limit, float(right.min()) + half_width)
    grid = step * np.arange(
        np.ceil(low / step - 1e-9), np.floor(high / step + 1e-9) + 1
    )
    if not settings.edge_offsets or low >= high:
        return grid
    return np.unique(np.concatenate([[low], grid, [high]]))


def full_grid_size(settings: CruiseSettings) -> int:
    """Count the offsets on a road wider than the limit; 21 in [Thesis] ch. 4."""
    n = 2 * int(settings.lateral_limit / settings.lateral_step + 1e-9) + 1
    return n + 2 if settings.edge_offsets else n


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
    ego = scene.ego_frenet
    coefficients, durations = _speed_keeping(ego, settings, speed_ahead)
    stop = stop_target(scene, settings)
    if stop is not None and stop > ego.s:
        rows = _arrivals(ego, stop, 0.0, np.array(settings.stop_times))
        coefficients.append(rows)
        durations.append(np.array(settings.stop_times))
    if leader is not None:
        times = np.array(settings.follow_times)
        k = np.minimum(np.rint(times / settings.step).astype(int), leader.s.size - 1)
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
    end_speed = np.outer(settings.speed_fractions, allowed)
    if ego.s_dot < SLOW:
        creeping = np.minimum.outer(np.array(settings.creep_speeds), allowed)
        end_speed = np.vstack([end_speed, creeping])
    rows = _quartics((ego.s, ego.s_dot, ego.s_ddot), end_speed, times)
    return [rows], [np.tile(times, end_speed.shape[0])]


def _arrivals(
    ego: FrenetState,
    s_end: float | FloatArray,
    speed_end: float | FloatArray,
    times: FloatArray,
) -> FloatArray:
    """Quintics that reach `s_end` at `speed_end` without acceleration, (n, 6)."""
    start = (ego.s, ego.s_dot, ego.s_ddot)
    return _quintics(start, s_end + 0.0 * times, speed_end + 0.0 * times, times)


@compiled
def _quartics(
    start: tuple[float, float, float], end_speed: FloatArray, times: FloatArray
) -> FloatArray:
    """Quartics to each end speed (n, n_times) in each time, padded to six terms."""
    rows = np.zeros((end_speed.size, 6))
    for i in range(end_speed.shape[0]):
        for j in range(times.size):
            c = polynomials.quartic_coefficients(
                start[0], start[1], start[2], end_speed[i, j], 0.0, times[j]
            )
            for k in range(5):
                rows[i * times.size + j, k] = c[k]
    return rows


@compiled
def _quintics(
    start: tuple[float, float, float],
    s_end: FloatArray,
    speed_end: FloatArray,
    times: FloatArray,
) -> FloatArray:
    """Quintics to each end, (n, 6)."""
    rows = np.empty((times.size, 6))
    for i in range(times.size):
        c = polynomials.quintic_coefficients(
            start[0], start[1], start[2], s_end[i], speed_end[i], 0.0, times[i]
        )
        for k in range(6):
            rows[i, k] = c[k]
    return rows


def _evaluate(
    coefficients: FloatArray, duration: FloatArray, settings: CruiseSettings
) -> Profiles:
    """Evaluate (n, 6) coefficients on the time grid, straight on after the end."""
    end = settings.horizon or float(duration.max())
    n_steps = round(end / settings.step) + 1
    if settings.horizon:
        count = np.full(duration.size, n_steps)
    else:
        count = np.rint(duration / settings.step).astype(np.int64) + 1
    rolled = roll_out(coefficients, duration, count, settings.step, end)
    motion, jerk, slowest, fastest = rolled
    return Profiles(motion, duration, count, jerk, slowest, fastest)


@compiled
def roll_out(
    coefficients: FloatArray,
    duration: FloatArray,
    count: IntArray,
    step: float,
    end: float,
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Evaluate quintics s(t) on the time grid, at constant speed after their end.

    Args:
        coefficients: (n, 6), lowest order first.
        duration: (n,) [s].
        count: Valid steps, (n,).
        step: [s].
        end: Of the horizon, to which the jerk is integrated [s].

    Returns:
        ((n, 4, n_steps): s and its three derivatives; integral of squared jerk, (n,)
        [m²/s⁵]; smallest and largest s_dot of the valid steps, (n,) each [m/s]).
    """
    n, n_steps = coefficients.shape[0], count.max()
    motion = np.empty((n, 4, n_steps))
    jerk = np.empty(n)
    slowest, fastest = np.full(n, np.inf), np.full(n, -np.inf)
    for p in range(n):
        c0, c1, c2 = coefficients[p, 0], coefficients[p, 1], coefficients[p, 2]
        c3, c4, c5 = coefficients[p, 3], coefficients[p, 4], coefficients[p, 5]
        jerk[p] = squared_jerk((c0, c1, c2, c3, c4, c5), min(duration[p], end))
        for i in range(n_steps):
            t = min(i * step, duration[p])
            after = i * step - t
            moving = 1.0 if after <= 1e-9 else 0.0
            v = c1 + t * (2.0 * c2 + t * (3.0 * c3 + t * (4.0 * c4 + t * 5.0 * c5)))
            a = 2.0 * c2 + t * (6.0 * c3 + t * (12.0 * c4 + t * 20.0 * c5))
            s = c0 + t * (c1 + t * (c2 + t * (c3 + t * (c4 + t * c5))))
            motion[p, 0, i] = s + v * after
            motion[p, 1, i] = v
            motion[p, 2, i] = moving * a
            motion[p, 3, i] = moving * (6.0 * c3 + t * (24.0 * c4 + t * 60.0 * c5))
            if i < count[p]:
                slowest[p] = min(slowest[p], v)
                fastest[p] = max(fastest[p], v)
    return motion, jerk, slowest, fastest
