"""Ways out for an ego that stands where no motion of its planner gets on."""

from planner.way_out.planner import WayOutPlanner

__all__ = ["WayOutPlanner"]
