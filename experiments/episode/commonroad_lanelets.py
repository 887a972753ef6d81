"""Lanelets of a SUMO network, or of a road along a path; for the export of runs."""

import math
from collections.abc import Iterable, Mapping
from dataclasses import replace
from itertools import pairwise
from typing import Final

import numpy as np

from experiments.commonroad.records import (
    Lanelet,
    RoadNetwork,
    StopMark,
    TrafficLight,
)
from experiments.cosim.road import Road
from experiments.trace.schema import Table
from planner.reference_path.path import ReferencePath
from planner.states import FloatArray
from sumo_nets.lane_choice import via_lanes
from sumo_nets.net_records import ROADS, Net, NetLane

MARGIN: Final = 100.0  # about the ego's path; what is farther away is left out [m]
SPACING: Final = 2.0  # between points of a road along a path [m]
BEYOND: Final = 60.0  # such a road goes on behind its path's end [m]
FIRST_SIGN: Final = 4_000_000  # ids of speed limits begin here
FIRST_LIGHT: Final = 5_000_000  # and those of lights
TURN: Final = 0.6  # from which on a way through a junction is a turn [rad]
ALONG: Final = 0.1  # bounds nowhere farther apart are one [m]
SHORT: Final = 0.05  # lanes without length are left out [m]
SHARPEST: Final = 0.2  # of a corner that is mitred: 2 + 2 cos of its angle
FASTEST: Final = 80.0  # a higher limit is none [m/s]
# SUMO's letter -> colour of a light
COLOURS: Final = {"r": "red", "u": "redYellow", "y": "yellow", "G": "green"}


def lanelets_of_net(net: Net, path: ReferencePath) -> RoadNetwork:
    """Turn the lanes for cars about a path into lanelets.

    Lanes inside junctions begin and end exactly where those outside end and begin, and
    lanes beside each other share their bound: a map without gaps.
    """
    lanes = list(_lanes_about(net, path))
    number = {lane.id: k for k, lane in enumerate(lanes, 1)}
    onward: dict[str, list[str]] = {lane.id: [] for lane in lanes}
    turns: dict[tuple[int, int], str] = {}
    speeds = {lane.id: lane.speed for lane in lanes}
    for lane in lanes:
        if lane.edge.internal:
            continue
        for link in lane.links:
            inside = via_lanes(net, link)
            # the speed of a lane inside is no limit: that of the road before goes on
            speeds.update({via.id: lane.speed for via in inside})
            chain = [lane, *inside, link.target]
            for before, after in pairwise(chain):
                if after.id in number and before.id in number:
                    onward[before.id].append(after.id)
            if chain[1].id in number:
                turn = _turn(lane.points, link.target.points)
                turns[number[lane.id], number[chain[1].id]] = turn
    bounds = _bounds(lanes, onward, left_hand=net.left_hand)
    lanelets = {}
    limits: dict[int, float] = {}
    for lane in lanes:
        left, right = bounds[lane.id]
        beside = _neighbours(lane, number, left_hand=net.left_hand)
        speed = round(speeds[lane.id], 4)
        # a sign for each: readers look for the first lanelet of a sign, and on a
        # circle there is none
        sign = () if speed > FASTEST else (FIRST_SIGN + number[lane.id],)
        limits.update(dict.fromkeys(sign, speed))
        following = tuple(dict.fromkeys(number[x] for x in onward[lane.id]))
        lanelets[number[lane.id]] = Lanelet(
            number[lane.id], left, right, (), following, *beside, signs=sign
        )
    return RoadNetwork(
        _with_predecessors(lanelets),
        limits,
        turns=turns,
    )


def _lanes_about(net: Net, path: ReferencePath) -> Iterable[NetLane]:
    """Yield the lanes for cars near a path."""
    at = path.at(np.linspace(0.0, path.length, int(path.length / SPACING) + 2))
    low_x, high_x = at.x.min() - MARGIN, at.x.max() + MARGIN
    low_y, high_y = at.y.min() - MARGIN, at.y.max() + MARGIN
    for _, edge in sorted(net.edges.items()):
        if edge.function not in ROADS:
            continue
        for lane in edge.drivable_lanes:
            points = lane.points
            if np.hypot(*np.diff(points, axis=0).T).sum() < SHORT:
                continue
            inside = (points[:, 0].max() >= low_x) & (points[:, 0].min() <= high_x)
            inside &= (points[:, 1].max() >= low_y) & (points[:, 1].min() <= high_y)
            if inside:
                yield lane


def _turn(before: FloatArray, after: FloatArray) -> str:
    """Say where a way through a junction leads."""
    first, second = before[-1] - before[-2], after[1] - after[0]
    turned = math.atan2(second[1], second[0]) - math.atan2(first[1], first[0])
    turned = math.remainder(turned, 2.0 * math.pi)
    if abs(turned) < TURN:
        return "straight"
    return "left" if turned > 0.0 else "right"


def _neighbours(
    lane: NetLane, number: Mapping[str, int], *, left_hand: bool
) -> tuple[tuple[int, bool] | None, tuple[int, bool] | None]:
    """Return the neighbours to the left and to the right; lane 0 is at the kerb."""
    if lane.edge.internal:
        return None, None
    by_index = {x.index: x.id for x in lane.edge.drivable_lanes if x.id in number}
    inner, outer = by_index.get(lane.index + 1), by_index.get(lane.index - 1)
    left, right = (outer, inner) if left_hand else (inner, outer)
    return (
        None if left is None else (number[left], True),
        None if right is None else (number[right], True),
    )


def _bounds(
    lanes: Iterable[NetLane], onward: Mapping[str, list[str]], *, left_hand: bool
) -> dict[str, tuple[FloatArray, FloatArray]]:
    """Return the left and right bounds of lanes by id, without gaps."""
    by_id = {lane.id: lane for lane in lanes}
    bounds = {name: _spread(lane) for name, lane in by_id.items()}
    _share_bounds(by_id, bounds, left_hand=left_hand)
    for name, following in onward.items():
        for after in following:
            mine, others = bounds[name], bounds[after]
            if by_id[after].edge.internal:
                for own, other in zip(mine, others, strict=True):
                    other[0] = own[-1]
            elif by_id[name].edge.internal:
                for own, other in zip(mine, others, strict=True):
                    own[-1] = other[0]
    return bounds


def _share_bounds(
    lanes: Mapping[str, NetLane],
    bounds: dict[str, tuple[FloatArray, FloatArray]],
    *,
    left_hand: bool,
) -> None:
    """Give lanes beside each other one bound, from the left to the right."""
    beside = {
        name: _to_the_left(lanes[name], lanes, left_hand=left_hand) for name in lanes
    }
    beside |= _left_inside(lanes, bounds)
    done: set[str] = set()

    def share(name: str) -> None:
        if name in done:
            return
        done.add(name)
        left = beside[name]
        if left is None:
            return
        share(left)
        line = bounds[left][1]
        own = bounds[name][1]
        if len(own) != len(line):
            own = _at_shares(own, _shares(line))
        bounds[name] = (line, own)

    for name in lanes:
        share(name)


def _to_the_left(
    lane: NetLane, lanes: Mapping[str, NetLane], *, left_hand: bool
) -> str | None:
    """Return the lane to the left on the same edge; None inside junctions."""
    if lane.edge.internal:
        return None
    step = -1 if left_hand else 1
    beside = [x.id for x in lane.edge.drivable_lanes if x.index == lane.index + step]
    return next((name for name in beside if name in lanes), None)


def _left_inside(
    lanes: Mapping[str, NetLane], bounds: Mapping[str, tuple[FloatArray, FloatArray]]
) -> dict[str, str]:
    """Return the lanes inside junctions that go along another one, to its right."""
    inside = [name for name, lane in lanes.items() if lane.edge.internal]
    ends = np.array([[bounds[x][1][0], bounds[x][1][-1]] for x in inside])
    found = {}
    for name in inside:
        left = bounds[name][0]
        own = np.array([left[0], left[-1]])
        apart = np.hypot(*np.moveaxis(ends - own, 2, 0)).max(axis=1)
        for k in np.flatnonzero(apart < ALONG).tolist():
            other = bounds[inside[k]][1]
            on = _at_shares(left, _shares(other))
            if inside[k] != name and np.hypot(*(on - other).T).max() < ALONG:
                found[name] = inside[k]
                break
    return found


def _shares(line: FloatArray) -> FloatArray:
    """Return the shares of a line's length at which its points are, (n,)."""
    along = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(line, axis=0).T))])
    return np.asarray(along / along[-1])


def _at_shares(line: FloatArray, shares: FloatArray) -> FloatArray:
    """Return the points of a line at shares of its length, (n, 2)."""
    own = _shares(line)
    return np.column_stack([np.interp(shares, own, axis) for axis in line.T])


def _spread(lane: NetLane) -> tuple[FloatArray, FloatArray]:
    """Return the bounds of a lane: its line moved to both sides, mitred."""
    points = np.array(lane.points, dtype=np.float64)
    kept = np.ones(len(points), dtype=bool)
    kept[1:] = np.hypot(*np.diff(points, axis=0).T) > 1e-4  # noqa: PLR2004 - [m]
    points = points[kept]
    side = np.diff(points, axis=0)
    side /= np.hypot(*side.T)[:, None]
    normal = np.column_stack([-side[:, 1], side[:, 0]])
    mean = np.concatenate([normal[:1], normal[:-1] + normal[1:], normal[-1:]])
    square = (mean**2).sum(axis=1)
    scale = 2.0 / np.maximum(square, SHARPEST)
    scale[[0, -1]] = 1.0
    half = 0.5 * lane.width * scale[:, None] * mean
    return points + half, points - half


def _with_predecessors(lanelets: dict[int, Lanelet]) -> dict[int, Lanelet]:
    """Add to lanelets those that lead to them."""
    before: dict[int, list[int]] = {name: [] for name in lanelets}
    for lanelet in lanelets.values():
        for name in lanelet.successors:
            before[name].append(lanelet.id)
    return {
        name: replace(lanelet, predecessors=tuple(before[name]))
        for name, lanelet in lanelets.items()
    }


def lanelets_of_road(road: Road) -> RoadNetwork:
    """Turn a road along a path into one lanelet a lane, or one between its edges."""
    path = road.path
    s = np.arange(0.0, path.length + BEYOND, SPACING)
    edges = []
    lanes = road.lanes
    if len(lanes.centre):
        for centre, width in zip(lanes.centre, lanes.width, strict=True):
            at = np.interp(s, lanes.s, centre)
            half = 0.5 * np.interp(s, lanes.s, width)
            edges.append((at + half, at - half))
    else:
        edges.append(road.bounds.at(s))
    place = path.at(s)
    lanelets = {}
    for k, (left, right) in enumerate(edges, 1):
        lines = [
            np.column_stack(
                [place.x - l * place.sin_heading, place.y + l * place.cos_heading]
            )
            for l in (left, right)
        ]
        lanelets[k] = Lanelet(
            k,
            lines[0],
            lines[1],
            beside_left=(k + 1, True) if k < len(edges) else None,
            beside_right=(k - 1, True) if k > 1 else None,
        )
    return RoadNetwork(lanelets)


def with_lights(
    network: RoadNetwork, path: ReferencePath, signals: Table, n_steps: int
) -> RoadNetwork:
    """Add the traffic lights of the route with the colours that were recorded.

    Args:
        network: Of the run.
        path: Of the ego.
        signals: As recorded.
        n_steps: Of the run.
    """
    lanelets, lights = dict(network.lanelets), dict(network.lights)
    stops = sorted(set(np.asarray(signals["stop_m"], dtype=float).tolist()))
    for k, stop in enumerate(stops):
        rows = np.asarray(signals["stop_m"], dtype=float) == stop
        letters = ["O"] * n_steps
        index = np.asarray(signals["index"])[rows].tolist()
        for step, letter in zip(index, signals["state"][rows].tolist(), strict=True):
            letters[step] = letter
        light = _light(FIRST_LIGHT + k, letters)
        lights[light.id] = light
        x, y, _ = path.pose(stop)
        name = min(
            lanelets,
            key=lambda n: math.hypot(*(lanelets[n].centre[-1] - (x, y))),
        )
        own = lanelets[name]
        refs = (*own.lights, light.id)
        lanelets[name] = replace(own, lights=refs, stop=StopMark(None, refs))
    return replace(network, lanelets=lanelets, lights=lights)


def _light(number: int, letters: list[str]) -> TrafficLight:
    """Turn the letters of all steps into a cycle, which is as long as the run."""
    colours: list[str] = []
    durations: list[int] = []
    for letter in letters:
        colour = COLOURS.get(letter, "green" if letter == "g" else "inactive")
        if colours and colours[-1] == colour:
            durations[-1] += 1
        else:
            colours.append(colour)
            durations.append(1)
    return TrafficLight(number, tuple(colours), tuple(durations), 0, "all", active=True)
