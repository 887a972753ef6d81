"""Responsibility Sensitive Safety; the safe distances of [Shalev2017].

The parameters are those of [Mattas2022]: both vehicles brake with 6 m/s², the rear one
accelerates with 3 m/s² during its response time of 0.75 s.
"""

from dataclasses import dataclass, field

import numpy as np

from planner.reference_drivers.driver import DriverState, Judgement
from planner.reference_drivers.reaction import FULL_BRAKING, Reaction
from planner.reference_drivers.situation import ConflictState
from planner.states import BoolArray, FloatArray


@dataclass(frozen=True, slots=True)
class ResponsibilitySensitiveSafety:
    """Parameters of the two safe distances."""

    response_time: float = 0.75  # rho [s]
    acceleration: float = 3.0  # of the rear vehicle while it responds [m/s²]
    rear_braking: float = 6.0  # least deceleration of the rear vehicle [m/s²]
    front_braking: float = 6.0  # greatest deceleration of the front vehicle [m/s²]
    lateral_margin: float = 0.3  # mu [m]
    lateral_acceleration: float = 1.0  # towards each other, and away [m/s²]
    reaction: Reaction = field(default_factory=Reaction)

    def following_gap(self, speed: FloatArray) -> FloatArray:
        """Return the gap [m] kept from a leader of the same `speed` [m/s].

        The safe distance still holds when the leader has braked for the response time.
        """
        rho, b = self.response_time, self.front_braking
        braked = np.maximum(speed - rho * b, 0.0)
        return self.longitudinal_distance(speed, braked) + 0.5 * b * rho * rho

    def longitudinal_distance(
        self, rear_speed: FloatArray, front_speed: FloatArray
    ) -> FloatArray:
        """Return the safe distance along the lane [m]; speeds in m/s."""
        rho = self.response_time
        reached = rear_speed + rho * self.acceleration
        return (
            rear_speed * rho
            + 0.5 * self.acceleration * rho * rho
            + reached * reached / (2.0 * self.rear_braking)
            - front_speed * front_speed / (2.0 * self.front_braking)
        )

    def lateral_distance(self, lateral_speed: FloatArray) -> FloatArray:
        """Return the safe distance across the lane [m] at a closing speed [m/s]."""
        rho, a = self.response_time, self.lateral_acceleration
        reached = lateral_speed + rho * a
        return (
            self.lateral_margin
            + 0.5 * (lateral_speed + reached) * rho
            + reached * reached / (2.0 * a)
        )

    def is_dangerous(self, situation: ConflictState) -> BoolArray:
        """Return whether both distances are violated, (n,)."""
        along = self.longitudinal_distance(situation.speed, situation.other_speed)
        across = self.lateral_distance(situation.lateral_speed)
        near = (situation.gap < along) & (situation.lateral_gap < across)
        return np.asarray(near)

    def judge(self, situation: ConflictState, state: DriverState) -> Judgement:
        """Return full braking while the situation is dangerous.

        Only the rear vehicle answers: the ego while its centre is behind.
        """
        danger = self.is_dangerous(situation) & situation.is_follower
        wish = np.where(danger, FULL_BRAKING, 0.0)
        return Judgement(wish, state.noticed | danger, state.dismissed)
