"""Pure pursuit and Stanley: the usual baselines, which know of no delay.

[Coulter1992] "Implementation of the Pure Pursuit Path Tracking Algorithm";
[Hoffmann2007] "Autonomous Automobile Trajectory Tracking for Off-Road Driving".
"""

import math

from planner.numerics.compiled import inlined
from planner.states import FloatArray
from planner.tracking.reference import ALONG, HEADING, X, Y, value_at

SOFTENING = 1.0  # keeps Stanley's gain finite in standing [m/s]


@inlined
def pure_pursuit(
    plan: FloatArray,
    place: float,
    pose: tuple[float, float, float],
    wheelbase: float,
    distance: float,
) -> float:
    """Steer on the arc through a point ahead, atan(2 L sin(alpha) / d) [rad].

    Args:
        plan: Its table, (8, n).
        place: Arc length of the ego's foot on it [m].
        pose: x, y [m] and heading [rad] of the rear axle.
        wheelbase: L [m].
        distance: To the point ahead along the plan; a plan that ends before goes
            straight on [m].
    """
    at = place + distance
    x, y = value_at(plan, ALONG, X, at), value_at(plan, ALONG, Y, at)
    end = plan.shape[1] - 1
    beyond = at - plan[ALONG, end]
    if beyond > 0.0:
        x += beyond * math.cos(plan[HEADING, end])
        y += beyond * math.sin(plan[HEADING, end])
    dx, dy = x - pose[0], y - pose[1]
    squared = max(dx * dx + dy * dy, 1e-6)
    across = dy * math.cos(pose[2]) - dx * math.sin(pose[2])
    return math.atan(2.0 * wheelbase * across / squared)


@inlined
def stanley(
    lateral: float, heading: float, speed: float, wheelbase: float, gain: float
) -> float:
    """Steer the front axle to the path, -theta - atan(k e_front / (v + v0)) [rad].

    Args:
        lateral: Error of the rear axle, positive to the left [m].
        heading: Error [rad].
        speed: [m/s].
        wheelbase: L [m].
        gain: k [1/s].
    """
    front = lateral + wheelbase * math.sin(heading)
    return -heading - math.atan2(gain * front, speed + SOFTENING)
