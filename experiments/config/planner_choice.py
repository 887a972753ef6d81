"""Which planner drives, and its settings."""

from collections.abc import Mapping
from typing import Any

from pydantic import Field

from experiments.config.base import Strict

DEFAULT_PLANNER = "cruise"
NETWORK_PLANNER = "route"  # the default on networks of users


class PlannerChoice(Strict):
    """A planner by name or `module:factory`, and its settings."""

    name: str = Field(min_length=1)
    settings: dict[str, Any] = Field(default_factory=dict)


def default_planner(data: Mapping[str, Any]) -> str:
    """Return the planner of a scenario that names none.

    Args:
        data: The scenario as it is written.
    """
    network, world = data.get("network"), data.get("world", "sumo")
    of_user = isinstance(network, Mapping) and network.get("file") is not None
    if world == "sumo" and of_user:
        return NETWORK_PLANNER
    return DEFAULT_PLANNER
