"""Comparison of curve models for a lane change; [Thesis] 6.3.4."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from experiments.thesis.lane_change.curve_models import (
    cubic_bezier,
    half_cosine,
    lane_change_b_spline,
    quintic_bezier,
    sine_ramp,
)
from experiments.thesis.lane_change.dubins import shortest_dubins
from experiments.thesis.lane_change.path_costs import (
    PathCostWeights,
    bending_cost,
    printed_cost,
    turning_cost,
)
from experiments.thesis.lane_change.plane_curve import Curve, sample_curve

STEADY = 1e-9  # a smaller change of curvature is rounding [1/m]


@dataclass(frozen=True, slots=True)
class LaneShift:
    """One lane change, and the free parameters of the models."""

    length: float = 60.0  # along the road [m]
    shift: float = 3.5  # across it [m]
    spline_c: float = 12.0  # from A to C [m]
    bezier_handle: float = 0.5  # end edges of the cubic over the length [-]
    dubins_radius: float = 100.0  # [m]; Fig. 6.2 shows no sharp turns
    spacing: float = 0.1  # of the points that are measured [m]


@dataclass(frozen=True, slots=True)
class CurveMeasures:
    """Demands of a curve on the vehicle."""

    length: float  # [m]
    jumps: int  # of the curvature between its ends
    largest_jump: float  # between its ends [1/m]
    start_curvature: float  # absolute, where the lane before it is straight [1/m]
    end_curvature: float  # absolute, where the lane after it is straight [1/m]
    peak_curvature: float  # [1/m]
    peak_rate: float  # of the curvature over the distance; inf with a jump [1/m²]
    cost_printed: float  # eq. 6.11 without ds
    cost_turning: float  # eq. 6.11 with ds
    cost: float  # eq. 6.11 corrected


@dataclass(frozen=True, slots=True)
class CurveClaim:
    """A statement of [Thesis] 6.3.4 and its evidence."""

    text: str
    holds: bool
    evidence: str


@dataclass(frozen=True, slots=True)
class CurveComparison:
    """Measures, claims, and the distance between the curves."""

    measures: Mapping[str, CurveMeasures]
    claims: tuple[CurveClaim, ...]
    apart: float  # largest distance across the road between two of the curves [m]


DUBINS, COSINE, RAMP = "Dubins", "half cosine", "sine ramp"
CUBIC, QUINTIC, SPLINE = "Bézier, cubic", "Bézier, quintic", "B-spline"


def lane_change_curves(task: LaneShift) -> dict[str, Curve]:
    """Build the same lane change with every model."""
    length, shift = task.length, task.shift
    end = (length, shift, 0.0)
    dubins = shortest_dubins((0.0, 0.0, 0.0), end, task.dubins_radius)
    models = {
        DUBINS: dubins.pieces(),
        COSINE: half_cosine(length, shift),
        RAMP: sine_ramp(length, shift),
        CUBIC: cubic_bezier(length, shift, task.bezier_handle),
        QUINTIC: quintic_bezier(length, shift),
        SPLINE: lane_change_b_spline(length, shift, task.spline_c),
    }
    return {name: sample_curve(model, task.spacing) for name, model in models.items()}


def measure(curve: Curve, weights: PathCostWeights) -> CurveMeasures:
    """Measure one curve between two straight lanes."""
    jumps = np.abs(curve.jumps)
    found = jumps[jumps > STEADY]
    rate = float(np.abs(curve.curvature_rate).max()) if found.size == 0 else np.inf
    return CurveMeasures(
        curve.length,
        found.size,
        float(found.max()) if found.size else 0.0,
        abs(float(curve.curvature[0])),
        abs(float(curve.curvature[-1])),
        float(np.abs(curve.curvature).max()),
        rate,
        printed_cost(curve.x, curve.y, weights),
        turning_cost(curve.x, curve.y, weights),
        bending_cost(curve.distance, curve.curvature, weights),
    )


def compare_curves(
    task: LaneShift | None = None, weights: PathCostWeights | None = None
) -> CurveComparison:
    """Measure all models on one lane change and check the statements of 6.3.4."""
    task = task or LaneShift()
    weights = weights or PathCostWeights()
    curves = lane_change_curves(task)
    measures = {name: measure(curve, weights) for name, curve in curves.items()}
    apart = _spread(curves, task.length)
    claims = (
        _dubins_jumps(measures[DUBINS]),
        _continuous(measures),
        _ends_bent(measures, (COSINE, CUBIC), "half cosine and four-point Bézier"),
        _ends_bent(measures, (COSINE, RAMP, CUBIC, QUINTIC), "all sine and Bézier"),
        _spline_straightens(measures[SPLINE]),
        _spline_is_best(measures),
    )
    return CurveComparison(measures, claims, apart)


def _spread(curves: Mapping[str, Curve], length: float) -> float:
    """Return the largest difference in y at one x [m]."""
    x = np.linspace(0.0, length, 601)
    y = np.array([np.interp(x, c.x, c.y) for c in curves.values()])
    return float((y.max(axis=0) - y.min(axis=0)).max())


def _dubins_jumps(dubins: CurveMeasures) -> CurveClaim:
    """Check Fig. 6.3 on the Dubins curve."""
    return CurveClaim(
        "the curvature of the Dubins curve jumps twice",
        dubins.jumps == 2,
        f"{dubins.jumps} inside by {dubins.largest_jump:.4f} 1/m, and at both ends "
        f"by {dubins.start_curvature:.4f} 1/m",
    )


def _continuous(measures: Mapping[str, CurveMeasures]) -> CurveClaim:
    """Check that all others are continuous between their ends."""
    others = [name for name in measures if name != DUBINS]
    jumps = {name: measures[name].jumps for name in others}
    return CurveClaim(
        "sine, Bézier and B-spline have continuous curvature",
        not any(jumps.values()),
        f"{sum(jumps.values())} jumps between the ends of {len(others)} curves",
    )


def _ends_bent(
    measures: Mapping[str, CurveMeasures], names: tuple[str, ...], which: str
) -> CurveClaim:
    """Check that curves end with a curvature."""
    straight = [name for name in names if measures[name].end_curvature <= STEADY]
    found = ", ".join(f"{name} {measures[name].end_curvature:.4f}" for name in names)
    return CurveClaim(
        f"{which} curves end with a curvature that is not 0",
        not straight,
        f"{found} 1/m",
    )


def _spline_straightens(spline: CurveMeasures) -> CurveClaim:
    """Check that the B-spline gives the steering wheel back."""
    return CurveClaim(
        "the B-spline has neither jumps nor curvature at its end",
        spline.jumps == 0 and spline.end_curvature <= STEADY,
        f"{spline.jumps} jumps, {spline.end_curvature:.1e} 1/m",
    )


def _spline_is_best(measures: Mapping[str, CurveMeasures]) -> CurveClaim:
    """Check that no other smooth curve is bent less."""
    smooth = {
        name: m.peak_curvature
        for name, m in measures.items()
        if m.jumps == 0 and max(m.start_curvature, m.end_curvature) <= STEADY
    }
    found = ", ".join(f"{name} {peak:.4f}" for name, peak in smooth.items())
    return CurveClaim(
        "of the curves without either fault the B-spline bends least",
        bool(smooth) and min(smooth, key=lambda name: smooth[name]) == SPLINE,
        f"peaks: {found} 1/m",
    )
