"""The speed that keeps the ego ahead of vehicles behind it that will not brake.

Planners rely on followers for the ego's own lane, as traffic does. In a recording
nobody sees the ego: whoever drove on where it slows down runs into it. Where the future
is known, the ego wants to be at least so fast that this does not happen.
"""

import numpy as np

from planner.scene import Vehicles
from planner.states import FloatArray, FrenetState
from planner.vehicle import Vehicle

ASIDE = 0.2  # more room than this between the sides is room enough [m]
GAP = 1.5  # left to the follower's front at any speed [m]
HEADWAY = 0.15  # and more of it for its speed [s]
SOONEST = 0.8  # a change of speed shows no earlier [s]
FASTER = 1.2  # share of what limits allow that is driven for it at most


def speed_ahead_of(
    vehicles: Vehicles, times: FloatArray, ego: FrenetState, vehicle: Vehicle
) -> float:
    """Return the speed to aim at in order to stay ahead of all that follow [m/s].

    It is the end of an even change of speed that gives the mean speed needed.

    Args:
        vehicles: With their recorded future, (n, n_steps).
        times: Of the future, (n_steps,) [s].
        ego: On its path.
        vehicle: Its body.
    """
    s, l = vehicles.prediction.s, vehicles.prediction.l
    half = 0.5 * (vehicles.width + vehicle.width) + ASIDE
    rear = ego.s - vehicle.rear_overhang
    behind = s[:, 0] + 0.5 * vehicles.length <= rear
    if not behind.any():
        return 0.0
    late = times >= SOONEST
    in_lane = np.abs(l[behind][:, late] - ego.l) < half[behind, None]
    # one that comes from beside is behind only if it is in the lane all the time
    in_lane &= np.logical_and.accumulate(in_lane, axis=1)
    keep = GAP + HEADWAY * vehicles.speed[behind] + 0.5 * vehicles.length[behind]
    front = s[behind][:, late] + keep[:, None]
    needed = np.where(in_lane & np.isfinite(front), (front - rear) / times[late], 0.0)
    mean = float(needed.max(initial=0.0))
    return max(mean, 2.0 * mean - ego.s_dot)
