"""What a reference driver sees of the other vehicle."""

from dataclasses import dataclass

import numpy as np

from planner.states import BoolArray, FloatArray

GRAVITY = 9.81  # [m/s²]


@dataclass(frozen=True, slots=True, eq=False)
class ConflictState:
    """Ego and one other vehicle at one moment, in many conflicts.

    All arrays are (n,), float64; lengths are the same in all conflicts.
    """

    gap: FloatArray  # ego's front bumper to the other's rear bumper [m]
    lateral_gap: FloatArray  # between the facing sides, negative when they overlap [m]
    lateral_speed: FloatArray  # of the other towards the ego, >= 0 [m/s]
    speed: FloatArray  # of the ego [m/s]
    other_speed: FloatArray  # along the lane [m/s]
    ego_length: float  # [m]
    other_length: float  # [m]
    narrower_width: float  # of the two vehicles [m]

    @property
    def closing_speed(self) -> FloatArray:
        """Speed at which the gap shrinks [m/s]."""
        return self.speed - self.other_speed

    @property
    def time_to_collision(self) -> FloatArray:
        """Gap over closing speed [s]; inf while the gap does not shrink.

        Where the vehicles are beside each other, the size of the gap counts.
        """
        closing = self.closing_speed
        safe = np.where(closing > 0.0, closing, 1.0)
        return np.where(closing > 0.0, np.abs(self.gap) / safe, np.inf)

    @property
    def is_follower(self) -> BoolArray:
        """Whether the ego's centre is not yet ahead of the other's centre."""
        return np.asarray(self.gap >= -0.5 * (self.ego_length + self.other_length))
