"""Lane-change and lane-keeping paths in the road's Frenet frame; [Thesis] 6.3.

A change is a clamped cubic B-spline with seven control points A, B, C, O, D, E, F, in
two halves symmetric about O ([Thesis] 6.3.5). Its first three points are placed such
that position, slope and second derivative are those of the ego, so that a change can
be planned anew from the middle of another one.
"""

import math
from dataclasses import dataclass

import numpy as np
from scipy.interpolate import BSpline

from planner.errors import OutsidePathDomainError
from planner.geometry.frenet import frenet_to_cartesian
from planner.geometry.reference_path import ReferencePath
from planner.lane_change.settings import PathSettings
from planner.motion import polynomials
from planner.states import FloatArray, FrenetState, FrenetStates, Path
from planner.vehicle import Vehicle

KNOTS = np.array([0.0, 0.0, 0.0, 0.0, 0.25, 0.5, 0.75, 1.0, 1.0, 1.0, 1.0])
SAMPLES = 161  # of the spline's parameter
_U = np.linspace(0.0, 1.0, SAMPLES)
_SPLINES = BSpline(KNOTS, np.eye(7), 3)
BASIS = tuple(_SPLINES(_U, nu=k) for k in range(3))  # N, N', N'' at _U, (SAMPLES, 7)


SETTLING_SHARES = (1.0, 0.7, 0.5, 0.35)  # of the usual length, tried in turn
MAX_SWING = 0.3  # beyond where a path begins and ends [m]


@dataclass(frozen=True, slots=True, eq=False)
class ChangePath:
    """A path that leaves a lane for another one and stays in it."""

    path: Path
    begin: float  # distance at which the lateral motion begins [m]
    end: float  # distance at which it is over [m]
    cost: float  # corrected eq. 6.11
    peak_curvature: float  # of the change itself, without the road's [1/m]


# (driven, l, dl/ds, d²l/ds²) of a change, (SAMPLES,) each
Shape = tuple[FloatArray, FloatArray, FloatArray, FloatArray]


def lane_keeping_path(
    reference: ReferencePath,
    state: FrenetState,
    offset: float,
    total: float,
    settings: PathSettings,
) -> Path | None:
    """Settle on an offset and stay there.

    Args:
        reference: Of the road.
        state: Of the ego.
        offset: Where to go [m].
        total: Length of the path along the reference [m].
        settings: Spacing and settling time.

    Returns:
        The path; None where the Frenet frame does not reach.
    """
    settle = max(settings.settle_length, settings.settle_time * max(state.s_dot, 0.0))
    start = (state.l, state.l_prime, state.l_second)
    driven = _grid(total, settings.spacing)
    for share in SETTLING_SHARES:  # the longest that does not swing out
        length = share * settle
        c = polynomials.quintic(start, (offset, 0.0, 0.0), length)
        inside = np.minimum(driven, length)
        l, slope, bend = (polynomials.evaluate(c, inside, k) for k in range(3))
        if swing(l, state.l, offset) <= MAX_SWING:
            break
    settle = length
    past = driven > settle
    slope, bend = np.where(past, 0.0, slope), np.where(past, 0.0, bend)
    return _in_plane(reference, state.s + driven, l, slope, bend)


def best_change(
    reference: ReferencePath,
    state: FrenetState,
    target: float,
    begin: float,
    total: float,
    vehicle: Vehicle,
    settings: PathSettings,
) -> tuple[ChangePath | None, dict[str, int]]:
    """Give the cheapest change path that can be driven.

    Candidates differ in their length and in the place of C ([Thesis] 6.3.5). They are
    priced by their shape on the road; only the cheapest are laid on it, until one
    keeps the limits.

    Args:
        reference: Of the road.
        state: Of the ego.
        target: Offset of the lane to go to [m].
        begin: Distance along the road over which the present offset is kept [m].
        total: Length of the path along the reference [m].
        vehicle: Its curvature limit holds.
        settings: Lengths, ratios, weights.

    Returns:
        (path or None, reason -> number of candidates refused).
    """
    speed = max(state.s_dot, 0.0)
    refused: dict[str, int] = {}
    shapes = []
    for length in sorted(
        {max(settings.min_length, t * speed) for t in settings.change_times}
    ):
        for ratio in settings.c_ratios:
            shape = spline_offsets(state, target, begin, length, ratio)
            cost, peak = _price(shape, settings)
            if speed**2 * peak > settings.lateral_acceleration:
                _count(refused, "lateral acceleration")
            else:
                shapes.append((cost, length, peak, shape))
    shapes.sort(key=lambda item: item[0])
    limit = settings.curvature_share * vehicle.limits.max_curvature
    for cost, length, peak, shape in shapes:
        made = _laid(reference, state, shape, begin, length, total, settings)
        if made is None:
            _count(refused, "outside the road's frame")
            continue
        path, place = made
        if swing(path.l, state.l, target) > MAX_SWING:
            _count(refused, "swings out")
            continue
        if float(np.abs(path.curvature).max()) <= limit:
            found = ChangePath(path, float(place[0]), float(place[1]), cost, peak)
            return found, refused
        _count(refused, "curvature")
    return None, refused


def _count(refused: dict[str, int], reason: str) -> None:
    """Count one refusal."""
    refused[reason] = refused.get(reason, 0) + 1


def _price(shape: Shape, settings: PathSettings) -> tuple[float, float]:
    """Price a shape, corrected eq. 6.11: (cost, peak curvature [1/m]).

    The curvature is that of the change itself, as on a straight road.
    """
    along, _, slope, bend = shape
    curvature = bend / (1.0 + slope**2) ** 1.5
    steps = np.diff(along) * np.sqrt(1.0 + slope[1:] ** 2)
    cost = settings.curvature_weight * float(curvature[1:] ** 2 @ steps)
    cost += settings.length_weight * float(along[-1])
    return cost, float(np.abs(curvature).max())


def swing(l: FloatArray, begin: float, end: float) -> float:
    """Say how far offsets go beyond both of their ends [m]."""
    low, high = min(begin, end), max(begin, end)
    return max(low - float(l.min()), float(l.max()) - high, 0.0)


def spline_offsets(
    state: FrenetState, target: float, begin: float, length: float, ratio: float
) -> Shape:
    """Sample the spline as (driven, l, dl/ds, d²l/ds²), (SAMPLES,) each.

    With b = BC's length along the road and AB the same, C's offset follows from the
    derivatives of a clamped cubic at its start: l'' = (y - e l') / (3 b²), y and e
    being the rise and length of BC.
    """
    c = ratio * length
    b = 0.5 * c
    if begin > 0.0:  # the present offset is kept first: the change begins straight
        slope, bend, l0 = 0.0, 0.0, state.l
    else:
        slope, bend, l0 = state.l_prime, state.l_second, state.l
    along = np.array([0.0, b, c, 0.5 * length, length - c, length - b, length])
    across = np.array(
        [
            l0,
            l0 + b * slope,
            l0 + c * slope + 3.0 * b * b * bend,
            0.5 * (l0 + target),
            target,
            target,
            target,
        ]
    )
    (s, l), (s_u, l_u), (s_uu, l_uu) = (
        (basis @ along, basis @ across) for basis in BASIS
    )
    return s, l, l_u / s_u, (l_uu * s_u - s_uu * l_u) / s_u**3


def _laid(
    reference: ReferencePath,
    state: FrenetState,
    shape: Shape,
    begin: float,
    length: float,
    total: float,
    settings: PathSettings,
) -> tuple[Path, FloatArray] | None:
    """Lay one spline on the road and extend it straight on.

    Returns:
        The path and the distances at which the change begins and ends; None outside
        the road's Frenet frame.
    """
    along, l, slope, bend = shape
    driven = _grid(max(total, begin + length + settings.spacing), settings.spacing)
    at = np.clip(driven - begin, 0.0, length)
    inside = (driven >= begin) & (driven <= begin + length)
    offsets = np.interp(at, along, l)
    slopes = np.where(inside, np.interp(at, along, slope), 0.0)
    bends = np.where(inside, np.interp(at, along, bend), 0.0)
    if begin > 0.0:
        _settle_first(state, begin, driven, offsets, slopes, bends)
    path = _in_plane(reference, state.s + driven, offsets, slopes, bends)
    if path is None:
        return None
    return path, np.interp([begin, begin + length], driven, path.distance)


def _settle_first(
    state: FrenetState,
    begin: float,
    driven: FloatArray,
    offsets: FloatArray,
    slopes: FloatArray,
    bends: FloatArray,
) -> None:
    """Take slope and bend out of the present motion before the change begins."""
    start = (state.l, state.l_prime, state.l_second)
    c = polynomials.quintic(start, (state.l, 0.0, 0.0), begin)
    before = driven < begin
    for order, column in enumerate((offsets, slopes, bends)):
        column[before] = polynomials.evaluate(c, driven[before], order)


def _grid(total: float, spacing: float) -> FloatArray:
    """Distances 0, spacing, ... at least up to `total`."""
    return spacing * np.arange(math.ceil(total / spacing) + 1, dtype=np.float64)


def _in_plane(
    reference: ReferencePath,
    s: FloatArray,
    l: FloatArray,
    slope: FloatArray,
    bend: FloatArray,
) -> Path | None:
    """Move a line from the road's frame to the plane; None outside the frame."""
    one, none = np.ones_like(s), np.zeros_like(s)
    # driven at one metre of road a second, slope and bend are rates
    states = FrenetStates(s, one, none, l, slope, bend, slope, bend)
    try:
        plane = frenet_to_cartesian(reference, states)
    except OutsidePathDomainError:
        return None
    stretch = np.hypot(1.0 - reference.at(s).curvature * l, slope)
    steps = 0.5 * (stretch[1:] + stretch[:-1]) * np.diff(s)
    distance = np.concatenate([[0.0], np.cumsum(steps)])
    return Path(distance, plane.x, plane.y, plane.heading, plane.curvature, s, l)
