"""Hand-made traces."""

import math

import numpy as np

from experiments.cosim.records import (
    Ending,
    EpisodeStatus,
    PlanningTime,
    StepRecord,
    TrafficState,
)
from experiments.cosim.road import EgoTask, Road
from experiments.trace.recording import RunFacts, build_trace
from experiments.trace.schema import Trace
from planner.interface import PlanResult
from planner.reference_path.frenet import cartesian_to_frenet_one
from planner.reference_path.path import ReferencePath
from planner.reference_path.segments import line
from planner.scene import Obstacles, RoadBounds
from planner.states import CartesianState
from planner.vehicle import Vehicle
from tests.experiments.road_users import road_users

STEP = 0.1
CAR = Vehicle()
STRAIGHT = ReferencePath.from_segments([line(1000.0)])


def traffic(time: float, cars=()) -> TrafficState:
    """Cars are (id, x, y, heading, speed, acceleration)."""
    return TrafficState(time, road_users(*cars, length=4.0, width=2.0))


def record(
    index: int,
    ego: CartesianState,
    *,
    path: ReferencePath = STRAIGHT,
    cars=(),
    plan: PlanResult | None = None,
    contacts=(),
    clearance: float = math.inf,
    off_road: float = 0.0,
) -> StepRecord:
    time = index * STEP
    frenet = cartesian_to_frenet_one(path, ego, None)
    return StepRecord(
        index,
        time,
        ego,
        frenet,
        traffic(time, cars),
        (),
        plan,
        None if plan is None else PlanningTime(1.0 + index, 0.5 + index),
        contacts,
        clearance,
        None,
        off_road,
    )


def trace_of(
    records,
    status=EpisodeStatus.ARRIVED,
    path=STRAIGHT,
    elapsed=None,
    obstacles=None,
) -> Trace:
    road = RoadBounds(np.array([0.0]), np.array([5.0]), np.array([-5.0]))
    bodies = Obstacles.none() if obstacles is None else obstacles
    return build_trace(
        RunFacts("s", "p", 0, STEP),
        Road(path, road, obstacles=bodies),
        EgoTask(CAR, 100.0, 10.0),
        records,
        Ending(status, ""),
        elapsed or [0.0] * len(records),
    )


def cruising(n: int, speed: float = 10.0, **fields) -> Trace:
    return trace_of(
        [
            record(k, CartesianState(speed * STEP * k, 0, 0, 0, speed, 0), **fields)
            for k in range(n)
        ]
    )
