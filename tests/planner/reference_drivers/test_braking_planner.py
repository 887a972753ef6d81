import math

import numpy as np
import pytest

from planner.interface import PlanStatus
from planner.prediction import constant_speed
from planner.reference_drivers import BrakingPlanner, CarefulHuman
from planner.reference_drivers.reaction import FULL_BRAKING
from planner.reference_path.frenet import cartesian_to_frenet_one, state_on_path
from planner.reference_path.path import ReferencePath
from planner.reference_path.segments import line
from planner.scene import Obstacles, RoadBounds, RoadUsers, Scene, Vehicles
from planner.vehicle import Vehicle

VEHICLE = Vehicle()
PATH = ReferencePath.from_segments([line(500.0)])
TIMES = 0.1 * np.arange(51)


def scene(gap, speed=20.0, other_speed=5.0, offset=0.0, obstacles=None):
    """Return a scene with a vehicle `gap` ahead; without one if it is infinite."""
    ego = state_on_path(PATH, 100.0, 0.0, speed)
    rows = []
    if math.isfinite(gap):
        s = 100.0 + VEHICLE.front_reach + gap + 2.4
        rows.append((s, offset, 0.0, other_speed, 0.0, 0.0, 4.8, 1.9))
    users = RoadUsers.from_table(
        tuple("a" for _ in rows), np.array(rows).reshape(-1, 8).T
    )
    prediction = constant_speed(PATH, users, TIMES)
    return Scene(
        0.0,
        0.1,
        ego,
        cartesian_to_frenet_one(PATH, ego),
        VEHICLE,
        PATH,
        RoadBounds(np.zeros(1), np.full(1, 5.0), np.full(1, -5.0)),
        obstacles or Obstacles.none(),
        Vehicles.predicted(users, prediction),
        (),
        20.0,
    )


def braking_after(planner, seen, cycles):
    """Return the deceleration planned in each of some cycles of the same scene."""
    memory, found = None, []
    for _ in range(cycles):
        plan = planner.plan(seen, memory)
        memory = plan.memory
        trajectory = plan.trajectory
        found.append((trajectory.speed[0] - trajectory.speed[1]) / 0.1)
    return np.array(found)


def test_without_a_conflict_speed_and_offset_are_held():
    plan = BrakingPlanner(CarefulHuman()).plan(scene(math.inf), None)
    assert plan.status is PlanStatus.OK
    np.testing.assert_array_equal(plan.trajectory.speed, 20.0)
    np.testing.assert_allclose(plan.trajectory.x, 100.0 + 20.0 * plan.trajectory.t)


def test_delay_coasting_and_jerk_of_the_human():
    # TTC 20/15 s: foot off in the eight steps up to 0.75 s, then 12.65 m/s³.
    braking = braking_after(BrakingPlanner(CarefulHuman()), scene(20.0), 20)
    np.testing.assert_allclose(braking[:8], 0.4, atol=1e-9)
    np.testing.assert_allclose(braking[8], 0.4 + 1.265, atol=1e-9)
    np.testing.assert_allclose(braking[-1], FULL_BRAKING, atol=1e-9)


@pytest.mark.parametrize(
    "seen",
    [scene(20.0, other_speed=20.0), scene(60.0), scene(20.0, offset=3.5)],
    ids=["no closing", "time enough", "other lane"],
)
def test_human_does_not_brake_without_danger(seen):
    assert not braking_after(BrakingPlanner(CarefulHuman()), seen, 12).any()


def test_obstacle_in_the_lane_is_braked_for():
    zero, side = np.zeros(1), np.full(1, 1.9)
    box = Obstacles(("box",), np.full(1, 130.0), zero, zero, side, side, zero)
    braking = braking_after(
        BrakingPlanner(CarefulHuman()), scene(math.inf, obstacles=box), 12
    )
    assert braking[-1] > 5.0


def test_positions_advance_with_the_speed_at_the_end_of_a_step():
    planner, memory = BrakingPlanner(CarefulHuman()), None
    for _ in range(15):
        plan = planner.plan(scene(20.0), memory)
        memory = plan.memory
    motion = plan.trajectory
    np.testing.assert_allclose(np.diff(motion.s), 0.1 * motion.speed[1:], atol=1e-9)
    assert motion.speed[-1] == 0.0
