"""How much a path may bend at each place, given how fast the ego will still be there.

A path is chosen before the speed along it. Without this bound it may turn, close ahead,
more than a fast ego can follow, and no speed is left to plan.
"""

from dataclasses import dataclass

import numpy as np

from planner.states import FloatArray

STRAIGHTENING = 1.0  # time that the present curvature is given to fall [s]
ALLOWANCE = 0.002  # over the present curvature, for what linearising leaves [1/m]
SLOWEST = 0.5  # below this speed the lateral acceleration bounds nothing [m/s]
SHORTEST = 0.5  # way in which a curvature fades [m]


@dataclass(frozen=True, slots=True)
class Turning:
    """What a manoeuvre may take: the path bends no more than this leaves room for."""

    lateral_acceleration: float  # [m/s²]
    braking: float  # with which the speed can fall until there [m/s²]


@dataclass(frozen=True, slots=True)
class Momentum:
    """What the ego brings along."""

    speed: float  # [m/s]
    curvature: float  # of its path at present [1/m]


def curvature_bounds(
    ahead: FloatArray, momentum: Momentum, turning: Turning, sharpest: float
) -> FloatArray:
    """Bound the curvature at each place such that braking leaves it drivable.

    v² |κ| <= the lateral acceleration, with the speed v² = v0² - 2 b d that braking
    leaves after d metres. The curvature that the ego has is given time to fall.

    Args:
        ahead: Distances d from the ego, (n,) [m].
        momentum: Of the ego.
        turning: What may be taken.
        sharpest: Nowhere exceeded [1/m].

    Returns:
        (n,) [1/m].
    """
    speed = momentum.speed
    left = speed**2 - 2.0 * turning.braking * ahead
    bound = turning.lateral_acceleration / np.maximum(left, SLOWEST**2)
    fading = np.maximum(1.0 - ahead / max(STRAIGHTENING * speed, SHORTEST), 0.0)
    present = (abs(momentum.curvature) + ALLOWANCE) * np.sqrt(fading)
    bounded: FloatArray = np.minimum(np.maximum(bound, present), sharpest)
    return bounded
