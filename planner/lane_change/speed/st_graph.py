"""The s-T graph: when and where each vehicle is on the ego's path; [Thesis] 6.4.1.

A vehicle is on the path at distance d if the ego's footprint there, grown by margins,
overlaps the vehicle's. The thesis projects a vehicle only when all four of its corners
are near the path, and ignores the ego's size: a car that is half on the path is then
not there.
"""

from dataclasses import dataclass

import numpy as np

from planner.lane_change.speed.st_projection import (
    COS,
    SIN,
    OwnRectangle,
    X,
    Y,
    project,
    users_at,
)
from planner.scene import Obstacles, Vehicles
from planner.states import BoolArray, FloatArray, IntArray, Path
from planner.vehicle import Vehicle

NOTHING = Obstacles.none()


@dataclass(frozen=True, slots=True, eq=False)
class UsersInTime:
    """All bodies at the knots of a speed plan, the same for every path.

    A view of its own: its times are those of the plan, between the columns of
    predictions, and its rectangles are grown by the radii of static bodies.
    """

    ids: tuple[str, ...]
    poses: FloatArray  # x, y, cosine and sine of the heading, (n, n_knots, 4)
    half_length: FloatArray  # (n,) [m]
    half_width: FloatArray  # (n,) [m]
    speed: FloatArray  # now, (n,) [m/s]

    def now(self, which: IntArray) -> "UsersInTime":
        """Return some of them at the first knot only."""
        return UsersInTime(
            tuple(self.ids[k] for k in which),
            np.ascontiguousarray(self.poses[which, :1]),
            self.half_length[which],
            self.half_width[which],
            self.speed[which],
        )


@dataclass(frozen=True, slots=True, eq=False)
class StGraph:
    """What is on the path; arrays are (n, n_knots), for the vehicles that hit it.

    `lower` and `upper` bound the distances of the ego's rear axle at which it would
    touch the vehicle; they mean something only where `hit` is true.
    """

    ids: tuple[str, ...]
    index: tuple[int, ...]  # of each vehicle among all
    hit: BoolArray
    lower: FloatArray  # [m]
    upper: FloatArray  # [m]
    speed: FloatArray  # of the vehicle, (n,) [m/s]


def in_time(
    vehicles: Vehicles, times: FloatArray, obstacles: Obstacles | None = None
) -> UsersInTime:
    """Read predictions at `times`; one that ends early goes on at its last speed.

    Obstacles come first. A disc becomes the square about it, a rectangle with a radius
    the larger rectangle: nothing gets smaller. Vehicles without a prediction stand.
    """
    ahead = vehicles.prediction
    motion = (ahead.x, ahead.y, ahead.heading)
    if ahead.x.shape[1] == 0:
        motion = (vehicles.x[:, None], vehicles.y[:, None], vehicles.heading[:, None])
    fixed = NOTHING if obstacles is None else obstacles
    # numpy's functions, which differ from those of compiled code in the last bit
    directions = (np.cos(fixed.heading), np.sin(fixed.heading))
    poses, rows = users_at(
        motion,
        (vehicles.length, vehicles.width, vehicles.speed),
        (fixed.x, fixed.y, *directions, fixed.length, fixed.width, fixed.radius),
        times,
        ahead.step,
    )
    return UsersInTime((*fixed.ids, *vehicles.ids), poses, *rows)


def st_graph(
    path: Path,
    vehicle: Vehicle,
    users: UsersInTime,
    considered: BoolArray,
    along_margin: float,
    across_margin: float,
) -> StGraph:
    """Project vehicles onto the path.

    Args:
        path: Of the ego's rear axle.
        vehicle: The ego's dimensions.
        users: At the knots.
        considered: Which of them count, (n_users,).
        along_margin: Added before and behind [m].
        across_margin: Added on both sides [m].

    Returns:
        The graph of those that are on the path at some knot.
    """
    on, hit, low, high = project(
        path.distance,
        path_table(path),
        users.poses,
        considered,
        users.half_length,
        users.half_width,
        OwnRectangle(
            vehicle.centre_offset,
            0.5 * vehicle.length + along_margin,
            0.5 * vehicle.width + across_margin,
        ),
    )
    index = tuple(on.tolist())
    return StGraph(
        tuple(users.ids[k] for k in index), index, hit, low, high, users.speed[on]
    )


def path_table(path: Path) -> FloatArray:
    """Return the points of a path as compiled code takes them, (4, n_points)."""
    table = np.empty((4, path.x.size))
    table[X], table[Y] = path.x, path.y
    np.cos(path.heading, out=table[COS])
    np.sin(path.heading, out=table[SIN])
    return table
