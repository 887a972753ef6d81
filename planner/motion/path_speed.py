"""Path and speed profile to a trajectory: the end of path-velocity decomposition."""

import numpy as np

from planner.errors import InvalidInputError
from planner.states import Path, SpeedProfile, Trajectory


def trajectory_on(path: Path, profile: SpeedProfile) -> Trajectory:
    """Drive a path at a given speed profile.

    Args:
        path: Long enough for the profile.
        profile: Distances along it.

    Returns:
        The trajectory at the profile's times; between the path's points x, y, heading,
        curvature, s and l are linear in the distance, so its spacing is the error.

    Raises:
        InvalidInputError: If the profile goes beyond the path's end.
    """
    reach = float(profile.distance.max())
    if reach > path.distance[-1] + 1e-6:
        raise InvalidInputError(
            f"the profile drives {reach:.2f} m, the path has {path.distance[-1]:.2f} m"
        )
    heading = np.unwrap(path.heading)
    x, y, turned, curvature, s, l = (
        np.interp(profile.distance, path.distance, column)
        for column in (path.x, path.y, heading, path.curvature, path.s, path.l)
    )
    return Trajectory(
        profile.t,
        x,
        y,
        np.arctan2(np.sin(turned), np.cos(turned)),
        curvature,
        profile.speed,
        profile.acceleration,
        s,
        l,
    )
