"""The road as a run page draws it: lanes, edges, obstacles, stop lines."""

from typing import Any

import numpy as np

from experiments.report.figures.outlines import offset_line, rectangle
from experiments.report.run_reader import numbers
from experiments.trace.road_map import MapLane, RoadMap
from experiments.trace.schema import Table, Trace
from planner.states import FloatArray

DIGITS = 2  # centimetres; a pixel is rarely less


def page_road(trace: Trace, road_map: RoadMap) -> dict[str, Any]:
    """Describe the road by polygons and polylines, [x, y, x, y, ...] in metres.

    Args:
        trace: Its road table gives the ego's carriageway.
        road_map: Lanes and junctions about it.

    Returns:
        Areas of asphalt; lines by kind: kerb, dashed, edge, reference.
    """
    drawn = page_lanes(road_map)
    edges = [_beside(trace.road, numbers(trace.road[key])) for key in _EDGES]
    drawn["areas"].append(_flat(np.concatenate((edges[0], edges[1][::-1]))))
    middle = np.column_stack((numbers(trace.road["x_m"]), numbers(trace.road["y_m"])))
    return {
        **drawn,
        "edges": [_flat(edge) for edge in edges],
        "reference": _flat(middle),
    }


def page_lanes(road_map: RoadMap) -> dict[str, Any]:
    """Describe lanes: areas of asphalt; lines by kind: kerb, dashed."""
    leftmost: dict[str, int] = {}
    for lane in road_map.lanes:
        leftmost[lane.edge] = max(leftmost.get(lane.edge, 0), lane.index)
    areas = [_flat(outline) for outline in road_map.junctions]
    kerbs: list[list[float]] = []
    dashed: list[list[float]] = []
    for lane in road_map.lanes:
        left, right = (offset_line(lane.points, side * lane.width) for side in _SIDES)
        areas.append(_flat(np.concatenate((left, right[::-1]))))
        if lane.inside_junction:
            continue
        (kerbs if _outermost(lane, leftmost) else dashed).append(_flat(left))
        if lane.index == 0:
            kerbs.append(_flat(right))
    return {"areas": areas, "kerbs": kerbs, "dashed": dashed}


def page_obstacles(obstacles: Table) -> list[dict[str, Any]]:
    """Outline the static bodies."""
    keys = ("x_m", "y_m", "heading_rad", "length_m", "width_m", "radius_m")
    bodies = zip(*(numbers(obstacles[key]) for key in keys), strict=True)
    return [
        {"id": str(name), "outline": _flat(rectangle(*body))}
        for name, body in zip(obstacles["id"], bodies, strict=True)
    ]


def page_signals(trace: Trace) -> list[dict[str, Any]]:
    """Place every stop line across the carriageway, with its signal over time."""
    table, road = trace.signals, trace.road
    row_of = {int(index): row for row, index in enumerate(trace.steps["index"])}
    lines: dict[tuple[str, float], list[str]] = {}
    for index, name, stop, state in zip(
        table["index"],
        table["id"],
        numbers(table["stop_m"]),
        table["state"],
        strict=True,
    ):
        letters = lines.setdefault((str(name), float(stop)), [" "] * len(row_of))
        if int(index) in row_of:
            letters[row_of[int(index)]] = str(state)[:1]
    s = numbers(road["s_m"])
    ends = [_beside(road, numbers(road[key])) for key in _EDGES]
    return [
        {
            "id": name,
            "line": [
                round(float(np.interp(stop, s, end[:, k])), DIGITS)
                for end in ends
                for k in (0, 1)
            ],
            "letters": "".join(letters),
        }
        for (name, stop), letters in lines.items()
    ]


_SIDES = (0.5, -0.5)
_EDGES = ("left_m", "right_m")


def _outermost(lane: MapLane, leftmost: dict[str, int]) -> bool:
    """Check whether a lane is the leftmost of its edge."""
    return lane.index == leftmost[lane.edge]


def _beside(road: Table, offset: FloatArray) -> FloatArray:
    """Return the points `offset` to the left of the path, (n, 2) [m]."""
    x, y, heading = (numbers(road[key]) for key in ("x_m", "y_m", "heading_rad"))
    return np.column_stack((x - offset * np.sin(heading), y + offset * np.cos(heading)))


def _flat(points: FloatArray) -> list[float]:
    """Write points one after the other."""
    flat: list[float] = np.round(points, DIGITS).ravel().tolist()
    return flat
