"""How the ego, and a slow leader with it, come into running traffic.

SUMO inserts them where it finds safe gaps. It looks at one lane alone, so that whoever
reaches into it from the next one has to be looked for here.
"""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from types import ModuleType

import numpy as np

from experiments.cosim.scene_builder import state_on_path
from experiments.cosim.sumo import frames
from experiments.cosim.sumo.ghost_vehicle import lane_of
from experiments.cosim.sumo.lanes import Lane
from experiments.cosim.sumo.settings import SumoSettings
from experiments.cosim.sumo.vehicle_reader import Row
from experiments.errors import SimulationError
from planner.shapes.rectangles import Rectangle, distance
from planner.states import CartesianState
from planner.vehicle import Vehicle

EGO_ID = "ego"
EGO_ROUTE = "route@ego"
LEADER_ROUTE = "route@leader"
CLEARANCE = 0.5  # between the ego and anybody where it enters [m]
FOLLOWED = tuple(0.2 * k for k in range(11))  # a lane changer is followed for [s]
DRIFTING = 0.05  # a lateral speed from here on is a lane change [m/s]


@dataclass(frozen=True, slots=True, eq=False)
class Departure:
    """Someone about to enter."""

    id: str
    type: str
    route: str
    edge: int  # place in the ego's route
    lane: Lane
    position: float  # of the front bumper on the lane, as SUMO counts [m]
    speed: float | None  # None: as fast as the gap allows [m/s]

    def ask(self, sumo: ModuleType) -> None:
        """Hand it to SUMO, which inserts it as soon as there is a gap."""
        sumo.vehicle.add(
            self.id,
            self.route,
            typeID=self.type,
            departLane=str(self.lane.index),
            departPos=repr(float(self.position)),
            departSpeed="max" if self.speed is None else repr(float(self.speed)),
        )


def departures(
    sumo: ModuleType, settings: SumoSettings, route_lanes: Sequence[Sequence[Lane]]
) -> list[Departure]:
    """Find where the ego enters, and where the slow leader if there is one.

    Returns:
        The ego first.

    Raises:
        SimulationError: If one of them would not be on the route.
    """
    start = start_state(settings, 0.0)
    x, y, _ = frames.front_from_rear_axle(start, settings.vehicle)
    found = _on_route(sumo, route_lanes, x, y)
    if found is None:
        raise SimulationError(
            f"at start_s = {settings.start_s:g} m, start_offset = "
            f"{settings.start_offset:g} m the ego's front bumper is on none of the "
            f"edges {', '.join(settings.route)}"
        )
    ego = Departure(EGO_ID, settings.ego_type, EGO_ROUTE, *found, settings.start_speed)
    leader = settings.leader
    if leader is None:
        return [ego]
    length = float(sumo.vehicletype.getLength(leader.id))
    front = settings.start_s + settings.vehicle.front_reach + leader.gap + length
    there = state_on_path(settings.path, front, settings.start_offset, 0.0)
    found = _on_route(sumo, route_lanes, there.x, there.y)
    if found is None:
        raise SimulationError(
            f"at s = {front:.1f} m the slow leader's front bumper is on none of the "
            f"edges {', '.join(settings.route)}"
        )
    return [ego, Departure(leader.id, leader.id, LEADER_ROUTE, *found, leader.speed)]


def start_state(settings: SumoSettings, speed: float) -> CartesianState:
    """Give the ego's state where it starts."""
    return state_on_path(settings.path, settings.start_s, settings.start_offset, speed)


def stands_free(vehicle: Vehicle, start: CartesianState, others: Iterable[Row]) -> bool:
    """Tell whether nobody is at the ego's place, or about to move into it.

    Someone in mid lane change is followed for a while, as is the ego.

    Args:
        vehicle: The ego's dimensions.
        start: Rear axle where it enters.
        others: Everyone near, as SUMO says it.
    """
    x, y = frames.centre_from_rear_axle(start, vehicle)
    vx = start.speed * math.cos(start.heading)
    vy = start.speed * math.sin(start.heading)
    for front_x, front_y, angle, speed, _, lateral, length, width in others:
        heading = float(frames.heading_from_angle(angle))
        other_x, other_y = frames.centre_from_front(
            front_x, front_y, np.array(heading), np.array(length)
        )
        cos, sin = math.cos(heading), math.sin(heading)
        other_vx, other_vy = speed * cos - lateral * sin, speed * sin + lateral * cos
        for time in FOLLOWED if abs(lateral) > DRIFTING else FOLLOWED[:1]:
            here = Rectangle(
                x + vx * time,
                y + vy * time,
                start.heading,
                vehicle.length,
                vehicle.width,
            )
            there = Rectangle(
                float(other_x) + other_vx * time,
                float(other_y) + other_vy * time,
                heading,
                length,
                width,
            )
            if distance(here, there) < CLEARANCE:
                return False
    return True


def _on_route(
    sumo: ModuleType, route_lanes: Sequence[Sequence[Lane]], x: float, y: float
) -> tuple[int, Lane, float] | None:
    """Find edge, lane and SUMO's lane position of a front bumper."""
    for index, lanes in enumerate(route_lanes):
        number = lane_of(lanes, x, y)
        if number is not None:
            lane = lanes[number]
            # SUMO may count a lane longer or shorter than it is drawn.
            scale = float(sumo.lane.getLength(lane.id)) / lane.length
            return index, lane, lane.project(x, y)[0] * scale
    return None
