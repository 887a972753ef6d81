"""The braking that a change may cost as long as the ego can stay in its lane."""

from planner.lane_change.settings import LaneChangeSettings
from planner.states import SpeedProfile

BEYOND_ADJUSTING = 0.5  # braking that a change may take beyond adjusting [m/s²]


def is_gentle(profile: SpeedProfile, settings: LaneChangeSettings) -> bool:
    """Tell whether a plan brakes hardly more than the ego does to reach a gap.

    Only beyond what it brakes now: that was decided before.
    """
    hardest = float(profile.acceleration.min())
    wanted = settings.gaps.braking + BEYOND_ADJUSTING
    return hardest >= min(-wanted, float(profile.acceleration[0]))
