import math
from dataclasses import replace

import numpy as np
import pytest

from planner.interface import PlanStatus
from planner.prediction import constant_speed
from planner.reference_drivers import IdmMobilPlanner, IdmMobilSettings
from planner.reference_path.frenet import cartesian_to_frenet_one, state_on_path
from planner.reference_path.path import ReferencePath
from planner.reference_path.segments import line
from planner.scene import Lanes, Obstacles, RoadBounds, RoadUsers, Scene, Vehicles
from planner.vehicle import Vehicle

VEHICLE = Vehicle()
PATH = ReferencePath.from_segments([line(800.0)])
TIMES = 0.1 * np.arange(51)
LANES = Lanes(np.zeros(1), np.array([[0.0], [3.5]]), np.full((2, 1), 3.5))
ENDING = Lanes(
    np.array([0.0, 250.0, 251.0]),
    np.array([[0.0] * 3, [3.5] * 3]),
    np.array([[3.5, 3.5, 0.0], [3.5] * 3]),
)
EGO_S = 200.0


def scene(others=(), walls=(), speed=15.0, lanes=LANES, target=20.0, l=0.0):
    """Return a scene; `others` are (bumper gap, l, speed), behind if negative."""
    ego = state_on_path(PATH, EGO_S, l, speed)
    front, rear = EGO_S + VEHICLE.front_reach, EGO_S - VEHICLE.rear_overhang
    rows = [
        (front + gap + 2.4 if gap > 0 else rear + gap - 2.4, y, 0.0, v, 0, 0, 4.8, 1.9)
        for gap, y, v in others
    ]
    ids = tuple(f"v{k}" for k in range(len(rows)))
    users = RoadUsers.from_table(ids, np.array(rows, float).reshape(-1, 8).T)
    n = len(walls)
    obstacles = Obstacles(
        tuple(f"w{k}" for k in range(n)),
        np.array([front + gap + 1.0 for gap, _ in walls]),
        np.array([y for _, y in walls], float),
        np.zeros(n),
        np.full(n, 2.0),
        np.full(n, 2.6),
        np.zeros(n),
    )
    return Scene(
        0.0,
        0.1,
        ego,
        cartesian_to_frenet_one(PATH, ego),
        VEHICLE,
        PATH,
        RoadBounds(np.zeros(1), np.full(1, 5.25), np.full(1, -1.75)),
        obstacles,
        Vehicles.predicted(users, constant_speed(PATH, users, TIMES)),
        (),
        target,
        lanes,
    )


def drive(seen, planner=None, memory=None):
    return (planner or IdmMobilPlanner(IdmMobilSettings())).plan(seen, memory)


def test_idm_is_the_published_formula():
    # a (1 - (15/20)^4 - ((2 + 15*1.2 + 15*5/(2 sqrt(1.5*2)))/40)^2), by hand: -0.601
    planner = IdmMobilPlanner(IdmMobilSettings())
    desired = 2.0 + 18.0 + 75.0 / (2.0 * math.sqrt(3.0))
    by_hand = 1.5 * (1.0 - 0.31640625 - (desired / 40.0) ** 2)
    assert by_hand == pytest.approx(-0.601, abs=1e-3)
    assert planner.idm(15.0, 20.0, 40.0, 10.0) == pytest.approx(by_hand, abs=1e-12)
    assert planner.idm(20.0, 20.0, math.inf, 0.0) == 0.0
    assert planner.idm(0.0, 20.0, math.inf, 0.0) == 1.5


def test_a_free_road_is_driven_with_the_free_acceleration():
    plan = drive(scene())
    assert plan.status is PlanStatus.OK
    assert plan.trajectory.acceleration[0] == pytest.approx(1.5 * (1 - 0.75**4))
    np.testing.assert_allclose(plan.trajectory.l, 0.0, atol=1e-12)


def test_a_slow_leader_is_overtaken_where_the_next_lane_is_free():
    plan = drive(scene([(30.0, 0.0, 8.0)]))
    assert plan.memory.lane == 1
    assert plan.trajectory.l[-1] == pytest.approx(3.5, abs=0.05)


def test_no_change_that_makes_the_follower_brake_too_hard():
    # the follower at 20 m/s, 5 m behind an ego of 15 m/s, would brake with all it has
    near = drive(scene([(30.0, 0.0, 8.0), (-5.0, 3.5, 20.0)]))
    far = drive(scene([(30.0, 0.0, 8.0), (-120.0, 3.5, 20.0)]))
    assert near.memory.lane == 0
    assert far.memory.lane == 1


def test_no_change_into_a_car_abreast():
    plan = drive(scene([(30.0, 0.0, 8.0), (-2.0, 3.5, 15.0)]))
    assert plan.memory.lane == 0


def test_politeness_keeps_a_driver_from_a_small_gain():
    # gain 0.25 m/s² for the ego, where a follower loses 0.6 m/s²
    others = [(60.0, 0.0, 14.0), (-35.0, 3.5, 16.0)]
    selfish = IdmMobilPlanner(IdmMobilSettings(politeness=0.0))
    polite = IdmMobilPlanner(IdmMobilSettings(politeness=1.0))
    assert drive(scene(others), selfish).memory.lane == 1
    assert drive(scene(others), polite).memory.lane == 0


@pytest.mark.parametrize(
    ("walls", "lanes", "queue"),
    [([(60.0, 0.0)], LANES, 0), ([], ENDING, 0), ([(60.0, 0.0)], LANES, 1)],
    ids=["wall", "end", "behind a car that waits at the wall"],
)
def test_a_closed_lane_is_waited_at_where_it_can_still_be_left(walls, lanes, queue):
    # a car abreast for ever: the ego stops `waiting_room` and the gap before the end
    queued = (EGO_S + VEHICLE.front_reach + 57.6, 0.0, 0.0, 0.0, 0.0, 0.0, 4.8, 1.9)
    s, speed, memory = EGO_S, 8.0, None
    for _ in range(400):
        ego = state_on_path(PATH, s, 0.0, speed)
        seen = scene([], walls, lanes=lanes)
        beside = (s + VEHICLE.centre_offset, 3.5, 0.0, speed, 0.0, 0.0, 4.8, 1.9)
        ids = ("beside", "queued")[: 1 + queue]
        rows = np.array([beside, queued])[: 1 + queue]
        users = RoadUsers.from_table(ids, rows.T)
        seen = Scene(
            0.0,
            0.1,
            ego,
            cartesian_to_frenet_one(PATH, ego),
            VEHICLE,
            PATH,
            seen.road,
            seen.obstacles,
            Vehicles.predicted(users, constant_speed(PATH, users, TIMES)),
            (),
            20.0,
            lanes,
        )
        plan = drive(seen, memory=memory)
        memory = plan.memory
        assert memory.lane == 0
        s, speed = float(plan.trajectory.s[1]), float(plan.trajectory.speed[1])
    assert speed < 0.05
    front = s + VEHICLE.front_reach
    stood_before = (EGO_S + VEHICLE.front_reach + 60.0 if walls else 250.0) - front
    stood_before -= 4.8 * queue
    assert 14.0 < stood_before < 18.0


@pytest.mark.parametrize("braking", [1.0, 2.0])
def test_the_room_to_pull_out_is_not_braked_for_hard(braking):
    """A leader slows down gently before the wall, a car abreast keeps the ego there."""
    s, speed, memory, hardest = EGO_S, 8.0, None, 0.0
    leader, leader_speed = EGO_S + VEHICLE.front_reach + 17.0, 8.0
    walls = scene([], [(60.0, 0.0)])
    for _ in range(200):
        rows = [
            (s + VEHICLE.centre_offset, 3.5, 0.0, speed, 0.0, 0.0, 4.8, 1.9),
            (leader, 0.0, 0.0, leader_speed, 0.0, 0.0, 4.8, 1.9),
        ]
        users = RoadUsers.from_table(("beside", "leader"), np.array(rows).T)
        ego = state_on_path(PATH, s, 0.0, speed)
        seen = replace(
            walls,
            ego=ego,
            ego_frenet=cartesian_to_frenet_one(PATH, ego),
            vehicles=Vehicles.predicted(users, constant_speed(PATH, users, TIMES)),
        )
        plan = drive(seen, memory=memory)
        memory, way = plan.memory, plan.trajectory
        hardest = max(hardest, -float(way.acceleration[0]))
        s, speed = float(way.s[1]), float(way.speed[1])
        leader += 0.1 * leader_speed
        leader_speed = max(leader_speed - 0.1 * braking, 0.0)
    assert hardest < 2.2  # b is 2.0
    assert leader - 2.4 - (s + VEHICLE.front_reach) > 3.0


def test_a_change_ends_in_the_middle_of_its_lane_and_is_kept_to():
    planner = IdmMobilPlanner(IdmMobilSettings())
    seen, memory = scene([(30.0, 0.0, 8.0)]), None
    plan = drive(seen, planner, memory)
    ego, memory = plan.trajectory.at(0.1), plan.memory
    for _ in range(80):
        seen = Scene(
            0.0,
            0.1,
            ego,
            cartesian_to_frenet_one(PATH, ego),
            VEHICLE,
            PATH,
            seen.road,
            seen.obstacles,
            scene().vehicles,
            (),
            20.0,
            LANES,
        )
        plan = drive(seen, planner, memory)
        ego, memory = plan.trajectory.at(0.1), plan.memory
        assert (
            abs(ego.curvature) * ego.speed**2 < VEHICLE.limits.max_lateral_acceleration
        )
    assert ego.y == pytest.approx(3.5, abs=0.02)
    assert memory.lane == 1
    assert memory.end is None


def test_without_lanes_whatever_is_in_the_corridor_leads():
    plan = drive(scene([(20.0, 0.5, 5.0)], lanes=Lanes.none()))
    assert plan.stats.blocker == "v0"
    assert plan.trajectory.acceleration[0] < -1.0
    beside = drive(scene([(20.0, 4.0, 5.0)], lanes=Lanes.none()))
    assert beside.stats.blocker is None


def test_settings_out_of_range_are_refused():
    with pytest.raises(ValueError, match="headway must be above 0"):
        IdmMobilSettings(headway=0.0)
    with pytest.raises(ValueError, match="politeness must be at least 0"):
        IdmMobilSettings(politeness=-0.1)
