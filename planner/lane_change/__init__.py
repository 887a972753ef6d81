"""[Thesis] ch. 6: changing lanes among vehicles that react."""

from planner.lane_change.planner import LaneChangePlanner
from planner.lane_change.settings import LaneChangeSettings


def proposed(settings: LaneChangeSettings | None = None) -> LaneChangePlanner:
    """Make the planner with every passing order solved."""
    return LaneChangePlanner(settings or LaneChangeSettings())


__all__ = ["LaneChangePlanner", "LaneChangeSettings", "proposed"]
