"""Which lane the ego is in, what each lane is worth, and which one it wants."""

from dataclasses import dataclass

import numpy as np

from planner.numerics.compiled import compiled
from planner.scene import Lanes, Scene
from planner.states import FloatArray

WORTH_TIME = 30.0  # over which a lane's mean speed is judged [s]
SIDE_MARGIN = 0.3  # a body this near the ego's corridor is in it [m]
GONE = 0.5  # a lane narrower than this is none [m]
LANE_END_STEP = 5.0  # at which the lane ahead is looked at [m]


@dataclass(frozen=True, slots=True, eq=False)
class BodiesAhead:
    """Everything on the carriageway now, in the road's frame; arrays are (n,)."""

    s: FloatArray  # centre [m]
    l: FloatArray  # [m]
    half_length: FloatArray  # along the road [m]
    half_width: FloatArray  # across it [m]
    speed: FloatArray  # along the road, negative against it [m/s]
    later_l: FloatArray  # where its lateral motion, as predicted, ends [m]
    n_static: int  # the first so many never move

    def static(self) -> "BodiesAhead":
        """Give those that never move."""
        n = self.n_static
        return BodiesAhead(
            self.s[:n],
            self.l[:n],
            self.half_length[:n],
            self.half_width[:n],
            self.speed[:n],
            self.later_l[:n],
            n,
        )


def bodies_on_road(scene: Scene) -> BodiesAhead:
    """Give every obstacle and vehicle its place on the road, obstacles first."""
    fixed, moving, path = scene.obstacles, scene.vehicles, scene.path
    s, l = path.project(fixed.x, fixed.y)
    ahead = moving.prediction
    if ahead.s.shape[1]:
        moving_s, moving_l = ahead.s[:, 0], ahead.l[:, 0]
        later = np.where(np.isfinite(ahead.s[:, -1]), ahead.l[:, -1], moving_l)
    else:
        moving_s, moving_l = path.project(moving.x, moving.y)
        later = moving_l
    later = np.concatenate([l, later])
    s, l = np.concatenate([s, moving_s]), np.concatenate([l, moving_l])
    on_path = np.where(np.isfinite(s), s, 0.0)
    turned = np.concatenate([fixed.heading, moving.heading]) - path.at(on_path).heading
    cos, sin = np.abs(np.cos(turned)), np.abs(np.sin(turned))
    length = 0.5 * np.concatenate([fixed.length, moving.length])
    width = 0.5 * np.concatenate([fixed.width, moving.width])
    radius = np.concatenate([fixed.radius, np.zeros(len(moving.ids))])
    speed = np.concatenate([np.zeros(len(fixed.ids)), moving.speed]) * np.cos(turned)
    return BodiesAhead(
        s,
        l,
        length * cos + width * sin + radius,
        length * sin + width * cos + radius,
        speed,
        later,
        len(fixed.ids),
    )


def lane_at(lanes: Lanes, s: float, l: float) -> int:
    """Give the index of the lane whose centre is nearest to `l`, -1 without lanes."""
    centres, widths = lanes.at(s)
    there = widths > GONE
    if not there.any():
        return -1
    return int(np.argmin(np.where(there, np.abs(centres - l), np.inf)))


def lane_end(lanes: Lanes, index: int, s: float, reach: float) -> float:
    """Find where a lane ends ahead [m]; inf if not within `reach`."""
    return float(_lane_end(lanes.s, lanes.width[index], s, reach))


@compiled
def _lane_end(lanes_s: FloatArray, width: FloatArray, s: float, reach: float) -> float:
    """Find the end of `lane_end`."""
    if lanes_s.size == 1:
        return np.inf if width[0] > GONE else s
    ahead = np.arange(s, s + reach, LANE_END_STEP)
    there = np.interp(ahead, lanes_s, width)
    for i in range(ahead.size):
        if there[i] <= GONE:
            return float(ahead[i])
    return np.inf


def lane_worths(scene: Scene, bodies: BodiesAhead, gap: float) -> FloatArray:
    """Judge each lane by the mean speed it allows over the next `WORTH_TIME`.

    A lane's worth is min(v_target, (d - gap + v T) / T) for the nearest body ahead in
    it, d before the ego's front and v fast; the end of a lane is a body that stands.

    Args:
        scene: Of this cycle, with lanes.
        bodies: On the road.
        gap: Kept to whatever is ahead [m].

    Returns:
        (n_lanes,) [m/s]; -inf where there is no lane beside the ego now.
    """
    ego, vehicle, lanes = scene.ego_frenet, scene.vehicle, scene.lanes
    return _worths(
        lanes.s,
        lanes.centre,
        lanes.width,
        ego.s,
        ego.s + vehicle.front_reach,
        scene.target_speed,
        gap,
        vehicle.width / 2.0 + SIDE_MARGIN,
        (bodies.s, bodies.l, bodies.half_length, bodies.half_width, bodies.speed),
    )


@compiled
def _worths(
    lanes_s: FloatArray,
    centre: FloatArray,
    width: FloatArray,
    ego_s: float,
    front: float,
    target_speed: float,
    gap: float,
    half_corridor: float,
    bodies: tuple[FloatArray, ...],
) -> FloatArray:
    """Give the worths of `lane_worths`."""
    s, l, half_length, half_width, speed = bodies
    worths = np.full(centre.shape[0], -np.inf)
    here = np.array([ego_s])
    for lane in range(centre.shape[0]):
        if not np.interp(here, lanes_s, width[lane])[0] > GONE:
            continue
        end = _lane_end(lanes_s, width[lane], ego_s, WORTH_TIME * target_speed)
        worth = min(target_speed, max(end - front - gap, 0.0) / WORTH_TIME)
        there = np.interp(s, lanes_s, centre[lane])
        for b in range(s.size):
            inside = abs(l[b] - there[b]) < half_width[b] + half_corridor
            if inside and np.isfinite(s[b]) and s[b] > ego_s:
                driven = max(s[b] - half_length[b] - front - gap, 0.0)
                driven += max(speed[b], 0.0) * WORTH_TIME
                worth = min(worth, driven / WORTH_TIME)
        worths[lane] = worth
    return worths


def wanted_lane(worths: FloatArray, own: int, gain: float) -> int | None:
    """Choose the neighbour lane worth changing to, None if the own one will do.

    A lane beyond the neighbour counts for the neighbour on the way to it.

    Args:
        worths: Of all lanes [m/s].
        own: Index of the lane the ego keeps.
        gain: Least advantage [m/s].

    Returns:
        The index of a neighbour lane or None.
    """
    best, chosen = worths[own] + gain, None
    for side in (1, -1):  # on a tie to the left, where the faster lanes are
        neighbour = own + side
        if not 0 <= neighbour < worths.size or not np.isfinite(worths[neighbour]):
            continue
        beyond = worths[neighbour:] if side > 0 else worths[: neighbour + 1]
        worth = float(beyond.max())
        if worth > best + 1e-9:
            best, chosen = worth, neighbour
    return chosen
