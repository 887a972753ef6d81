"""Cost of a plane curve; [Thesis] eq. 6.11, corrected and as printed."""

from dataclasses import dataclass

import numpy as np

from planner.states import FloatArray


@dataclass(frozen=True, slots=True)
class PathCostWeights:
    """Weights of smoothness and length; not given in [Thesis]."""

    bending: float = 4000.0  # of the integral of squared curvature [m]
    turning: float = 1.0  # of the integral of absolute curvature [1/rad]
    length: float = 0.02  # [1/m]


def bending_cost(
    distance: FloatArray, curvature: FloatArray, weights: PathCostWeights
) -> float:
    """Return w1 ∫k² ds + w2 L, trapezoids; the corrected eq. 6.11."""
    square = curvature * curvature
    bent = 0.5 * float((square[1:] + square[:-1]) @ np.diff(distance))
    return weights.bending * bent + weights.length * float(distance[-1] - distance[0])


def turning_cost(x: FloatArray, y: FloatArray, weights: PathCostWeights) -> float:
    """Return w1 Σ|Δheading|/ds · ds + w2 L; eq. 6.11 made independent of n.

    Headings are those of the chords between the points. Points that repeat the one
    before are left out.
    """
    dx, dy = np.diff(x), np.diff(y)
    steps = np.hypot(dx, dy)
    moved = steps > 0.0
    heading = np.unwrap(np.arctan2(dy[moved], dx[moved]))
    turned = float(np.abs(np.diff(heading)).sum())
    return weights.turning * turned + weights.length * float(steps.sum())


def printed_cost(x: FloatArray, y: FloatArray, weights: PathCostWeights) -> float:
    """Return w1 Σ|Δheading / ds| + w2 L; eq. 6.11 without ds: it grows with n.

    Only the zero denominator is repaired.
    """
    dx, dy = np.diff(x), np.diff(y)
    steps = np.hypot(dx, dy)
    moved = steps > 0.0
    heading = np.unwrap(np.arctan2(dy[moved], dx[moved]))
    bent = float(np.abs(np.diff(heading) / steps[moved][:-1]).sum())
    return weights.turning * bent + weights.length * float(steps.sum())
