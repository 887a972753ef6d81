"""The grids of [Mattas2022], full and thinned."""

from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from experiments.errors import ConfigError
from experiments.r157.conflicts import Conflicts, Sizes, braking_leader, cut_in, cut_out
from planner.reference_drivers.situation import GRAVITY
from planner.states import FloatArray

KMH = 1.0 / 3.6  # [m/s]
LOW_EGO_KMH = tuple(range(10, 61, 10))
HIGH_EGO_KMH = (70, 90, 110, 130)
CUT_OUT_KMH = tuple(range(10, 131, 10))
LATERAL_STEP = 0.1  # of the full grid [m/s]
LATERAL_SPEEDS = 18  # 0 ... 1.7 m/s


class Density(StrEnum):
    """How many cells of a grid are taken."""

    FULL = "full"
    THINNED = "thinned"  # every second value of both axes

    @property
    def stride(self) -> int:
        """Step between the values that are taken."""
        return 1 if self is Density.FULL else 2


@dataclass(frozen=True, slots=True, eq=False)
class CutInPanel:
    """All cut-ins at one pair of speeds; cells are (n_gaps, n_lateral_speeds)."""

    ego_kmh: int
    other_kmh: int
    gaps: FloatArray  # dx0 [m]
    lateral_speeds: FloatArray  # Vy [m/s]

    @property
    def shape(self) -> tuple[int, int]:
        """Numbers of gaps and of lateral speeds."""
        return self.gaps.size, self.lateral_speeds.size

    def conflicts(self, sizes: Sizes | None = None) -> Conflicts:
        """Build the conflicts, in the order of the flattened cells."""
        gap, lateral = np.meshgrid(self.gaps, self.lateral_speeds, indexing="ij")
        return cut_in(
            self.ego_kmh * KMH,
            self.other_kmh * KMH,
            gap.ravel(),
            lateral.ravel(),
            sizes,
        )


def cut_in_panel(
    ego_kmh: int, other_kmh: int, density: Density = Density.FULL
) -> CutInPanel:
    """Return the panel of one pair of speeds.

    Raises:
        ConfigError: If the other vehicle is not slower than the ego, or stands.
    """
    if not 0 < other_kmh < ego_kmh:
        raise ConfigError(
            f"a cut-in needs 0 < Vo < Ve, got Ve {ego_kmh} and Vo {other_kmh} km/h"
        )
    low = ego_kmh <= max(LOW_EGO_KMH)
    gaps = np.arange(1.0, 60.0) if low else np.arange(1.0, 120.0, 2.0)
    lateral = LATERAL_STEP * np.arange(LATERAL_SPEEDS, dtype=np.float64)
    stride = density.stride
    return CutInPanel(ego_kmh, other_kmh, gaps[::stride], lateral[::stride])


def cut_in_panels(density: Density = Density.FULL) -> tuple[CutInPanel, ...]:
    """Return the 15 panels of low and the 13 of high speed."""
    low = [(ve, vo) for ve in LOW_EGO_KMH for vo in range(10, ve, 10)]
    high = [(ve, vo) for ve in HIGH_EGO_KMH for vo in range(10, ve, 30)]
    return tuple(cut_in_panel(ve, vo, density) for ve, vo in low + high)


def cut_out_conflicts(
    ego_kmh: int, following_gap: float, density: Density = Density.FULL
) -> Conflicts:
    """Build the cut-outs at one speed: dx0_f 2 ... 147 m, Vy 0.1 ... 2.9 m/s.

    Args:
        ego_kmh: Of ego and leader.
        following_gap: Between them; each driver model keeps its own [m].
        density: Of the grid.
    """
    stride = density.stride
    gaps = np.arange(2.0, 148.0, 5.0)[::stride]
    lateral = 0.1 + 0.2 * np.arange(15)[::stride]
    gap, across = np.meshgrid(gaps, lateral, indexing="ij")
    return cut_out(ego_kmh * KMH, following_gap, gap.ravel(), across.ravel())


def braking_speeds_and_decelerations(
    density: Density = Density.FULL,
) -> tuple[FloatArray, FloatArray]:
    """Return speeds [m/s] and decelerations [m/s²] of the braking leaders.

    Speeds are 12 ... 128 km/h in steps of 4, decelerations 0.05 ... 0.95 g in steps
    of 0.05 g; both flattened.
    """
    stride = density.stride
    speeds = np.arange(12.0, 129.0, 4.0)[::stride] * KMH
    braking = 0.05 * np.arange(1, 20)[::stride] * GRAVITY
    v, b = np.meshgrid(speeds, braking, indexing="ij")
    return v.ravel(), b.ravel()


def braking_conflicts(
    following_gap: FloatArray, density: Density = Density.FULL
) -> Conflicts:
    """Build the braking leaders; `following_gap` [m] has one value a conflict."""
    speed, deceleration = braking_speeds_and_decelerations(density)
    return braking_leader(speed, deceleration, following_gap)
