"""Spaces of observations and actions."""

from typing import Any

import numpy as np
from gymnasium import spaces

from experiments.api.gym.actions import LANE_CHOICES, SPEED_CHOICES, ActionKind
from experiments.api.gym.observation import ObservationShape


def observation_space(shape: ObservationShape) -> spaces.Dict:
    """Return the space of observations of a shape."""
    boxes: dict[str, spaces.Space[Any]] = {
        name: spaces.Box(0.0 if name == "mask" else -1.0, 1.0, size, np.float32)
        for name, size in shape.shapes.items()
    }
    return spaces.Dict(boxes)


def action_space(kind: ActionKind) -> spaces.Space[Any]:
    """Return the space of a kind of actions."""
    if kind is ActionKind.LANE_AND_SPEED:
        return spaces.MultiDiscrete([LANE_CHOICES, SPEED_CHOICES])
    size = 2 if kind is ActionKind.CONTROL else 3
    return spaces.Box(-1.0, 1.0, (size,), np.float32)


def cast_action(space: spaces.Space[Any], action: Any) -> Any:
    """Cast an array of numbers to the precision of its space; others stay."""
    if isinstance(space, spaces.Box) and isinstance(action, np.ndarray):
        return action.astype(space.dtype) if action.dtype.kind in "fiu" else action
    return action
