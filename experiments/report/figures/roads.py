"""Pictures of a network, and of a scenario's route in it."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from experiments.report.figures import palette
from experiments.report.figures.outlines import offset_line
from experiments.trace.road_map import RoadMap
from planner.states import FloatArray

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

WIDTH = 7.2  # of the picture [in]
HEIGHT = (1.6, 9.0)  # least and largest [in]
ROOM = 15.0  # about a route [m]
NAME_AT = 0.35  # of an edge: apart from that of the other direction
MOST_NAMES = 60  # edges that are named in a picture


@dataclass(frozen=True, slots=True, eq=False)
class RoutePicture:
    """A route to be drawn; points are (n, 2) [m]."""

    path: FloatArray
    edges: Sequence[FloatArray]  # of the carriageway
    marks: dict[str, FloatArray] = field(default_factory=dict)  # words -> (1, 2)
    bodies: Sequence[FloatArray] = ()  # outlines of obstacles


def draw_network(road_map: RoadMap) -> "Figure":
    """Draw all lanes for cars, with the names of edges if they are few."""
    points = np.concatenate([lane.points for lane in road_map.lanes])
    figure, axes = _figure(points)
    _draw_lanes(axes, road_map)
    named: dict[str, FloatArray] = {
        lane.edge: lane.points
        for lane in road_map.lanes
        if lane.index == 0 and not lane.inside_junction
    }
    for name, line in named.items() if len(named) <= MOST_NAMES else ():
        _write(axes, name, _along(line, NAME_AT))
    return figure


def draw_route(road_map: RoadMap, route: RoutePicture) -> "Figure":
    """Draw a route with start, goal, signals and its sharpest bend."""
    figure, axes = _figure(route.path)
    _draw_lanes(axes, road_map)
    for edge in route.edges:
        axes.plot(*edge.T, color=palette.ROAD_EDGE, lw=palette.MEDIUM)
    axes.plot(*route.path.T, color=palette.MOMENTS[0], lw=palette.EDGE)
    for body in route.bodies:
        axes.fill(*body.T, color=palette.OBSTACLE)
    for words, place in route.marks.items():
        axes.plot(*place.T, "o", ms=4.0, color=palette.MOMENTS[1])
        _write(axes, words, place[0])
    return figure


def _figure(points: FloatArray) -> "tuple[Figure, Axes]":
    """Create a figure in which points have room, in metres."""
    from matplotlib.figure import Figure

    low, high = points.min(axis=0) - ROOM, points.max(axis=0) + ROOM
    ratio = float((high[1] - low[1]) / (high[0] - low[0]))
    height = float(np.clip(WIDTH * ratio, *HEIGHT))
    figure = Figure(figsize=(WIDTH, height), layout="constrained")
    axes = figure.subplots()
    axes.set_aspect("equal")
    axes.set_xlim(low[0], high[0])
    axes.set_ylim(low[1], high[1])
    axes.set_xlabel("x [m]")
    axes.set_ylabel("y [m]")
    return figure, axes


def _draw_lanes(axes: "Axes", road_map: RoadMap) -> None:
    """Draw lanes and junctions."""
    from matplotlib.collections import PolyCollection

    areas: list[Any] = list(road_map.junctions)
    for lane in road_map.lanes:
        left, right = (
            offset_line(lane.points, k * lane.width / 2.0) for k in (1.0, -1.0)
        )
        areas.append(np.concatenate((left, right[::-1])))
    axes.add_collection(
        PolyCollection(
            areas,
            linewidths=palette.THIN / 2.0,
            facecolors=palette.ASPHALT,
            edgecolors=palette.KERB,
        )
    )


def _along(line: FloatArray, share: float) -> FloatArray:
    """Return the point of a polyline at a share of its length, (2,) [m]."""
    s = np.concatenate(([0.0], np.cumsum(np.hypot(*np.diff(line, axis=0).T))))
    return np.array([np.interp(share * s[-1], s, line[:, k]) for k in (0, 1)])


def _write(axes: "Axes", words: str, place: FloatArray) -> None:
    """Write a name at a place."""
    axes.annotate(
        words.replace("$", r"\$"),
        (float(place[0]), float(place[1])),
        xytext=(3, 3),
        textcoords="offset points",
        fontsize=palette.FONT_SIZE - 1.0,
    )
