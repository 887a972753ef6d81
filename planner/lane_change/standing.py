"""What stands in a lane for good: obstacles, and the vehicles that wait before them."""

import numpy as np

from planner.lane_change.lane_choice import BodiesAhead, lane_end
from planner.lane_change.surroundings import in_lane
from planner.numerics.compiled import compiled
from planner.numerics.interpolation import interpolated
from planner.scene import Scene
from planner.states import BoolArray, FloatArray

STANDS = 0.3  # slower than this a vehicle stands [m/s]
QUEUE = 100.0  # a vehicle that stands this near before a wall waits there [m]


def stands_for_good(scene: Scene, bodies: BodiesAhead, reach: float) -> BoolArray:
    """Mark what never moves, and vehicles that stand where their lane is closed, (n,).

    These leave only through the next lane, as the ego does: it has to keep the room to
    pull out to them, not to the wall behind which it cannot come.

    Args:
        scene: Of this cycle, with lanes.
        bodies: On the road.
        reach: How far the end of a lane is looked for [m].
    """
    never_moves = np.arange(bodies.s.size) < bodies.n_static
    slow = np.abs(bodies.speed) < STANDS
    slow &= bodies.s > scene.ego_frenet.s
    slow[: bodies.n_static] = False
    if not slow.any():
        return never_moves
    stands = never_moves.copy()
    for lane in range(scene.lanes.centre.shape[0]):
        end = lane_end(scene.lanes, lane, scene.ego_frenet.s, reach)
        wall = first_in_lane(scene, bodies, never_moves, lane)
        if wall >= 0:
            end = min(end, float(bodies.s[wall]))
        waits = slow & (bodies.s < end) & (end - bodies.s < QUEUE)
        if waits.any():
            stands |= waits & in_lane(scene, bodies, lane)
    return stands


def first_in_lane(
    scene: Scene, bodies: BodiesAhead, among: BoolArray, lane: int
) -> int:
    """Return which of some bodies is the first in a lane ahead of the ego, or -1.

    Args:
        scene: Of this cycle, with lanes.
        bodies: On the road.
        among: The bodies that count, (n,).
        lane: Index of the lane.
    """
    return int(
        _first(
            (bodies.s, bodies.l, bodies.half_length, bodies.half_width),
            among,
            scene.lanes.s,
            scene.lanes.centre[lane],
            (scene.ego_frenet.s, 0.5 * scene.vehicle.width),
        )
    )


@compiled
def _first(
    bodies: tuple[FloatArray, FloatArray, FloatArray, FloatArray],
    among: BoolArray,
    lanes_s: FloatArray,
    centre: FloatArray,
    ego: tuple[float, float],
) -> int:
    """Find the body of `first_in_lane`.

    Args:
        bodies: s, l, half length and half width, (n,) [m].
        among: Those that count, (n,).
        lanes_s: Arc lengths of the road, (m,) [m].
        centre: Of the lane there, (m,) [m].
        ego: Where the ego is along the road, and half its width [m].
    """
    s, l, long, wide = bodies
    ego_s, half_width = ego
    middle = interpolated(np.minimum(s, lanes_s[-1]), lanes_s, centre)
    found, nearest = -1, np.inf
    for b in range(s.size):
        inside = among[b] and abs(l[b] - middle[b]) < wide[b] + half_width
        if inside and s[b] > ego_s and s[b] - long[b] < nearest:
            found, nearest = b, s[b] - long[b]
    return found
