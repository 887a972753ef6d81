"""The reward of a step."""

from collections.abc import Callable

from experiments.api.gym.transition import TERMINAL, Transition
from experiments.cosim.records import EpisodeStatus
from experiments.errors import ConfigError

Reward = Callable[[Transition], float]

FAILURE, ARRIVAL = -10.0, 5.0  # rewards of endings
EFFORT = 0.01  # per (m/s²)² of acceleration and lateral acceleration, a second


def progress_reward(transition: Transition) -> float:
    """Reward progress at the target speed with 1 a second; punish effort and failure.

    Returns:
        Way over the target speed [s], less `EFFORT` for accelerations, less 10 where
        the ego collides, leaves the road, is blocked or cannot be driven, plus 5 where
        it arrives.
    """
    before, after = transition.before, transition.after
    way = 0.0
    if before.ego_frenet is not None and after.ego_frenet is not None:
        way = after.ego_frenet.s - before.ego_frenet.s
    ego = after.ego
    lateral = ego.curvature * ego.speed**2
    effort = min(ego.acceleration**2 + lateral**2, 100.0) * transition.step
    reward = way / transition.target_speed - EFFORT * effort
    if transition.ending is not None:
        status = transition.ending.status
        reward += ARRIVAL if status is EpisodeStatus.ARRIVED else 0.0
        failed = status in TERMINAL and status is not EpisodeStatus.ARRIVED
        reward += FAILURE if failed else 0.0
    return reward


def require_reward(reward: object) -> None:
    """Raise ConfigError unless it can be called."""
    if not callable(reward):
        raise ConfigError(
            f"reward: is {reward!r}; allowed: a function of a Transition, see "
            "rearview.gym.progress_reward"
        )
