"""The lateral room along the ego's path: carriageway, and what a turning body takes.

On ordinary roads the bounds are the edges of the carriageway. In bends the body sweeps
more than its width: where it would leave those edges although it stays in the area of
the route (inside junctions for the most part), the bounds are as wide as it needs.
"""

import math
from typing import NamedTuple

import numpy as np

from experiments.world_setup.driven_path import DrivenPath
from experiments.world_setup.path_stretches import areas_along
from planner.reference_path.body_in_area import outline_points
from planner.reference_path.linear_curvature import CURVATURE, RATE, S
from planner.reference_path.path import ReferencePath
from planner.reference_path.road_turn import circles_to, turn_of_pieces
from planner.scene import RoadBounds
from planner.states import BoolArray, FloatArray
from planner.vehicle import Vehicle
from sumo_nets.drivable_area import distances_to_edge
from sumo_nets.route_path import RoutePath

STEP = 0.5  # [m], between bounds that the body decides about
SIDE_STEP = 0.5  # between points on the body's sides [m]
SPARE = 0.3  # beside the body on the path: a planner's own margin, and control [m]
LEAST_SPARE = 0.15  # also where the area ends sooner [m]
FARTHEST = 12.0  # of an edge of the area from the path [m]
BENT = 1e-6  # a smaller curvature bends nothing within a body's length [1/m]
DOMAIN = 0.9  # share of the way to the centre of curvature that may be road


class _Room(NamedTuple):
    """Lateral offsets along the path, (n,) each [m]."""

    left: FloatArray
    right: FloatArray


def road_bounds(
    found: RoutePath, driven: DrivenPath, carriageway: RoadBounds, vehicle: Vehicle
) -> RoadBounds:
    """Widen the carriageway where the body on the path needs it.

    Args:
        found: The route.
        driven: The ego's path along it.
        carriageway: Edges of the route's lanes about the path.
        vehicle: The ego.

    Returns:
        The bounds; the carriageway itself where the body has room in it.
    """
    path = driven.path
    s = np.arange(0.0, path.length, STEP)
    body = _swept(path, s, vehicle)
    edge = _edges(found, driven, s)
    left, right = carriageway.at(s)
    planned = driven.is_planned(s)
    most = np.where(planned, np.minimum(left, edge.left), left)
    least = np.where(planned, np.maximum(right, edge.right), right)
    wanted = np.minimum(body.left + SPARE, np.maximum(edge.left, body.left))
    most = np.maximum(most, np.maximum(wanted, body.left + LEAST_SPARE))
    wanted = np.maximum(body.right - SPARE, np.minimum(edge.right, body.right))
    least = np.minimum(least, np.minimum(wanted, body.right - LEAST_SPARE))
    changed = (most != left) | (least != right)
    if not changed.any():
        return carriageway
    return _merged(carriageway, s, _Room(most, least), changed)


def _merged(
    carriageway: RoadBounds, s: FloatArray, room: _Room, changed: BoolArray
) -> RoadBounds:
    """Put changed bounds between those that stay."""
    grown = changed.copy()  # their neighbours are corners, too
    grown[1:] |= changed[:-1]
    grown[:-1] |= changed[1:]
    near = np.interp(carriageway.s, s, grown.astype(np.float64)) > 0.0
    keep = ~near
    at = np.concatenate([carriageway.s[keep], s[grown]])
    left = np.concatenate([carriageway.left[keep], room.left[grown]])
    right = np.concatenate([carriageway.right[keep], room.right[grown]])
    order = np.unique(at, return_index=True)[1]
    return RoadBounds(at[order], left[order], right[order])


def _swept(path: ReferencePath, s: FloatArray, vehicle: Vehicle) -> _Room:
    """Measure what the body on the path sweeps at each arc length.

    Counted are the foot points of its outline, and its outline as the planners see it:
    by the circles that lead as far aside as the road does up to each point.
    """
    at = path.at(s)
    outline = _outline(vehicle)
    x, y = outline_points(at.x, at.y, at.heading, outline)
    near = s[:, None] + outline[:, 0]
    foot, l = path.project(x.ravel(), y.ravel(), near=near.ravel(), reach=5.0)
    left, right = np.full(s.size, -np.inf), np.full(s.size, np.inf)
    for shift in (-1, 0, 1):
        place = np.clip(np.rint(foot / STEP).astype(int) + shift, 0, s.size - 1)
        np.maximum.at(left, place, l)
        np.minimum.at(right, place, l)
    along, across = outline[:, 0], outline[:, 1]
    knots = path.table.knots
    turn = turn_of_pieces(
        *(np.ascontiguousarray(knots[:, column]) for column in (S, CURVATURE, RATE))
    )
    circles = circles_to(s, np.ascontiguousarray(along), turn)[0].T
    bent = np.where(np.abs(circles) < BENT, BENT, circles)
    offset = (1.0 - np.hypot(1.0 - bent * across, bent * along)) / bent
    return _Room(
        np.maximum(left, _also_ahead(offset.max(axis=1), vehicle)),
        np.minimum(right, -_also_ahead(-offset.min(axis=1), vehicle)),
    )


def _also_ahead(offset: FloatArray, vehicle: Vehicle) -> FloatArray:
    """Return the larger of offsets here and of those an ego reaches with its front.

    Planners keep the body within the bounds under its front, too: where a bend opens
    or closes, the body as seen from the rear axle must fit between those as well.
    """
    ahead = math.ceil(vehicle.front_reach / STEP)
    out = offset.copy()
    for shift in (ahead - 1, ahead):
        out[shift:] = np.maximum(out[shift:], offset[: out.size - shift])
    return out


def _outline(vehicle: Vehicle) -> FloatArray:
    """Place points on the body's sides, corners included, (p, 2), rear axle at 0."""
    back, front = -vehicle.rear_overhang, vehicle.front_reach
    along = np.linspace(back, front, math.ceil((front - back) / SIDE_STEP) + 1)
    # in a bend the inner side comes nearest to the centre beside the axle
    along = np.union1d(along, [0.0])
    half = vehicle.width / 2.0
    sides = [np.column_stack([along, np.full(along.size, y)]) for y in (half, -half)]
    return np.concatenate(sides)


def _edges(found: RoutePath, driven: DrivenPath, s: FloatArray) -> _Room:
    """Measure the way to the edges of the area, short of the centre of curvature."""
    at = driven.path.at(s)
    points = np.column_stack([at.x, at.y])
    normal = np.column_stack([-at.sin_heading, at.cos_heading])
    left, right = np.zeros(s.size), np.zeros(s.size)
    for rows, area in areas_along(found, np.interp(s, driven.near, found.s)):
        here, side = points[rows], normal[rows]
        left[rows] = distances_to_edge(area, here, side, FARTHEST)
        right[rows] = -distances_to_edge(area, here, -side, FARTHEST)
    centre = DOMAIN / np.where(np.abs(at.curvature) < BENT, BENT, at.curvature)
    left = np.where(centre > 0.0, np.minimum(left, centre), left)
    right = np.where(centre < 0.0, np.maximum(right, centre), right)
    return _Room(left, right)
