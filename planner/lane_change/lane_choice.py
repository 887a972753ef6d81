"""The lane that the ego is in, the worth of each lane, and the lane to change to."""

from typing import NamedTuple

import numpy as np

from planner.bodies import bodies_of
from planner.numerics.compiled import compiled
from planner.numerics.interpolation import interpolated
from planner.reference_path.linear_curvature import IndexArray, point_at
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
    """Return every obstacle and vehicle in the road's frame, obstacles first."""
    fixed, moving, ahead = scene.obstacles, scene.vehicles, scene.vehicles.prediction
    table = bodies_of(scene, max(ahead.x.shape[1], 1), ahead.step).table
    path = scene.path.table
    turned = _turned(path.knots, path.bins, table.s, fixed.heading, moving.heading)
    # numpy's functions, which differ from those of compiled code in the last bit
    rows = _on_road(
        table.s, table.l, table.extents, table.speed, np.cos(turned), np.sin(turned)
    )
    s, l, half_length, half_width, speed, later_l = rows
    return BodiesAhead(s, l, half_length, half_width, speed, later_l, table.n_static)


@compiled
def _turned(
    knots: FloatArray,
    bins: IndexArray,
    s: FloatArray,
    fixed: FloatArray,
    moving: FloatArray,
) -> FloatArray:
    """Return the headings of bodies against that of the road beside them [rad].

    Args:
        knots: Of the reference path.
        bins: Of the reference path.
        s: Of the bodies at each step, (n, n_steps); inf without a place [m].
        fixed: Headings of the first of them, (n_fixed,) [rad].
        moving: Headings of the others, (n - n_fixed,) [rad].
    """
    turned = np.empty(s.shape[0])
    for b in range(turned.size):
        at = s[b, 0] if np.isfinite(s[b, 0]) else 0.0
        heading = fixed[b] if b < fixed.size else moving[b - fixed.size]
        turned[b] = heading - point_at(knots, bins, at)[6]
    return turned


@compiled
def _on_road(
    s: FloatArray,
    l: FloatArray,
    extents: FloatArray,
    speed: FloatArray,
    cos: FloatArray,
    sin: FloatArray,
) -> FloatArray:
    """Fill the rows of `BodiesAhead`, (6, n), from columns of a `BodyTable`.

    Args:
        s: (n, n_steps) [m].
        l: (n, n_steps) [m].
        extents: (n, 3) [m].
        speed: Along their own motion, (n,) [m/s].
        cos: Of the headings against the road, (n,).
        sin: The same.
    """
    rows = np.empty((6, speed.size))
    last = s.shape[1] - 1
    for b in range(speed.size):
        half_length, half_width, radius = extents[b, 0], extents[b, 1], extents[b, 2]
        rows[0, b], rows[1, b] = s[b, 0], l[b, 0]
        rows[2, b] = half_length * abs(cos[b]) + half_width * abs(sin[b]) + radius
        rows[3, b] = half_length * abs(sin[b]) + half_width * abs(cos[b]) + radius
        rows[4, b] = speed[b] * cos[b]
        rows[5, b] = l[b, last] if np.isfinite(s[b, last]) else l[b, 0]
    return rows


def lane_at(lanes: Lanes, s: float, l: float) -> int:
    """Return the index of the lane whose centre is nearest to `l`, -1 without lanes."""
    return int(_lane_at(lanes.s, lanes.centre, lanes.width, float(s), float(l)))


@compiled
def _lane_at(
    lanes_s: FloatArray, centre: FloatArray, width: FloatArray, s: float, l: float
) -> int:
    """Find the lane of `lane_at`."""
    here, nearest, least = np.array([s]), -1, np.inf
    for lane in range(centre.shape[0]):
        if not interpolated(here, lanes_s, width[lane])[0] > GONE:
            continue
        away = abs(interpolated(here, lanes_s, centre[lane])[0] - l)
        if nearest < 0 or away < least:
            nearest, least = lane, away
    return nearest


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
