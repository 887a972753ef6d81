import numpy as np
import pytest

from experiments.cosim.conflict_world import (
    FOLLOWER,
    ConflictWorld,
    FollowerModel,
    leader_motion,
    other_motion,
)
from experiments.cosim.conflicts import braking_leader, cut_in, cut_out
from experiments.cosim.kinematic_world import constant_bounds
from experiments.cosim.road import EgoTask, Road, Start
from planner.reference_path.frenet import state_on_path
from planner.reference_path.path import ReferencePath
from planner.reference_path.segments import line
from planner.vehicle import Vehicle

PATH = ReferencePath.from_segments([line(2000.0)])
VEHICLE = Vehicle(4.3, 1.9, 2.6, 0.9)
FRONT = 300.0 + VEHICLE.front_reach


def world_of(conflicts, *more, side=-1.0, speed=20.0, follower=None):
    road = Road(PATH, constant_bounds(PATH, 5.25))
    task = EgoTask(VEHICLE, 1900.0, speed, Start(300.0, 0.0, speed))
    motions = (other_motion(conflicts, 0, side), *more)
    world = ConflictWorld(road, task, motions, follower)
    world.enter()
    return world


def drive(world, steps, speed=20.0, braking=0.0):
    """Yield the traffic of each step while the ego drives, braking evenly."""
    s, v = 300.0, speed
    for _ in range(steps):
        yield world.observe().vehicles
        s, v = s + v * 0.1, max(v - braking * 0.1, 0.0)
        world.advance(state_on_path(PATH, s, 0.0, v))


def test_cut_in_has_the_gap_and_lateral_gap_of_the_batch():
    conflicts = cut_in(20.0, 10.0, np.array([30.0]), np.array([1.2]))
    for k, users in enumerate(drive(world_of(conflicts), 45)):
        gap = users.x[0] - 2.15 - (FRONT + 2.0 * k)
        assert gap == pytest.approx(conflicts.gap[0] - 1.0 * k)
        lateral = max(conflicts.lateral_gap[k, 0], -1.9)
        assert abs(users.y[0]) - 1.9 == pytest.approx(lateral)
        assert users.y[0] <= 0.0  # from the right
        if lateral > -1.9:
            assert users.lateral_speed[0] == conflicts.lateral_speed[k, 0]
    assert users.y[0] == 0.0
    assert users.lateral_speed[0] == 0.0


def test_gap_at_the_cut_in_is_dx0():
    conflicts = cut_in(20.0, 10.0, np.array([30.0]), np.array([1.2]))
    k = int(conflicts.start[0])
    users = list(drive(world_of(conflicts), k + 1))[-1]
    assert users.x[0] - 2.15 - (FRONT + 2.0 * k) == pytest.approx(30.0)


def test_braking_leader_stands_in_the_end_and_shows_its_braking():
    leader = braking_leader(np.array([20.0]), np.array([5.0]), np.array([40.0]))
    seen = list(drive(world_of(leader), 60))
    assert seen[0].acceleration[0] == 0.0  # nothing has been seen of it yet
    assert seen[5].acceleration[0] == pytest.approx(-5.0)
    assert seen[-1].speed[0] == 0.0
    assert seen[-1].x[0] == seen[-5].x[0]


def test_standing_vehicle_is_hidden_until_the_leader_is_aside():
    conflicts = cut_out(20.0, 40.0, np.array([60.0]), np.array([1.0]))
    leader = leader_motion(conflicts, 0, 40.0, 1.0, 1.0)
    seen = list(drive(world_of(conflicts, leader), 40))
    assert [users.ids for users in seen[:19]] == [("leader",)] * 19  # 1.9 m at 1 m/s
    assert seen[20].ids == ("other", "leader")
    assert seen[20].x[0] - 2.15 == pytest.approx(FRONT + 40.0 + 4.3 + 60.0)
    assert seen[36].y[1] == pytest.approx(3.5)  # the leader keeps the next lane


def test_hidden_vehicle_appears_where_the_ego_reaches_it():
    conflicts = cut_out(20.0, 5.0, np.array([2.0]), np.array([0.1]))
    leader = leader_motion(conflicts, 0, 5.0, 0.1, 1.0)
    seen = list(drive(world_of(conflicts, leader), 12))
    assert "other" not in seen[5].ids
    assert "other" in seen[6].ids  # 11.3 m at 20 m/s


def test_follower_holds_its_gap_and_brakes_behind_a_braking_ego():
    conflicts = cut_in(20.0, 10.0, np.array([500.0]), np.zeros(1))
    calm = world_of(conflicts, follower=FollowerModel())
    gaps = [u.x[u.ids.index(FOLLOWER)] for u in drive(calm, 50)]
    np.testing.assert_allclose(np.diff(gaps), 2.0, rtol=1e-3)
    hard = world_of(conflicts, follower=FollowerModel())
    seen = list(drive(hard, 60, braking=8.0))
    braking = [-u.acceleration[u.ids.index(FOLLOWER)] for u in seen]
    assert 3.0 < max(braking) <= 9.0
    assert seen[-1].x[seen[-1].ids.index(FOLLOWER)] + 2.15 < 300.0 - 0.9 + 26.0
