"""Who is on foot on a crossing of the ego's way, or about to step on it."""

from collections.abc import Sequence, Set

import numpy as np
import shapely

from experiments.cosim.junctions import CrossingZone, RoadJunction
from experiments.cosim.signals import CLEARING, STOP
from experiments.cosim.sumo.libsumo_api import Libsumo
from experiments.cosim.sumo.vehicle_reader import PERSON
from planner.right_of_way.records import Foe
from planner.scene import RoadUsers

WATCHED = 6.0  # on a pavement, so far before a crossing people may step on it [m]
BRISK = 1.8  # nobody is expected to walk faster, unless they do [m/s]
RADIUS = 0.3  # of a person [m]
NO_LINE = -1.0  # people on foot have no line where they would wait [m]


class CrossingReader:
    """Reads the people at the crossings of the ego's junctions.

    Args:
        sumo: The running libsumo module.
        junctions: Of the ego's road.
    """

    def __init__(self, sumo: Libsumo, junctions: Sequence[RoadJunction]) -> None:
        self._sumo = sumo
        self._zones: dict[str, list[tuple[int, CrossingZone]]] = {}
        for number, junction in enumerate(junctions):
            for zone in junction.crossings:
                for edge in (zone.edge, *zone.corners):
                    self._zones.setdefault(edge, []).append((number, zone))

    def foes(self, name: str, near: Set[int], people: RoadUsers, row: int) -> list[Foe]:
        """List the crossings of the ego's way that a person is on, or goes to.

        Args:
            name: Of somebody on foot, as in `people`.
            near: Places of the junctions that are looked at.
            people: All road users.
            row: Of the person.
        """
        if not self._zones:
            return []
        api, person = self._sumo.person, name.removeprefix(PERSON)
        edge = str(api.getRoadID(person))
        onward = str(api.getNextEdge(person))
        known = self._zones.get(edge) or self._zones.get(onward) or ()
        found = []
        for number, zone in known:
            if number not in near:
                continue
            on = edge == zone.edge
            if not on and onward != zone.edge and onward not in zone.corners:
                continue
            far = _places(zone, people, row, on=on)
            if onward in zone.corners and not on and -far[0] > WATCHED:
                continue
            found.append(self._foe(number, zone, name, far, float(people.speed[row])))
        return [foe for foe in found if foe.exit > 0.0]

    def _foe(
        self,
        number: int,
        zone: CrossingZone,
        name: str,
        at: tuple[float, float, float],
        speed: float,
    ) -> Foe:
        """Describe one person; `at` is as of `_places`."""
        station, entry, leave = at
        waits = station < 0.0
        stood = float(self._sumo.person.getWaitingTime(name.removeprefix(PERSON)))
        return Foe(
            junction=number,
            vehicle=name,
            begin_s=zone.begin_s,
            end_s=zone.end_s,
            entry=entry - station,
            exit=leave - station + RADIUS,
            to_line=NO_LINE,
            speed=speed,
            limit=max(speed, BRISK),
            turn_speed=max(speed, BRISK),
            road=0.0,
            merges=False,
            stood=stood,
            goes_first=zone.goes_first,
            gives_way=zone.gives_way,
            held=waits and self._is_held(zone),
        )

    def _is_held(self, zone: CrossingZone) -> bool:
        """Check whether a light holds the people at a crossing."""
        if not zone.signal:
            return False
        state = self._sumo.trafficlight.getRedYellowGreenState(zone.signal)
        return state[zone.signal_link] in STOP | CLEARING


def _places(
    zone: CrossingZone, people: RoadUsers, row: int, *, on: bool
) -> tuple[float, float, float]:
    """Measure along the crossing in the direction in which somebody walks.

    Args:
        zone: The crossing.
        people: All road users.
        row: Of the person.
        on: Whether the person is on the crossing, not before it.

    Returns:
        Where the person is, negative before the crossing, and between which two places
        the ego's way is [m].
    """
    line = shapely.LineString(zone.line)
    x, y = float(people.x[row]), float(people.y[row])
    begin, end = np.hypot(*(zone.line[[0, -1]] - (x, y)).T)
    if on:
        heading = float(people.heading[row])
        along = zone.line[-1] - zone.line[0]
        forwards = along @ (np.cos(heading), np.sin(heading)) >= 0.0
    else:
        forwards = bool(begin <= end)
    station = float(line.project(shapely.Point(x, y))) if on else -float(begin)
    if forwards:
        return station, zone.entry, zone.exit
    station = line.length - station if on else -float(end)
    return station, line.length - zone.exit, line.length - zone.entry
