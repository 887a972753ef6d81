"""The lane that the ego is in, the worth of each lane, and the lane to change to."""

from typing import NamedTuple

import numpy as np

from planner.bodies import bodies_of
from planner.numerics.compiled import compiled
from planner.numerics.interpolation import interpolated
from planner.scene import Lanes, Scene
from planner.states import FloatArray

WORTH_TIME = 30.0  # over which a lane's mean speed is judged [s]
SIDE_MARGIN = 0.3  # a body this near the ego's corridor is in it [m]
GONE = 0.5  # a lane narrower than this is none [m]
LANE_END_STEP = 5.0  # at which the lane ahead is looked at [m]


class BodiesAhead(NamedTuple):
    """All bodies on the carriageway now, in the road's frame; arrays are (n,)."""

    s: FloatArray  # centre [m]
    l: FloatArray  # [m]
    half_length: FloatArray  # along the road [m]
    half_width: FloatArray  # across it [m]
    speed: FloatArray  # along the road, negative against it [m/s]
    later_l: FloatArray  # where its lateral motion, as predicted, ends [m]
    n_static: int  # the first so many never move

    def static(self) -> "BodiesAhead":
        """Return those that never move."""
        n, columns = self.n_static, self._asdict()
        del columns["n_static"]
        return self._replace(**{name: row[:n] for name, row in columns.items()})


def bodies_on_road(scene: Scene) -> BodiesAhead:
    """Return every obstacle and vehicle in the road's frame, obstacles first."""
    fixed, moving, ahead = scene.obstacles, scene.vehicles, scene.vehicles.prediction
    table = bodies_of(scene, max(ahead.x.shape[1], 1), ahead.step).table
    s, l = table.s[:, 0].copy(), table.l[:, 0].copy()
    heading = np.concatenate([fixed.heading, moving.heading])
    turned = heading - scene.path.at(np.where(np.isfinite(s), s, 0.0)).heading
    cos, sin = np.abs(np.cos(turned)), np.abs(np.sin(turned))
    half_length, half_width, radius = table.extents.T
    return BodiesAhead(
        s,
        l,
        half_length * cos + half_width * sin + radius,
        half_length * sin + half_width * cos + radius,
        table.speed * np.cos(turned),
        np.where(np.isfinite(table.s[:, -1]), table.l[:, -1], l),
        table.n_static,
    )


def lane_at(lanes: Lanes, s: float, l: float) -> int:
    """Return the index of the lane whose centre is nearest to `l`, -1 without lanes."""
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
    there = interpolated(ahead, lanes_s, width)
    for i in range(ahead.size):
        if there[i] <= GONE:
            return float(ahead[i])
    return np.inf


def lane_worths(scene: Scene, bodies: BodiesAhead, gap: float) -> FloatArray:
    """Return the mean speed that each lane allows over the next `WORTH_TIME`.

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
        (lanes.s, lanes.centre, lanes.width),
        (ego.s, ego.s + vehicle.front_reach),
        scene.target_speed,
        gap,
        vehicle.width / 2.0 + SIDE_MARGIN,
        bodies,
    )


@compiled
def _worths(
    lanes: tuple[FloatArray, FloatArray, FloatArray],
    ego: tuple[float, float],
    target_speed: float,
    gap: float,
    half_corridor: float,
    bodies: BodiesAhead,
) -> FloatArray:
    """Return the worths of `lane_worths`.

    Args:
        lanes: Arc lengths, centres and widths, as in `Lanes`.
        ego: s of its rear axle and of its front bumper [m].
        target_speed: Of the ego [m/s].
        gap: Kept to whatever is ahead [m].
        half_corridor: Half the width that the ego needs [m].
        bodies: On the road.
    """
    lanes_s, centre, width = lanes
    ego_s, front = ego
    s, l, half_width = bodies.s, bodies.l, bodies.half_width
    worths = np.full(centre.shape[0], -np.inf)
    here = np.array([ego_s])
    for lane in range(centre.shape[0]):
        if not interpolated(here, lanes_s, width[lane])[0] > GONE:
            continue
        end = _lane_end(lanes_s, width[lane], ego_s, WORTH_TIME * target_speed)
        worth = min(target_speed, max(end - front - gap, 0.0) / WORTH_TIME)
        there = interpolated(s, lanes_s, centre[lane])
        for b in range(s.size):
            inside = abs(l[b] - there[b]) < half_width[b] + half_corridor
            if inside and np.isfinite(s[b]) and s[b] > ego_s:
                driven = max(s[b] - bodies.half_length[b] - front - gap, 0.0)
                driven += max(bodies.speed[b], 0.0) * WORTH_TIME
                worth = min(worth, driven / WORTH_TIME)
        worths[lane] = worth
    return worths


def wanted_lane(
    worths: FloatArray,
    own: int,
    gain: float,
    *,
    left_hand: bool = False,
) -> int | None:
    """Choose the neighbour lane worth changing to, None if the own one will do.

    A lane beyond the neighbour counts for the neighbour on the way to it.

    Args:
        worths: Of all lanes [m/s].
        own: Index of the lane the ego keeps.
        gain: Least advantage [m/s].
        left_hand: Whether traffic keeps to the left.

    Returns:
        The index of a neighbour lane or None.
    """
    best, chosen = worths[own] + gain, None
    # On a tie to where the faster lanes are.
    for side in (-1, 1) if left_hand else (1, -1):
        neighbour = own + side
        if not 0 <= neighbour < worths.size or not np.isfinite(worths[neighbour]):
            continue
        beyond = worths[neighbour:] if side > 0 else worths[: neighbour + 1]
        worth = float(beyond.max())
        if worth > best + 1e-9:
            best, chosen = worth, neighbour
    return chosen
