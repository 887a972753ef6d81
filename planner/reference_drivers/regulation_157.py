"""The formula of the regulation itself; [R157] 5.2.5.2.

A collision must be avoided if, when the other vehicle intrudes the lane,
TTC > v_rel / (2 · 6 m/s²) + 0.35 s. The driver of this model brakes with 6 m/s² after
0.35 s as soon as the intruder is inside and the bound is reached. The regulation takes
the intrusion for 0.3 m between the outside of a front wheel's tyre and the inner edge
of the marking; [Mattas2022] for a lateral gap of 0.5 m, which is the same for vehicles
1.9 m wide in the middle of lanes 3.5 m wide.
"""

import math
from dataclasses import dataclass, field

import numpy as np

from planner.reference_drivers.driver import DriverState, Judgement
from planner.reference_drivers.reaction import Reaction
from planner.reference_drivers.situation import ConflictState
from planner.states import BoolArray, FloatArray

AVOIDING_DECELERATION = 6.0  # [m/s²]
REACTION_TIME = 0.35  # [s]
WHEEL_INTRUSION = 0.3  # of the tyre past the marking [m]
INTRUSION_GAP = 0.5  # lateral gap of [Mattas2022] [m]
SAMPLING_MARGIN = (
    0.1  # one step of [Mattas2022]: the bound is met before, not after [s]
)


def gap_at_wheel_intrusion(
    lane_width: float, ego_width: float, tyre_inset: float = 0.0
) -> float:
    """Return the lateral gap at which a wheel is 0.3 m inside the ego's lane.

    Args:
        lane_width: Between the inner edges of the markings [m].
        ego_width: Of the ego, which drives in the middle [m].
        tyre_inset: Of the tyre's outside behind the side of the body [m].
    """
    return 0.5 * (lane_width - ego_width) - WHEEL_INTRUSION - tyre_inset


@dataclass(frozen=True, slots=True)
class Regulation157:
    """Parameters of 5.2.5.2.

    `intrusion_gap` is the lateral gap that counts as an intrusion; take it from
    `gap_at_wheel_intrusion` for other vehicles and lanes.
    """

    intrusion_gap: float = INTRUSION_GAP  # [m]
    deceleration: float = AVOIDING_DECELERATION  # [m/s²]
    margin: float = SAMPLING_MARGIN  # added to the bound [s]
    reaction: Reaction = field(
        default_factory=lambda: Reaction(REACTION_TIME, jerk=math.inf)
    )

    def following_gap(self, speed: FloatArray) -> FloatArray:
        """Return the gap [m] of [R157] 5.2.3.3 at `speed` [m/s], at least 2 m.

        The table's time gap grows from 1.1 s at 10 km/h to 1.6 s at 60 km/h; above,
        it is continued linearly.
        """
        kmh = np.maximum(speed * 3.6, 10.0)
        return np.maximum(speed * (1.0 + kmh / 100.0), 2.0)

    def least_time_to_collision(self, closing_speed: FloatArray) -> FloatArray:
        """Return the bound on the time to collision [s] at a closing speed [m/s]."""
        return closing_speed / (2.0 * self.deceleration) + REACTION_TIME

    def must_react(self, situation: ConflictState) -> BoolArray:
        """Return whether the intruder is inside and the bound is reached, (n,)."""
        bound = self.least_time_to_collision(situation.closing_speed) + self.margin
        inside = situation.lateral_gap <= self.intrusion_gap
        late = situation.time_to_collision <= bound
        return np.asarray(inside & late & situation.is_follower)

    def judge(self, situation: ConflictState, state: DriverState) -> Judgement:
        """Return the avoiding deceleration as long as the bound is reached."""
        danger = self.must_react(situation)
        wish = np.where(danger, self.deceleration, 0.0)
        return Judgement(wish, state.noticed | danger, state.dismissed)
