"""The lanes about the ego's route, kept with a run so that it can be drawn later."""

import json
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import numpy as np
from pydantic import Field

from experiments.commonroad.records import RoadNetwork
from experiments.errors import ResultsError
from experiments.storage.json_files import FileSchema, checked, read_json, short
from planner.reference_path.path import ReferencePath
from planner.states import FloatArray, freeze
from sumo_nets.net_reader import read_net
from sumo_nets.net_records import ROADS, Net

MAP_FILE = "map.json"
MAP_SCHEMA = 1
MARGIN = 80.0  # lanes farther from the box around the ego's path are left out [m]
SPACING = 5.0  # between the points of the path that the box is taken from [m]
MIN_CORNERS = 3  # of an area; the junction of a dead end has two, or none
FARTHEST = 1e9  # the largest coordinate of a file that is not damaged [m]
LEAST = 0.01  # width of a lane that is drawn [m]
DIGITS = 3  # millimetres are enough for a drawing


@dataclass(frozen=True, slots=True, eq=False)
class MapLane:
    """One lane that cars may use; `points` is its centre line, (n, 2) [m]."""

    edge: str
    index: int  # 0 is the rightmost lane of its edge
    width: float  # [m]
    inside_junction: bool
    points: FloatArray

    def __post_init__(self) -> None:
        """Freeze the centre line."""
        object.__setattr__(self, "points", freeze(self.points))


Coordinate = Annotated[float, Field(ge=-FARTHEST, le=FARTHEST)]
Point = Annotated[list[Coordinate], Field(min_length=2, max_length=2)]


class LaneEntry(FileSchema):
    """A lane in the file."""

    edge: str
    index: Annotated[int, Field(ge=0)]
    width_m: Annotated[float, Field(gt=0.0, le=FARTHEST)]
    inside_junction: bool
    points_m: Annotated[list[Point], Field(min_length=2)]


class MapFile(FileSchema):
    """The file of a map."""

    lanes: list[LaneEntry]
    junctions_m: list[Annotated[list[Point], Field(min_length=MIN_CORNERS)]]


@dataclass(frozen=True, slots=True, eq=False)
class RoadMap:
    """Lanes and junction areas; both empty for a road without a network."""

    lanes: tuple[MapLane, ...] = ()
    junctions: tuple[FloatArray, ...] = ()  # outlines, (n, 2) each [m]


def map_around(path: ReferencePath, net_file: Path | None) -> RoadMap:
    """Collect the lanes and junctions about a path.

    Args:
        path: Of the ego's route.
        net_file: The network; None for a road without one.

    Returns:
        Lanes and junctions that reach into the box around the path.

    Raises:
        NetworkError: If the network cannot be read.
    """
    if net_file is None:
        return RoadMap()
    net = read_net(net_file)
    box = _box_about(path)
    outlines = [junction.outline for junction in net.junctions.values()]
    areas = [freeze(outline) for outline in outlines if len(outline) >= MIN_CORNERS]
    lanes = [lane for lane in _lanes(net) if _reaches_into(lane.points, box)]
    return RoadMap(tuple(lanes), tuple(a for a in areas if _reaches_into(a, box)))


def _box_about(path: ReferencePath) -> tuple[float, float, float, float]:
    """Return the box around a path and its margin: low x, low y, high x, high y."""
    at = path.at(np.linspace(0.0, path.length, int(path.length / SPACING) + 2))
    x, y = (at.x.min(), at.x.max()), (at.y.min(), at.y.max())
    return (x[0] - MARGIN, y[0] - MARGIN, x[1] + MARGIN, y[1] + MARGIN)


def lanelet_map(path: ReferencePath, network: RoadNetwork) -> RoadMap:
    """Collect the lanelets about a path.

    Each is an area as it is, and a lane of its mean width for the lines; lanelets that
    intersections lead over are drawn as areas alone.
    """
    box = _box_about(path)
    inside = {name for _, name in network.turns}
    lanes, areas = [], []
    for lanelet in network.lanelets.values():
        if not _reaches_into(lanelet.centre, box):
            continue
        areas.append(freeze(np.concatenate([lanelet.left, lanelet.right[::-1]])))
        width = float(np.hypot(*(lanelet.left - lanelet.right).T).mean())
        name, crosses = str(lanelet.id), lanelet.id in inside
        lanes.append(MapLane(name, 0, max(width, LEAST), crosses, lanelet.centre))
    return RoadMap(tuple(lanes), tuple(areas))


def whole_map(net: Net) -> RoadMap:
    """Collect all lanes and junctions of a network."""
    outlines = [junction.outline for junction in net.junctions.values()]
    areas = [freeze(outline) for outline in outlines if len(outline) >= MIN_CORNERS]
    return RoadMap(tuple(_lanes(net)), tuple(areas))


def write_map(road_map: RoadMap, folder: Path) -> None:
    """Write a map into a run folder."""
    content = {
        "schema": MAP_SCHEMA,
        "lanes": [
            {
                "edge": lane.edge,
                "index": lane.index,
                "width_m": lane.width,
                "inside_junction": lane.inside_junction,
                "points_m": _rounded(lane.points),
            }
            for lane in road_map.lanes
        ],
        "junctions_m": [_rounded(outline) for outline in road_map.junctions],
    }
    (folder / MAP_FILE).write_text(json.dumps(content) + "\n", encoding="utf-8")


def read_map(folder: Path) -> RoadMap:
    """Read a map that `write_map` wrote.

    Raises:
        ResultsError: If it is missing, damaged or of another schema version.
    """
    file = folder / MAP_FILE
    content = read_json(file)
    version = content.get("schema")
    if version != MAP_SCHEMA:
        raise ResultsError(
            f"{file}: has map schema version {short(version)}; allowed: {MAP_SCHEMA}"
        )
    found = checked(MapFile, content, file)
    lanes = tuple(
        MapLane(
            lane.edge,
            lane.index,
            lane.width_m,
            lane.inside_junction,
            np.array(lane.points_m),
        )
        for lane in found.lanes
    )
    return RoadMap(lanes, tuple(freeze(np.array(o)) for o in found.junctions_m))


def _lanes(net: Net) -> Iterator[MapLane]:
    """Yield all lanes for cars, edge by edge, by index."""
    for _, edge in sorted(net.edges.items()):
        if edge.function not in ROADS:
            continue  # pavements and crossings
        for lane in edge.drivable_lanes:
            yield MapLane(edge.id, lane.index, lane.width, edge.internal, lane.points)


def _reaches_into(points: FloatArray, box: tuple[float, float, float, float]) -> bool:
    """Check whether the box around points overlaps another box."""
    low, high = points.min(axis=0), points.max(axis=0)
    return bool(
        low[0] <= box[2]
        and high[0] >= box[0]
        and low[1] <= box[3]
        and high[1] >= box[1]
    )


def _rounded(points: FloatArray) -> list[list[float]]:
    """Return points as lists of numbers."""
    rounded: list[list[float]] = np.round(points, DIGITS).tolist()
    return rounded
