"""The s-T graph: when and where each vehicle is on the ego's path; [Thesis] 6.4.1.

A vehicle is on the path at distance d if the ego's footprint there, grown by margins,
overlaps the vehicle's. The thesis projects a vehicle only when all four of its corners
are near the path, and ignores the ego's size: a car that is half on the path is then
not there.
"""

from dataclasses import dataclass

import numpy as np

from planner.lane_change.st_projection import interpolate_poses, project
from planner.scene import Vehicles
from planner.states import BoolArray, FloatArray, IntArray, Path
from planner.vehicle import Vehicle


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


def st_graph(
    path: Path,
    vehicle: Vehicle,
    users: Vehicles,
    considered: BoolArray,
    times: FloatArray,
    along_margin: float,
    across_margin: float,
) -> StGraph:
    """Project vehicles onto the path.

    Args:
        path: Of the ego's rear axle.
        vehicle: The ego's dimensions.
        users: With predictions; one that ends early goes on at its last speed.
        considered: Which of them count, (n_users,).
        times: Of the knots, (n_knots,) [s].
        along_margin: Added before and behind [m].
        across_margin: Added on both sides [m].

    Returns:
        The graph of those that are on the path at some knot.
    """
    chosen = np.flatnonzero(considered)
    hit, low, high = project(
        path.distance,
        path_table(path),
        *predicted_at(users, chosen, times),
        0.5 * users.length[chosen],
        0.5 * users.width[chosen],
        (
            vehicle.centre_offset,
            0.5 * vehicle.length + along_margin,
            0.5 * vehicle.width + across_margin,
        ),
    )
    on = np.flatnonzero(hit.any(axis=1))
    return StGraph(
        tuple(users.ids[chosen[k]] for k in on),
        tuple(chosen[on].tolist()),
        hit[on],
        low[on],
        high[on],
        users.speed[chosen[on]],
    )


def path_table(path: Path) -> FloatArray:
    """Give x, y, cosine and sine of the heading at every point, (4, n_points)."""
    heading = path.heading
    return np.array([path.x, path.y, np.cos(heading), np.sin(heading)])


def predicted_at(
    users: Vehicles, chosen: IntArray, times: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Give (x, y, heading), (n, n_knots), of the predictions at `times`."""
    ahead = users.prediction
    return interpolate_poses(ahead.x, ahead.y, ahead.heading, chosen, times, ahead.step)
