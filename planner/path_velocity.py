"""Path and speed profile to a trajectory: the end of path-velocity decomposition."""

import math

import numpy as np

from planner.errors import InvalidInputError
from planner.numerics.compiled import compiled
from planner.states import FloatArray, Path, SpeedProfile, Trajectory

SHARP = 0.05  # a turn between two points from which their arc counts [rad]


def trajectory_on(path: Path, profile: SpeedProfile) -> Trajectory:
    """Drive a path at a given speed profile.

    Args:
        path: Long enough for the profile.
        profile: Distances along it; they do not fall.

    Returns:
        The trajectory at the profile's times; between the path's points x, y, heading,
        curvature, s and l are linear in the distance, so its spacing is the error. In
        sharp bends x and y are on the arc.

    Raises:
        InvalidInputError: If the profile goes beyond the path's end.
    """
    reach = float(profile.distance.max())
    if reach > path.distance[-1] + 1e-6:
        raise InvalidInputError(
            f"the profile drives {reach:.2f} m, the path has {path.distance[-1]:.2f} m"
        )
    return Trajectory.from_rows(
        _driven(
            path.distance,
            (path.x, path.y, path.curvature, path.s, path.l, path.heading),
            (profile.t, profile.distance, profile.speed, profile.acceleration),
        )
    )


@compiled
def _driven(
    distance: FloatArray,
    line: tuple[FloatArray, ...],
    motion: tuple[FloatArray, FloatArray, FloatArray, FloatArray],
) -> FloatArray:
    """Fill the rows of a `Trajectory`, (9, n).

    Args:
        distance: Along the path, (n_points,) [m].
        line: x, y, curvature, s, l and heading of the path, (n_points,) each.
        motion: Time, distance, speed and acceleration driven, (n,) each.
    """
    x, y, curvature, s, l, heading = line
    time, driven, speed, acceleration = motion
    columns = np.empty((6, x.size))
    columns[0], columns[1], columns[2] = x, y, curvature
    columns[3], columns[4], columns[5] = s, l, heading
    read = _read(driven, distance, columns)
    rows = np.empty((9, time.size))
    rows[0], rows[1], rows[2], rows[3] = time, read[0], read[1], read[5]
    rows[4], rows[5], rows[6] = read[2], speed, acceleration
    rows[7], rows[8] = read[3], read[4]
    return rows


@compiled
def _read(driven: FloatArray, distance: FloatArray, columns: FloatArray) -> FloatArray:
    """Interpolate columns, (n_columns, n_points), at the distances driven.

    The distances must not fall. The last column is the heading: it turns the short way.
    The first two are x and y. Where the heading turns by more than `SHARP` between two
    points, they are put from the chord onto the arc: who plans anew in every step would
    otherwise drift to the inside of the bend.
    """
    n_columns = columns.shape[0]
    out = np.empty((n_columns, driven.size))
    i = 0
    for k in range(driven.size):
        while i < distance.size - 2 and distance[i + 1] < driven[k]:
            i += 1
        share = (driven[k] - distance[i]) / (distance[i + 1] - distance[i])
        share = min(max(share, 0.0), 1.0)
        for c in range(n_columns):
            rise = columns[c, i + 1] - columns[c, i]
            if c == n_columns - 1:
                rise = math.atan2(math.sin(rise), math.cos(rise))
            out[c, k] = columns[c, i] + share * rise
            if c == n_columns - 1 and abs(rise) > SHARP:
                gap = distance[i + 1] - distance[i]
                bulge = 0.5 * gap * rise * share * (1.0 - share)
                middle = columns[c, i] + 0.5 * rise
                out[0, k] += bulge * math.sin(middle)
                out[1, k] -= bulge * math.cos(middle)
        angle = out[n_columns - 1, k]
        out[n_columns - 1, k] = math.atan2(math.sin(angle), math.cos(angle))
    return out
