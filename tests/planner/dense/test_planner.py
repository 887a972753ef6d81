"""The dense planner in closed loop without a world, and on odd scenes."""

import itertools
import math
from dataclasses import replace

import numpy as np
import pytest

from planner.dense import DensePlanner, DenseSettings, adaptive, proposed, uniform
from planner.dense.planner import DenseMemory
from planner.dense.settings import PathMethod
from planner.interface import PlanStatus
from planner.scene import Obstacles
from planner.shapes.rectangles import Rectangle, distance
from planner.states import Trajectory
from tests.planner.scenes import (
    STEP,
    Car,
    Disc,
    cars,
    clearance_now,
    discs,
    drive,
    ego_on,
    ego_rectangle,
    least_clearance,
    make_scene,
    straight,
    winding,
)

PLANNER = proposed()
FIELD = [
    Disc(25.0, 1.2, 1.5),
    Disc(40.0, -1.5, 1.2),
    Disc(52.0, 2.5, 0.8),
    Disc(68.0, 0.3, 1.0),
    Disc(80.0, -3.0, 2.0),
]


def past(s):
    return lambda scene: scene.ego_frenet.s > s


@pytest.mark.parametrize("path", [straight(), winding()], ids=["straight", "winding"])
@pytest.mark.parametrize("planner", [proposed(), adaptive()], ids=["sides", "adaptive"])
def test_it_drives_through_a_field(path, planner):
    scene = make_scene(path, ego_on(path, speed=8.0), FIELD, target_speed=8.0)
    cycles = drive(planner, scene, 300, until=past(100.0))
    assert len(cycles) < 300
    assert least_clearance(cycles) > 0.05
    limits = scene.vehicle.limits
    for before, after in itertools.pairwise(cycles):
        ego, now = before.scene.ego, after.scene.ego
        assert abs(now.curvature) <= limits.max_curvature + 1e-6
        if before.plan.status is PlanStatus.OK:
            lateral = now.speed**2 * abs(now.curvature)
            assert lateral <= limits.max_lateral_acceleration + 0.05
            assert now.acceleration >= -limits.max_deceleration - 1e-3
        assert abs(now.speed - ego.speed) <= STEP * limits.emergency_deceleration + 1e-6


@pytest.mark.parametrize("speed", [8.0, 14.0])
def test_a_field_is_driven_through_in_comfort(speed):
    path = straight()
    scene = make_scene(path, ego_on(path, speed=8.0), FIELD, target_speed=speed)
    cycles = drive(PLANNER, scene, 200, until=past(100.0))
    lateral = [c.scene.ego.speed**2 * abs(c.scene.ego.curvature) for c in cycles]
    assert max(lateral) <= 2.3
    assert len(cycles) * STEP < 1.15 * 100.0 / 8.0
    assert {cycle.plan.status for cycle in cycles} == {PlanStatus.OK}


def test_the_uniform_lattice_drives_too():
    path = straight()
    scene = make_scene(path, ego_on(path, speed=6.0), FIELD[:2], target_speed=6.0)
    cycles = drive(uniform(), scene, 200, until=past(60.0))
    assert least_clearance(cycles) > 0.0
    assert len(cycles) < 200


def test_sides_do_not_flip_where_two_ways_cost_the_same():
    path = straight()
    scene = make_scene(
        path, ego_on(path, l=0.02, speed=8.0), [Disc(60.0, 0.0, 1.0)], target_speed=8.0
    )
    cycles = drive(PLANNER, scene, 120, until=past(70.0))
    sides = {cycle.plan.memory.sides.get("disc.0") for cycle in cycles[:60]}
    assert len(sides) == 1
    # The same scene with the other side in memory keeps the other side.
    other = DenseMemory(None, {"disc.0": -next(iter(sides))})
    assert PLANNER.plan(scene, other).memory.sides == other.sides


def test_a_side_that_costs_much_more_is_given_up():
    path = straight()
    scene = make_scene(
        path, ego_on(path, speed=8.0), [Disc(50.0, -2.5, 1.5)], target_speed=8.0
    )
    plan = PLANNER.plan(scene, DenseMemory(None, {"disc.0": -1.0}))
    assert plan.memory.sides["disc.0"] == 1.0


def wall(s, gap=0.0):
    return [Disc(s, l, 0.8) for l in np.arange(-5.0, 5.1, 1.5) if abs(l) > gap]


def test_a_closed_road_ends_in_a_stop_with_a_reason():
    path = straight()
    scene = make_scene(
        path, ego_on(path, speed=8.0), [*FIELD[:2], *wall(90.0)], target_speed=8.0
    )
    cycles = drive(PLANNER, scene, 300)
    last = cycles[-1]
    assert last.scene.ego.speed < 1e-3
    assert last.plan.status is PlanStatus.OK
    assert last.plan.stats.reason.startswith("found no passage beyond s = ")
    assert "no way round it for a body 4.8 m long" in last.plan.stats.reason
    assert last.plan.stats.blocker.startswith("disc.")
    assert 1.0 <= clearance_now(last.scene) < 2.5
    assert least_clearance(cycles) > 0.05
    assert {cycle.plan.status for cycle in cycles} == {PlanStatus.OK}


def test_it_stops_as_far_from_what_it_would_pass_beyond_the_end():
    # The lower two of three side by side could be passed, the upper one closes the gap.
    path = straight()
    beside = Disc(52.7, 3.5, 2.5)
    closed = [Disc(60.0, l, 1.58) for l in (-3.3, 0.0, 3.3)]
    scene = make_scene(
        path, ego_on(path, speed=8.0), [beside, *closed], target_speed=8.0
    )
    last = drive(PLANNER, scene, 250)[-1].scene
    assert last.ego.speed < 1e-3
    assert clearance_now(replace(last, obstacles=discs(path, closed))) >= 1.0


def test_who_stands_ahead_is_waited_for():
    path = straight()
    car = Car(60.0, 0.0, 0.0, width=9.0)  # as wide as the road
    scene = make_scene(path, ego_on(path, speed=8.0), (), [car], target_speed=8.0)
    cycles = drive(PLANNER, scene, 150)
    last = cycles[-1]
    assert last.scene.ego.speed < 0.05
    assert last.plan.stats.blocker == "car.0"
    front = last.scene.ego_frenet.s + last.scene.vehicle.front_reach
    assert 1.0 < 60.0 - 2.4 - front < 6.0


@pytest.mark.parametrize("behind", [25.0, 40.0, 300.0])
def test_who_comes_fast_from_behind_is_let_by_before_the_ego_swings_out(behind):
    """The way round what stands leads through the lane in which they drive."""
    path = straight()
    standing = [Disc(105.0, -1.0, 1.2), Disc(105.0, -3.5, 1.2)]
    car = Car(60.0 - behind, 3.0, 13.0)
    scene = make_scene(
        path, ego_on(path, 60.0, speed=5.5), standing, [car], target_speed=5.5
    )
    cycles = drive(PLANNER, scene, 300, traffic=[car], until=past(120.0))
    assert cycles[-1].scene.ego_frenet.s > 118.0
    least = math.inf
    for k, cycle in enumerate(cycles):
        ego = ego_rectangle(cycle.scene.ego, cycle.scene.vehicle)
        s = car.s + car.speed * k * STEP
        least = min(least, distance(ego, Rectangle(s, car.l, 0.0, 4.8, 1.9)))
    assert least > 0.3
    slowest = min(cycle.scene.ego.speed for cycle in cycles)
    assert (slowest < 3.5) == (behind < 100.0)  # who is far away is not waited for


@pytest.mark.parametrize(
    ("room", "status"),
    [(2.2, PlanStatus.FULL_STOP), (-20.0, PlanStatus.LAST_PLAN_SHIFTED)],
)
def test_the_last_plan_is_not_driven_into_a_vehicle(room, status):
    """Too near a vehicle for its gap, no speed plan is allowed: the ladder decides."""
    path, speed = straight(), 3.0
    t = STEP * np.arange(61)
    s, zero = 20.0 + speed * t, np.zeros(61)
    last = Trajectory(t, s, zero, zero, zero, zero + speed, zero, s, zero)
    ego = ego_on(path, 20.0 + speed * STEP, speed=speed)
    scene = make_scene(path, ego, target_speed=8.0)
    front = scene.ego_frenet.s + scene.vehicle.front_reach
    rows = [Car(front + room + 2.4, 0.0, 0.0)]
    if room < 0.0:  # behind it nobody counts, and a closed line leaves no speed
        scene = replace(scene, stop_lines=(front + 0.2,))
    result = PLANNER.plan(replace(scene, vehicles=cars(path, rows)), DenseMemory(last))
    assert result.stats.reason.startswith("no speed along the path: ")
    assert result.status is status
    assert (result.trajectory.s[-1] < scene.ego_frenet.s + 2.0) == (room > 0.0)


def test_a_closed_stop_line_is_kept():
    path = straight()
    scene = make_scene(
        path, ego_on(path, speed=8.0), (), stop_lines=(50.0,), target_speed=8.0
    )
    cycles = drive(PLANNER, scene, 150)
    front = cycles[-1].scene.ego_frenet.s + cycles[-1].scene.vehicle.front_reach
    assert cycles[-1].scene.ego.speed < 0.05
    assert 48.5 < front <= 50.11


def test_a_rectangle_is_a_row_of_discs_and_leaves_the_road_beside_it_open():
    path = straight()
    lorry = Obstacles(
        ("lorry",), *(np.array([v]) for v in (50.0, -2.5, 0.0, 12.0, 2.5, 0.0))
    )
    scene = make_scene(path, ego_on(path, speed=8.0), lorry, target_speed=8.0)
    cycles = drive(PLANNER, scene, 200, until=past(75.0))
    assert len(cycles) < 200
    assert least_clearance(cycles) > 0.05


ODD = {
    "none": [],
    "on the ego": [Disc(1.0, 0.0, 1.0)],
    "all round the ego": [Disc(1.0, l, 1.0) for l in (-3.0, 3.0)]
    + [Disc(8.0, 0.0, 2.0), Disc(-4.0, 0.0, 1.0)],
    "overlapping": [Disc(30.0, 0.0, 1.0), Disc(30.0, 0.0, 1.0), Disc(30.5, 0.2, 2.0)],
    "across the road": wall(30.0),
    "at once": wall(6.0),
    "behind": [Disc(-20.0, 0.0, 2.0)],
    "beyond": [Disc(300.0, 0.0, 2.0)],
    "on the edge": [Disc(30.0, 5.0, 1.0), Disc(40.0, -5.0, 1.0)],
    "two hundred": [
        Disc(s, l, r)
        for s, l, r in np.random.default_rng(5).uniform(
            [10.0, -5.0, 0.1], [200.0, 5.0, 0.5], (200, 3)
        )
    ],
}


@pytest.mark.parametrize("method", PathMethod)
@pytest.mark.parametrize("case", ODD)
@pytest.mark.parametrize(
    "ego",
    [(0.0, 8.0, 0.0), (3.9, 5.0, 0.0), (-6.0, 5.0, 0.0), (0.0, 3.0, 1.2), (0.0, 0, 0)],
    ids=["centre", "at the edge", "off the road", "across", "standing"],
)
def test_odd_scenes_end_in_a_trajectory_and_a_status(case, ego, method):
    path = straight()
    l, speed, error = ego
    planner = DensePlanner(DenseSettings(method=method))
    state = ego_on(path, s=20.0, l=l, speed=speed, error=error)
    moved = [replace(disc, s=disc.s + 20.0) for disc in ODD[case]]
    scene = make_scene(path, state, moved, target_speed=8.0)
    plan = planner.plan(scene, None)
    assert plan.trajectory is not None
    assert plan.trajectory.is_finite()
    assert plan.trajectory.speed[0] == pytest.approx(speed, abs=1e-9)
    assert plan.status is PlanStatus.OK or plan.stats.reason


def test_a_scene_that_is_none_is_refused():
    scene = make_scene(straight(), ego_on(straight(), speed=math.nan), FIELD)
    plan = PLANNER.plan(scene, None)
    assert plan.status is PlanStatus.INVALID_SCENE
    assert plan.trajectory is None


def test_the_same_scene_gives_the_same_plan():
    path = winding()
    scene = make_scene(path, ego_on(path, speed=8.0), FIELD, target_speed=8.0)
    one, two = (proposed().plan(scene, None) for _ in range(2))
    assert one.trajectory.x.tobytes() == two.trajectory.x.tobytes()
    assert one.stats == two.stats


def test_who_stands_between_obstacles_says_between_which():
    path = straight()
    beside = [Disc(21.0, l, 1.0) for l in (-2.05, 2.05)]
    scene = make_scene(
        path, ego_on(path, 20.0, speed=0.0), [*beside, Disc(27.0, 0.0, 2.0)]
    )
    plan = PLANNER.plan(scene, None)
    assert "disc." in plan.stats.reason


def test_who_waits_at_a_line_says_so():
    path = straight()
    ego = ego_on(path, 20.0, speed=0.0)
    scene = make_scene(path, ego, stop_lines=(24.0,), target_speed=8.0)
    plan = PLANNER.plan(scene, None)
    assert plan.stats.reason.startswith("waits at the stop line, 0.2 m ahead")
