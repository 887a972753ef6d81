"""Environments of Gymnasium: `import rearview.gym` registers them.

import gymnasium
import rearview.gym

env = gymnasium.make("rearview/LaneChange-v0")
"""

from typing import TYPE_CHECKING, Any

try:
    from gymnasium.envs.registration import register, registry
except ModuleNotFoundError as _error:
    raise ModuleNotFoundError(
        "rearview.gym needs gymnasium; install it: pip install gymnasium",
        name="gymnasium",
    ) from _error

from experiments.api.gym.actions import ActionKind, drive
from experiments.api.gym.environment import DrivingEnv
from experiments.api.gym.observation import Observation, ObservationShape, observe
from experiments.api.gym.policy import PolicyPlanner, onnx_planner
from experiments.api.gym.rewards import Reward, progress_reward
from experiments.api.gym.spaces import observation_space
from experiments.api.gym.transition import Transition
from experiments.errors import ConfigError

_ENTRY = "experiments.api.gym.environment:DrivingEnv"
_ENVIRONMENTS = {
    "rearview/Cruise-v0": {"scenario": "straight", "action": "frenet"},
    "rearview/LaneChange-v0": {"scenario": "lane_change", "action": "lane_and_speed"},
    "rearview/Route-v0": {"scenario": "town", "action": "lane_and_speed"},
}

for _name, _kwargs in _ENVIRONMENTS.items():
    if _name not in registry:
        register(_name, _ENTRY, kwargs=_kwargs)

if TYPE_CHECKING:
    from experiments.api.gym.many_agents import ManyAgentsEnv


def parallel_env(**options: Any) -> "ManyAgentsEnv":
    """Make a PettingZoo environment in which many egos of a simulation are agents.

    Args:
        options: Of `ManyAgentsEnv`: `scenario`, `action`, `egos`, `changes`, `shape`,
            `repeat`, `reward`, `seeds`.

    Raises:
        ConfigError: If an option is wrong, or pettingzoo is missing.
    """
    try:
        from experiments.api.gym.many_agents import ManyAgentsEnv
    except ModuleNotFoundError as error:
        if error.name != "pettingzoo":
            raise
        raise ConfigError(
            "parallel_env needs pettingzoo; install it: pip install pettingzoo"
        ) from error
    return ManyAgentsEnv(**options)


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
    "parallel_env",
    "progress_reward",
]
