"""One way to go on, and the count of what was tried."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

from planner.lane_change.phases.memory import Change, Phase
from planner.lane_change.speed.plan import SpeedPlan
from planner.states import Path


@dataclass(frozen=True, slots=True, eq=False)
class PlanCandidate:
    """One way to go on and its speed plan."""

    phase: Phase
    lane: int
    path: Path
    speed: SpeedPlan
    change: Change | None = None
    start_s: float | None = None
    why: str = ""
    gap: tuple[int, str | None, str | None] | None = None  # that is aimed at


@dataclass(slots=True)
class SearchCounts:
    """Numbers of candidates of a cycle."""

    candidates: int = 0
    feasible: int = 0
    removed: dict[str, int] = field(default_factory=dict)

    def paths(self, refused: Mapping[str, int]) -> None:
        """Count the paths that were refused."""
        for reason, number in refused.items():
            self._remove(reason, number)

    def no_way_out(self) -> None:
        """Count a plan that cannot be taken back."""
        self._remove("no way out", 1)

    def hard_braking(self) -> None:
        """Count a change that would let the gap go by, braking hard."""
        self._remove("hard braking", 1)

    def speeds(self, plan: SpeedPlan) -> None:
        """Count the orders of one speed plan."""
        self.candidates += max(len(plan.alternatives), 1)
        solved = sum(math.isfinite(a.cost) for a in plan.alternatives)
        self.feasible += solved
        lost = max(len(plan.alternatives), 1) - solved
        if lost:
            self._remove("speed", lost)

    def _remove(self, reason: str, number: int) -> None:
        """Count some removed for one reason."""
        self.removed[reason] = self.removed.get(reason, 0) + number
