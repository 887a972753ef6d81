"""Puts the ego into running traffic: into a gap, or in the place of a vehicle."""

from collections.abc import Callable, Sequence

import numpy as np

from experiments.cosim.sumo import frames
from experiments.cosim.sumo.control_modes import KEEP_ROUTE_EXACT
from experiments.cosim.sumo.ego_entry import (
    EGO_ID,
    EGO_ROUTE,
    Departure,
    entry_speed,
    stands_free,
)
from experiments.cosim.sumo.libsumo_api import Libsumo
from experiments.cosim.sumo.settings import EGO_TYPE, VIEW_RADIUS, SumoSettings
from experiments.cosim.sumo.vehicle_reader import VehicleReader
from experiments.errors import EntryError
from planner.reference_path.frenet import state_on_path
from planner.states import CartesianState

SLOWEST_ENTRY = 1.0  # at which the ego always may enter [m/s]


def insert(
    sumo: Libsumo,
    settings: SumoSettings,
    entering: Sequence[Departure],
    reader: VehicleReader,
) -> int:
    """Wait until SUMO finds safe gaps for all of them.

    Args:
        sumo: The running libsumo module.
        settings: Of the world.
        entering: The ego first.
        reader: Of the traffic.

    Returns:
        The steps that this took.

    Raises:
        EntryError: If there is no gap in time.
    """
    ego = entering[0]
    if ego.speed is not None:
        # The scenario decides how fast the ego enters, not the lane's limit.
        _allow(sumo, ego.speed, ego.lane.id)
    fastest = float(sumo.vehicletype.getMaxSpeed(EGO_TYPE))
    if ego.speed is None:
        most = min(fastest, max(entry_speed(settings), SLOWEST_ENTRY))
        sumo.vehicletype.setMaxSpeed(EGO_TYPE, most)
    ahead_first = entering[::-1]  # the vehicle behind adapts to the one ahead
    for one in ahead_first:
        one.ask(sumo)
    for step in _steps(settings):
        sumo.simulationStep()
        arrived = {one.id for one in entering} & set(sumo.vehicle.getIDList())
        if not arrived:
            continue
        if len(arrived) == len(entering) and _stands_free(sumo, settings, reader):
            sumo.vehicletype.setMaxSpeed(EGO_TYPE, fastest)
            return step
        # All at once or none; SUMO considers the lane alone, and another vehicle
        # may reach into it from the next one.
        for one in ahead_first:
            sumo.vehicle.remove(one.id)
            one.ask(sumo)
    speed = "any speed" if ego.speed is None else f"{ego.speed:g} m/s"
    raise EntryError(
        f"no room to enter within {settings.entry_patience:g} s on lane "
        f"{ego.lane.id} at {ego.position:.1f} m with {speed}: take less traffic, "
        "another ego.start_m or network.lane, or ego.depart_speed_mps: max"
    )


def replace_vehicle(
    sumo: Libsumo,
    settings: SumoSettings,
    name: str,
    take_over: Callable[[Libsumo], None],
) -> tuple[CartesianState, int]:
    """Wait for a vehicle of the demand and put the ego in its place.

    Args:
        sumo: The running libsumo module.
        settings: Of the world.
        name: Of the vehicle.
        take_over: Called once the ego is there, before it is moved.

    Returns:
        Where the ego is a step later, beside its path as far as the vehicle was, and
        the steps until the vehicle came.

    Raises:
        EntryError: If the vehicle does not come in time.
    """
    steps = _wait_for(sumo, settings, name)
    path, body = settings.road.path, settings.task.vehicle
    fastest = float(sumo.vehicletype.getMaxSpeed(EGO_TYPE))
    speed = min(float(sumo.vehicle.getSpeed(name)), fastest)
    _allow(sumo, speed, str(sumo.vehicle.getLaneID(name)))
    x, y = sumo.vehicle.getPosition(name)
    angle = float(sumo.vehicle.getAngle(name))
    rear = frames.rear_axle_from_front(x, y, angle, body)
    s, l = path.project(np.array(rear[:1]), np.array(rear[1:2]))
    ego = state_on_path(
        path, max(float(s[0]), 0.0) + speed * settings.step, float(l[0]), speed
    )
    sumo.vehicle.add(EGO_ID, EGO_ROUTE, typeID=EGO_TYPE, departSpeed=repr(speed))
    take_over(sumo)
    sumo.vehicle.setSpeed(EGO_ID, speed)
    x, y, angle = frames.front_from_rear_axle(ego, body)
    sumo.vehicle.moveToXY(EGO_ID, "", -1, x, y, angle, KEEP_ROUTE_EXACT)
    sumo.simulationStep()
    # until now it has kept the place free of those who wait to enter there
    if name in sumo.vehicle.getIDList():
        sumo.vehicle.remove(name)
    return ego, steps


def _wait_for(sumo: Libsumo, settings: SumoSettings, name: str) -> int:
    """Wait until a vehicle has departed; return the steps that this took."""
    for step in _steps(settings):
        sumo.simulationStep()
        if name in sumo.vehicle.getIDList():
            return step
    raise EntryError(
        f'the vehicle "{name}" did not depart within '
        f"{settings.entry_patience:g} s of its time: its road is full"
    )


def _steps(settings: SumoSettings) -> range:
    """Return the numbers of the steps in which the ego may enter, from 1 on."""
    return range(1, max(round(settings.entry_patience / settings.step), 1) + 1)


def _allow(sumo: Libsumo, speed: float, lane: str) -> None:
    """Let the ego enter a lane with this speed, whatever the lane's limit [m/s]."""
    factor = max(1.0, 1.001 * speed / float(sumo.lane.getMaxSpeed(lane)))
    sumo.vehicletype.setSpeedFactor(EGO_TYPE, factor)


def _stands_free(sumo: Libsumo, settings: SumoSettings, reader: VehicleReader) -> bool:
    """Check that no vehicle is in the way of the ego that SUMO has inserted."""
    task, path = settings.task, settings.road.path
    there = task.state_at_start(path, 0.0)
    front = frames.front_from_rear_axle(there, task.vehicle)[:2]
    start = task.state_at_start(path, float(sumo.vehicle.getSpeed(EGO_ID)))
    return stands_free(task.vehicle, start, reader.near(front, VIEW_RADIUS))
