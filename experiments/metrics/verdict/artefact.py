"""Motion that no vehicle can make, just before a contact."""

import numpy as np

from experiments.metrics.verdict.records import BodyTrack
from planner.numerics.angles import wrapped_all

WINDOW = 1.0  # before the contact [s]
LATERAL = 4.0  # a vehicle that moves sideways faster has jumped [m/s]
LATERAL_SHARE = 0.7  # of its own speed: a wheel does not roll sideways
SLIP = 0.6  # sideways, below which nothing is said [m/s]
SURPLUS = 4.0  # beyond what its speed explains: it was moved [m/s]
SHARPEST = 0.35  # curvature that no vehicle drives [1/m]
TURN = 0.15  # per step, below which nothing is said of it [rad/s]


def impossible_motion(track: BodyTrack, step: float) -> str:
    """Name the motion that no vehicle can make; empty if there is none.

    Args:
        track: Of the vehicle on the map, up to the contact.
        step: Between its rows [s].

    Returns:
        A few words about the last second.
    """
    first = max(len(track.x) - 1 - round(WINDOW / step), 0)
    x, y = track.x[first:], track.y[first:]
    if not np.isfinite(x).all():
        return "appears where it was not" if np.isfinite(x[-1]) else ""
    heading, speed = track.heading[first:], track.speed[first:]
    middle = heading[:-1] + 0.5 * wrapped_all(np.diff(heading))
    dx, dy = np.diff(x) / step, np.diff(y) / step
    along = dx * np.cos(middle) + dy * np.sin(middle)
    across = np.abs(dy * np.cos(middle) - dx * np.sin(middle))
    pace = np.maximum(speed[:-1], speed[1:])
    turn = np.abs(wrapped_all(np.diff(heading))) / step
    # a long body that turns about its front moves its centre sideways by half of it
    swing = 0.5 * track.length * turn
    if (np.abs(along) > pace + SURPLUS).any():
        return "jumps along its way"
    if (across > np.maximum(LATERAL, swing)).any():
        return "jumps sideways"
    if (turn > SHARPEST * pace + TURN).any():
        return "turns on the spot"
    if ((across - swing > LATERAL_SHARE * pace) & (across - swing > SLIP)).any():
        return "slides sideways"
    return ""
