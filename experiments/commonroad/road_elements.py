"""Reads lanelets, traffic signs, traffic lights and intersections."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Final

import numpy as np

from experiments.commonroad.records import Lanelet, RoadNetwork, StopMark, TrafficLight
from experiments.commonroad.shapes import read_points
from experiments.commonroad.xml_tree import Node, short
from planner.states import FloatArray

# Signs that limit the speed, by country; the German number stands for all of them.
SPEED_SIGNS: Final = frozenset(
    ("274", "274.1", "R2-1", "r301", "3.24", "R15", "C43", "B14", "B31", "\u03a1-32")
)
TOWN_SIGN: Final = "310"
TOWN_SPEED: Final = 50.0 / 3.6  # in towns without another sign [m/s]
TURNS: Final = {
    "successorsLeft": "left",
    "successorsStraight": "straight",
    "successorsRight": "right",
}
# Lanelets on which no car drives, by their types; and users of whom one has to be named
# where a lanelet names its users.
CLOSED_TYPES: Final = frozenset(
    ("sidewalk", "crosswalk", "bicycleLane", "busLane", "busStop", "shoulder", "border")
)
CAR_USERS: Final = frozenset(("vehicle", "car"))
JOINED: Final = 0.3  # bounds that end and begin this near each other are one [m]
SHARED: Final = 0.1  # bounds nowhere farther apart are one between two lanelets [m]
LEAST_STEP: Final = 1e-6  # between points of a bound [m]


def read_network(root: Node) -> RoadNetwork:
    """Read everything about the road.

    References to what the file does not hold are dropped, since maps are cut out of
    larger ones; the lanelets among them are listed.

    Raises:
        ConfigError: If there is no lanelet, or an element is not as the format says.
    """
    lanelets: dict[int, Lanelet] = {}
    for node in root.all("lanelet"):
        lanelet = _read_lanelet(node)
        if lanelet.id in lanelets:
            raise node.error("is there twice")
        lanelets[lanelet.id] = lanelet
    if not lanelets:
        raise root.error("has no lanelet; allowed: at least one")
    limits = dict(_read_speed_signs(root))
    own = {x.key(): x.child("speedLimit") for x in root.all("lanelet")}
    for name, limit in own.items():  # of an older format, and still written
        if limit is not None:
            limits[-name] = limit.positive()
            lanelets[name] = replace(
                lanelets[name], signs=(*lanelets[name].signs, -name)
            )
    lights = {x.id: x for x in map(_read_light, root.all("trafficLight"))}
    return RoadNetwork(
        _connected(lanelets), limits, lights, _read_turns(root), _missing(lanelets)
    )


def _missing(lanelets: Mapping[int, Lanelet]) -> tuple[int, ...]:
    """List the lanelets that others refer to and the file does not hold."""
    named = {
        name
        for one in lanelets.values()
        for name in (
            *one.predecessors,
            *one.successors,
            *(beside[0] for beside in (one.beside_left, one.beside_right) if beside),
        )
    }
    return tuple(sorted(named - set(lanelets)))


def _read_lanelet(node: Node) -> Lanelet:
    """Read one lanelet."""
    left, right = (_read_bound(node.need(tag)) for tag in ("leftBound", "rightBound"))
    if left.shape != right.shape:
        n = max(left.shape[0], right.shape[0])
        left, right = _resampled(left, n), _resampled(right, n)
    if _is_swapped(left, right):
        left, right = right, left
    if np.ptp(0.5 * (left + right), axis=0).max() < LEAST_STEP:
        raise node.error("has no length: its bounds cross")
    kinds = frozenset(x.text for x in node.all("laneletType"))
    users = frozenset(x.text for x in node.all("userOneWay", "userBidirectional"))
    return Lanelet(
        node.key(),
        left,
        right,
        node.refs("predecessor"),
        node.refs("successor"),
        _beside(node.child("adjacentLeft")),
        _beside(node.child("adjacentRight")),
        kinds,
        users,
        node.refs("trafficSignRef"),
        node.refs("trafficLightRef"),
        _read_stop(node.child("stopLine")),
        bool(kinds & CLOSED_TYPES) or bool(users and not users & CAR_USERS),
    )


def _read_bound(node: Node) -> FloatArray:
    """Read the points of a bound, (n, 2) [m]."""
    points = read_points(node, 2)
    if np.ptp(points, axis=0).max() < LEAST_STEP:
        raise node.error("has no length")
    return points


def _is_swapped(left: FloatArray, right: FloatArray) -> bool:
    """Tell whether the bounds of a lanelet were written the wrong way round."""
    ahead = np.diff(left + right, axis=0)
    across = (left - right)[:-1] + (left - right)[1:]
    return float((ahead[:, 0] * across[:, 1] - ahead[:, 1] * across[:, 0]).sum()) < 0.0


def _resampled(points: FloatArray, n: int) -> FloatArray:
    """Spread n points evenly over a polyline, (n, 2)."""
    along = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(points, axis=0).T))])
    wanted = np.linspace(0.0, along[-1], n)
    return np.column_stack([np.interp(wanted, along, axis) for axis in points.T])


def _beside(node: Node | None) -> tuple[int, bool] | None:
    """Read a neighbour and whether it has the same driving direction."""
    if node is None:
        return None
    direction = node.attributes.get("drivingDir", "same")
    if direction not in ("same", "opposite"):
        shown = short(direction)
        raise node.error(f"drivingDir is {shown}; allowed: same, opposite")
    return node.key("ref"), direction == "same"


def _read_stop(node: Node | None) -> StopMark | None:
    """Read a stop line; without points it is at the end of its lanelet."""
    if node is None:
        return None
    points = read_points(node, 0)
    given = points if points.shape[0] >= 2 else None  # noqa: PLR2004 - two ends
    return StopMark(given, node.refs("trafficLightRef"))


def _connected(lanelets: dict[int, Lanelet]) -> dict[int, Lanelet]:
    """Drop references that lead nowhere; find successors where none are written."""
    starts = {x.id: np.array([x.left[0], x.right[0]]) for x in lanelets.values()}
    names = np.array(list(starts))
    begins = np.array(list(starts.values()))  # (n, 2, 2)
    found = {}
    for lanelet in lanelets.values():
        onward = tuple(x for x in lanelet.successors if x in lanelets)
        if not onward:
            end = np.array([lanelet.left[-1], lanelet.right[-1]])
            apart = np.hypot(*np.moveaxis(begins - end, 2, 0)).max(axis=1)
            onward = tuple(x for x in names[apart < JOINED].tolist() if x != lanelet.id)
        left, right = lanelet.beside_left, lanelet.beside_right
        found[lanelet.id] = replace(
            lanelet,
            successors=onward,
            beside_left=left if left and left[0] in lanelets else None,
            beside_right=right if right and right[0] in lanelets else None,
        )
    found = {name: _with_mutual_neighbours(x, found) for name, x in found.items()}
    found = _with_unwritten_neighbours(found)
    before: dict[int, list[int]] = {name: [] for name in found}
    for lanelet in found.values():
        for name in lanelet.successors:
            before[name].append(lanelet.id)
    return {
        name: replace(lanelet, predecessors=tuple(before[name]))
        for name, lanelet in found.items()
    }


def _with_mutual_neighbours(
    lanelet: Lanelet, lanelets: Mapping[int, Lanelet]
) -> Lanelet:
    """Drop neighbours of the same direction that do not have this one beside them."""
    left, right = lanelet.same_left, lanelet.same_right
    if left is not None and lanelets[left].same_right != lanelet.id:
        lanelet = replace(lanelet, beside_left=None)
    if right is not None and lanelets[right].same_left != lanelet.id:
        lanelet = replace(lanelet, beside_right=None)
    return lanelet


def _with_unwritten_neighbours(lanelets: dict[int, Lanelet]) -> dict[int, Lanelet]:
    """Find neighbours where none are written: two lanelets share a bound all along.

    Maps leave them out inside junctions, where lanes go on side by side.
    """
    names = list(lanelets)
    ends = np.array([[x.right[0], x.right[-1]] for x in lanelets.values()])
    found = dict(lanelets)
    for name, lanelet in lanelets.items():
        if lanelet.beside_left is not None:
            continue
        own = np.array([lanelet.left[0], lanelet.left[-1]])
        apart = np.hypot(*np.moveaxis(ends - own, 2, 0)).max(axis=1)
        for k in np.flatnonzero(apart < SHARED).tolist():
            other = found[names[k]]
            if other.beside_right is not None or other.id == name:
                continue
            n = max(len(lanelet.left), len(other.right))
            mine, theirs = _resampled(lanelet.left, n), _resampled(other.right, n)
            if np.hypot(*(mine - theirs).T).max() < SHARED:
                found[name] = replace(found[name], beside_left=(other.id, True))
                found[other.id] = replace(other, beside_right=(name, True))
                break
    return found


def _read_speed_signs(root: Node) -> Mapping[int, float]:
    """Read which speed each sign allows; other signs are left out [m/s]."""
    limits: dict[int, float] = {}
    for sign in root.all("trafficSign"):
        for element in sign.all("trafficSignElement"):
            kind = element.need("trafficSignID").text
            value = element.child("additionalValue")
            speed = None
            if kind in SPEED_SIGNS and value is not None:
                speed = value.positive()
            elif kind == TOWN_SIGN:
                speed = TOWN_SPEED
            if speed is not None:
                limits[sign.key()] = min(speed, limits.get(sign.key(), speed))
    return limits


def _read_light(node: Node) -> TrafficLight:
    """Read a traffic light with its cycle."""
    cycle, active = node.child("cycle"), node.child("active")
    colours, durations, offset = [], [], 0
    if cycle is not None:
        for element in cycle.all("cycleElement"):
            colours.append(element.need("color").text)
            durations.append(max(element.need("duration").whole(), 0))
        shift = cycle.child("timeOffset")
        offset = 0 if shift is None else shift.whole()
    direction = node.child("direction")
    return TrafficLight(
        node.key(),
        tuple(colours),
        tuple(durations),
        offset,
        "all" if direction is None else direction.text,
        active is None or active.text != "false",
    )


def _read_turns(root: Node) -> dict[tuple[int, int], str]:
    """Read where the lanelets of intersections lead to."""
    turns = {}
    for intersection in root.all("intersection"):
        for incoming in intersection.all("incoming"):
            for tag, turn in TURNS.items():
                for onward in incoming.refs(tag):
                    for lanelet in incoming.refs("incomingLanelet"):
                        turns[lanelet, onward] = turn
    return turns
