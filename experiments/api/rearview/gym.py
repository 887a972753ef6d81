"""Environments of Gymnasium: `import rearview.gym` registers them.

import gymnasium
import rearview.gym

env = gymnasium.make("rearview/LaneChange-v0")
"""

from gymnasium.envs.registration import register, registry

from experiments.api.gym.actions import ActionKind, drive
from experiments.api.gym.environment import (
    DrivingEnv,
    Reward,
    Transition,
    observation_space,
    progress_reward,
)
from experiments.api.gym.observation import Observation, ObservationShape, observe
from experiments.api.gym.policy import PolicyPlanner, onnx_planner

_ENTRY = "experiments.api.gym.environment:DrivingEnv"
_ENVIRONMENTS = {
    "rearview/Cruise-v0": {"scenario": "straight", "action": "frenet"},
    "rearview/LaneChange-v0": {"scenario": "lane_change", "action": "lane_and_speed"},
    "rearview/Route-v0": {"scenario": "town", "action": "lane_and_speed"},
}

for _name, _kwargs in _ENVIRONMENTS.items():
    if _name not in registry:
        register(_name, _ENTRY, kwargs=_kwargs)

__all__ = [
    "ActionKind",
    "DrivingEnv",
    "Observation",
    "ObservationShape",
    "PolicyPlanner",
    "Reward",
    "Transition",
    "drive",
    "observation_space",
    "observe",
    "onnx_planner",
    "progress_reward",
]
