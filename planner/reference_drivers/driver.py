"""The contract of a reference driver, and what it remembers between two steps."""

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from planner.reference_drivers.reaction import (
    EMERGENCY_BRAKING,
    EMERGENCY_JERK,
    Reaction,
)
from planner.reference_drivers.situation import ConflictState
from planner.states import BoolArray, FloatArray, IntArray


@dataclass(frozen=True, slots=True, eq=False)
class Judgement:
    """What a driver makes of one moment; all arrays are (n,)."""

    wish: FloatArray  # deceleration that the driver wants, 0 without danger [m/s²]
    noticed: BoolArray  # the driver has decided to react, now or before
    dismissed: BoolArray  # the driver has judged the conflict to be uncritical
    emergency: BoolArray | None = None  # an emergency braking system acts


@dataclass(frozen=True, slots=True, eq=False)
class DriverState:
    """What a driver carries from step to step; all arrays are (n,)."""

    deceleration: FloatArray  # of the step before [m/s²]
    level: FloatArray  # that the brake has been built up to, kept while released [m/s²]
    waited: IntArray  # steps of danger that count for the delay
    noticed: BoolArray
    dismissed: BoolArray


class ReferenceDriver(Protocol):
    """A driver model that only brakes."""

    def __hash__(self) -> int:
        """Return the same number for the same parameters."""
        ...

    @property
    def reaction(self) -> Reaction:
        """Delay and jerk between wish and deceleration."""
        ...

    def following_gap(self, speed: FloatArray) -> FloatArray:
        """Return the gap [m] that the driver keeps from a leader at `speed` [m/s]."""
        ...

    def judge(self, situation: ConflictState, state: DriverState) -> Judgement:
        """Return the deceleration that the driver wants at this moment."""
        ...


def attentive(n: int) -> DriverState:
    """Return the state of a driver before anything has happened, for `n` conflicts."""
    nothing, none = np.zeros(n), np.zeros(n, dtype=np.int64)
    unseen = np.zeros(n, dtype=np.bool_)
    return DriverState(nothing, nothing, none, unseen, unseen)


def react(
    driver: ReferenceDriver, situation: ConflictState, state: DriverState, step_s: float
) -> DriverState:
    """Return the driver's state after one look at the situation.

    As in the published implementation: the delay counts down in the steps in which
    there is danger, and once only; between two dangers the speed is held, and the
    second finds the brake where the first left it.

    Args:
        driver: The model.
        situation: At the beginning of the step.
        state: After the step before.
        step_s: Length of the step [s].

    Returns:
        The new state; its `deceleration` holds during the coming step.
    """
    judgement, reaction = driver.judge(situation, state), driver.reaction
    danger = judgement.wish > 0.0
    waiting = danger & (state.waited < reaction.delay_steps(step_s))
    built_up = reaction.build_up(state.level, judgement.wish, step_s)
    level = np.where(danger & ~waiting, built_up, state.level)
    level = np.where(waiting, reaction.coasting, level)
    deceleration = np.where(danger, level, 0.0)
    if judgement.emergency is not None:
        built_up = state.deceleration + EMERGENCY_JERK * step_s
        system = np.minimum(built_up, EMERGENCY_BRAKING)
        braked = np.maximum(deceleration, system)
        deceleration = np.where(judgement.emergency, braked, deceleration)
    waited = state.waited + waiting
    return DriverState(
        deceleration, level, waited, judgement.noticed, judgement.dismissed
    )
