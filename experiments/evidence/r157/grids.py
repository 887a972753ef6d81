"""The grids of [Mattas2022], full and thinned."""

from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from experiments.cosim.conflict_world import (
    ScriptedMotion,
    leader_motion,
    other_motion,
)
from experiments.cosim.conflicts import (
    Conflicts,
    LateralProfile,
    Sizes,
    braking_leader,
    cut_in,
    cut_out,
)
from experiments.errors import ConfigError
from planner.reference_drivers import CarefulHuman, ReferenceDriver
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


class ConflictKind(StrEnum):
    """The three conflicts of the regulation."""

    CUT_IN = "cut_in"
    CUT_OUT = "cut_out"
    BRAKING = "braking"


@dataclass(frozen=True, slots=True, eq=False)
class ConflictPanel:
    """A grid of conflicts of one kind; cells are (n_x, n_y).

    Axes: dx0 [m] and Vy [m/s] of a cut-in; dx0_f [m] and Vy [m/s] of a cut-out; speed
    [km/h] and the leader's deceleration [g] of a braking leader.
    """

    kind: ConflictKind
    ego_kmh: int  # 0 where the speed is an axis
    other_kmh: int  # 0 where it is the ego's
    x: FloatArray
    y: FloatArray

    @property
    def shape(self) -> tuple[int, int]:
        """Numbers of values of both axes."""
        return self.x.size, self.y.size

    @property
    def cells(self) -> int:
        """Number of conflicts."""
        return self.x.size * self.y.size

    @property
    def key(self) -> str:
        """Name of the panel among those of its kind."""
        if self.kind is ConflictKind.CUT_IN:
            return f"{self.ego_kmh}_{self.other_kmh}"
        return f"{self.ego_kmh}" if self.kind is ConflictKind.CUT_OUT else "all"

    @property
    def title(self) -> str:
        """Speeds of the panel in words."""
        if self.kind is ConflictKind.CUT_IN:
            return f"Ve {self.ego_kmh}, Vo {self.other_kmh} km/h"
        if self.kind is ConflictKind.CUT_OUT:
            return f"Ve {self.ego_kmh} km/h"
        return "braking leader"

    def grid(self) -> tuple[FloatArray, FloatArray]:
        """Return both parameters of the flattened cells, (n_cells,) each."""
        x, y = np.meshgrid(self.x, self.y, indexing="ij")
        return x.ravel(), y.ravel()

    def ego_speed(self) -> FloatArray:
        """Return the ego's speed in the flattened cells, (n_cells,) [m/s]."""
        if self.kind is ConflictKind.BRAKING:
            return self.grid()[0] * KMH
        return np.full(self.cells, self.ego_kmh * KMH)

    def conflicts(
        self,
        driver: ReferenceDriver | None = None,
        sizes: Sizes | None = None,
        profile: LateralProfile = LateralProfile.LINEAR,
    ) -> Conflicts:
        """Build the conflicts, in the order of the flattened cells.

        Args:
            driver: Whose distance to the leader is kept; the careful human's if None.
            sizes: Of vehicles and lane.
            profile: Of the lateral motion of a cut-in.
        """
        x, y = self.grid()
        speed = self.ego_speed()
        gap = (driver or CarefulHuman()).following_gap(speed)
        if self.kind is ConflictKind.CUT_IN:
            ego, other = self.ego_kmh * KMH, self.other_kmh * KMH
            return cut_in(ego, other, x, y, sizes, profile)
        if self.kind is ConflictKind.CUT_OUT:
            return cut_out(self.ego_kmh * KMH, float(gap[0]), x, y, sizes)
        return braking_leader(speed, y * GRAVITY, gap, sizes)

    def motions(
        self, conflicts: Conflicts, row: int, side: float
    ) -> tuple[ScriptedMotion, ...]:
        """Return the vehicles of one conflict; the leader of a cut-out is the second.

        Args:
            conflicts: Of this panel.
            row: Index of the flattened cell.
            side: From or to which a vehicle changes its lane: 1 left, -1 right.
        """
        other = other_motion(conflicts, row, side)
        if self.kind is not ConflictKind.CUT_OUT:
            return (other,)
        dx0, lateral = (float(axis[row]) for axis in self.grid())
        gap = float(conflicts.gap[row]) - conflicts.sizes.other_length - dx0
        return other, leader_motion(conflicts, row, gap, lateral, side)


def cut_in_panel(
    ego_kmh: int, other_kmh: int, density: Density = Density.FULL
) -> ConflictPanel:
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
    x, y = gaps[::stride], lateral[::stride]
    return ConflictPanel(ConflictKind.CUT_IN, ego_kmh, other_kmh, x, y)


def cut_in_panels(density: Density = Density.FULL) -> tuple[ConflictPanel, ...]:
    """Return the 15 panels of low and the 13 of high speed."""
    low = [(ve, vo) for ve in LOW_EGO_KMH for vo in range(10, ve, 10)]
    high = [(ve, vo) for ve in HIGH_EGO_KMH for vo in range(10, ve, 30)]
    return tuple(cut_in_panel(ve, vo, density) for ve, vo in low + high)


def cut_out_panel(ego_kmh: int, density: Density = Density.FULL) -> ConflictPanel:
    """Return the cut-outs at one speed: dx0_f 2 ... 147 m, Vy 0.1 ... 2.9 m/s.

    Raises:
        ConfigError: If the ego does not move.
    """
    if ego_kmh <= 0:
        raise ConfigError(f"a cut-out needs Ve > 0, got Ve {ego_kmh} km/h")
    stride = density.stride
    gaps = np.arange(2.0, 148.0, 5.0)[::stride]
    lateral = 0.1 + 0.2 * np.arange(15, dtype=np.float64)[::stride]
    return ConflictPanel(ConflictKind.CUT_OUT, ego_kmh, 0, gaps, lateral)


def braking_panel(density: Density = Density.FULL) -> ConflictPanel:
    """Return the braking leaders: 12 ... 128 km/h by 4, 0.05 ... 0.95 g by 0.05 g."""
    stride = density.stride
    speeds = np.arange(12.0, 129.0, 4.0)[::stride]
    braking = 0.05 * np.arange(1, 20, dtype=np.float64)[::stride]
    return ConflictPanel(ConflictKind.BRAKING, 0, 0, speeds, braking)


def panels_of(kind: ConflictKind, density: Density) -> tuple[ConflictPanel, ...]:
    """Return all panels of a kind."""
    if kind is ConflictKind.CUT_IN:
        return cut_in_panels(density)
    if kind is ConflictKind.CUT_OUT:
        return tuple(cut_out_panel(kmh, density) for kmh in CUT_OUT_KMH)
    return (braking_panel(density),)
