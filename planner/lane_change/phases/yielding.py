"""Followers in the lane that the ego goes to, predicted to yield gently.

The prediction only lets a gap count that the driver behind will open without haste.
Whether the ego may enter it is decided by `gap_safety`, from where everybody is now.
"""

from dataclasses import replace

import numpy as np

from planner.lane_change.phases.cycle_view import Situation
from planner.lane_change.settings import GapRule, LaneChangeSettings
from planner.lane_change.speed.program import knot_times
from planner.lane_change.speed.st_graph import UsersInTime
from planner.lane_change.surroundings import in_lane
from planner.states import FloatArray

SLOWEST = 0.5  # share of its speed to which a driver is predicted to yield [-]


def with_yielding(
    here: Situation, target: int, begins: float, settings: LaneChangeSettings
) -> UsersInTime:
    """Return all road users, those behind in the target lane yielding to the ego.

    They keep their speed until `begins`, then brake with `gaps.yielding` to the ego's
    speed now, or to `SLOWEST` of their own.

    Args:
        here: Of this cycle.
        target: Lane that the ego goes to.
        begins: When they begin to brake [s].
        settings: See there.
    """
    users = here.ahead
    if settings.gaps.rule is GapRule.PLACES:
        return users
    there = here.behind & in_lane(here.scene, here.bodies, target)
    there[: here.bodies.n_static] = False
    times = knot_times(settings.speed)
    pace = max(here.scene.ego.speed, 0.0)
    poses = None
    for k in np.flatnonzero(there & (users.speed > pace)).tolist():
        speed = float(users.speed[k])
        slow = max(pace, SLOWEST * speed)
        until = begins + (speed - slow) / settings.gaps.yielding
        braked = np.clip(times, begins, until) - begins
        lost = 0.5 * settings.gaps.yielding * braked**2
        lost += (speed - slow) * np.maximum(times - until, 0.0)
        poses = users.poses.copy() if poses is None else poses
        poses[k] = _at(users.poses[k], times, times - lost / speed)
    return users if poses is None else replace(users, poses=poses)


def _at(poses: FloatArray, times: FloatArray, asked: FloatArray) -> FloatArray:
    """Read poses (n_knots, 4) at other times."""
    rows = np.array([np.interp(asked, times, column) for column in poses.T])
    rows[2:] /= np.hypot(rows[2], rows[3])
    return rows.T
