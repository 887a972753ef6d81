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
from planner.states import BoolArray, FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class Judgement:
    """What a driver makes of one moment; all arrays are (n,)."""

    wish: FloatArray  # deceleration that the driver wants [m/s²]
    noticed: BoolArray  # the driver has decided to react, now or before
    dismissed: BoolArray  # the driver has judged the conflict to be uncritical
    emergency: BoolArray | None = None  # an emergency braking system acts


@dataclass(frozen=True, slots=True, eq=False)
class DriverState:
    """What a driver carries from step to step; arrays are (n,) but for `wishes`."""

    deceleration: FloatArray  # of the step before [m/s²]
    noticed: BoolArray
    dismissed: BoolArray
    wishes: FloatArray  # of the steps within the delay, oldest first, (n_delay, n)


class ReferenceDriver(Protocol):
    """A driver model that only brakes."""

    @property
    def reaction(self) -> Reaction:
        """Delay and jerk between wish and deceleration."""
        ...

    @property
    def releases_at_once(self) -> bool:
        """Whether braking ends with the wish, or one delay later."""
        ...

    def following_gap(self, speed: FloatArray) -> FloatArray:
        """Return the gap [m] that the driver keeps from a leader at `speed` [m/s]."""
        ...

    def judge(self, situation: ConflictState, state: DriverState) -> Judgement:
        """Return the deceleration that the driver wants at this moment."""
        ...


def attentive(driver: ReferenceDriver, n: int, step_s: float) -> DriverState:
    """Return the state of a driver before anything has happened, for `n` conflicts."""
    nothing = np.zeros(n)
    unseen = np.zeros(n, dtype=np.bool_)
    wishes = np.zeros((driver.reaction.delay_steps(step_s), n))
    return DriverState(nothing, unseen, unseen, wishes)


def react(
    driver: ReferenceDriver, situation: ConflictState, state: DriverState, step_s: float
) -> DriverState:
    """Return the driver's state after one look at the situation.

    Args:
        driver: The model.
        situation: At the beginning of the step.
        state: After the step before.
        step_s: Length of the step [s].

    Returns:
        The new state; its `deceleration` holds during the coming step.
    """
    judgement = driver.judge(situation, state)
    line = np.concatenate([state.wishes, judgement.wish[np.newaxis]])
    delayed = line[0]
    if driver.releases_at_once:
        delayed = np.where(judgement.wish > 0.0, delayed, 0.0)
    deceleration = driver.reaction.decelerate(
        state.deceleration, judgement.wish, delayed, step_s
    )
    if judgement.emergency is not None:
        built_up = state.deceleration + EMERGENCY_JERK * step_s
        system = np.minimum(built_up, EMERGENCY_BRAKING)
        braked = np.maximum(deceleration, system)
        deceleration = np.where(judgement.emergency, braked, deceleration)
    return DriverState(deceleration, judgement.noticed, judgement.dismissed, line[1:])
