"""Stops on the path of the last cycle, which was found free of what stands.

In a field of obstacles hardly any other path is: one that settles on the ego's present
offset runs into the next obstacle.
"""

import numpy as np

from planner.fallback import (
    EMERGENCY_JERK,
    STOP_JERK,
    Blocker,
    Brake,
    brake_down,
    shifted_plan,
)
from planner.interface import PlanStatus
from planner.path_velocity import trajectory_on
from planner.scene import Scene
from planner.states import FloatArray, Path, SpeedProfile, Trajectory

LEAST_STEP = 1e-3  # between points of a path [m]
# of a trajectory, in the order of a path
PATH_COLUMNS = ("x", "y", "heading", "curvature", "s", "l")


def rest_of(scene: Scene, last: Trajectory | None) -> tuple[Trajectory, Path] | None:
    """Return what is left of the last plan and its path; None if the ego is not on it.

    Args:
        scene: Of this cycle.
        last: The trajectory of the cycle before.
    """
    shifted = None if last is None else shifted_plan(scene, last)
    if shifted is None:
        return None
    gaps = np.hypot(np.diff(shifted.x), np.diff(shifted.y))
    keep = np.concatenate([[True], gaps > LEAST_STEP])
    if np.count_nonzero(keep) < 2:
        return None
    columns = [getattr(shifted, name)[keep] for name in PATH_COLUMNS]
    along = np.hypot(np.diff(columns[0]), np.diff(columns[1]))
    return shifted, Path(np.concatenate([[0.0], np.cumsum(along)]), *columns)


def stop_on(
    scene: Scene, path: Path, deceleration: float, times: FloatArray
) -> Trajectory | None:
    """Brake to a stand on a path; None where it is too short for that.

    Args:
        scene: Of this cycle.
        path: From the ego on.
        deceleration: Positive [m/s²].
        times: Of the trajectory, from 0 on, (n,) [s].
    """
    hard = deceleration > scene.vehicle.limits.max_deceleration
    jerk = EMERGENCY_JERK if hard else STOP_JERK
    brake = Brake(scene.ego.acceleration, deceleration, jerk)
    way, speed, acceleration = brake_down(scene.ego.speed, brake, times)
    if way[-1] > path.distance[-1] or speed[-1] > 0.0:
        return None
    profile = SpeedProfile(times, way, speed, acceleration, np.zeros_like(times))
    return trajectory_on(path, profile)


def keep_to_path(
    scene: Scene, last: Trajectory | None, blocker: Blocker, horizon: float
) -> tuple[PlanStatus, Trajectory] | None:
    """Go on with the last plan while its path has room for a stop, else stop on it.

    Args:
        scene: Of this cycle.
        last: The trajectory of the cycle before.
        blocker: Names what a trajectory would hit, None if nothing.
        horizon: Of the stops [s].

    Returns:
        (status, trajectory); None where no stop on the path is free.
    """
    rest = rest_of(scene, last)
    if rest is None:
        return None
    shifted, path = rest
    times = scene.step * np.arange(round(horizon / scene.step) + 1, dtype=np.float64)
    limits = scene.vehicle.limits
    stop = stop_on(scene, path, limits.max_deceleration, times)
    if stop is not None and blocker(stop) is None:
        driven = scene.ego.speed * scene.step
        room = float(path.distance[-1] - (stop.s[-1] - stop.s[0])) - driven
        if room > 0.0 and blocker(shifted) is None:
            return PlanStatus.LAST_PLAN_SHIFTED, shifted
        return PlanStatus.FULL_STOP, stop
    hard = stop_on(scene, path, limits.emergency_deceleration, times)
    if hard is not None and blocker(hard) is None:
        return PlanStatus.EMERGENCY_BRAKING, hard
    return None
