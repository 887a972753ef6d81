import math

import numpy as np
import pytest

from experiments.cosim.execution import PlanExecution, PlanTiming, StartRule
from experiments.cosim.plant import PerfectTracking, PlannerOutputError
from experiments.cosim.plants.parameters import ACTUATORS, CHASSIS, PlantModel
from experiments.cosim.plants.tracked import PlantSettings, TrackedPlant
from experiments.cosim.records import PlanStartKind
from planner.interface import PlanResult, PlanStatus
from planner.reference_path.frenet import cartesian_to_frenet_one
from planner.reference_path.path import ReferencePath
from planner.reference_path.segments import line
from planner.states import CartesianState, Trajectory

STEP = 0.1
PATH = ReferencePath.from_segments([line(500.0)])
SLOW = PlantSettings(
    PlantModel.DYNAMIC, CHASSIS["car"], actuators=ACTUATORS["autoware"]
)


def ahead_of(state: CartesianState, speed=None) -> Trajectory:
    """Straight on at a steady speed, from where a plan begins."""
    t = STEP * np.arange(31)
    v = state.speed if speed is None else speed
    x = state.x + v * t * math.cos(state.heading)
    y = state.y + v * t * math.sin(state.heading)
    full = np.ones_like(t)
    return Trajectory(
        t, x, y, state.heading * full, 0 * t, v * full, 0 * t, x - state.x, 0 * t
    )


def run(plant, timing, n=30, ego=None, took=1.0):
    execution = PlanExecution(plant, PATH, STEP, timing)
    ego = ego or CartesianState(10.0, 0.0, 0.0, 0.0, 10.0, 0.0)
    starts = {}
    for k in range(n):
        time = STEP * k
        start = execution.start(k, time, ego, cartesian_to_frenet_one(PATH, ego, ego.x))
        if start is not None:
            starts[k] = start
            plan = PlanResult(PlanStatus.OK, ahead_of(start.state), None)
            execution.accept(plan, start, time, took)
        ego = execution.advance(time, ego)
    return starts, ego


def test_a_perfect_plant_plans_from_where_the_ego_is():
    starts, ego = run(PerfectTracking(), PlanTiming())
    assert {start.kind for start in starts.values()} == {PlanStartKind.EGO}
    assert len(starts) == 30
    assert ego.x == pytest.approx(40.0)


def test_plans_are_made_in_every_period():
    starts, ego = run(PerfectTracking(), PlanTiming(period=0.3))
    assert sorted(starts) == list(range(0, 30, 3))
    assert ego.x == pytest.approx(40.0)


@pytest.mark.parametrize("delay", [0.1, 0.2, 0.5])
def test_a_plan_begins_where_the_last_one_is_when_it_takes_effect(delay):
    starts, ego = run(PerfectTracking(), PlanTiming(delay=delay))
    assert starts[0].kind is PlanStartKind.EGO
    for k in range(1, 30):
        assert starts[k].kind is PlanStartKind.STITCHED
        assert starts[k].lead == delay
        assert starts[k].state.x == pytest.approx(10.0 + 10.0 * (STEP * k + delay))
    assert ego.x == pytest.approx(40.0)


def test_a_measured_delay_is_that_of_the_plan_before():
    starts, _ = run(PerfectTracking(), PlanTiming(delay=None), took=140.0)
    assert starts[1].lead == pytest.approx(0.2)  # whole steps
    assert starts[9].lead == pytest.approx(0.2)


def test_a_vehicle_with_errors_is_stitched_or_measured():
    stitched, _ = run(TrackedPlant(SLOW, STEP), PlanTiming())
    assert {s.kind for k, s in stitched.items() if k} == {PlanStartKind.STITCHED}
    assert stitched[20].state.x == pytest.approx(30.0)
    timing = PlanTiming(rule=StartRule.MEASURED)
    measured, _ = run(TrackedPlant(SLOW, STEP), timing)
    assert {s.kind for k, s in measured.items() if k} == {PlanStartKind.MEASURED}


def test_too_far_from_its_plan_the_ego_begins_anew():
    plant = TrackedPlant(SLOW, STEP)
    execution = PlanExecution(plant, PATH, STEP, PlanTiming())
    ego = CartesianState(10.0, 0.0, 0.0, 0.0, 10.0, 0.0)
    start = execution.start(0, 0.0, ego, cartesian_to_frenet_one(PATH, ego, 10.0))
    plan = PlanResult(PlanStatus.OK, ahead_of(ego), None)
    execution.accept(plan, start, 0.0, 1.0)
    for offset, kind in ((0.4, PlanStartKind.STITCHED), (0.6, PlanStartKind.ANEW)):
        off = CartesianState(11.0, offset, 0.0, 0.0, 10.0, 0.0)
        place = cartesian_to_frenet_one(PATH, off, 11.0)
        assert execution.start(1, 0.1, off, place).kind is kind
    late = CartesianState(8.0, 0.0, 0.0, 0.0, 10.0, 0.0)
    place = cartesian_to_frenet_one(PATH, late, 8.0)
    anew = execution.start(1, 0.1, late, place)
    assert anew.kind is PlanStartKind.ANEW
    assert anew.state.x == 8.0


def test_a_plan_has_to_last_until_the_next_one():
    execution = PlanExecution(PerfectTracking(), PATH, STEP, PlanTiming(period=4.0))
    ego = CartesianState(10.0, 0.0, 0.0, 0.0, 10.0, 0.0)
    start = execution.start(0, 0.0, ego, cartesian_to_frenet_one(PATH, ego, 10.0))
    with pytest.raises(PlannerOutputError, match="ends at 3 s"):
        execution.accept(
            PlanResult(PlanStatus.OK, ahead_of(ego), None), start, 0.0, 1.0
        )
