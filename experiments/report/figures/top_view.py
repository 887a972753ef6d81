"""Top view: road, obstacles, the ego's path, and all vehicles at a few moments."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.patches import Polygon
from matplotlib.patheffects import Normal, Stroke

from experiments.report.figures import palette
from experiments.report.figures.outlines import offset_line, rectangle
from experiments.report.run_reader import RunRecord, numbers
from experiments.trace.road_map import MapLane
from experiments.trace.schema import Table
from planner.states import FloatArray

MARGIN = 14.0  # around the ego's path [m]
REACH = 50.0  # vehicles farther from the ego then are left out [m]
NUMBER_GAP = 8.0  # of a moment's number from the ego's centre [pt]
DASHES = (0.0, (6.0, 7.0))  # of lane lines, in line widths


def extent(run: RunRecord) -> tuple[float, float, float, float]:
    """Return (x_min, x_max, y_min, y_max) of the view [m]."""
    x, y = numbers(run.trace.steps["x_m"]), numbers(run.trace.steps["y_m"])
    return (
        float(x.min()) - MARGIN,
        float(x.max()) + MARGIN,
        float(y.min()) - MARGIN,
        float(y.max()) + MARGIN,
    )


def draw_from_above(axes: Axes, run: RunRecord) -> LineCollection:
    """Draw the scene.

    Args:
        axes: Where.
        run: What.

    Returns:
        The ego's way coloured by speed, for the colour bar.
    """
    draw_road(axes, run)
    way = _draw_way(axes, run)
    for number in range(len(run.moments)):
        _draw_moment(axes, run, number)
    x_min, x_max, y_min, y_max = extent(run)
    axes.set(xlim=(x_min, x_max), ylim=(y_min, y_max), xlabel="x [m]", ylabel="y [m]")
    axes.set_aspect("equal")
    return way


def draw_road(axes: Axes, run: RunRecord) -> None:
    """Draw the static parts: lanes, edges, reference path, obstacles."""
    _draw_lanes(axes, run)
    _draw_carriageway(axes, run.trace.road)
    _draw_obstacles(axes, run.trace.obstacles)


def _draw_lanes(axes: Axes, run: RunRecord) -> None:
    """Draw asphalt, lane lines and kerbs."""
    for outline in run.road_map.junctions:
        axes.add_patch(Polygon(outline, fc=palette.ASPHALT, ec="none", zorder=0))
    lanes = run.road_map.lanes
    leftmost: dict[str, int] = {}
    for lane in lanes:
        leftmost[lane.edge] = max(leftmost.get(lane.edge, 0), lane.index)
        half = lane.width / 2.0
        sides = offset_line(lane.points, half), offset_line(lane.points, -half)
        area = np.concatenate((sides[0], sides[1][::-1]))
        axes.add_patch(Polygon(area, fc=palette.ASPHALT, ec=palette.ASPHALT, zorder=0))
    for lane in lanes:
        if not lane.inside_junction:
            _draw_lines(axes, lane, leftmost=lane.index == leftmost[lane.edge])


def _draw_lines(axes: Axes, lane: MapLane, *, leftmost: bool) -> None:
    """Draw the lines on both sides of a lane; a shared one is drawn once."""
    left = offset_line(lane.points, lane.width / 2.0).T
    if leftmost:
        axes.plot(*left, color=palette.KERB, lw=palette.MEDIUM, zorder=1)
    else:
        axes.plot(*left, color=palette.MARKING, lw=palette.MEDIUM, ls=DASHES, zorder=1)
    if lane.index == 0:
        right = offset_line(lane.points, -lane.width / 2.0).T
        axes.plot(*right, color=palette.KERB, lw=palette.MEDIUM, zorder=1)


def _draw_carriageway(axes: Axes, road: Table) -> None:
    """Draw the reference path and the edges of the carriageway."""
    x, y, heading = (numbers(road[key]) for key in ("x_m", "y_m", "heading_rad"))
    edges = []
    for key in ("left_m", "right_m"):
        l = numbers(road[key])
        edges.append((x - l * np.sin(heading), y + l * np.cos(heading)))
    (left_x, left_y), (right_x, right_y) = edges
    area = np.column_stack(
        (
            np.concatenate((left_x, right_x[::-1])),
            np.concatenate((left_y, right_y[::-1])),
        )
    )
    axes.add_patch(Polygon(area, fc=palette.ASPHALT, ec="none", zorder=0))
    for edge in edges:
        axes.plot(*edge, color=palette.ROAD_EDGE, lw=palette.EDGE, zorder=2)
    axes.plot(x, y, color=palette.REFERENCE, lw=palette.THIN, ls=":", zorder=2)


def _draw_obstacles(axes: Axes, obstacles: Table) -> None:
    """Draw the static bodies."""
    keys = ("x_m", "y_m", "heading_rad", "length_m", "width_m", "radius_m")
    for body in zip(*(numbers(obstacles[key]) for key in keys), strict=True):
        axes.add_patch(
            Polygon(rectangle(*body), fc=palette.OBSTACLE, ec="none", zorder=3)
        )


def _draw_way(axes: Axes, run: RunRecord) -> LineCollection:
    """Draw the path of the rear axle, coloured by speed."""
    steps = run.trace.steps
    points = np.column_stack((numbers(steps["x_m"]), numbers(steps["y_m"])))
    speed = numbers(steps["speed_mps"])
    pieces = np.stack((points[:-1], points[1:]), axis=1)  # (n_steps - 1, 2, 2)
    way = LineCollection(
        list(pieces),
        cmap=palette.SPEED_MAP,
        lw=palette.THICK,
        capstyle="round",
        zorder=5,
    )
    way.set_array((speed[:-1] + speed[1:]) / 2.0)
    way.set_clim(0.0, max(float(speed.max()), run.trace.fact("target_speed_mps")))
    axes.add_collection(way)
    return way


def _draw_moment(axes: Axes, run: RunRecord, number: int) -> None:
    """Draw the plan, the vehicles nearby and the ego of one moment."""
    trace, step, colour = run.trace, run.moments[number], palette.MOMENTS[number]
    plan = run.at(trace.plans, step)
    x, y = numbers(trace.plans["x_m"])[plan], numbers(trace.plans["y_m"])[plan]
    axes.plot(x, y, color=colour, lw=palette.MEDIUM, zorder=6)
    ego = ego_centre(run, step)
    now = run.at(trace.vehicles, step)
    for other in _others_near(run, step):
        axes.add_patch(Polygon(rectangle(*other), fc="white", ec=colour, zorder=4))
    size = trace.fact("length_m"), trace.fact("width_m")
    body = Polygon(rectangle(*ego, *size), fc=colour, ec="black", zorder=7)
    body.set_linewidth(palette.THIN)
    axes.add_patch(body)
    x, y = (
        np.append(numbers(trace.obstacles[key]), numbers(trace.vehicles[key])[now])
        for key in ("x_m", "y_m")
    )
    _write_number(axes, number + 1, colour, ego, _free_side(x, y, ego))


def vehicles_shown(run: RunRecord) -> bool:
    """Check whether there is another vehicle in the view from above."""
    return any(_others_near(run, step) for step in run.moments)


def _others_near(
    run: RunRecord, step: int
) -> list[tuple[float, float, float, float, float]]:
    """Return pose and size of the vehicles around the ego in a step."""
    vehicles, (x, y, _) = run.trace.vehicles, ego_centre(run, step)
    now = run.at(vehicles, step)
    keys = ("x_m", "y_m", "heading_rad", "length_m", "width_m")
    columns = (numbers(vehicles[key])[now].tolist() for key in keys)
    return [
        other
        for other in zip(*columns, strict=True)
        if np.hypot(other[0] - x, other[1] - y) <= REACH
    ]


def _write_number(
    axes: Axes, number: int, colour: str, ego: tuple[float, float, float], side: float
) -> None:
    """Write the number of a moment on one side of the ego."""
    x, y, heading = ego
    gap = side * NUMBER_GAP
    axes.annotate(
        str(number),
        (x, y),
        xytext=(-gap * np.sin(heading), gap * np.cos(heading)),
        textcoords="offset points",
        color=colour,
        weight="bold",
        ha="center",
        va="center",
        zorder=8,
        path_effects=[Stroke(linewidth=1.6, foreground="white"), Normal()],
    )


def ego_centre(run: RunRecord, step: int) -> tuple[float, float, float]:
    """Return centre [m] and heading [rad] of the ego, recorded at its rear axle."""
    steps, fact = run.trace.steps, run.trace.fact
    heading = float(steps["heading_rad"][step])
    reach = fact("length_m") / 2.0 - fact("rear_overhang_m")
    x = float(steps["x_m"][step]) + reach * np.cos(heading)
    y = float(steps["y_m"][step]) + reach * np.sin(heading)
    return x, y, heading


def _free_side(x: FloatArray, y: FloatArray, ego: tuple[float, float, float]) -> float:
    """Return the side of the ego away from the nearest body: 1 left, -1 right."""
    if x.size == 0:
        return -1.0
    ego_x, ego_y, heading = ego
    dx, dy = x - ego_x, y - ego_y
    nearest = int(np.argmin(np.hypot(dx, dy)))
    left = dy[nearest] * np.cos(heading) - dx[nearest] * np.sin(heading)
    return -1.0 if left > 0.0 else 1.0
