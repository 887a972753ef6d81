"""The scene seen along one lane: its centre becomes the reference path.

Between lanes that run side by side the Frenet frames differ by the offset of the lane
and the length of its way round bends; places are moved from one to the other by a
table, without projections. Only the ego is projected anew.
"""

from dataclasses import dataclass, replace

import numpy as np

from planner.errors import InvalidInputError, OutsidePathDomainError
from planner.lane_change.lane_choice import GONE
from planner.reference_path.frenet import cartesian_to_frenet_one
from planner.reference_path.path import ReferencePath
from planner.scene import (
    Lanes,
    Prediction,
    RoadBounds,
    Scene,
    SpeedLimits,
    Vehicles,
)
from planner.states import BoolArray, FloatArray, Trajectory
from planner.vehicle import Vehicle

SPACING = 1.0  # of the table [m]
SAME = 0.05  # lanes nearer than this are one [m]
SEEN_BEHIND, SEEN_AHEAD = 15.0, 110.0  # of the ego, where a frame is looked at [m]
# A frame is made for a stretch, since smoothing takes long: for so much of the way ...
USED = 300.0  # [m]
KEPT_BEHIND, KEPT_AHEAD = 150.0, 350.0  # and what can be seen and planned about it [m]
FADE = 25.0  # beyond its ends a lane leads back to the reference path [m]
SPARE = 0.15  # beside a body in a bend [m]
SHARP = 0.6  # share of the ego's curvature from which the inner side is kept free
INNER_SPARE = 0.4  # beside the body there [m]
TIGHT = 0.3  # a road that leaves no more beside the body in a bend is narrow [m]
BENT = 0.02  # a path that curves more is in a bend [1/m]
EASING = 0.02  # by which this grows with each metre before the bend [-]
ANYWHERE = 100.0  # half the width of a road that is not narrowed [m]


@dataclass(frozen=True, slots=True, eq=False)
class LaneFrame:
    """One lane as the reference; arrays are (n,), tables over the path of the scene."""

    lane: int
    path: ReferencePath
    reference: ReferencePath  # of the scene
    at: FloatArray  # arc lengths on the reference path [m]
    s: FloatArray  # the same on `path` [m]
    offset: FloatArray  # of `path` from the reference path [m]
    need: FloatArray  # half the width that the ego's body takes, bends included [m]
    inner: FloatArray  # most of the left and of the right side, (2, n) [m]
    lanes: Lanes
    road: RoadBounds
    limits: SpeedLimits
    begin: float = -np.inf  # on the reference path, of where `path` is the lane [m]
    end: float = np.inf

    @property
    def is_reference(self) -> bool:
        """Whether this is the frame of the scene itself."""
        return self.path is self.reference

    def to_s(self, at: FloatArray) -> FloatArray:
        """Move arc lengths of the reference path into this frame; inf stays inf."""
        return _moved(at, self.at, self.s)

    def to_reference(self, s: FloatArray) -> FloatArray:
        """Move arc lengths of this frame to the reference path."""
        return _moved(s, self.s, self.at)


def lane_frame(scene: Scene, lane: int) -> LaneFrame | None:
    """Make the frame of a lane about the ego; None where the lane makes no line.

    Args:
        scene: With lanes.
        lane: Which one; it has to exist beside the ego.
    """
    at = _table(scene.path)
    offset, (begin, end) = _offsets(scene, lane, at)
    begin = max(begin, scene.ego_frenet.s - KEPT_BEHIND)
    end = min(end, scene.ego_frenet.s + USED)
    kept = (at >= scene.ego_frenet.s - KEPT_BEHIND) & (at <= end + KEPT_AHEAD)
    at, offset = at[kept], offset[kept]
    points = scene.path.at(at)
    x = points.x - offset * points.sin_heading
    y = points.y + offset * points.cos_heading
    try:
        path = ReferencePath.from_polyline(np.column_stack([x, y]))
        s, _ = path.project(x, y, near=_along(x, y))
    except InvalidInputError:
        return None
    s = np.maximum.accumulate(s + 1e-9 * np.arange(s.size))
    return replace(_frame(scene, lane, path, (at, s, offset)), begin=begin, end=end)


def reference_frame(scene: Scene, lane: int) -> LaneFrame:
    """Make the frame in which the reference path stays, for a lane it runs along."""
    at = _table(scene.path)
    return _frame(scene, lane, scene.path, (at, at, np.zeros(at.size)))


def narrows_bends(frame: LaneFrame) -> bool:
    """Tell whether the inner side of some bend of the frame is kept free."""
    return bool((frame.inner < ANYWHERE).any())


def without_inner_sides(frame: LaneFrame) -> LaneFrame:
    """Return a frame whose corridor goes to the lane's edges in sharp bends, too."""
    return replace(frame, inner=np.full_like(frame.inner, ANYWHERE))


def coincides(scene: Scene, lane: int) -> bool:
    """Check whether the reference path is the middle of a lane about the ego."""
    s = scene.ego_frenet.s
    at = np.arange(s - SEEN_BEHIND, s + SEEN_AHEAD, 5.0)
    lanes = scene.lanes
    there = np.interp(at, lanes.s, lanes.width[lane]) > GONE
    off = np.abs(np.interp(at, lanes.s, lanes.centre[lane]))
    return not bool(np.any(off[there] > SAME))


def seen_from(
    scene: Scene, frame: LaneFrame, road: RoadBounds, lines: tuple[float, ...]
) -> Scene | None:
    """Return the scene along a lane; None if the ego is outside the frame.

    Args:
        scene: Along the reference path.
        frame: Of the lane.
        road: What may be used, in the frame.
        lines: Arc lengths on the reference path where the front bumper stops [m].
    """
    if frame.is_reference:
        return replace(scene, road=road, stop_lines=lines)
    near = float(frame.to_s(np.array([scene.ego_frenet.s]))[0])
    try:
        ego = cartesian_to_frenet_one(frame.path, scene.ego, near)
    except OutsidePathDomainError:
        return None
    table = scene.vehicles.prediction.table.copy()
    table[4] -= np.interp(table[3], frame.at, frame.offset)
    table[3] = frame.to_s(table[3])
    table[4] = np.where(np.isfinite(table[3]), table[4], 0.0)
    prediction = Prediction.from_table(scene.vehicles.prediction.step, table)
    return replace(
        scene,
        path=frame.path,
        ego_frenet=ego,
        road=road,
        vehicles=Vehicles.predicted(scene.vehicles, prediction),
        stop_lines=tuple(frame.to_s(np.array(lines)).tolist()),
        lanes=frame.lanes,
        speed_limits=frame.limits,
        junctions=(),
        foes=(),
    )


def on_reference(frame: LaneFrame, trajectory: Trajectory) -> Trajectory:
    """Return a trajectory of a frame with places on the reference path."""
    if frame.is_reference:
        return trajectory
    near = frame.to_reference(trajectory.s)
    s, l = frame.reference.project(trajectory.x, trajectory.y, near=near)
    return replace(trajectory, s=s, l=l)


def in_frame(frame: LaneFrame, trajectory: Trajectory) -> Trajectory:
    """Return a trajectory of the reference path with places in a frame."""
    if frame.is_reference:
        return trajectory
    s = frame.to_s(trajectory.s)
    l = trajectory.l - np.interp(trajectory.s, frame.at, frame.offset)
    return replace(trajectory, s=s, l=l)


def _frame(
    scene: Scene,
    lane: int,
    path: ReferencePath,
    table: tuple[FloatArray, FloatArray, FloatArray],
) -> LaneFrame:
    """Move what belongs to the road into a frame."""
    at, s, offset = table
    road, lanes, limits = scene.road, scene.lanes, scene.speed_limits
    need = _body_need(path, s, scene.vehicle)
    sides = np.stack(
        [np.interp(at, road.s, road.left), -np.interp(at, road.s, road.right)]
    )
    moving = np.stack([-offset, offset])
    inner = _inner_sides(path, s, scene.vehicle, sides + moving)
    if path is scene.path:
        return LaneFrame(
            lane, path, path, at, s, offset, need, inner, lanes, road, limits
        )
    moved = np.interp(road.s, at, offset)
    left, right = road.left - moved, road.right - moved
    own = np.interp(road.s, at, need)
    along = _moved(road.s, at, s)
    kept = _first_ones(along)
    bounds = RoadBounds(
        along[kept], np.maximum(left, own)[kept], np.minimum(right, -own)[kept]
    )
    there = np.interp(lanes.s, at, offset)
    return LaneFrame(
        lane,
        path,
        scene.path,
        at,
        s,
        offset,
        need,
        inner,
        _moved_lanes(lanes, _moved(lanes.s, at, s), there),
        bounds,
        _moved_limits(limits, _moved(limits.s, at, s)),
    )


def _moved_lanes(lanes: Lanes, s: FloatArray, offset: FloatArray) -> Lanes:
    """Move lanes into a frame; of samples that coincide there the first one stays.

    Args:
        lanes: On the reference path.
        s: Of their samples in the frame, (n,) [m].
        offset: Of the frame there, (n,) [m].
    """
    kept = _first_ones(s)
    return Lanes(
        s[kept],
        (lanes.centre - offset)[:, kept],
        lanes.width[:, kept],
        lanes.left_hand,
        lanes.solid_left[:, kept],
        lanes.solid_right[:, kept],
    )


def _first_ones(s: FloatArray) -> BoolArray:
    """Mark samples that lie beyond all those before them, (n,)."""
    return np.concatenate([[True], s[1:] > np.maximum.accumulate(s)[:-1]])


def _moved_limits(limits: SpeedLimits, s: FloatArray) -> SpeedLimits:
    """Move speed limits into a frame; of those that coincide there the last one holds.

    Args:
        limits: On the reference path.
        s: Of their begins in the frame, (n,) [m].
    """
    kept = np.append(np.diff(s) > 0.0, [True])
    return SpeedLimits(s[kept], limits.limit[kept])


def _table(path: ReferencePath) -> FloatArray:
    """Return arc lengths of the reference path, its ends included [m]."""
    return np.linspace(0.0, path.length, max(int(path.length / SPACING), 2) + 1)


def _moved(values: FloatArray, at: FloatArray, s: FloatArray) -> FloatArray:
    """Read a growing table, carried on beyond its ends; inf stays inf."""
    inside = np.clip(values, at[0], at[-1])
    return np.asarray(np.interp(inside, at, s) + (values - inside))


def _offsets(
    scene: Scene, lane: int, at: FloatArray
) -> tuple[FloatArray, tuple[float, float]]:
    """Return the lane's offset where it exists about the ego, fading out beyond.

    Returns:
        Offsets, (n,), and from where to where the lane exists [m].
    """
    lanes, s = scene.lanes, scene.ego_frenet.s
    centre = np.interp(at, lanes.s, lanes.centre[lane])
    there = np.interp(at, lanes.s, lanes.width[lane]) > GONE
    gone = np.flatnonzero(~there)
    here = int(np.searchsorted(at, s))
    behind, ahead = gone[gone < here], gone[gone >= here]
    first = int(behind[-1]) + 1 if behind.size else 0
    last = int(ahead[0]) - 1 if ahead.size else at.size - 1
    first, last = min(first, at.size - 1), max(last, 0)
    out = centre.copy()
    fade = np.clip(1.0 - (at - at[last]) / FADE, 0.0, 1.0)
    out[last + 1 :] = centre[last] * _smooth(fade[last + 1 :])
    fade = np.clip(1.0 - (at[first] - at) / FADE, 0.0, 1.0)
    out[:first] = centre[first] * _smooth(fade[:first])
    return out, (float(at[first]), float(at[last]))


def _smooth(share: FloatArray) -> FloatArray:
    """Ease a share in and out, without a step in its curvature."""
    return share**3 * (10.0 - 15.0 * share + 6.0 * share**2)


def _along(x: FloatArray, y: FloatArray) -> FloatArray:
    """Return the arc length of a polyline at its corners [m]."""
    steps = np.hypot(np.diff(x), np.diff(y))
    return np.concatenate([[0.0], np.cumsum(steps)])


def _body_need(path: ReferencePath, s: FloatArray, vehicle: Vehicle) -> FloatArray:
    """Compute half the width that the body takes on its way through bends [m]."""
    return _swept(np.abs(path.at(s).curvature), vehicle)


def _swept(curvature: FloatArray, vehicle: Vehicle) -> FloatArray:
    """Compute half the width with what the front sweeps about each place, (n,) [m]."""
    reach = max(int(vehicle.front_reach / SPACING), 1)
    padded = np.pad(curvature, reach, mode="edge")
    windows = np.lib.stride_tricks.sliding_window_view(padded, 2 * reach + 1)
    sweep = 0.5 * vehicle.front_reach**2 * windows.max(axis=1)
    return np.asarray(0.5 * vehicle.width + SPARE + sweep)


def _inner_sides(
    path: ReferencePath, s: FloatArray, vehicle: Vehicle, road: FloatArray
) -> FloatArray:
    """Compute how far the road goes to the inner side of sharp bends, (2, n) [m].

    It narrows gently before them, and before places where the road leaves no room
    beside the body, so that an ego at its edge can follow it. In a bend to the other
    side before it, the front still gets the room that it sweeps there.

    Args:
        path: Of the frame.
        s: Places on it, (n,) [m].
        vehicle: The ego.
        road: How far the road reaches to the left and to the right there, (2, n) [m].
    """
    curvature, sharp = path.at(s).curvature, SHARP * vehicle.limits.max_curvature
    out = np.full((2, s.size), ANYWHERE)
    for side, inwards in enumerate((curvature, -curvature)):
        half = 0.5 * vehicle.width
        closed = np.where(inwards > sharp, half + INNER_SPARE, ANYWHERE)
        tight = (road[side] < half + TIGHT) & (inwards > BENT)
        closed = np.where(tight, np.minimum(closed, road[side]), closed)
        if not (closed < ANYWHERE).any():
            continue
        falling = np.minimum.accumulate((closed + EASING * s)[::-1])[::-1]
        room = np.maximum(falling - EASING * s, half)
        room = np.maximum(room, _swept(np.maximum(-inwards, 0.0), vehicle))
        out[side] = np.minimum(room, ANYWHERE)
    return out
