"""Lane-change and lane-keeping paths in the road's Frenet frame; [Thesis] 6.3.

Candidates of a change differ in their length and in the place of C ([Thesis] 6.3.5);
they are priced by their shape on the road, and placed on it from the cheapest on.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from planner.lane_change.change_shapes import BASIS, control_points, prices, sample
from planner.lane_change.settings import PathSettings
from planner.numerics.compiled import compiled
from planner.numerics.interpolation import interpolate, interpolated
from planner.numerics.polynomials import quintic_coefficients
from planner.reference_path.frenet_lines import line_in_plane
from planner.reference_path.path import ReferencePath
from planner.states import FloatArray, FrenetState, Path
from planner.vehicle import Vehicle, body_scale

# of the usual length, tried in turn; a long body that is slow needs longer ones
SETTLING_SHARES = (1.0, 0.7, 0.5, 0.35, 1.6, 2.5)
PARALLEL = 0.05  # a lane that shifts by less is parallel to the reference path [m]
SMOOTHED = 4.0  # to either side, over which a shifting lane is smoothed [m]
SHARES = np.linspace(-1.0, 1.0, 9)
WINDOW = (1.0 - np.abs(SHARES)) / (1.0 - np.abs(SHARES)).sum()
CENTRED = 0.1  # within as much of a lane's centre the body is in the lane [m]
MAX_SWING = 0.3  # beyond where a path begins and ends [m]


class KeptLane(NamedTuple):
    """A lane's centre line along the reference path; arrays are (n,)."""

    s: FloatArray  # strictly growing [m]
    centre: FloatArray  # [m]

    def offset_at(self, s: float) -> float:
        """Return the offset of the centre line [m]."""
        return float(np.interp(s, self.s, self.centre))

    def rows(self, s: FloatArray) -> FloatArray | None:
        """Return offset, slope and bend at arc lengths, (3, n); None if parallel.

        The centre line is smoothed over `SMOOTHED`, so that a corner in it does not
        turn into a steep bend.
        """
        if _shift(self.s, self.centre, float(s[0]), float(s[-1])) < PARALLEL:
            return None
        reach = SMOOTHED * SHARES
        around = np.interp(s[:, None] + reach, self.s, self.centre)
        offset = around @ WINDOW
        slope = np.gradient(offset, s)
        return np.array([offset, slope, np.gradient(slope, s)])


@compiled
def _shift(lane_s: FloatArray, centre: FloatArray, begin: float, end: float) -> float:
    """Return by how much a centre line shifts between two arc lengths [m]."""
    ends = interpolated(np.array([begin, end]), lane_s, centre)
    low, high = min(ends[0], ends[1]), max(ends[0], ends[1])
    for i in range(lane_s.size):
        if begin < lane_s[i] < end:
            low, high = min(low, centre[i]), max(high, centre[i])
    return float(high - low)


@dataclass(frozen=True, slots=True, eq=False)
class ChangePath:
    """A path that leaves a lane for another one and stays in it."""

    path: Path
    begin: float  # distance at which the lateral motion begins [m]
    end: float  # distance at which it is over [m]
    cost: float  # corrected eq. 6.11
    peak_curvature: float  # of the change itself, without the road's [1/m]


def lane_keeping_path(
    reference: ReferencePath,
    state: FrenetState,
    lane: float | KeptLane,
    total: float,
    settings: PathSettings,
    beyond: Callable[[Path], float] = lambda _: 0.0,
) -> Path | None:
    """Settle on an offset and stay there, or in a lane that shifts.

    Args:
        reference: Of the road.
        state: Of the ego.
        lane: Where to go [m].
        total: Length of the path along the reference [m].
        settings: Spacing and settling time.
        beyond: Returns how far a path takes the body over the road's edges [m].

    Returns:
        The path; None where the Frenet frame does not reach. Of several ways to settle
        the first that neither swings out nor leaves the road, else the one that does
        so least.
    """
    settle = max(settings.settle_length, settings.settle_time * max(state.s_dot, 0.0))
    driven = _grid(total, settings.spacing)
    if isinstance(lane, KeptLane):
        centre = lane.rows(state.s + driven)
        if centre is None:
            lane = lane.offset_at(state.s)
    else:
        centre = None
    if centre is None:
        assert isinstance(lane, float)  # noqa: S101 - a lane that is parallel
        centre = np.zeros((3, driven.size))
        centre[0] = lane
    least, best = math.inf, None
    motion = (state.l, state.l_prime, state.l_second)
    along = state.s + driven
    for share in SETTLING_SHARES:
        line, low, high = _settling_line(motion, centre, share * settle, driven)
        path = line_in_plane(reference, along, line[0], line[1], line[2])
        if path is None:
            continue
        away = state.l - float(centre[0, 0])
        out = max(min(away, 0.0) - low, high - max(away, 0.0), 0.0)  # as `swing`
        over = max(out - MAX_SWING, 0.0)
        if abs(away) + out > CENTRED:  # else the body is where the lane is
            over += max(beyond(path), 0.0)
        if over < least:
            least, best = over, path
        if over <= 0.0:
            break
    return best


@compiled
def _settling_line(
    motion: tuple[float, float, float],
    centre: FloatArray,
    length: float,
    driven: FloatArray,
) -> tuple[FloatArray, float, float]:
    """Lay a way to a lane's centre line.

    Args:
        motion: l, dl/ds and d²l/ds² of the ego.
        centre: Offset, slope and bend of the lane at the distances driven, (3, n).
        length: Over which the ego comes to the centre line [m].
        driven: Distances along the reference, (n,) [m].

    Returns:
        l, dl/ds, d²l/ds², (3, n), and the least and greatest offset from the centre.
    """
    l, slope, bend = (
        motion[0] - centre[0, 0],
        motion[1] - centre[1, 0],
        motion[2] - centre[2, 0],
    )
    line = np.empty((3, driven.size))
    _settle(l, slope, bend, 0.0, length, driven, line)
    low, high = np.inf, -np.inf
    for i in range(driven.size):
        for row in range(3):
            line[row, i] += centre[row, i]
        off = line[0, i] - centre[0, i]
        low, high = min(low, off), max(high, off)
    return line, low, high


class ChangeTarget(NamedTuple):
    """Where a change has to lead."""

    offset: float  # of the lane to go to [m]
    begin: float  # distance along the road over which the present offset is kept [m]
    total: float  # length of the path along the reference [m]


def best_change(
    reference: ReferencePath,
    state: FrenetState,
    target: ChangeTarget,
    vehicle: Vehicle,
    settings: PathSettings,
    refuses: Callable[[ChangePath], str | None] = lambda _: None,
    cutoff: float = math.inf,
) -> tuple[ChangePath | None, dict[str, int]]:
    """Find the cheapest change path that can be driven.

    Args:
        reference: Of the road.
        state: Of the ego.
        target: See there.
        vehicle: Its curvature limit holds.
        settings: Lengths, ratios, weights.
        refuses: Returns why a change cannot be driven, None if nothing is in its way.
            Of one length only the cheapest is asked about.
        cutoff: Changes that cost as much are not looked at.

    Returns:
        (path or None, reason -> number of candidates refused).
    """
    speed = max(state.s_dot, 0.0)
    refused: dict[str, int] = {}
    motion = (0.0, 0.0) if target.begin > 0.0 else (state.l_prime, state.l_second)
    points, costs, peaks = _priced(
        (state.l, *motion), target.offset, _lengths(speed, vehicle, settings), settings
    )
    slow = speed**2 * peaks <= settings.lateral_acceleration
    if not slow.all():
        refused["lateral acceleration"] = int((~slow).sum())
    limit = settings.curvature_share * vehicle.limits.max_curvature
    blocked: set[float] = set()
    for k in np.argsort(costs, kind="stable").tolist():
        length = float(points[k, -1, 0])
        if costs[k] >= cutoff:
            break
        if not slow[k] or length in blocked:
            continue
        shape = sample(points[k], BASIS)
        made = _on_road(reference, state, shape, target, length, settings)
        if made is None:
            _count(refused, "outside the road's frame")
            continue
        path, place = made
        if swing(path.l, state.l, target.offset) > MAX_SWING:
            _count(refused, "swings out")
            continue
        if float(np.abs(path.curvature).max()) > limit:
            _count(refused, "curvature")
            continue
        cost, peak = float(costs[k]), float(peaks[k])
        found = ChangePath(path, float(place[0]), float(place[1]), cost, peak)
        why = refuses(found)
        if why is None:
            return found, refused
        _count(refused, why)
        blocked.add(length)
    return None, refused


@lru_cache(maxsize=8)
def _priced(
    start: tuple[float, float, float],
    target: float,
    lengths: tuple[float, ...],
    settings: PathSettings,
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return control points, costs and peak curvatures, read only.

    A cycle asks for the changes that begin farther on once for each place: they are
    the same shapes.
    """
    points = control_points(start, target, lengths, settings.c_ratios)
    weights = settings.curvature_weight, settings.length_weight
    return points, *prices(points, BASIS, *weights)


def _lengths(
    speed: float, vehicle: Vehicle, settings: PathSettings
) -> tuple[float, ...]:
    """Return the lengths to try [m]; the tight ones are for walking speed.

    A body longer than a car needs more, or its ends swing over the edges.
    """
    scale = body_scale(vehicle)
    usual, *tight = (scale * length for length in settings.min_lengths)
    soonest = min(settings.change_times) * speed
    lengths = {max(usual, t * speed) for t in settings.change_times}
    lengths |= {length for length in tight if length > soonest}
    return tuple(sorted(lengths))


def _count(refused: dict[str, int], reason: str) -> None:
    """Count one refusal."""
    refused[reason] = refused.get(reason, 0) + 1


def swing(l: FloatArray, begin: float, end: float) -> float:
    """Compute how far offsets go beyond both of their ends [m]."""
    low, high = min(begin, end), max(begin, end)
    return max(low - float(l.min()), float(l.max()) - high, 0.0)


def _on_road(
    reference: ReferencePath,
    state: FrenetState,
    shape: FloatArray,
    target: ChangeTarget,
    length: float,
    settings: PathSettings,
) -> tuple[Path, FloatArray] | None:
    """Place one sampled spline on the road and extend it straight on.

    Returns:
        The path and the distances at which the change begins and ends; None outside
        the road's Frenet frame.
    """
    begin, spacing = target.begin, settings.spacing
    driven = _grid(max(target.total, begin + length + spacing), spacing)
    line = np.empty((3, driven.size))
    _fill_change(shape, begin, length, driven, line)
    if begin > 0.0:  # slope and bend are taken out of the present motion first
        first = driven < begin
        before = np.empty((3, int(first.sum())))
        _settle(
            state.l,
            state.l_prime,
            state.l_second,
            state.l,
            begin,
            driven[first],
            before,
        )
        line[:, first] = before
    path = line_in_plane(reference, state.s + driven, *line)
    if path is None:
        return None
    return path, np.interp([begin, begin + length], driven, path.distance)


@compiled
def _fill_change(
    shape: FloatArray, begin: float, length: float, driven: FloatArray, line: FloatArray
) -> None:
    """Fill l, dl/ds, d²l/ds² at the distances driven, (3, n), from a sampled change."""
    at = np.minimum(np.maximum(driven - begin, 0.0), length)
    for order in range(3):
        interpolate(at, 0.0, shape[0], shape[1 + order], line[order])
        if order > 0:
            for i in range(driven.size):
                if not begin <= driven[i] <= begin + length:
                    line[order, i] = 0.0


@compiled
def _settle(
    l: float,
    slope: float,
    bend: float,
    offset: float,
    length: float,
    driven: FloatArray,
    line: FloatArray,
) -> None:
    """Fill l, dl/ds, d²l/ds², (3, n), of a quintic to an offset that is then kept."""
    c0, c1, c2, c3, c4, c5 = quintic_coefficients(
        l, slope, bend, offset, 0.0, 0.0, length
    )
    for i in range(driven.size):
        s = min(driven[i], length)
        line[0, i] = c0 + s * (c1 + s * (c2 + s * (c3 + s * (c4 + s * c5))))
        line[1, i], line[2, i] = 0.0, 0.0
        if driven[i] <= length:
            line[1, i] = c1 + s * (2 * c2 + s * (3 * c3 + s * (4 * c4 + s * 5 * c5)))
            line[2, i] = 2 * c2 + s * (6 * c3 + s * (12 * c4 + s * 20 * c5))


def _grid(total: float, spacing: float) -> FloatArray:
    """Return distances 0, spacing, ... at least up to `total`."""
    return spacing * np.arange(math.ceil(total / spacing) + 1, dtype=np.float64)
