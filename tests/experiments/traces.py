"""Hand-made traces."""

import math

import numpy as np

from experiments.cosim.records import Ending, EpisodeStatus, StepRecord, TrafficState
from experiments.trace.recording import Setting, build_trace
from experiments.trace.schema import Trace
from planner.interface import PlanResult
from planner.reference_path.frenet import cartesian_to_frenet_one
from planner.reference_path.path import ReferencePath
from planner.reference_path.segments import line
from planner.scene import Obstacles, RoadBounds
from planner.states import CartesianState
from planner.vehicle import Vehicle

STEP = 0.1
CAR = Vehicle()
STRAIGHT = ReferencePath.from_segments([line(1000.0)])


def traffic(time: float, cars=()) -> TrafficState:
    """Cars are (id, x, y, heading, speed, acceleration)."""
    ids = tuple(car[0] for car in cars)
    rows = np.array([car[1:] for car in cars], dtype=float).reshape(-1, 5).T
    size = np.ones(len(ids))
    return TrafficState(time, ids, *rows, 4.0 * size, 2.0 * size)


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
        None if plan is None else 1.0 + index,
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
    setting = Setting("s", "p", 0, STEP, 100.0, 10.0, CAR, path, road, bodies)
    return build_trace(
        setting, records, Ending(status, ""), elapsed or [0.0] * len(records)
    )


def cruising(n: int, speed: float = 10.0, **fields) -> Trace:
    return trace_of(
        [
            record(k, CartesianState(speed * STEP * k, 0, 0, 0, speed, 0), **fields)
            for k in range(n)
        ]
    )
