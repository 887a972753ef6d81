"""Lines given in a road's Frenet frame, laid into the plane in one compiled loop."""

import numpy as np

from planner.numerics.compiled import compiled
from planner.reference_path.frenet import cartesian_point
from planner.reference_path.linear_curvature import IndexArray
from planner.reference_path.path import ReferencePath
from planner.states import FloatArray, Path


def line_in_plane(
    reference: ReferencePath,
    s: FloatArray,
    l: FloatArray,
    slope: FloatArray,
    bend: FloatArray,
) -> Path | None:
    """Move a line from the road's frame to the plane.

    Args:
        reference: Of the road.
        s: Growing, (n,) [m].
        l: Offsets [m].
        slope: dl/ds [-].
        bend: d²l/ds² [1/m].

    Returns:
        The line; None where it leaves the domain of the frame.
    """
    table = reference.table
    rows, inside = _lay(table.knots, table.bins, s, l, slope, bend)
    return Path.from_rows(rows) if inside else None


@compiled
def _lay(
    knots: FloatArray,
    bins: IndexArray,
    s: FloatArray,
    l: FloatArray,
    slope: FloatArray,
    bend: FloatArray,
) -> tuple[FloatArray, bool]:
    """Return the rows of a `Path`, (7, n), and whether all of it is inside."""
    out = np.empty((7, s.size))
    before = 0.0
    for i in range(s.size):
        # driven at one metre of road a second, slope and bend are rates and the speed
        # is the length of the line over that of the road
        x, y, heading, curvature, stretch, _, inside = cartesian_point(
            knots, bins, s[i], 1.0, 0.0, l[i], slope[i], bend[i]
        )
        if not inside:
            return out, False
        if i == 0:
            out[0, 0] = 0.0
        else:
            out[0, i] = out[0, i - 1] + 0.5 * (before + stretch) * (s[i] - s[i - 1])
        out[1, i], out[2, i], out[3, i], out[4, i] = x, y, heading, curvature
        out[5, i], out[6, i] = s[i], l[i]
        before = stretch
    return out, True
