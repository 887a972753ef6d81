"""From the simulator's traffic to the scene that a planner gets."""

from dataclasses import dataclass, field

import numpy as np

from experiments.cosim.records import TrafficState
from experiments.cosim.road import EgoTask, Road
from experiments.cosim.unreacting_followers import FASTER, speed_ahead_of
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


def predicted_vehicles(
    road: Road, outlook: Outlook, traffic: TrafficState, ego: CartesianState
) -> Vehicles:
    """Predict every vehicle within `PLANNED_RADIUS` of the ego.

    Args:
        road: Of the episode.
        outlook: How vehicles are predicted.
        traffic: All other vehicles, now.
        ego: Rear axle, now.
    """
    users = traffic.vehicles
    near = np.hypot(users.x - ego.x, users.y - ego.y) <= PLANNED_RADIUS
    planned = users.among(near)
    predict = traffic.future or outlook.predictor
    prediction = predict(road.path, planned, outlook.times, road.lanes)
    if traffic.ways is not None:
        ways = traffic.ways.among(np.flatnonzero(near))
        brake = outlook.predictor is held_braking
        prediction = along_ways(
            prediction, road.path, planned, ways, outlook.times, brake=brake
        )
    return Vehicles.predicted(planned, prediction)


def build_scene(
    road: Road,
    task: EgoTask,
    outlook: Outlook,
    traffic: TrafficState,
    ego: CartesianState,
    ego_frenet: FrenetState,
    stop_lines: tuple[float, ...],
    vehicles: Vehicles | None = None,
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
        vehicles: As of `predicted_vehicles`, if they are known already.

    Returns:
        The scene.
    """
    front = ego_frenet.s + task.vehicle.front_reach
    if vehicles is None:
        vehicles = predicted_vehicles(road, outlook, traffic, ego)
    target = _target_speed(road, task, outlook, traffic, ego, ego_frenet, vehicles)
    return Scene(
        time=traffic.time,
        step=outlook.step,
        ego=ego,
        ego_frenet=ego_frenet,
        vehicle=task.vehicle,
        path=road.path,
        road=road.bounds,
        obstacles=road.known_obstacles(front),
        vehicles=vehicles,
        stop_lines=stop_lines,
        target_speed=target,
        lanes=road.lanes,
        speed_limits=road.speed_limits,
        junctions=traffic.junctions,
        foes=traffic.foes,
        full_statistics=outlook.full_statistics,
    )


def _target_speed(
    road: Road,
    task: EgoTask,
    outlook: Outlook,
    traffic: TrafficState,
    ego: CartesianState,
    ego_frenet: FrenetState,
    vehicles: Vehicles,
) -> float:
    """Return how fast the ego wants to be and may be now [m/s].

    Limits bind, but not to the last: who has to be at a goal in time, or ahead of a
    recorded follower, drives up to `FASTER` times the limit, as recorded traffic does.
    """
    front = ego_frenet.s + task.vehicle.front_reach
    allowed = road.allowed_speed(front, ego.speed)
    wanted = task.wanted_speed(ego_frenet.s, traffic.time, ego.speed)
    most = min(FASTER * allowed, task.vehicle.limits.max_speed)
    hurries = task.region is not None and wanted > task.target_speed
    target = min(wanted, most if hurries else allowed)
    if traffic.future is not None:
        pushed = speed_ahead_of(vehicles, outlook.times, ego_frenet, task.vehicle)
        target = max(target, min(pushed, most))
    return target
