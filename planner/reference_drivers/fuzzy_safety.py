"""The fuzzy safety model: braking in anticipation; [Mattas2020], [Mattas2022].

Two fuzzy numbers grade the danger from 0 (safe) to 1 (unsafe). The *proactive* one
(PFS) asks whether the ego could stop behind a leader that brakes hard; the *critical*
one (CFS) whether it would collide if both went on as they do. The driver brakes
comfortably with the first and up to hard braking with the second.
"""

from dataclasses import dataclass, field

import numpy as np

from planner.reference_drivers.driver import DriverState, Judgement
from planner.reference_drivers.reaction import Reaction
from planner.reference_drivers.situation import ConflictState
from planner.states import BoolArray, FloatArray


@dataclass(frozen=True, slots=True)
class FuzzySafety:
    """Parameters of the fuzzy safety model."""

    response_time: float = 0.75  # rho [s]
    comfortable_braking: float = 4.0  # b1 [m/s²]
    hard_braking: float = 6.0  # b2 [m/s²]
    leader_braking: float = 7.0  # [m/s²]
    standstill_gap: float = 2.0  # d1: kept from the leader [m]
    safe_margin: float = 2.0  # d2: of the safe distance [m]
    passing_margin: float = 0.1  # of the lateral filter [s]
    reaction: Reaction = field(default_factory=Reaction)

    def following_gap(self, speed: FloatArray) -> FloatArray:
        """Return the least gap [m] with PFS = 0 at one `speed` [m/s] of both."""
        safe = self._safe_distance(speed, speed)
        return safe + self.standstill_gap

    def proactive(self, situation: ConflictState) -> FloatArray:
        """Return the PFS, (n,), from 0 (safe) to 1 (unsafe)."""
        v, leader = situation.speed, situation.other_speed
        safe = self._safe_distance(v, leader)
        driven = v * self.response_time
        ahead = leader * leader / (2.0 * self.leader_braking)
        unsafe = driven + v * v / (2.0 * self.hard_braking) - ahead
        return _grade(situation.gap - self.standstill_gap, safe, unsafe)

    def _safe_distance(self, speed: FloatArray, leader: FloatArray) -> FloatArray:
        """Return the distance to stop in comfortably behind a hard braking leader."""
        driven = speed * self.response_time
        ahead = leader * leader / (2.0 * self.leader_braking)
        comfortable = speed * speed / (2.0 * self.comfortable_braking)
        return driven + comfortable - ahead + self.safe_margin

    def critical(
        self, situation: ConflictState, deceleration: FloatArray
    ) -> FloatArray:
        """Return the CFS, (n,), from 0 (safe) to 1 (unsafe).

        Args:
            situation: What the driver sees.
            deceleration: Of the ego, held during the response time, (n,) [m/s²].
        """
        rho, v = self.response_time, situation.speed
        a = -np.minimum(deceleration, self.comfortable_braking)
        held = np.where(deceleration > 0.0, deceleration, 1.0)
        closing = v - situation.other_speed
        reached = closing + rho * a  # closing speed after the response time
        driven = (closing + 0.5 * a * rho) * rho
        square = reached * reached
        safe = driven + square / (2.0 * self.comfortable_braking)
        unsafe = driven + square / (2.0 * self.hard_braking)
        graded = _grade(situation.gap, safe, unsafe)
        # Slower than the leader before the response time is over: only a gap shorter
        # than what is driven until then is unsafe.
        short = situation.gap < closing * closing / (2.0 * held)
        graded = np.where(reached < 0.0, np.where(short, 1.0, 0.0), graded)
        return np.where(closing <= 0.0, 0.0, graded)

    def passes_before(self, situation: ConflictState) -> BoolArray:
        """Return whether the ego has passed before the other reaches its side, (n,).

        The lateral filter: the time to the lateral contact is longer than the time to
        drive past the other's whole length, with a margin.
        """
        lengths = situation.ego_length + situation.other_length
        closing = situation.closing_speed
        approaching = (closing > 0.0) & (situation.lateral_speed > 0.0)
        passing = (situation.gap + lengths) / np.where(approaching, closing, 1.0)
        contact = situation.lateral_gap / np.where(
            approaching, situation.lateral_speed, 1.0
        )
        apart = situation.lateral_gap > 0.0
        in_time = ~approaching | (contact > passing + self.passing_margin)
        return np.asarray(apart & in_time)

    def wished_deceleration(
        self, proactive: FloatArray, critical: FloatArray
    ) -> FloatArray:
        """Return the deceleration of the two grades, (n,) [m/s²]."""
        b1, b2 = self.comfortable_braking, self.hard_braking
        return np.where(critical > 0.0, critical * (b2 - b1) + b1, proactive * b1)

    def judge(self, situation: ConflictState, state: DriverState) -> Judgement:
        """Return the graded deceleration, while the ego's centre is behind.

        Both grades are functions of a gap and mean nothing without one.
        """
        grade = self.wished_deceleration(
            self.proactive(situation), self.critical(situation, state.deceleration)
        )
        ignored = self.passes_before(situation) | ~situation.is_follower
        wish = np.where(ignored, 0.0, grade)
        return Judgement(wish, state.noticed | (wish > 0.0), state.dismissed)


def _grade(distance: FloatArray, safe: FloatArray, unsafe: FloatArray) -> FloatArray:
    """Return 0 from the safe distance on, 1 from the unsafe one down, linear between.

    Where both distances are the same, the grade is a step.
    """
    width = unsafe - safe
    flat = width == 0.0
    graded = (distance - safe) / np.where(flat, 1.0, width)
    step = np.where(distance < unsafe, 1.0, 0.0)
    return np.where(flat, step, np.clip(graded, 0.0, 1.0))
