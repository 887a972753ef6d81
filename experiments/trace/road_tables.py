"""The road in the trace: obstacles, path, bounds, limits and lanes."""

import numpy as np

from experiments.cosim.road import Road
from experiments.trace.schema import (
    Table,
)
from experiments.trace.table_rows import from_arrays
from planner.reference_path.path import ReferencePath
from planner.scene import Lanes, Obstacles, RoadBounds, SpeedLimits

ROAD_SPACING = 1.0  # between recorded points of the road [m]


def obstacle_table(obstacles: Obstacles) -> Table:
    """Make one row for each obstacle."""
    names = ("x", "y", "heading", "length", "width", "radius")
    arrays = [getattr(obstacles, name) for name in names]
    return from_arrays("obstacles", obstacles.ids, *arrays)


def road_table(road: Road) -> Table:
    """Sample the reference path and its bounds."""
    path = road.path
    s = np.linspace(0.0, path.length, max(int(path.length / ROAD_SPACING), 1) + 1)
    points = path.at(s)
    left, right = road.bounds.at(s)
    return from_arrays(
        "road", s, points.x, points.y, points.heading, points.curvature, left, right
    )


def path_table(path: ReferencePath) -> Table:
    """Make one row for each knot of the reference path."""
    pose = (path.x, path.y, path.heading)
    return from_arrays("path", path.s, *pose, path.curvature, path.curvature_rate)


def bounds_table(bounds: RoadBounds) -> Table:
    """Make one row for each sample of the road's bounds."""
    return from_arrays("bounds", bounds.s, bounds.left, bounds.right)


def speed_limit_table(limits: SpeedLimits) -> Table:
    """Make one row for each speed limit; none is null."""
    shown = np.where(np.isfinite(limits.limit), limits.limit, np.nan)
    return from_arrays("speed_limits", limits.s, shown)


def lane_table(lanes: Lanes) -> Table:
    """Make one row for each sample of each lane."""
    n_lanes, n = lanes.centre.shape
    number = np.repeat(np.arange(n_lanes), n)
    s = np.tile(lanes.s, n_lanes)
    side = np.full(number.size, int(lanes.left_hand))
    offsets = (lanes.centre.ravel(), lanes.width.ravel())
    solid = lanes.solid_left.astype(int) + 2 * lanes.solid_right.astype(int)
    return from_arrays("lanes", number, s, *offsets, side, solid.ravel())
