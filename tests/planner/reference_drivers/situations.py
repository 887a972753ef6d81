import numpy as np

from planner.reference_drivers import ConflictState


def situation(
    gap=20.0, lateral_gap=-0.1, lateral_speed=1.0, speed=20.0, other_speed=10.0
):
    values = np.broadcast_arrays(gap, lateral_gap, lateral_speed, speed, other_speed)
    columns = [np.atleast_1d(np.array(v, dtype=np.float64)) for v in values]
    return ConflictState(*columns, 4.3, 4.3, 1.9)
