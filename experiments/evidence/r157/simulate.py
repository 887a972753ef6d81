"""Drive a reference driver through many conflicts at once."""

from dataclasses import dataclass
from enum import IntEnum

import numpy as np

from experiments.cosim.conflicts import STEP_S, Conflicts
from planner.reference_drivers.driver import ReferenceDriver, attentive, react
from planner.reference_drivers.situation import ConflictState
from planner.states import BoolArray, FloatArray, IntArray


class ConflictEnd(IntEnum):
    """How a conflict ends."""

    AVOIDED = 0
    UNCRITICAL = 1  # the driver saw no danger when the other vehicle came in
    SIDE_COLLISION = 2  # the ego's centre was ahead; type 1 of [Mattas2022]
    REAR_COLLISION = 3  # the ego's centre was behind; type 2 of [Mattas2022]
    FAILED = 4  # a planner left the road or returned nothing that can be driven


def collided(outcome: IntArray) -> BoolArray:
    """Return which outcomes are collisions, in the shape of `outcome`."""
    ends = (ConflictEnd.SIDE_COLLISION, ConflictEnd.REAR_COLLISION)
    return np.isin(outcome, ends)


@dataclass(frozen=True, slots=True, eq=False)
class Results:
    """Ends of many conflicts; all arrays are (n,)."""

    outcome: IntArray  # values of `ConflictEnd`
    impact_speed: FloatArray  # closing speed at the collision, else 0 [m/s]
    hardest_braking: FloatArray  # until then [m/s²]

    @property
    def collided(self) -> BoolArray:
        """Whether the driver could not avoid the collision."""
        return collided(self.outcome)


def simulate(driver: ReferenceDriver, conflicts: Conflicts) -> Results:
    """Drive all conflicts to their ends.

    The ego's position advances with the speed at the end of each step, as in the
    published implementation; a collision is an overlap of the two rectangles at a
    step. The conflict of a driver who has judged it uncritical ends there.

    Args:
        driver: The model.
        conflicts: At least one.
    """
    n, sizes = conflicts.size, conflicts.sizes
    lengths = sizes.ego_length + sizes.other_length
    narrower = min(sizes.ego_width, sizes.other_width)
    gap, speed = conflicts.gap.copy(), conflicts.ego_speed.copy()
    state = attentive(n)
    outcome = np.full(n, int(ConflictEnd.AVOIDED))
    impact, hardest = np.zeros(n), np.zeros(n)
    open_ = conflicts.lateral_gap.min(axis=0) < 0.0  # a lane kept is no conflict
    settled = _settled(conflicts)
    for other_speed, lateral_gap, lateral_speed, visible, constant in zip(
        conflicts.other_speed,
        conflicts.lateral_gap,
        conflicts.lateral_speed,
        conflicts.visible,
        settled,
        strict=True,
    ):
        beside = lateral_gap < 0.0
        hit = open_ & beside & (gap < 0.0) & (gap > -lengths)
        ahead = gap < -0.5 * lengths
        outcome[hit & ahead] = ConflictEnd.SIDE_COLLISION
        outcome[hit & ~ahead] = ConflictEnd.REAR_COLLISION
        impact[hit] = np.abs(speed - other_speed)[hit]
        outcome[open_ & ~hit & state.dismissed] = ConflictEnd.UNCRITICAL
        open_ &= ~hit & ~state.dismissed & ~(beside & (gap <= -lengths))
        if constant:  # a slower ego stays behind
            open_ &= ~(beside & (gap >= 0.0) & (speed <= other_speed))
        if not open_.any():
            break
        situation = ConflictState(
            np.where(visible, gap, np.inf),
            lateral_gap,
            lateral_speed,
            speed,
            other_speed,
            sizes.ego_length,
            sizes.other_length,
            narrower,
        )
        state = react(driver, situation, state, STEP_S)
        hardest = np.where(open_, np.maximum(hardest, state.deceleration), hardest)
        speed = np.maximum(speed - state.deceleration * STEP_S, 0.0)
        gap = gap - (speed - other_speed) * STEP_S
    return Results(outcome, impact, hardest)


def _settled(conflicts: Conflicts) -> BoolArray:
    """Return, step by step, whether the other vehicles' speeds stay as they are."""
    changes = np.any(np.diff(conflicts.other_speed, axis=0) != 0.0, axis=1)
    last = np.flatnonzero(changes)
    steps = np.arange(len(conflicts.other_speed))
    return np.asarray(steps > (last[-1] if last.size else -1))
