"""Lines l(s) in the frame of the road, moved to the plane."""

import numpy as np

from planner.errors import OutsidePathDomainError
from planner.geometry.frenet import frenet_to_cartesian
from planner.geometry.reference_path import ReferencePath
from planner.states import FloatArray, FrenetStates, Path


def path_in_plane(
    reference: ReferencePath,
    s: FloatArray,
    l: FloatArray,
    slope: FloatArray,
    second: FloatArray,
) -> Path | None:
    """Move a line from the road's frame to the plane; [Thesis] eq. 3.45 corrected.

    Args:
        reference: The road.
        s: Strictly growing, (n,) [m].
        l: (n,) [m].
        slope: dl/ds, (n,) [-].
        second: d²l/ds², (n,) [1/m].

    Returns:
        The path; None where the frame does not reach. Its distance is the trapezoidal
        rule over the stretch of the frame.
    """
    one, none = np.ones_like(s), np.zeros_like(s)
    # driven at one metre of road a second, slope and second derivative are rates
    states = FrenetStates(s, one, none, l, slope, second, slope, second)
    try:
        plane = frenet_to_cartesian(reference, states)
    except OutsidePathDomainError:
        return None
    stretch = np.hypot(1.0 - reference.at(s).curvature * l, slope)
    steps = 0.5 * (stretch[1:] + stretch[:-1]) * np.diff(s)
    distance = np.concatenate([[0.0], np.cumsum(steps)])
    return Path(distance, plane.x, plane.y, plane.heading, plane.curvature, s, l)
