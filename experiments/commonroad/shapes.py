"""Shapes of the format: bodies as rectangles, areas as polygons."""

import math
from collections.abc import Iterator

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from experiments.commonroad.records import Box
from experiments.commonroad.xml_tree import Node
from planner.states import FloatArray

SHAPES = ("rectangle", "circle", "polygon")
TIGHT = 1.15  # a rectangle may be so much larger than the part it covers
FINEST = 0.15  # [m], no part is cut that is narrower
DEEPEST = 5  # cuts of a polygon on the way to a part
ROUND = 32  # sides of a circle's polygon
LEAST_SIZE = 0.01  # of a body, which may be a line or a point [m]


def read_point(node: Node) -> tuple[float, float]:
    """Read x and y."""
    return node.need("x").number(), node.need("y").number()


def read_points(node: Node, least: int) -> FloatArray:
    """Read the points of an element, (n, 2) [m].

    Args:
        node: Has them as children.
        least: Number of them that are needed.
    """
    points = [read_point(point) for point in node.all("point")]
    if len(points) < least:
        raise node.error(f"has {len(points)} points; allowed: at least {least}")
    return np.array(points, dtype=np.float64).reshape(-1, 2)


def shape_nodes(node: Node) -> list[Node]:
    """Return the shapes among the children of an element; at least one."""
    found = list(node.all(*SHAPES))
    if not found:
        raise node.error(f"has no shape; allowed: {', '.join(SHAPES)}")
    return found


def read_area(node: Node) -> BaseGeometry:
    """Read one shape as a polygon."""
    if node.tag == "polygon":
        outline = shapely.make_valid(shapely.Polygon(read_points(node, 3)))
        if outline.area <= 0.0:
            raise node.error("has no area")
        return outline
    x, y = _centre(node)
    if node.tag == "circle":
        radius = node.need("radius").positive()
        return shapely.Point(x, y).buffer(radius, quad_segs=ROUND // 4)
    return box_polygon(_rectangle(node))


def box_polygon(box: Box) -> BaseGeometry:
    """Return the outline of a rectangle; its radius does not count."""
    along, across = box.length / 2.0, box.width / 2.0
    corners = np.array(
        [[-along, -across], [along, -across], [along, across], [-along, across]]
    )
    cos, sin = math.cos(box.heading), math.sin(box.heading)
    turned = corners @ np.array([[cos, sin], [-sin, cos]])
    return shapely.Polygon(turned + np.array([box.x, box.y]))


def read_boxes(node: Node) -> tuple[Box, ...]:
    """Cover one shape by few rectangles; a rectangle and a circle are exact."""
    if node.tag == "rectangle":
        return (_rectangle(node),)
    if node.tag == "circle":
        x, y = _centre(node)
        return (Box(x, y, 0.0, 0.0, 0.0, node.need("radius").positive()),)
    return tuple(covering_boxes(read_area(node)))


def covering_boxes(area: BaseGeometry, depth: int = DEEPEST) -> Iterator[Box]:
    """Yield rectangles that cover an area and little more.

    A part that fills its smallest rectangle badly is cut across the longer side.
    """
    if area.is_empty:
        return
    box = smallest_box(area)
    size = box.length * box.width
    if depth == 0 or box.length < 2.0 * FINEST or size <= TIGHT * area.area:
        yield box
        return
    for share in (-0.25, 0.25):
        x = box.x + share * box.length * math.cos(box.heading)
        y = box.y + share * box.length * math.sin(box.heading)
        half = Box(x, y, box.heading, 0.5 * box.length, box.width + 1.0)
        part = area.intersection(box_polygon(half))
        yield from covering_boxes(part, depth - 1)


def smallest_box(area: BaseGeometry) -> Box:
    """Return the smallest rectangle about an area; its length is the longer side.

    One of its sides lies on a side of the convex hull (Freeman, Shapira 1975). The
    rectangle of GEOS 3.14 leaves parts of some areas outside.
    """
    hull = shapely.get_coordinates(area.convex_hull)
    sides = np.diff(hull, axis=0)
    sides = sides[np.hypot(*sides.T) > 0.0]
    if not len(sides):
        x, y = hull[0].tolist()
        return Box(x, y, 0.0, LEAST_SIZE, LEAST_SIZE)
    boxes = (box_along(area, math.atan2(y, x)) for x, y in sides.tolist())
    box = min(boxes, key=lambda one: one.length * one.width)
    if box.length >= box.width:
        return box
    turned = math.remainder(box.heading + math.pi / 2.0, 2.0 * math.pi)
    return Box(box.x, box.y, turned, box.width, box.length)


def box_along(area: BaseGeometry, heading: float) -> Box:
    """Return the smallest rectangle in one direction about an area."""
    points = shapely.get_coordinates(area)
    cos, sin = math.cos(heading), math.sin(heading)
    along = points[:, 0] * cos + points[:, 1] * sin
    across = points[:, 1] * cos - points[:, 0] * sin
    s = 0.5 * float(along.min() + along.max())
    l = 0.5 * float(across.min() + across.max())
    return Box(
        s * cos - l * sin,
        s * sin + l * cos,
        heading,
        max(float(np.ptp(along)), LEAST_SIZE),
        max(float(np.ptp(across)), LEAST_SIZE),
    )


def body_box(node: Node) -> Box:
    """Return one rectangle along the body's own x axis about all shapes of a body."""
    shapes = shape_nodes(node)
    if len(shapes) == 1 and shapes[0].tag == "rectangle":
        own = _rectangle(shapes[0])
        if own.heading == 0.0:
            return own
    return box_along(shapely.union_all([read_area(shape) for shape in shapes]), 0.0)


def placed(box: Box, x: float, y: float, heading: float) -> Box:
    """Return a rectangle of a body's own frame where the body is."""
    cos, sin = math.cos(heading), math.sin(heading)
    return Box(
        x + cos * box.x - sin * box.y,
        y + sin * box.x + cos * box.y,
        heading + box.heading,
        box.length,
        box.width,
        box.radius,
    )


def _centre(node: Node) -> tuple[float, float]:
    """Read the centre of a shape, the origin by default."""
    centre = node.child("center")
    return (0.0, 0.0) if centre is None else read_point(centre)


def _rectangle(node: Node) -> Box:
    """Read a rectangle."""
    x, y = _centre(node)
    turned = node.child("orientation")
    heading = 0.0 if turned is None else turned.number()
    length, width = node.need("length").positive(), node.need("width").positive()
    return Box(x, y, heading, length, width)
