"""Hand-made road users."""

import numpy as np

from planner.scene import RoadUsers


def road_users(*cars: tuple[object, ...], length=4.6, width=1.8) -> RoadUsers:
    """Make cars from (id, x, y, heading, speed, acceleration, lateral speed).

    What is left out at the end is 0.
    """
    table = np.zeros((8, len(cars)))
    for k, (_, *motion) in enumerate(cars):
        table[: len(motion), k] = motion
    table[6], table[7] = length, width
    return RoadUsers.from_table(tuple(str(car[0]) for car in cars), table)
