"""Cruising with obstacles of different size; [Thesis] ch. 4.

The proposed and the conventional method [100] are one planner with different cost
sets, each in its closed-loop form and in the printed one (*thesis mode*). In closed
loop only the proposed one leads long bodies by their front axle.
"""

from dataclasses import replace

from planner.cruise.planner import CruisePlanner
from planner.cruise.settings import (
    CruiseSettings,
    LateralMotion,
    Normalisation,
    SafetyTerm,
    Scales,
    Weights,
    thesis_settings,
)

__all__ = [
    "CruisePlanner",
    "CruiseSettings",
    "LateralMotion",
    "Normalisation",
    "SafetyTerm",
    "Scales",
    "Weights",
    "conventional",
    "proposed",
    "thesis_conventional",
    "thesis_proposed",
]


ONLY_PRINTED = (0.0,) * 6  # the terms that [Thesis] eq. 4.14 does not have


def proposed(settings: CruiseSettings | None = None) -> CruisePlanner:
    """Make the closed-loop planner with edge clearance and offset in its cost."""
    return CruisePlanner(settings or CruiseSettings())


def conventional(settings: CruiseSettings | None = None) -> CruisePlanner:
    """Make the closed-loop planner with the cost set of the conventional method."""
    base = settings or CruiseSettings()
    return CruisePlanner(
        replace(
            base,
            edge_offsets=False,  # the convolution needs offsets one step apart
            lead_long_bodies=False,  # four of nine lorries that arrive would not
            safety_term=SafetyTerm.BINARY_CONVOLUTION,
            convolution_sigma=2.0,
            weights=replace(base.weights, jerk=0.4, safety=0.3, offset=0.0),
        )
    )


def thesis_proposed() -> CruisePlanner:
    """Make the proposed method as printed, Table 4.1."""
    weights = Weights(0.4, 0.3, 0.3, *ONLY_PRINTED)
    return CruisePlanner(thesis_settings(SafetyTerm.SIZE_CONVOLUTION, weights))


def thesis_conventional() -> CruisePlanner:
    """Make the conventional method [100] in the set-up of Table 4.1."""
    weights = Weights(0.4, 0.3, 0.0, *ONLY_PRINTED)
    return CruisePlanner(thesis_settings(SafetyTerm.BINARY_CONVOLUTION, weights))
