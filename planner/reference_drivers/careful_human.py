"""The competent and careful human driver; [R157], Annex 4, Appendix 3.

The driver perceives the risk of a cut-in, judges the time to collision once, at that
moment, and brakes fully or not at all. The published implementations differ in what
perceiving the risk means, so it is a setting:

* *overlap* ([Mattas2022]): the moment at which the other vehicle's side reaches the
  ego's; wandering zone and risk perception time lie before it.
* *drift* (as in esmini's controller): the other vehicle has left its wandering zone by
  a further 0.72 m (0.4 s of risk perception at 1.8 m/s); with the regulation's lateral
  clearance of 1.6 m this comes earlier than the overlap.
* *closing*: for a leader that brakes, or a standing vehicle that a cut-out uncovers:
  the gap to what is seen in the own lane shrinks. Used with an infinite critical time.
* *emergency braking* may be added to either (as in esmini): a system that brakes with
  0.85 g, built up within 0.6 s, once the narrower vehicle's whole width lies in the
  other's and the time to collision is below 1.5 s.
"""

from dataclasses import dataclass, field
from enum import StrEnum

import numpy as np

from planner.reference_drivers.driver import DriverState, Judgement
from planner.reference_drivers.reaction import FULL_BRAKING, Reaction
from planner.reference_drivers.situation import ConflictState
from planner.states import BoolArray, FloatArray

WANDERING_ZONE = 0.375  # half width of the drift within a lane [m]
PERCEPTION_DISTANCE = 0.72  # 0.4 s of risk perception at 1.8 m/s lateral [m]
CRITICAL_TIME = 2.0  # time to collision at which a cut-in becomes a danger [s]
FOLLOWING_TIME = 2.0  # to the leader [s]
FOOT_OFF = 0.4  # deceleration without the accelerator [m/s²]
EMERGENCY_TIME = 1.5  # time to collision of the emergency braking system [s]


class Trigger(StrEnum):
    """What the driver takes for the beginning of a danger."""

    OVERLAP = "overlap"
    DRIFT = "drift"
    CLOSING = "closing"


@dataclass(frozen=True, slots=True)
class CarefulHuman:
    """Parameters of the competent and careful human driver."""

    trigger: Trigger = Trigger.OVERLAP
    lateral_clearance: float = 1.6  # before the manoeuvre; only for the drift [m]
    critical_time: float = CRITICAL_TIME  # [s]
    emergency_braking: bool = False
    reaction: Reaction = field(default_factory=lambda: Reaction(coasting=FOOT_OFF))

    def following_gap(self, speed: FloatArray) -> FloatArray:
        """Return the gap [m] that the driver keeps from a leader at `speed` [m/s]."""
        return FOLLOWING_TIME * speed

    def perceives_risk(self, situation: ConflictState) -> BoolArray:
        """Return whether the other vehicle is seen to become a danger, (n,)."""
        if self.trigger is Trigger.OVERLAP:
            return np.asarray(situation.lateral_gap <= 0.0)
        if self.trigger is Trigger.CLOSING:
            closing = np.isfinite(situation.gap) & (situation.closing_speed > 0.0)
            return np.asarray(closing & (situation.lateral_gap < 0.0))
        drift = self.lateral_clearance - situation.lateral_gap
        return np.asarray(drift >= WANDERING_ZONE + PERCEPTION_DISTANCE)

    def judge(self, situation: ConflictState, state: DriverState) -> Judgement:
        """Return full braking from the moment of a dangerous cut-in on.

        A cut-in that is not critical when it is perceived is dismissed for good; so
        is one behind the ego's centre.
        """
        undecided = ~(state.noticed | state.dismissed)
        first = self.perceives_risk(situation) & undecided
        critical = situation.time_to_collision <= self.critical_time
        critical &= situation.is_follower
        noticed = state.noticed | (first & critical)
        dismissed = state.dismissed | (first & ~critical)
        wish = np.where(noticed, FULL_BRAKING, 0.0)
        return Judgement(wish, noticed, dismissed, self._emergency(situation))

    def _emergency(self, situation: ConflictState) -> BoolArray:
        """Return whether the emergency braking system acts, (n,)."""
        if not self.emergency_braking:
            return np.zeros(situation.gap.shape, dtype=np.bool_)
        aligned = situation.lateral_gap <= -situation.narrower_width
        soon = situation.time_to_collision < EMERGENCY_TIME
        return np.asarray(soon & aligned & situation.is_follower)
