"""From what the simulator says to what a planner sees."""

import math
from dataclasses import dataclass, field

import numpy as np

from experiments.cosim.records import TrafficState
from experiments.cosim.sumo import frames
from planner.prediction import Predictor, constant_speed
from planner.reference_path.path import ReferencePath
from planner.scene import Lanes, Obstacles, RoadBounds, Scene, Vehicles
from planner.states import CartesianState, FrenetState
from planner.vehicle import Vehicle


@dataclass(frozen=True, slots=True, eq=False)
class SceneFrame:
    """What stays the same in every scene of an episode."""

    step: float  # [s]
    vehicle: Vehicle
    path: ReferencePath
    road: RoadBounds
    obstacles: Obstacles
    target_speed: float  # [m/s]
    predictor: Predictor = constant_speed
    horizon: float = 5.0  # of the predictions [s]
    radius: float = 120.0  # vehicles farther from the ego are left out [m]
    lanes: Lanes = field(default_factory=Lanes.none)

    @property
    def n_steps(self) -> int:
        """Columns of the predictions, the first is now."""
        return round(self.horizon / self.step) + 1


def make_scene(
    frame: SceneFrame,
    traffic: TrafficState,
    ego: CartesianState,
    ego_frenet: FrenetState,
    stop_lines: tuple[float, ...],
) -> Scene:
    """Build the scene of one planning cycle.

    Args:
        frame: What stays the same.
        traffic: Everyone else, now.
        ego: Rear axle, now.
        ego_frenet: The same state along the path.
        stop_lines: Arc lengths that the front bumper must not pass now [m].

    Returns:
        The scene with predictions for every vehicle within `frame.radius`.
    """
    return Scene(
        time=traffic.time,
        step=frame.step,
        ego=ego,
        ego_frenet=ego_frenet,
        vehicle=frame.vehicle,
        path=frame.path,
        road=frame.road,
        obstacles=frame.obstacles,
        vehicles=_vehicles(frame, traffic, ego),
        stop_lines=stop_lines,
        target_speed=frame.target_speed,
        lanes=frame.lanes,
    )


def state_on_path(
    path: ReferencePath, s: float, l: float, speed: float
) -> CartesianState:
    """Give the state of a rear axle that follows the path at a constant offset.

    Args:
        path: The reference path.
        s: Arc length [m].
        l: Offset, positive to the left [m].
        speed: Along the heading [m/s].

    Returns:
        The state; its heading is wrapped, its acceleration 0.
    """
    x, y, heading = path.pose(s)
    curvature = float(path.at(s).curvature)
    return CartesianState(
        x - l * math.sin(heading),
        y + l * math.cos(heading),
        frames.wrapped(heading),
        curvature / (1.0 - curvature * l),
        speed,
        0.0,
    )


def _vehicles(
    frame: SceneFrame, traffic: TrafficState, ego: CartesianState
) -> Vehicles:
    """Pick the vehicles near the ego and predict them."""
    near = np.hypot(traffic.x - ego.x, traffic.y - ego.y) <= frame.radius
    kept = slice(None) if near.all() else np.flatnonzero(near)
    ids = traffic.ids
    if not isinstance(kept, slice):
        ids = tuple(ids[i] for i in kept)
    motion = (
        traffic.x[kept],
        traffic.y[kept],
        traffic.heading[kept],
        traffic.speed[kept],
        traffic.acceleration[kept],
    )
    prediction = frame.predictor(
        frame.path, *motion, traffic.lateral_speed[kept], frame.step, frame.n_steps
    )
    length, width = traffic.length[kept], traffic.width[kept]
    return Vehicles(ids, *motion, length, width, prediction)
