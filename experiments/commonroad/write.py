"""Writes scenarios of format 2020a."""

import math
from collections.abc import Iterable, Sequence
from datetime import UTC, datetime
from pathlib import Path
from typing import Final
from xml.etree import ElementTree as ET

import numpy as np
import shapely

from experiments.commonroad.records import (
    Box,
    CommonRoadScenario,
    GoalState,
    Lanelet,
    MovingObstacle,
    PlanningProblem,
    Range,
    StopMark,
    TrafficLight,
)
from experiments.errors import ResultsError
from planner.states import FloatArray

DIGITS: Final = 6  # of lengths and speeds
KINDS: Final = ("car", "truck", "bus", "bicycle", "pedestrian", "motorcycle")
MAX_SPEED_SIGN: Final = "274"


def write_commonroad(scenario: CommonRoadScenario, file: Path) -> None:
    """Write a scenario.

    Areas of goals are written as polygons, static bodies as rectangles, or as circles
    if they are discs.

    Raises:
        ResultsError: If the file cannot be written.
    """
    root = ET.Element(
        "commonRoad",
        timeStepSize=f"{scenario.step:g}",
        commonRoadVersion="2020a",
        author="rearview",
        affiliation="",
        source="rearview",
        benchmarkID=scenario.benchmark_id,
        date=datetime.now(UTC).date().isoformat(),
    )
    _add_header(root)
    for lanelet in scenario.network.lanelets.values():
        _add_lanelet(root, lanelet)
    for sign, speed in scenario.network.speed_limits.items():
        _add_sign(root, sign, speed)
    for light in scenario.network.lights.values():
        _add_light(root, light)
    _add_intersections(root, scenario)
    for name, box in scenario.static:
        _add_static(root, name, box)
    for moving in scenario.moving:
        _add_moving(root, moving)
    for problem in scenario.problems:
        _add_problem(root, problem)
    ET.indent(root, " ")
    text = ET.tostring(root, encoding="unicode", xml_declaration=False)
    try:
        file.write_text(f"<?xml version='1.0' encoding='UTF-8'?>\n{text}\n", "utf-8")
    except OSError as error:
        raise ResultsError(f"{file}: cannot be written: {error.strerror}") from error


def _add(parent: ET.Element, tag: str, text: str | float | None = None) -> ET.Element:
    """Add a child, maybe with a text."""
    child = ET.SubElement(parent, tag)
    if text is not None:
        child.text = text if isinstance(text, str) else _number(text)
    return child


def _number(value: float) -> str:
    """Write a number without an exponent."""
    text = f"{value:.{DIGITS}f}".rstrip("0").rstrip(".")
    return "0" if text in ("", "-0") else text


def _add_header(root: ET.Element) -> None:
    """Add the elements that every file has."""
    location = _add(root, "location")
    for tag, value in (("geoNameId", "-999"), ("gpsLatitude", "999")):
        _add(location, tag, value)
    _add(location, "gpsLongitude", "999")
    _add(root, "scenarioTags")


def _add_point(parent: ET.Element, point: Iterable[float]) -> None:
    """Add a point."""
    added = _add(parent, "point")
    for tag, value in zip("xy", point, strict=True):
        _add(added, tag, float(value))


def _add_lanelet(root: ET.Element, lanelet: Lanelet) -> None:
    """Add a lanelet."""
    node = ET.SubElement(root, "lanelet", id=str(lanelet.id))
    for tag, bound in (("leftBound", lanelet.left), ("rightBound", lanelet.right)):
        side = _add(node, tag)
        for point in bound:
            _add_point(side, point)
    _add_refs(node, "predecessor", lanelet.predecessors)
    _add_refs(node, "successor", lanelet.successors)
    for tag, beside in (
        ("adjacentLeft", lanelet.beside_left),
        ("adjacentRight", lanelet.beside_right),
    ):
        if beside is not None:
            direction = "same" if beside[1] else "opposite"
            ET.SubElement(node, tag, ref=str(beside[0]), drivingDir=direction)
    if lanelet.stop is not None:
        _add_stop(node, lanelet.stop)
    for kind in sorted(lanelet.kinds) or ["urban"]:
        _add(node, "laneletType", kind)
    for user in sorted(lanelet.users) or ["vehicle"]:
        _add(node, "userOneWay", user)
    _add_refs(node, "trafficSignRef", lanelet.signs)
    _add_refs(node, "trafficLightRef", lanelet.lights)


def _add_refs(node: ET.Element, tag: str, names: Iterable[int]) -> None:
    """Add references."""
    for name in names:
        ET.SubElement(node, tag, ref=str(name))


def _add_stop(node: ET.Element, mark: StopMark) -> None:
    """Add a stop line."""
    stop = _add(node, "stopLine")
    for point in () if mark.points is None else mark.points:
        _add_point(stop, point)
    _add(stop, "lineMarking", "solid")
    _add_refs(stop, "trafficLightRef", mark.lights)


def _add_sign(root: ET.Element, sign: int, speed: float) -> None:
    """Add a speed limit."""
    node = ET.SubElement(root, "trafficSign", id=str(sign))
    element = _add(node, "trafficSignElement")
    _add(element, "trafficSignID", MAX_SPEED_SIGN)
    _add(element, "additionalValue", speed)
    _add(node, "virtual", "true")


def _add_light(root: ET.Element, light: TrafficLight) -> None:
    """Add a traffic light."""
    node = ET.SubElement(root, "trafficLight", id=str(light.id))
    cycle = _add(node, "cycle")
    for colour, duration in zip(light.colours, light.durations, strict=True):
        element = _add(cycle, "cycleElement")
        _add(element, "duration", str(duration))
        _add(element, "color", colour)
    _add(cycle, "timeOffset", str(light.offset))
    _add(node, "direction", light.direction)
    _add(node, "active", "true" if light.active else "false")


def _add_intersections(root: ET.Element, scenario: CommonRoadScenario) -> None:
    """Add the turns, all of them as incomings of one intersection."""
    turns = scenario.network.turns
    if not turns:
        return
    taken = {problem.id for problem in scenario.problems}
    taken |= {int(user.id) for user in scenario.moving}
    taken |= {int(name) for name, _ in scenario.static}
    taken |= set(scenario.network.lanelets) | set(scenario.network.lights)
    taken |= set(scenario.network.speed_limits)
    free = max(taken) + 1
    node = ET.SubElement(root, "intersection", id=str(free))
    for lanelet in sorted({lanelet for lanelet, _ in turns}):
        free += 1
        incoming = ET.SubElement(node, "incoming", id=str(free))
        ET.SubElement(incoming, "incomingLanelet", ref=str(lanelet))
        for word, tag in (
            ("right", "successorsRight"),
            ("straight", "successorsStraight"),
            ("left", "successorsLeft"),
        ):
            for (begin, onward), turn in turns.items():
                if begin == lanelet and turn == word:
                    ET.SubElement(incoming, tag, ref=str(onward))


def _add_shape(parent: ET.Element, box: Box) -> None:
    """Add the shape of a body in its own frame."""
    shape = _add(parent, "shape")
    if box.length == 0.0 and box.width == 0.0:
        _add(_add(shape, "circle"), "radius", box.radius)
        return
    rectangle = _add(shape, "rectangle")
    _add(rectangle, "length", box.length + 2.0 * box.radius)
    _add(rectangle, "width", box.width + 2.0 * box.radius)


def _add_state(
    parent: ET.Element, tag: str, step: int, row: Sequence[float] | FloatArray
) -> ET.Element:
    """Add an exact state: x, y, heading, speed."""
    node = _add(parent, tag)
    _add_point(_add(node, "position"), row[:2])
    _add(_add(node, "orientation"), "exact", float(row[2]))
    _add(_add(node, "time"), "exact", str(step))
    _add(_add(node, "velocity"), "exact", float(row[3]))
    return node


def _add_static(root: ET.Element, name: str, box: Box) -> None:
    """Add a static obstacle."""
    node = ET.SubElement(root, "staticObstacle", id=name)
    _add(node, "type", "parkedVehicle")
    _add_shape(node, box)
    _add_state(node, "initialState", 0, (box.x, box.y, box.heading, 0.0))


def _add_moving(root: ET.Element, moving: MovingObstacle) -> None:
    """Add a recorded road user; its size is that of its first step."""
    node = ET.SubElement(root, "dynamicObstacle", id=moving.id)
    _add(node, "type", moving.kind if moving.kind in KINDS else "unknown")
    table = moving.table
    length, width = float(table[6, 0]), float(table[7, 0])
    _add_shape(node, Box(0.0, 0.0, 0.0, length, width))
    rows = table.T
    first = _add_state(node, "initialState", moving.first, rows[0])
    _add(_add(first, "acceleration"), "exact", float(rows[0, 4]))
    if len(rows) == 1:
        return
    trajectory = _add(node, "trajectory")
    for k, row in enumerate(rows[1:], moving.first + 1):
        state = _add_state(trajectory, "state", k, row)
        _add(_add(state, "acceleration"), "exact", float(row[4]))


def _add_problem(root: ET.Element, problem: PlanningProblem) -> None:
    """Add a planning problem."""
    node = ET.SubElement(root, "planningProblem", id=str(problem.id))
    start = problem.start
    row = (start.x, start.y, start.heading, start.speed)
    state = _add_state(node, "initialState", start.step, row)
    _add(_add(state, "yawRate"), "exact", start.yaw_rate)
    _add(_add(state, "slipAngle"), "exact", start.slip)
    for goal in problem.goals:
        _add_goal(node, goal)


def _add_goal(node: ET.Element, goal: GoalState) -> None:
    """Add a goal state."""
    state = _add(node, "goalState")
    if goal.lanelets:
        position = _add(state, "position")
        for name in goal.lanelets:
            ET.SubElement(position, "lanelet", ref=str(name))
    elif goal.area is not None:
        position = _add(state, "position")
        for part in shapely.get_parts(goal.area):
            polygon = _add(position, "polygon")
            for point in np.array(part.exterior.coords)[:-1]:
                _add_point(polygon, point)
    if goal.heading is not None:
        begin, end = goal.heading
        turns = math.floor((begin + math.pi) / (2.0 * math.pi)) * 2.0 * math.pi
        _add_span(state, "orientation", Range(begin - turns, end - turns))
    _add_span(state, "time", goal.steps, whole=True)
    if goal.speed is not None:
        _add_span(state, "velocity", goal.speed)


def _add_span(
    parent: ET.Element, tag: str, span: Range, *, whole: bool = False
) -> None:
    """Add an interval."""
    node = _add(parent, tag)
    for name, value in zip(("intervalStart", "intervalEnd"), span, strict=True):
        _add(node, name, str(round(value)) if whole else value)
