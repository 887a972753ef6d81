"""Whom an ego meets where it swings out of its lanes, over the middle of the road.

No rule of the network says who goes first there: whoever is in its own lane does.
"""

from collections.abc import Mapping

import numpy as np

from experiments.cosim.junctions import RoadJunction, Swing
from planner.right_of_way.records import Foe
from planner.scene import RoadUsers
from planner.states import FloatArray
from planner.ways import NO_WAY, Ways, nearest_on

MEETS = 1.3  # from the middle of another's way to what the ego takes of its lane [m]
AHEAD = 150.0  # on its way, others are looked at: they come while the ego creeps [m]
SPACING = 0.5  # of the places that are looked at [m]
FASTEST = 1.2  # times its speed, another may come [-]
STAYS = 1000.0  # to the exit of one that is not counted on to leave [m]
AT_LINE = 3.0  # a stretch that begins no farther behind the line begins there [m]
SETS_OFF = 3.0  # one that is slower now may come as one with this speed [m/s]
STANDS = 0.3  # a slower one does not use its lane now [m/s] ...
A_WHILE = 2.0  # ... after so long: who stands for a moment goes on at once [s]


def oncoming(
    place: int,
    junction: RoadJunction,
    vehicles: RoadUsers,
    ways: Ways,
    stood: Mapping[str, float],
) -> list[Foe]:
    """List those on whose ways the ego would swing out.

    Args:
        place: Of the junction in the list of those looked at.
        junction: Where the ego leaves its lanes.
        vehicles: Others, n of them.
        ways: Of these vehicles.
        stood: For how long those that stand have done so [s].
    """
    found = []
    for row in np.flatnonzero(ways.way != NO_WAY).tolist():
        line = ways.lines[ways.way[row]]
        heading = float(vehicles.heading[row])
        half = 0.5 * float(vehicles.length[row])
        front = (
            float(vehicles.x[row]) + half * np.cos(heading),
            float(vehicles.y[row]) + half * np.sin(heading),
        )
        at = nearest_on(line, front)[0]
        for swing in junction.swings:
            met = _met(line, at, swing.places, 2.0 * half)
            if met is None or ways.stop[row] < met[0]:
                continue  # it waits at a line before
            speed = max(float(vehicles.speed[row]), 0.0)
            foe = _foe(vehicles.ids[row], speed, met, 2.0 * half, swing)
            # one that is there already is in the way, however long it has stood
            if foe.entry > 0.0 and stood.get(foe.vehicle, 0.0) >= A_WHILE:
                continue
            inside = swing.begin_s > junction.ahead.stop_s + AT_LINE
            if inside and foe.entry > 0.0:
                # behind its line, in the turn, the ego waits for nobody who comes
                foe = foe._replace(exit=STAYS)
            found.append(foe._replace(junction=place))
    return found


def _foe(
    name: str, speed: float, met: tuple[float, float], length: float, swing: Swing
) -> Foe:
    """Describe one that is met.

    Args:
        name: Its id.
        speed: Its speed [m/s].
        met: From where to where on its way, from its front on [m].
        length: Of the vehicle [m].
        swing: Where.
    """
    return Foe(
        junction=0,
        vehicle=name,
        begin_s=swing.begin_s,
        end_s=swing.end_s,
        entry=met[0],
        exit=met[1] + length,
        to_line=met[0],
        speed=speed,
        limit=FASTEST * max(speed, SETS_OFF),
        turn_speed=FASTEST * max(speed, SETS_OFF),
        road=AHEAD,
        merges=False,
        stood=0.0,
        goes_first=True,
        gives_way=False,
        held=False,
    )


def _met(
    line: FloatArray, at: float, taken: FloatArray, length: float
) -> tuple[float, float] | None:
    """Find from where to where, from the front on, a way leads by places; or None.

    Args:
        line: Arc length, x, y of the way's corners, (3, m) [m].
        at: Arc length of the vehicle's front [m].
        taken: Places, (k, 2) [m].
        length: Of the vehicle; what its rear has not left yet counts [m].
    """
    s = np.arange(at - length, min(at + AHEAD, float(line[0, -1])), SPACING)
    if not taken.size:
        return None
    x, y = np.interp(s, line[0], line[1]), np.interp(s, line[0], line[2])
    low, high = taken.min(axis=0) - MEETS, taken.max(axis=0) + MEETS
    about = (x > low[0]) & (x < high[0]) & (y > low[1]) & (y < high[1])
    s, x, y = s[about], x[about], y[about]
    if not s.size:
        return None
    gap = np.hypot(x[:, None] - taken[:, 0], y[:, None] - taken[:, 1])
    near = s[gap.min(axis=1) < MEETS]
    return (float(near[0]) - at, float(near[-1]) - at) if near.size else None
