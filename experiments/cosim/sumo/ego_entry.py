"""How the ego, and a slow leader with it, enter running traffic.

SUMO inserts them where it finds safe gaps. It considers one lane alone, so that
vehicles that reach into it from the next one have to be found here.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from experiments.cosim.sumo import frames
from experiments.cosim.sumo.lanes import Lane, Strip
from experiments.cosim.sumo.libsumo_api import Libsumo
from experiments.cosim.sumo.settings import EGO_TYPE, SumoSettings
from experiments.errors import SimulationError
from planner.reference_path.frenet import state_on_path
from planner.scene import RoadUsers
from planner.shapes.rectangles import Rectangle, distance
from planner.states import CartesianState
from planner.vehicle import Vehicle, centre_from_rear_axle

EGO_ID = "ego"
EGO_ROUTE = "route@ego"
LEADER_ROUTE = "route@leader"
CLEARANCE = 0.5  # between the ego and any vehicle where it enters [m]
REACTION = 0.5  # until the one behind brakes [s]
SIDE_ROOM = 0.2  # a vehicle passing nearer than this is in the way [m]
SAME_WAY = 0.9  # cosine of the angle between vehicles of one direction
IN_WAY = 60.0  # a vehicle farther along than this is not looked at [m]
FOLLOWED = tuple(0.2 * k for k in range(11))  # a lane changer is followed for [s]
ENTRY_BRAKING = 2.5  # that the road ahead may ask for at the entry [m/s²]
ENTRY_SIDEWAYS = 2.2  # lateral acceleration in its bends [m/s²]
ENTRY_STEP = 1.0  # at which the road ahead is looked at [m]
ENTRY_VIEW = 150.0  # [m]
DRIFTING = 0.05  # a lateral speed from here on is a lane change [m/s]


@dataclass(frozen=True, slots=True, eq=False)
class Departure:
    """A vehicle about to enter."""

    id: str
    type: str
    route: str
    edge: int  # place in the ego's route
    lane: Lane
    position: float  # of the front bumper on the lane, as SUMO counts [m]
    speed: float | None  # None: as fast as the gap allows [m/s]

    def ask(self, sumo: Libsumo) -> None:
        """Ask SUMO to insert it as soon as there is a gap."""
        sumo.vehicle.add(
            self.id,
            self.route,
            typeID=self.type,
            departLane=str(self.lane.index),
            departPos=repr(float(self.position)),
            departSpeed="max" if self.speed is None else repr(float(self.speed)),
        )


def departures(
    sumo: Libsumo, settings: SumoSettings, route_lanes: Sequence[Sequence[Lane]]
) -> list[Departure]:
    """Find where the ego enters, and where the slow leader if there is one.

    Returns:
        The ego first.

    Raises:
        SimulationError: If one of them would not be on the route.
    """
    road, task = settings.road, settings.task
    start = task.state_at_start(road.path, 0.0)
    x, y, _ = frames.front_from_rear_axle(start, task.vehicle)
    found = _on_route(sumo, route_lanes, x, y)
    if found is None:
        raise SimulationError(
            f"at start_s = {task.start.s:g} m, start_offset = {task.start.l:g} m the "
            f"ego's front bumper is on none of the edges {', '.join(settings.route)}: "
            "inside a junction, or beside the lanes; take another start_m"
        )
    ego = Departure(EGO_ID, EGO_TYPE, EGO_ROUTE, *found, task.start.speed)
    leader = settings.leader
    if leader is None:
        return [ego]
    length = float(sumo.vehicletype.getLength(leader.id))
    front = task.start.s + task.vehicle.front_reach + leader.gap + length
    there = state_on_path(road.path, front, task.start.l, 0.0)
    found = _on_route(sumo, route_lanes, there.x, there.y)
    if found is None:
        raise SimulationError(
            f"at s = {front:.1f} m the slow leader's front bumper is on none of the "
            f"edges {', '.join(settings.route)}"
        )
    return [ego, Departure(leader.id, leader.id, LEADER_ROUTE, *found, leader.speed)]


def entry_speed(settings: SumoSettings) -> float:
    """Return the speed at which the ego can enter, whatever the traffic is [m/s].

    From it the ego can slow down for the bends ahead, and stop at a traffic light that
    turns red.
    """
    road, start = settings.road, settings.task.start
    front = start.s + settings.task.vehicle.front_reach
    lines = [line.s - front for line in road.stop_lines if line.s > front]
    ahead = np.arange(0.0, ENTRY_VIEW, ENTRY_STEP)
    curvature = np.abs(road.path.at(start.s + ahead).curvature)
    slowest = ENTRY_SIDEWAYS / np.maximum(curvature, 1e-6)
    squares = [*(slowest + 2.0 * ENTRY_BRAKING * ahead)]
    squares += [2.0 * ENTRY_BRAKING * line for line in lines]
    return math.sqrt(min(squares))


def stands_free(vehicle: Vehicle, start: CartesianState, others: RoadUsers) -> bool:
    """Check that no vehicle is at the ego's place, or about to move into it.

    A vehicle in mid lane change is followed for a while, as is the ego. Whatever is
    ahead or behind in the ego's way leaves room to brake.

    Args:
        vehicle: The ego's dimensions.
        start: Rear axle where it enters.
        others: All vehicles near.
    """
    x, y = centre_from_rear_axle(start, vehicle)
    vx = start.speed * math.cos(start.heading)
    vy = start.speed * math.sin(start.heading)
    for row in others.table.T.tolist():
        other_x, other_y, heading, speed, _, lateral, length, width = row
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
                other_x + other_vx * time,
                other_y + other_vy * time,
                heading,
                length,
                width,
            )
            if distance(here, there) < CLEARANCE:
                return False
    return not _too_near(vehicle, start, others)


def _too_near(vehicle: Vehicle, start: CartesianState, others: RoadUsers) -> bool:
    """Check whether someone could not brake in time behind the one ahead.

    Both brake as hard as the ego does in service, the one behind after `REACTION`;
    a lane changer counts from where it is to where it will be after as long.
    """
    x, y = centre_from_rear_axle(start, vehicle)
    cos, sin = math.cos(start.heading), math.sin(start.heading)
    dx, dy = others.x - x, others.y - y
    along, across = dx * cos + dy * sin, dy * cos - dx * sin
    turned = others.heading - start.heading
    moved = across + REACTION * others.lateral_speed
    nearest = np.where(
        across * moved < 0.0, 0.0, np.minimum(np.abs(across), np.abs(moved))
    )
    # a lane changer stands askew, and its ends reach farther than its sides
    reach = others.width * np.cos(turned) + others.length * np.abs(np.sin(turned))
    beside = nearest < (vehicle.width + reach) / 2.0 + SIDE_ROOM
    same_way = np.cos(turned) > SAME_WAY
    gap = np.abs(along) - (vehicle.length + others.length) / 2.0
    ahead = along > 0.0
    behind_speed = np.where(ahead, start.speed, others.speed)
    front_speed = np.where(ahead, others.speed, start.speed)
    braking = 2.0 * vehicle.limits.max_deceleration
    longer = (behind_speed**2 - front_speed**2) / braking
    needed = np.maximum(REACTION * behind_speed + longer, 0.0)
    in_way = beside & same_way & (np.abs(along) < IN_WAY)
    return bool(np.any(in_way & (gap < needed)))


def _on_route(
    sumo: Libsumo, route_lanes: Sequence[Sequence[Lane]], x: float, y: float
) -> tuple[int, Lane, float] | None:
    """Find edge, lane and SUMO's lane position of a front bumper."""
    for index, lanes in enumerate(route_lanes):
        number = Strip(lanes).lane_of(x, y)
        if number is not None:
            lane = lanes[number]
            # SUMO may count a lane longer or shorter than it is drawn.
            scale = float(sumo.lane.getLength(lane.id)) / lane.length
            return index, lane, lane.project(x, y)[0] * scale
    return None
