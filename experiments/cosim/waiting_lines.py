"""Whether the ego is at a line of its road where it may have to wait.

SUMO counts some that wait there in the junction already, and everybody else waits for
them; its worlds put those back.
"""

from experiments.cosim.road import Road

LINE_VIEW = 2.0  # a line so near ahead is one that the ego may wait at [m]
STANDING = 0.1  # slower is standing [m/s]
OVER_LINE = 0.35  # a bumper this far beyond a line still counts as waiting at it [m]


def is_before_line(road: Road, front: float, speed: float) -> bool:
    """Check whether the ego's front is before a line of its road, or stands at it.

    One that stands a little over a line still waits there; one that drives over it is
    in the junction.

    Args:
        road: Its road.
        front: Arc length of its front bumper [m].
        speed: Its speed [m/s].
    """
    over = OVER_LINE if abs(speed) < STANDING else 0.0
    lines = [line.s for line in road.stop_lines]
    lines += [junction.ahead.stop_s for junction in road.junctions]
    return any(-over <= line - front < LINE_VIEW for line in lines)
