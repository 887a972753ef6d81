"""States of the format: exact values, or intervals and areas."""

import math
from collections.abc import Mapping
from dataclasses import dataclass

import shapely
from shapely.geometry.base import BaseGeometry

from experiments.commonroad.records import GoalState, InitialState, Lanelet, Range
from experiments.commonroad.shapes import SHAPES, read_area, read_point
from experiments.commonroad.xml_tree import Node

SHOWN_LANELETS = 8  # of those that a message names
FULL_TURN = 2.0 * math.pi
FASTEST = 70.0  # that an ego may begin with, as in scenarios of other worlds [m/s]
SLACK = 1e-9  # by which the ends of an interval may be in the wrong order


@dataclass(frozen=True, slots=True)
class ObstacleState:
    """Where an obstacle is in one step."""

    step: int
    x: float  # [m]
    y: float
    heading: float  # [rad]
    speed: float | None  # [m/s]
    acceleration: float | None  # [m/s²]
    reach: float  # of an uncertain position about its middle [m]


def read_span(node: Node, *, whole: bool = False) -> Range:
    """Read an exact value or an interval."""
    exact = node.child("exact")
    if exact is not None:
        value = float(exact.whole()) if whole else exact.number()
        return Range(value, value)
    begin, end = node.child("intervalStart"), node.child("intervalEnd")
    if begin is None or end is None:
        allowed = "allowed: exact, or intervalStart and intervalEnd"
        raise node.error(f"has no value; {allowed}")
    span = Range(
        float(begin.whole()) if whole else begin.number(),
        float(end.whole()) if whole else end.number(),
    )
    if span.end < span.begin - SLACK:
        raise node.error(f"begins at {span.begin:g} and ends at {span.end:g}")
    return span


def _middle(node: Node, tag: str) -> float | None:
    """Read a value, of an interval its middle; None without it."""
    found = node.child(tag)
    return None if found is None else read_span(found).middle


def read_step(node: Node) -> int:
    """Read the time of a state, of an interval its middle."""
    return round(read_span(node.need("time"), whole=True).middle)


def _read_position(
    node: Node, lanelets: Mapping[int, Lanelet]
) -> tuple[float, float, float]:
    """Read (x, y, reach) of a position: a point, or the middle of an area."""
    position = node.need("position")
    point = position.child("point")
    if point is not None:
        return *read_point(point), 0.0
    area = position_area(position, lanelets)
    middle = area.centroid
    reach = 0.0
    if any(position.all(*SHAPES)):
        low_x, low_y, high_x, high_y = area.bounds
        reach = 0.5 * max(high_x - low_x, high_y - low_y)
    return float(middle.x), float(middle.y), reach


def position_area(position: Node, lanelets: Mapping[int, Lanelet]) -> BaseGeometry:
    """Read the area of a position: shapes or lanelets."""
    areas = [read_area(shape) for shape in position.all(*SHAPES)]
    for name in position.refs("lanelet"):
        if name not in lanelets:
            nearby = ", ".join(map(str, sorted(lanelets)[:SHOWN_LANELETS]))
            more = ", ..." if len(lanelets) > SHOWN_LANELETS else ""
            raise position.error(
                f"refers to lanelet {name}, which is not in the file; allowed: "
                f"{nearby}{more}"
            )
        areas.append(lanelets[name].area)
    if not areas:
        raise position.error("has no place; allowed: point, a shape, lanelet")
    return shapely.union_all(areas)


def read_obstacle_state(node: Node, lanelets: Mapping[int, Lanelet]) -> ObstacleState:
    """Read a state of an obstacle."""
    x, y, reach = _read_position(node, lanelets)
    speed, sideways = _middle(node, "velocity"), _middle(node, "velocityY")
    heading = _middle(node, "orientation")
    if speed is not None and sideways is not None:
        heading = math.atan2(sideways, speed) if heading is None else heading
        speed = math.hypot(speed, sideways)
    return ObstacleState(
        read_step(node),
        x,
        y,
        0.0 if heading is None else heading,
        speed,
        _middle(node, "acceleration"),
        reach,
    )


def read_initial_state(node: Node, lanelets: Mapping[int, Lanelet]) -> InitialState:
    """Read where the ego begins."""
    x, y, _ = _read_position(node, lanelets)
    values = [
        _middle(node, tag)
        for tag in ("orientation", "velocity", "acceleration", "yawRate", "slipAngle")
    ]
    for tag, value in zip(("orientation", "velocity"), values, strict=False):
        if value is None:
            raise node.error(f"has no {tag}")
    heading, speed, *rest = (value or 0.0 for value in values)
    if not 0.0 <= speed <= FASTEST:
        raise node.error(f"velocity is {speed:g}; allowed: 0 to {FASTEST:g} m/s")
    return InitialState(read_step(node), x, y, heading, speed, *rest)


def read_goal_state(node: Node, lanelets: Mapping[int, Lanelet]) -> GoalState:
    """Read a state that the ego has to reach."""
    position = node.child("position")
    area = None if position is None else _goal_area(position, lanelets)
    refs = () if position is None else position.refs("lanelet")
    turned, speed = node.child("orientation"), node.child("velocity")
    return GoalState(
        read_span(node.need("time"), whole=True),
        area,
        refs,
        None if turned is None else _read_angles(turned),
        None if speed is None else read_span(speed),
    )


def _goal_area(position: Node, lanelets: Mapping[int, Lanelet]) -> BaseGeometry:
    """Read the area of a goal; a point is a disc of a metre, which can be met."""
    point = position.child("point")
    if point is None:
        return position_area(position, lanelets)
    return shapely.Point(read_point(point)).buffer(1.0)


def _read_angles(node: Node) -> Range:
    """Read an interval of angles; its end is at most a full turn behind its begin."""
    exact = node.child("exact")
    if exact is not None:
        return read_span(node)
    begin, end = node.need("intervalStart").number(), node.need("intervalEnd").number()
    end += FULL_TURN * max(math.ceil((begin - end) / FULL_TURN), 0)
    return Range(begin, end)
