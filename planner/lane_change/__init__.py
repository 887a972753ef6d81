"""[Thesis] ch. 6: changing lanes among vehicles that react."""

import math
from dataclasses import replace

from planner.lane_change.planner import LaneChangePlanner
from planner.lane_change.settings import GapRule, LaneChangeSettings, OrderRule

DEFAULTS = LaneChangeSettings()
PUBLISHED_GAIN = 1.0  # advantage that was worth a change [m/s]


def proposed(settings: LaneChangeSettings | None = None) -> LaneChangePlanner:
    """Make the planner with every passing order solved and gaps rolled out."""
    return LaneChangePlanner(settings or LaneChangeSettings())


def area(settings: LaneChangeSettings | None = None) -> LaneChangePlanner:
    """Make the planner with the area rule of [Thesis] eq. 6.12-6.18."""
    return LaneChangePlanner(_with(settings, OrderRule.AREA))


def thesis(settings: LaneChangeSettings | None = None) -> LaneChangePlanner:
    """Make the planner whose speeds are planned as chapter 6 is printed."""
    base = _with(settings, OrderRule.AREA)
    printed = replace(
        base.speed.printed, four_corners=True, region_bounds=True, objective=True
    )
    return LaneChangePlanner(replace(base, speed=replace(base.speed, printed=printed)))


def conventional(settings: LaneChangeSettings | None = None) -> LaneChangePlanner:
    """Make the planner that finds its order by dynamic programming: DP&QP."""
    return LaneChangePlanner(_with(settings, OrderRule.DYNAMIC_PROGRAMMING))


def _with(settings: LaneChangeSettings | None, rule: OrderRule) -> LaneChangeSettings:
    """Return settings with another order rule, and changes as they were published.

    The check of a gap before it is entered is that of `proposed`.
    """
    base = settings or DEFAULTS
    lateral, gain = base.speed.lateral_acceleration, base.manoeuvre.gain
    if lateral == DEFAULTS.speed.lateral_acceleration:
        lateral = math.inf
    if gain == DEFAULTS.manoeuvre.gain:
        gain = PUBLISHED_GAIN
    return replace(
        base,
        speed=replace(base.speed, order_rule=rule, lateral_acceleration=lateral),
        gaps=replace(base.gaps, rule=GapRule.PLACES),
        manoeuvre=replace(base.manoeuvre, gain=gain),
    )


__all__ = [
    "LaneChangePlanner",
    "LaneChangeSettings",
    "area",
    "conventional",
    "proposed",
    "thesis",
]
