"""The speed along a path through obstacles: the piecewise-jerk program in time.

The reference is the fastest drive that curvature, braking and the end of the path
allow; the program of [Thesis] eq. 6.19, 6.20 (corrected) follows it within the limits
of acceleration and jerk, and never past the end or into a vehicle ahead.
"""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from planner.dense.settings import DriveSettings
from planner.piecewise_jerk.solve import (
    PiecewiseJerkProblem,
    QpStatus,
    solve,
)
from planner.scene import Scene
from planner.speed_limits import drive_along, limit_speeds
from planner.states import FloatArray, Path, SpeedProfile, freeze

ROUNDING = 1e-6  # of places [m]
OVERSHOOT = 1.1  # of the comfortable lateral acceleration that a drive may reach
GAIN = 0.98  # of its worst lateral acceleration that another attempt must reach
END_ROOM = 0.1  # beyond the end, for what the place of the end moves between cycles [m]


@dataclass(frozen=True, slots=True, eq=False)
class DrivablePath:
    """A path and how far along it the ego may go."""

    path: Path
    end: float  # of the ego's point [m]
    ahead: FloatArray  # bound by vehicles at each knot, inf if none, (n_knots,) [m]


def knot_times(settings: DriveSettings) -> FloatArray:
    """Return the times of the knots [s]."""
    return _knots(settings.duration, settings.time_step)


@lru_cache(maxsize=16)
def _knots(duration: float, step: float) -> FloatArray:
    """Make the times of knots, read only."""
    n = round(duration / step) + 1
    return freeze(step * np.arange(n, dtype=np.float64))


def plan_drive(
    way: DrivablePath, scene: Scene, settings: DriveSettings
) -> SpeedProfile | None:
    """Plan the speed along a way; None if the limits cannot be kept.

    The program smooths its reference in time and may be late to slow down. Where it
    takes a bend faster than is comfortable, the reference is lowered there and it is
    asked again; the calmest drive counts.
    """
    limits, times = scene.vehicle.limits, knot_times(settings)
    end = min(way.end, float(way.path.distance[-1]) - END_ROOM)
    limit = limits.max_lateral_acceleration
    comfort = settings.lateral_share * limit
    wanted = np.full(way.path.distance.size, comfort)
    calmest, least = None, np.inf
    for _ in range(settings.attempts):
        allowed = limit_speeds(
            way.path,
            limits,
            scene.target_speed,
            wanted,
            settings.lateral_jerk,
            settings.braking,
            end,
        )
        wish = drive_along(
            way.path.distance,
            allowed,
            scene.ego.speed,
            settings.acceleration,
            limits.max_deceleration,
            times,
        )
        problem = drive_program(way, scene, wish, end, settings)
        if (problem.lower[1:] > problem.upper[1:]).any():
            break
        solution = solve(problem)
        if solution.status is not QpStatus.SOLVED:
            break
        profile = _profile(solution.state, solution.jerk, times)
        bend = np.interp(profile.distance, way.path.distance, way.path.curvature)
        lateral = np.abs(profile.speed**2 * bend)
        worst = float(lateral[1:].max())
        if worst > GAIN * least:
            break
        calmest, least = profile, worst
        if worst <= OVERSHOOT * comfort:
            break
        ratio = comfort / np.maximum(lateral, comfort)
        wanted *= np.interp(way.path.distance, profile.distance, ratio)
    return calmest if least <= limit else None


def drive_program(
    way: DrivablePath,
    scene: Scene,
    wish: tuple[FloatArray, FloatArray],
    end: float,
    settings: DriveSettings,
) -> PiecewiseJerkProblem:
    """Write the program that follows a reference.

    Args:
        way: Gives the bound by vehicles.
        scene: Gives start and limits.
        wish: Distance [m] and speed [m/s] at the knots.
        end: Where the reference stops [m].
        settings: See there.
    """
    limits, n = scene.vehicle.limits, wish[0].size
    reference = np.zeros((n, 3))
    reference[:, 0], reference[:, 1] = wish
    lower, upper = np.empty((n, 3)), np.empty((n, 3))
    speed = max(scene.ego.speed, 0.0)
    lower[:] = -ROUNDING, 0.0, -limits.max_deceleration
    upper[:] = max(end, 0.0) + END_ROOM, np.inf, limits.max_acceleration
    upper[:, 1] = max(limits.max_speed, speed + 1.0)
    # An ego that brakes harder than allowed, or is just stopping, may finish it.
    lowest = max(-limits.max_deceleration, -np.sqrt(2.0 * settings.max_jerk * speed))
    start = min(max(scene.ego.acceleration, lowest), limits.max_acceleration)
    row = np.zeros((n, 1, 3))
    row[:, 0] = 1.0, settings.headway, 0.0
    weight = np.empty((n, 3))
    weight[:] = (
        settings.distance_weight,
        settings.speed_weight,
        settings.acceleration_weight,
    )
    return PiecewiseJerkProblem(
        np.full(n - 1, settings.time_step),
        np.array([0.0, speed, start]),
        weight,
        reference,
        settings.jerk_weight,
        lower,
        upper,
        -settings.max_jerk,
        settings.max_jerk,
        row,
        np.full((n, 1), -np.inf),
        way.ahead[:, None],
    )


def _profile(state: FloatArray, jerk: FloatArray, times: FloatArray) -> SpeedProfile:
    """Make the record; rounding below a standstill is cut off."""
    s, v, a = state.T
    rows = np.empty((5, times.size))
    rows[0], rows[3] = times, a
    np.maximum.accumulate(np.maximum(s, 0.0), out=rows[1])
    np.maximum(v, 0.0, out=rows[2])
    rows[4, :-1], rows[4, -1] = jerk, jerk[-1]
    return SpeedProfile.from_rows(rows)
