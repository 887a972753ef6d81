"""From the wish to brake to the deceleration: delay, coasting and jerk."""

import math
from dataclasses import dataclass

import numpy as np

from planner.errors import InvalidInputError
from planner.reference_drivers.situation import GRAVITY
from planner.states import FloatArray

FULL_BRAKING = 0.774 * GRAVITY  # of the competent and careful human [m/s²]
BRAKING_JERK = 12.65  # 0.774 g within 0.6 s [m/s³]
EMERGENCY_BRAKING = 0.85 * GRAVITY  # of the emergency braking system [m/s²]
EMERGENCY_JERK = EMERGENCY_BRAKING / 0.6  # [m/s³]


@dataclass(frozen=True, slots=True)
class Reaction:
    """How a wish becomes a deceleration; the numbers are those of [R157].

    Raises:
        InvalidInputError: If a number is negative or the jerk is not positive.
    """

    delay_s: float = 0.75  # from the wish to the first effect of the brake [s]
    deceleration: float = FULL_BRAKING  # that the driver never exceeds [m/s²]
    jerk: float = BRAKING_JERK  # while the deceleration grows [m/s³]
    coasting: float = 0.0  # deceleration during the delay: foot off the pedal [m/s²]

    def __post_init__(self) -> None:
        """Check the numbers."""
        least = min(self.delay_s, self.deceleration, self.coasting)
        if not (least >= 0.0 and self.jerk > 0.0):
            raise InvalidInputError(f"a reaction needs numbers >= 0, got {self}")

    def delay_steps(self, step_s: float) -> int:
        """Return the number of steps that pass until the delay is over."""
        return math.ceil(self.delay_s / step_s - 1e-9)

    def build_up(
        self, level: FloatArray, wish: FloatArray, step_s: float
    ) -> FloatArray:
        """Return the deceleration after one more step of braking.

        Args:
            level: Deceleration that has been built up, (n,) [m/s²].
            wish: What the driver wants now, (n,) [m/s²].
            step_s: Length of the step [s].

        Returns:
            (n,) [m/s²]: it grows no faster than the jerk allows and falls at once.
        """
        target = np.minimum(wish, self.deceleration)
        return np.asarray(np.minimum(level + self.jerk * step_s, target))
