"""One driver for a route: cruises, changes lanes because the route or the speed asks.

Built from the families: the core of `cruise` drives along the lane that is followed,
the rules of `lane_change` decide which lane that is and when a change binds, and
`dense` takes over where obstacles leave cruising no way.
"""

from planner.route.planner import RoutePlanner
from planner.route.settings import RouteSettings


def proposed(settings: RouteSettings | None = None) -> RoutePlanner:
    """Make the planner."""
    return RoutePlanner(settings or RouteSettings())


__all__ = ["RoutePlanner", "RouteSettings", "proposed"]
