"""A picture of a step from above, in the colours of all pictures."""

import math

import numpy as np
from numpy.typing import NDArray

from experiments.cosim.records import StepRecord
from experiments.world_setup.road import Layout
from planner.states import FloatArray
from planner.vehicle import centre_from_rear_axle

SIZE = (7.2, 2.4)  # [in]
RESOLUTION = 100  # [1/in]
BEHIND, AHEAD, ASIDE = 30.0, 60.0, 15.0  # of the ego [m]


def picture(layout: Layout, record: StepRecord) -> NDArray[np.uint8]:
    """Draw the road, the ego and all bodies about it, heading to the right.

    Args:
        layout: Of the scenario.
        record: The step.

    Returns:
        (height, width, 3), 0 to 255.
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure
    from matplotlib.patches import Polygon

    figure = Figure(figsize=SIZE, dpi=RESOLUTION)
    canvas = FigureCanvasAgg(figure)
    axes = figure.add_axes((0.0, 0.0, 1.0, 1.0))
    axes.set(xlim=(-BEHIND, AHEAD), ylim=(-ASIDE, ASIDE), aspect="equal")
    axes.axis("off")
    ego, vehicle = record.ego, layout.task.vehicle
    turn = np.array(
        (
            (math.cos(ego.heading), math.sin(ego.heading)),
            (-math.sin(ego.heading), math.cos(ego.heading)),
        )
    )

    def seen(x: FloatArray, y: FloatArray) -> NDArray[np.float64]:
        """Turn points into the ego's frame, (n, 2)."""
        apart = np.column_stack((np.subtract(x, ego.x), np.subtract(y, ego.y)))
        turned: NDArray[np.float64] = apart @ turn.T
        return turned

    place = record.ego_frenet.s if record.ego_frenet is not None else 0.0
    s = np.arange(max(place - BEHIND, 0.0), place + AHEAD, 1.0)
    road = layout.road.path.at(s)
    for bound in layout.road.bounds.at(s):
        points = seen(
            road.x - bound * road.sin_heading, road.y + bound * road.cos_heading
        )
        axes.plot(*points.T, color="black", lw=1.0)

    def draw(body: tuple[float, ...], colour: str) -> None:
        """Draw a rectangle (x, y, heading, length, width)."""
        x, y, heading, length, width = body
        along = np.array((1.0, 1.0, -1.0, -1.0)) * length / 2.0
        across = np.array((1.0, -1.0, -1.0, 1.0)) * width / 2.0
        cos, sin = math.cos(heading), math.sin(heading)
        corners = seen(x + along * cos - across * sin, y + along * sin + across * cos)
        axes.add_patch(Polygon(corners, closed=True, fc=colour, ec="black", lw=0.5))

    users, static = record.traffic.vehicles, layout.road.obstacles
    for column in users.table[[0, 1, 2, 6, 7]].T:
        draw(tuple(column.tolist()), "white")
    grown = 2.0 * static.radius
    sizes = (static.length + grown, static.width + grown)
    for body in zip(static.x, static.y, static.heading, *sizes, strict=True):
        draw(body, "0.4")
    x, y = centre_from_rear_axle(ego, vehicle)
    draw((x, y, ego.heading, vehicle.length, vehicle.width), "#d55e00")
    canvas.draw()  # type: ignore[no-untyped-call]
    pixels = canvas.buffer_rgba()  # type: ignore[no-untyped-call]
    shown: NDArray[np.uint8] = np.asarray(pixels)[:, :, :3].copy()
    return shown
