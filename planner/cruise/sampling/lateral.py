"""Lateral targets of the candidates."""

import math

import numpy as np

from planner.cruise.settings import CruiseSettings
from planner.numerics.compiled import compiled, inlined
from planner.numerics.interpolation import interpolate
from planner.scene import RoadBounds, Scene
from planner.states import FloatArray

AHEAD = 3.0  # after which the lanes are looked at [s]
SAME = 1e-9  # share of the lateral step by which an offset may miss a multiple [-]


def terminal_offsets(
    road: RoadBounds,
    s: tuple[float, float],
    half_width: float,
    settings: CruiseSettings,
) -> FloatArray:
    """Terminal offsets: multiples of the lateral step inside the widest road ahead.

    The outermost places that the body can take are added: between an obstacle and the
    road's edge there may be room for the body but not for a multiple of the step.

    Args:
        road: Lateral room.
        s: First and last arc length that the horizon covers [m].
        half_width: Of the body [m].
        settings: Step and limit.

    Returns:
        Offsets in growing order, (n,) [m].
    """
    return _offsets(
        (road.s, road.left, road.right),
        s,
        half_width,
        settings.lateral_limit,
        settings.lateral_step,
        settings.edge_offsets,
    )


@compiled
def _offsets(
    road: tuple[FloatArray, FloatArray, FloatArray],
    s: tuple[float, float],
    half_width: float,
    limit: float,
    step: float,
    with_edges: bool,  # noqa: FBT001 - a constant of the planner
) -> FloatArray:
    """Return the offsets of `terminal_offsets`; an edge at a multiple counts once."""
    low, high = lateral_room(road, s)
    high = min(limit, high - half_width)
    low = max(-limit, low + half_width)
    first, last = math.ceil(low / step - SAME), math.floor(high / step + SAME)
    n = max(last - first + 1, 0)
    edges = with_edges and low < high
    below = int(edges and (n == 0 or low / step < first - SAME))
    above = int(edges and (n == 0 or high / step > last + SAME))
    offsets = np.empty(below + n + above)
    for k in range(n):
        offsets[below + k] = step * (first + k)
    if below:
        offsets[0] = low
    if above:
        offsets[-1] = high
    return offsets


@inlined
def lateral_room(
    road: tuple[FloatArray, FloatArray, FloatArray], s: tuple[float, float]
) -> tuple[float, float]:
    """Widest bounds between two places.

    Args:
        road: Arc lengths, left and right bounds, (n,) [m].
        s: First and last place [m].

    Returns:
        (lowest right one, highest left one) [m].
    """
    road_s, road_left, road_right = road
    ends, left, right = np.array(s), np.empty(2), np.empty(2)
    interpolate(ends, 0.0, road_s, road_left, left)
    interpolate(ends, 0.0, road_s, road_right, right)
    low, high = min(right[0], right[1]), max(left[0], left[1])
    for i in range(road_s.size):
        if s[0] < road_s[i] < s[1]:
            low, high = min(low, road_right[i]), max(high, road_left[i])
    return low, high


def lane_term(scene: Scene, offsets: FloatArray) -> FloatArray:
    """Squared distance of terminal offsets from the middle of the nearest lane.

    Args:
        scene: Gives the lanes, those at `AHEAD`.
        offsets: (n,) [m].

    Returns:
        (n,) [m²], 0 where there are no lanes.
    """
    lanes, ego = scene.lanes, scene.ego_frenet
    at = ego.s + AHEAD * max(ego.s_dot, 0.0)
    return _lane_term((lanes.s, lanes.centre, lanes.width), at, offsets)


@compiled
def _lane_term(
    lanes: tuple[FloatArray, FloatArray, FloatArray], at: float, offsets: FloatArray
) -> FloatArray:
    """Return the squares of `lane_term`, (n,) [m²].

    Args:
        lanes: Arc lengths (m,), offsets of the middles and widths (n_lanes, m) [m].
        at: Where the lanes are looked at [m].
        offsets: (n,) [m].
    """
    lanes_s, centre, width = lanes
    k = min(max(int(np.searchsorted(lanes_s, at)) - 1, 0), max(lanes_s.size - 2, 0))
    after = min(k + 1, lanes_s.size - 1)
    share = 0.0
    if after > k:
        share = min(max((at - lanes_s[k]) / (lanes_s[after] - lanes_s[k]), 0.0), 1.0)
    square = np.full(offsets.size, np.inf)
    for lane in range(centre.shape[0]):
        if width[lane, k] + share * (width[lane, after] - width[lane, k]) > 0.0:
            middle = centre[lane, k] + share * (centre[lane, after] - centre[lane, k])
            for o in range(offsets.size):
                square[o] = min(square[o], (offsets[o] - middle) ** 2)
    for o in range(offsets.size):
        if square[o] == np.inf:  # no lane
            square[o] = 0.0
    return square


def full_grid_size(settings: CruiseSettings) -> int:
    """Count the offsets on a road wider than the limit; 21 in [Thesis] ch. 4."""
    steps = settings.lateral_limit / settings.lateral_step
    whole = math.floor(steps + SAME)
    edges = 2 if settings.edge_offsets and steps > whole + SAME else 0
    return 2 * whole + 1 + edges
