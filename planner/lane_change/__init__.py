"""[Thesis] ch. 6: changing lanes among vehicles that react."""

from dataclasses import replace

from planner.lane_change.planner import LaneChangePlanner
from planner.lane_change.settings import LaneChangeSettings, OrderRule


def proposed(settings: LaneChangeSettings | None = None) -> LaneChangePlanner:
    """Make the planner with every passing order solved."""
    return LaneChangePlanner(settings or LaneChangeSettings())


def thesis(settings: LaneChangeSettings | None = None) -> LaneChangePlanner:
    """Make the planner with the area rule of [Thesis] eq. 6.12-6.18."""
    return LaneChangePlanner(_with(settings, OrderRule.AREA))


def conventional(settings: LaneChangeSettings | None = None) -> LaneChangePlanner:
    """Make the planner that finds its order by dynamic programming: DP&QP."""
    return LaneChangePlanner(_with(settings, OrderRule.DYNAMIC_PROGRAMMING))


def _with(settings: LaneChangeSettings | None, rule: OrderRule) -> LaneChangeSettings:
    """Return settings with another order rule."""
    base = settings or LaneChangeSettings()
    return replace(base, speed=replace(base.speed, order_rule=rule))


__all__ = [
    "LaneChangePlanner",
    "LaneChangeSettings",
    "conventional",
    "proposed",
    "thesis",
]
