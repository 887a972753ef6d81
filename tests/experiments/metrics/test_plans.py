"""Plans off the road, by hand."""

import numpy as np
import pytest

from experiments.metrics.plans import off_road_plans
from planner.interface import PlanResult, PlanStatus
from planner.reference_path.path import ReferencePath
from planner.reference_path.segments import arc
from planner.states import CartesianState, Trajectory
from tests.experiments.traces import CAR, STRAIGHT, record, trace_of

T = 0.1 * np.arange(11)
EDGE = 5.0  # of the road of these traces, to each side [m]
ROOM = EDGE - CAR.width / 2.0


def planned(index, l, path=STRAIGHT, s0=100.0):
    """Return the record of a plan along the path at offsets l, (11,)."""
    s = s0 + 10.0 * T
    road = path.at(s)
    x, y = road.x - l * road.sin_heading, road.y + l * road.cos_heading
    zero = np.zeros_like(T)
    plan = Trajectory(T, x, y, road.heading, zero, zero + 10.0, zero, s, l + zero)
    here = path.pose(s0)
    ego = CartesianState(*here, 0.0, 10.0, 0.0)
    result = PlanResult(PlanStatus.OK, plan, None)
    return record(index, ego, path=path, plan=result)


def test_a_plan_counts_if_its_body_is_off_the_road_somewhere():
    inside = np.full(11, ROOM - 0.01)
    late = np.where(T > 0.85, ROOM + 0.02, 0.0)  # two points at its end
    right = np.full(11, -ROOM - 0.02)
    trace = trace_of([planned(k, l) for k, l in enumerate((inside, late, right))])
    assert off_road_plans(trace) == 2


def test_corners_count_in_a_bend():
    # on the inside of a bend of 40 m the middle of the side is nearest to the edge, by
    # the sagitta of half the car; on the outside the corners are
    path = ReferencePath.from_segments([arc(200.0, 1.0 / 40.0)])
    half = np.hypot(40.0 + ROOM, 0.0) - 40.0
    assert half == pytest.approx(ROOM)
    outside = trace_of([planned(0, np.full(11, -ROOM + 0.02), path)], path=path)
    assert off_road_plans(outside) == 1
    well_inside = trace_of([planned(0, np.full(11, -ROOM + 0.4), path)], path=path)
    assert off_road_plans(well_inside) == 0


def test_nothing_planned_is_nothing_known():
    assert (
        off_road_plans(trace_of([record(0, CartesianState(0, 0, 0, 0, 1, 0))])) is None
    )
