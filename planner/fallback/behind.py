"""Who is behind the ego, or comes in behind it: theirs to keep clear, in a fallback."""

import numpy as np

from planner.bodies import CORRIDOR_MARGIN, Bodies
from planner.scene import Scene
from planner.states import BoolArray

ALONG_THE_ROAD = 0.5  # who changes lanes is turned less against the road [rad]


def behind(scene: Scene, bodies: Bodies) -> BoolArray:
    """Mark followers, and vehicles that change into the ego's lane behind it, (n,).

    One that changes lanes gives way to who is there: an ego that keeps its speed is
    still ahead when the other comes into its corridor. Emergency braking, because
    everything planned would meet it, would be what makes it hit.

    Args:
        scene: Of this cycle.
        bodies: On the planner's time grid.
    """
    table, ego, vehicle = bodies.table, scene.ego_frenet, scene.vehicle
    marked = table.follower.copy()
    first = table.n_static
    s, l, extents = table.s[first:], table.l[first:], table.extents[first:]
    if not len(s):
        return marked
    front = s + (extents[:, 0] + extents[:, 2])[:, None]
    reach = extents[:, 1] + extents[:, 2] + 0.5 * vehicle.width + CORRIDOR_MARGIN
    inside = np.abs(l - ego.l) < reach[:, None]
    comes = np.argmax(inside, axis=1)  # the step at which it is in the corridor
    rows = np.arange(len(s))
    rear = ego.s - vehicle.rear_overhang
    then = rear + ego.s_dot * bodies.step * comes
    changes = inside.any(axis=1) & (front[:, 0] < rear) & (front[rows, comes] < then)
    for k in np.flatnonzero(changes & (comes > 0)):
        at = scene.path.at(s[k, :1])
        cos, sin = table.poses[first + k, 2, 0], table.poses[first + k, 3, 0]
        along = at.cos_heading[0] * cos + at.sin_heading[0] * sin
        marked[first + k] |= along > np.cos(ALONG_THE_ROAD)
    return marked
