"""From the simulator's traffic to the scene that a planner gets."""

from dataclasses import dataclass, field

import numpy as np

from experiments.cosim.records import TrafficState
from experiments.cosim.road import EgoTask, Road
from planner.prediction import Predictor, constant_speed, held_braking
from planner.scene import Scene, Vehicles
from planner.states import CartesianState, FloatArray, FrenetState, freeze
from planner.ways import along_ways

PLANNED_RADIUS = 120.0  # vehicles farther from the ego are not planned with [m]


@dataclass(frozen=True, slots=True)
class Outlook:
    """How other vehicles are predicted, and what planners are asked to count."""

    step: float  # between columns of the predictions, and planning cycles [s]
    horizon: float = 5.0  # [s]
    predictor: Predictor = constant_speed
    full_statistics: bool = True  # see `Scene`
    times: FloatArray = field(init=False)  # of the predictions, from 0 on [s]

    def __post_init__(self) -> None:
        """Compute the times, which are the same in every cycle."""
        n_steps = max(round(self.horizon / self.step), 1) + 1
        times = freeze(self.step * np.arange(n_steps, dtype=np.float64))
        object.__setattr__(self, "times", times)


def build_scene(
    road: Road,
    task: EgoTask,
    outlook: Outlook,
    traffic: TrafficState,
    ego: CartesianState,
    ego_frenet: FrenetState,
    stop_lines: tuple[float, ...],
) -> Scene:
    """Build the scene of one planning cycle.

    Args:
        road: Of the episode.
        task: Of the ego.
        outlook: How vehicles are predicted.
        traffic: All other vehicles, now.
        ego: Rear axle, now.
        ego_frenet: The same state along the path.
        stop_lines: Arc lengths that the front bumper must not pass now [m].

    Returns:
        The scene with predictions for every vehicle within `PLANNED_RADIUS`.
    """
    users = traffic.vehicles
    front = ego_frenet.s + task.vehicle.front_reach
    near = np.hypot(users.x - ego.x, users.y - ego.y) <= PLANNED_RADIUS
    planned = users.among(near)
    prediction = outlook.predictor(road.path, planned, outlook.times, road.lanes)
    if traffic.ways is not None:
        ways = traffic.ways.among(np.flatnonzero(near))
        brake = outlook.predictor is held_braking
        prediction = along_ways(
            prediction, road.path, planned, ways, outlook.times, brake=brake
        )
    return Scene(
        time=traffic.time,
        step=outlook.step,
        ego=ego,
        ego_frenet=ego_frenet,
        vehicle=task.vehicle,
        path=road.path,
        road=road.bounds,
        obstacles=road.known_obstacles(front),
        vehicles=Vehicles.predicted(planned, prediction),
        stop_lines=stop_lines,
        target_speed=min(task.target_speed, road.allowed_speed(front, ego.speed)),
        lanes=road.lanes,
        speed_limits=road.speed_limits,
        junctions=traffic.junctions,
        foes=traffic.foes,
        full_statistics=outlook.full_statistics,
    )
