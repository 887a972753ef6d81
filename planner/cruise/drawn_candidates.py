"""Some of a cycle's candidates to be drawn: a few of each verdict, spread evenly."""

import numpy as np

from planner.cruise.cycle import Cycle
from planner.cruise.feasibility import Check
from planner.interface import KEPT, Alternative
from planner.states import FloatArray, IntArray

MOST_KEPT = 16  # drawn of those that passed
MOST_REMOVED = 6  # drawn of those that one check removed
SPACING = 0.4  # between the points drawn [s]


def alternatives_of(cycle: Cycle, verdict: IntArray) -> tuple[Alternative, ...]:
    """Return the thinned candidates.

    Args:
        cycle: What was evaluated.
        verdict: `Check` of each candidate, (n,).

    Returns:
        In the order of the checks, the ones that passed first; candidates whose
        profile cannot be driven at all have no trajectory and are left out, as are
        those that leave the domain of the path.
    """
    every = max(round(SPACING / cycle.tables.lateral.step), 1)
    found = []
    has_shape = np.repeat(
        cycle.tables.tracks.dropped == Check.PASSED, cycle.tables.lateral.offsets.size
    )
    for check in Check:
        if check is Check.DOMAIN:
            continue
        members = np.flatnonzero((verdict == check) & has_shape)
        most = MOST_KEPT if check is Check.PASSED else MOST_REMOVED
        name = KEPT if check is Check.PASSED else check.name.lower()
        for index in _spread(members, most):
            one = cycle.trajectory(int(index))
            found.append(Alternative(name, _thin(one.x, every), _thin(one.y, every)))
    return tuple(found)


def _spread(members: IntArray, most: int) -> IntArray:
    """Pick up to `most`, evenly over their order, first and last included."""
    if members.size <= most:
        return members
    return members[np.rint(np.linspace(0, members.size - 1, most)).astype(np.int64)]


def _thin(values: FloatArray, every: int) -> FloatArray:
    """Return every so many points, and the last."""
    last = values.size - 1
    thinned: FloatArray = values[[*range(0, last, every), last]]
    return thinned
