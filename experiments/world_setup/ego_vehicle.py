"""The ego of a scenario, as the loop and the SUMO traffic need it."""

from experiments.config import Ego
from experiments.cosim.road import EgoTask, Start
from planner.vehicle import Vehicle
from sumo_nets.vehicle_types import EgoType


def ego_task(ego: Ego) -> EgoTask:
    """Make the ego's task of its section."""
    wanted = ego.depart_speed_mps
    speed = None if wanted == "max" else wanted
    return EgoTask(
        vehicle=ego.vehicle.to_planner(),
        goal=ego.goal,
        target_speed=ego.target_speed_mps,
        start=Start(ego.start_m, ego.start_offset_m, speed),
    )


def ego_type(vehicle: Vehicle) -> EgoType:
    """Make the ego's vehicle type in SUMO of its body."""
    limits = vehicle.limits
    return EgoType(
        vehicle.length,
        vehicle.width,
        limits.max_deceleration,
        limits.emergency_deceleration,
        limits.max_speed,
    )
