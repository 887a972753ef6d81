"""Which planner drives, and its settings."""

from typing import Any

from pydantic import Field

from experiments.config.base import Strict


class PlannerChoice(Strict):
    """A planner by name or `module:factory`, and its settings."""

    name: str = Field(min_length=1)
    settings: dict[str, Any] = Field(default_factory=dict)
