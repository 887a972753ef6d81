"""One way to go on, and the count of what was tried."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

from planner.lane_change.phases.memory import Change, Phase
from planner.lane_change.speed.plan import SpeedPlan
from planner.states import Path


@dataclass(frozen=True, slots=True, eq=False)
class Attempt:
    """One way to go on and its speed plan."""

    phase: Phase
    lane: int
    path: Path
    speed: SpeedPlan
    change: Change | None = None
    start_s: float | None = None
    why: str = ""


@dataclass(slots=True)
class Tally:
    """What was tried in a cycle."""

    candidates: int = 0
    survivors: int = 0
    removed: dict[str, int] = field(default_factory=dict)

    def paths(self, refused: Mapping[str, int]) -> None:
        """Count the paths that were refused."""
        for reason, number in refused.items():
            self.removed[reason] = self.removed.get(reason, 0) + number

    def speeds(self, plan: SpeedPlan) -> None:
        """Count the orders of one speed plan."""
        self.candidates += max(len(plan.alternatives), 1)
        solved = sum(math.isfinite(a.cost) for a in plan.alternatives)
        self.survivors += solved
        lost = max(len(plan.alternatives), 1) - solved
        if lost:
            self.removed["speed"] = self.removed.get("speed", 0) + lost
