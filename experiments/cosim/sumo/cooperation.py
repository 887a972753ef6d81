"""Drivers who open a gap for an ego that indicates a lane change.

SUMO's drivers help those who ask for it inside SUMO, which an ego that is moved from
outside does not. Whoever drives behind it in the lane that it indicates therefore opens
a gap to it with SUMO's gap control, if it is a driver who does that: drawn once for
each driver, from the seed and its id alone.
"""

from dataclasses import dataclass
from zlib import crc32

import numpy as np

from experiments.cosim.sumo.libsumo_api import Libsumo
from planner.interface import Indicator

REACH = 60.0  # bumper to bumper; drivers farther behind are not asked [m]
STREAM = b"cooperates"
TIME_GAP, SPACE_GAP = 1.5, 6.0  # to the ego, that is opened [s, m]
LASTS = 4.0  # then it is decided anew [s]
RATE = 0.8  # of opening, as SUMO's changeRate
DECELERATION = 2.0  # no harder than this [m/s²]
INNER_BEHIND, OUTER_BEHIND = 0, 1  # mode of SUMO's getNeighbors: lane index up, down


@dataclass(frozen=True, slots=True)
class CooperationSettings:
    """Who cooperates."""

    seed: int
    probability: float  # of a driver


class Cooperation:
    """Lets the driver behind an indicating ego open a gap.

    Args:
        sumo: Running.
        settings: Who does so.
        ego: Id of the ego.
        hidden: Vehicles that are nobody's.
        left_hand: Whether traffic keeps to the left: lanes then count from there.
    """

    def __init__(
        self,
        sumo: Libsumo,
        settings: CooperationSettings,
        ego: str,
        hidden: frozenset[str],
        *,
        left_hand: bool = False,
    ) -> None:
        self._sumo = sumo
        self._settings = settings
        self._ego = ego
        self._hidden = hidden
        self._inner = Indicator.RIGHT if left_hand else Indicator.LEFT
        self._opening: tuple[str, float] | None = None  # who, until when [s]

    def update(self, time: float, indicator: Indicator) -> None:
        """Ask the driver behind; called before each step.

        Args:
            time: [s].
            indicator: Of the ego.
        """
        asked = self._behind(indicator)
        if self._opening is not None:
            who, until = self._opening
            if who == asked and time < until:
                return
            self._opening = None
            if who != asked and who in self._sumo.vehicle.getIDList():
                self._sumo.vehicle.deactivateGapControl(who)
        if asked is not None and self.cooperates(asked):
            self._sumo.vehicle.openGap(
                asked, TIME_GAP, SPACE_GAP, LASTS, RATE, DECELERATION, self._ego
            )
            self._opening = asked, time + LASTS

    def cooperates(self, name: str) -> bool:
        """Check whether a driver is one who opens gaps."""
        key = [self._settings.seed, crc32(name.encode()), crc32(STREAM)]
        drawn = np.random.default_rng(key).random()
        return bool(drawn < self._settings.probability)

    def _behind(self, indicator: Indicator) -> str | None:
        """Return who is the first behind in the lane beside; None without any."""
        if indicator is Indicator.NONE:
            return None
        mode = INNER_BEHIND if indicator is self._inner else OUTER_BEHIND
        found = self._sumo.vehicle.getNeighbors(self._ego, mode)
        near = [(gap, name) for name, gap in found if name not in self._hidden]
        gap, name = min(near, default=(REACH + 1.0, ""))
        return name if gap <= REACH else None
