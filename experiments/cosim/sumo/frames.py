"""Where SUMO's frame meets ours: the only place that knows degrees and bumpers.

SUMO says where the centre of the *front bumper* is and measures angles in degrees
clockwise from north. We say where the centre of the *rectangle* is (other vehicles)
or of the *rear axle* (the ego) and measure radians counter-clockwise from +x.
"""

import math

import numpy as np

from planner.numerics.compiled import compiled
from planner.scene import COLUMNS
from planner.states import CartesianState, FloatArray
from planner.vehicle import Vehicle

RIGHT_ANGLE = 90.0  # from north to east [degrees]
FULL_TURN = 360.0  # [degrees]
X, Y, HEADING, LENGTH = (COLUMNS.index(n) for n in ("x", "y", "heading", "length"))


@compiled
def heading_from_angle(angle: float) -> float:
    """Turn SUMO's angle [degrees, clockwise from north] into a heading [rad]."""
    turned = (RIGHT_ANGLE - angle) % FULL_TURN
    return math.radians(turned - FULL_TURN if turned > FULL_TURN / 2 else turned)


def angle_from_heading(heading: float) -> float:
    """Turn a heading [rad] into SUMO's angle in [0, 360) [degrees]."""
    angle = (RIGHT_ANGLE - math.degrees(heading)) % FULL_TURN
    # The remainder of a tiny negative angle rounds up to a full turn.
    return 0.0 if angle == FULL_TURN else angle


@compiled
def centres_of(fronts: FloatArray) -> FloatArray:
    """Turn SUMO's poses of many vehicles into ours.

    Args:
        fronts: Front bumpers and SUMO's angles, columns in the order of
            `planner.scene.COLUMNS`, (n, 8).

    Returns:
        Centres and headings, (8, n), as in `RoadUsers`.
    """
    table = np.empty((fronts.shape[1], fronts.shape[0]))
    for k in range(fronts.shape[0]):
        table[:, k] = fronts[k]
        heading = heading_from_angle(fronts[k, HEADING])
        half = fronts[k, LENGTH] / 2.0
        table[X, k] = fronts[k, X] - half * math.cos(heading)
        table[Y, k] = fronts[k, Y] - half * math.sin(heading)
        table[HEADING, k] = heading
    return table


def front_from_rear_axle(
    ego: CartesianState, vehicle: Vehicle
) -> tuple[float, float, float]:
    """Go from the ego's rear axle to SUMO's pose.

    Returns:
        (x, y) of the front bumper [m] and SUMO's angle [degrees].
    """
    return (
        ego.x + vehicle.front_reach * math.cos(ego.heading),
        ego.y + vehicle.front_reach * math.sin(ego.heading),
        angle_from_heading(ego.heading),
    )


def rear_axle_from_front(
    x: float, y: float, angle: float, vehicle: Vehicle
) -> tuple[float, float, float]:
    """Go from SUMO's pose of the ego to its rear axle.

    Args:
        x: Front bumper [m].
        y: Front bumper [m].
        angle: SUMO's [degrees].
        vehicle: The ego's dimensions.

    Returns:
        (x, y) of the rear axle [m] and the heading [rad].
    """
    heading = heading_from_angle(angle)
    return (
        x - vehicle.front_reach * math.cos(heading),
        y - vehicle.front_reach * math.sin(heading),
        heading,
    )
