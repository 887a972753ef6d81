"""Speed that the road ahead asks for."""

import numpy as np

from planner.cruise.feasibility import STRAIGHT
from planner.cruise.settings import CruiseSettings
from planner.numerics.compiled import compiled
from planner.reference_path.linear_curvature import curvature_at
from planner.scene import Scene
from planner.states import FloatArray, IntArray

PREVIEW = 90.0  # how far ahead the road sets the speed: 20 m/s stop at 2.2 m/s² [m]
PREVIEW_STEP = 1.0  # [m]
JERK_SHARE = 0.8  # of the lateral jerk that the road itself may take [-]


def reference_speed(
    scene: Scene, settings: CruiseSettings
) -> tuple[FloatArray, FloatArray]:
    """Speed that the road ahead asks for.

    The target speed, lowered where curvature would exceed the comfortable lateral
    acceleration, where its change would exceed the comfortable lateral jerk, or a stop
    line is closed, and before such places so far that they are reached with the
    comfortable deceleration: v(s)² = min over s' >= s of v_limit(s')² + 2 b (s' - s).

    Returns:
        (s, v), both (n,); s grows by 1 m from the ego on [m], v [m/s].
    """
    table = scene.path.table
    return _reachable_speed(
        table.knots,
        table.bins,
        scene.ego_frenet.s,
        min(scene.target_speed, scene.vehicle.limits.max_speed),
        min(scene.stop_lines, default=np.inf)
        - settings.stop_gap
        - scene.vehicle.front_reach,
        settings.comfort_lateral_acceleration,
        settings.comfort_deceleration,
        JERK_SHARE * settings.comfort.lateral_jerk,
    )


@compiled
def _reachable_speed(
    knots: FloatArray,
    bins: IntArray,
    start: float,
    wanted: float,
    stop_at: float,
    lateral_acceleration: float,
    deceleration: float,
    lateral_jerk: float,
) -> tuple[FloatArray, FloatArray]:
    """Return (s, v) of `reference_speed`; from `stop_at` on v is 0."""
    n = int(np.ceil(PREVIEW / PREVIEW_STEP))
    s, v = np.empty(n), np.empty(n)
    ahead = np.inf
    after = curvature_at(knots, bins, start + PREVIEW_STEP * n)
    for k in range(n - 1, -1, -1):
        s[k] = start + PREVIEW_STEP * k
        here = curvature_at(knots, bins, s[k])
        curvature, rate = abs(here), abs(after - here) / PREVIEW_STEP
        after = here
        limit = wanted * wanted
        if lateral_jerk < np.inf and rate > STRAIGHT:
            limit = min(limit, (lateral_jerk / rate) ** (2.0 / 3.0))
        if curvature > STRAIGHT:
            limit = min(limit, lateral_acceleration / curvature)
        if s[k] >= stop_at:
            limit = 0.0
        ahead = min(limit, ahead + 2.0 * deceleration * PREVIEW_STEP)
        v[k] = np.sqrt(max(ahead, 0.0))
    return s, v
