import itertools
import math
from dataclasses import replace

import numpy as np
import pytest

from planner.lane_change.path import ChangeTarget, best_change, lane_keeping_path
from planner.lane_change.settings import PathSettings, SpeedSettings
from planner.lane_change.speed.passing_orders import (
    DriveLimits,
    Order,
    Side,
    demands,
    possible_orders,
    reachable,
)
from planner.lane_change.speed.plan import SpeedPlan, plan_speed, soft_speed
from planner.lane_change.speed.program import (
    SpeedTask,
    knot_times,
    program,
    speed_caps,
    start_state,
)
from planner.lane_change.speed.st_graph import UsersInTime, in_time, st_graph
from planner.piecewise_jerk.solve import QpStatus, solve
from planner.scene import Scene
from planner.shapes.rectangles import Rectangle, distance
from planner.states import Path
from planner.vehicle import Vehicle, VehicleLimits
from tests.planner.lane_change.roads import on_lanes
from tests.planner.scenes import Car

SETTINGS = SpeedSettings()
# of the published scenario: no gaps beyond the margins
BARE = replace(
    SETTINGS, front_gap=0.0, front_headway=0.0, rear_gap=0.0, rear_headway=0.0
)
PUBLISHED = Vehicle(
    limits=VehicleLimits(max_speed=20.0, max_acceleration=2.5, max_deceleration=4.0)
)
SHAPE = PathSettings(
    change_times=(0.1,), min_lengths=(60.0,), c_ratios=(0.2,), lateral_acceleration=9.0
)
CAR = Vehicle()
LIMITS = DriveLimits(-4.5, 3.0, 20.0)


def moving(scene: Scene) -> UsersInTime:
    return in_time(scene.vehicles, knot_times(SETTINGS))


def change_path(scene: Scene) -> Path:
    found, _ = best_change(
        scene.path, scene.ego_frenet, ChangeTarget(1.75, 0.0, 220.0), CAR, SHAPE
    )
    assert found is not None
    return found.path


def keep_path(scene: Scene) -> Path:
    path = lane_keeping_path(scene.path, scene.ego_frenet, -1.75, 220.0, PathSettings())
    assert path is not None
    return path


def following(scene: Scene):
    everyone = np.ones(len(scene.vehicles.ids), np.bool_)
    task = SpeedTask(scene.ego.speed, scene.ego.acceleration, 13.9)
    path = keep_path(scene)
    return plan_speed(path, CAR, moving(scene), everyone, task, SETTINGS), path


def planned(scene: Scene, vehicle: Vehicle, settings: SpeedSettings, wish: float):
    everyone = np.ones(len(scene.vehicles.ids), np.bool_)
    task = SpeedTask(scene.ego.speed, scene.ego.acceleration, wish)
    path = change_path(scene)
    return plan_speed(path, vehicle, moving(scene), everyone, task, settings), path


def published(speed: float) -> SpeedPlan:
    """Rear car 14 m/s, 12 m behind centre to centre, in the target lane."""
    rear = Car(100.0 + CAR.centre_offset - 12.0, 1.75, 14.0)
    scene = on_lanes(s=100.0, speed=speed, cars=[rear])
    return planned(scene, PUBLISHED, BARE, 11.0)[0]


def test_case_1_yields_and_follows():
    plan = published(9.0)
    assert plan.order == (("car.0", Side.AFTER),)
    v = plan.profile.speed
    assert v[0] == 9.0
    assert v.min() == pytest.approx(7.5, abs=0.6)  # 6.97
    assert v.max() == pytest.approx(12.0, abs=0.3)
    assert v[-1] == pytest.approx(11.6, abs=0.5)
    assert np.argmin(v) < np.argmax(v)


def test_case_2_goes_first():
    plan = published(15.0)
    assert plan.order == (("car.0", Side.BEFORE),)
    v = plan.profile.speed
    assert v[0] == 15.0
    assert v.min() == pytest.approx(12.5, abs=0.5)
    assert v[-1] == pytest.approx(14.0, abs=0.4)


@pytest.mark.parametrize("speed", [9.0, 15.0])
def test_both_orders_of_a_case_are_priced(speed):
    plan = published(speed)
    costs = {a.sides[0][1]: a.cost for a in plan.alternatives}
    assert plan.cost == min(costs.values())
    for limit, values in (
        ((-4.0, 2.5), plan.profile.acceleration),
        ((-5.0, 5.0), plan.profile.jerk),
    ):
        assert values.min() >= limit[0] - 1e-6
        assert values.max() <= limit[1] + 1e-6


def random_scene(rng: np.random.Generator, n: int) -> Scene:
    """Cars ahead and behind in both lanes, none on the ego."""
    cars: list[Car] = []
    while len(cars) < n:
        s, lane = rng.uniform(20.0, 220.0), rng.choice([-1.75, 1.75])
        near = [c for c in cars if c.l == lane and abs(c.s - s) < 8.0]
        if near or (lane < 0.0 and s < 112.0):
            continue
        cars.append(Car(float(s), float(lane), float(rng.uniform(4.0, 16.0))))
    return on_lanes(s=100.0, speed=float(rng.uniform(2.0, 16.0)), cars=cars)


def brute_force(scene: Scene, wish: float) -> float:
    """Least cost over all 2^m orders, without any pruning."""
    path, times = change_path(scene), knot_times(SETTINGS)
    everyone = np.ones(len(scene.vehicles.ids), np.bool_)
    graph = st_graph(path, CAR, moving(scene), everyone, 1.0, 0.3)
    task = SpeedTask(scene.ego.speed, scene.ego.acceleration, wish)
    start = start_state(task, CAR, SETTINGS)
    bounds = demands(graph, SETTINGS, start.speed, times)
    caps = speed_caps(path, CAR, task, times, SETTINGS.lateral_acceleration)
    best = math.inf
    for sides in itertools.product((Side.BEFORE, Side.AFTER), repeat=len(graph.ids)):
        lower, upper = np.full(times.size, -1.0), np.full(times.size, path.distance[-1])
        headway = np.full(times.size, np.inf)
        for v, side in enumerate(sides):
            if side is Side.BEFORE:
                lower = np.maximum(lower, bounds.above[v])
            else:
                upper = np.minimum(upper, bounds.below[v])
                headway = np.minimum(headway, bounds.headway[v])
        order = Order(sides, lower, upper, headway)
        found = solve(program(order, start, caps, task, CAR, SETTINGS))
        if found.status is QpStatus.SOLVED:
            best = min(best, found.objective)
    return best


def check_against_brute_force(seeds: range, most: int) -> None:
    solved = 0
    for seed in seeds:
        rng = np.random.default_rng(seed)
        scene = random_scene(rng, int(rng.integers(1, most + 1)))
        plan, _ = planned(scene, CAR, SETTINGS, 13.9)
        expected = brute_force(scene, 13.9)
        assert plan.cost == pytest.approx(expected, rel=1e-5, abs=1e-5), seed
        solved += math.isfinite(expected)
    assert solved > 0.2 * len(seeds)


def test_no_passing_order_is_dropped_wrongly():
    check_against_brute_force(range(30), 5)


@pytest.mark.slow
def test_no_passing_order_is_dropped_wrongly_among_eight():
    check_against_brute_force(range(1000, 1300), 8)


def test_an_order_that_was_given_up_costs_at_least_what_is_said():
    times, given_up = knot_times(SETTINGS), 0
    for seed in range(25):
        scene = random_scene(np.random.default_rng(seed), 5)
        plan, path = planned(scene, CAR, SETTINGS, 13.9)
        everyone = np.ones(5, np.bool_)
        graph = st_graph(path, CAR, moving(scene), everyone, 1.0, 0.3)
        task = SpeedTask(scene.ego.speed, scene.ego.acceleration, 13.9)
        start = start_state(task, CAR, SETTINGS)
        bounds = demands(graph, SETTINGS, start.speed, times)
        reach = reachable(start.speed, start.acceleration, LIMITS, 5.0, times)
        caps = speed_caps(path, CAR, task, times, SETTINGS.lateral_acceleration)
        said = {a.sides: a for a in plan.alternatives}
        orders, _ = possible_orders(graph, bounds, reach, path.distance[-1], 64)
        for order in orders:
            named = tuple(zip(graph.ids, order.sides, strict=True))
            if named in said and not said[named].exact:
                found = solve(program(order, start, caps, task, CAR, SETTINGS))
                assert found.objective >= said[named].cost * (1.0 - 1e-6)
                assert said[named].cost > plan.cost
                given_up += 1
    assert given_up > 5


def test_what_costs_more_than_allowed_is_not_worked_out():
    scene = random_scene(np.random.default_rng(0), 3)
    plan, path = planned(scene, CAR, SETTINGS, 13.9)
    assert plan.profile is not None
    everyone = np.ones(3, np.bool_)
    task = SpeedTask(scene.ego.speed, scene.ego.acceleration, 13.9)
    asked = (path, CAR, moving(scene), everyone, task, SETTINGS)
    assert plan_speed(*asked, 1.01 * plan.cost).cost == pytest.approx(plan.cost)
    beaten = plan_speed(*asked, 0.5 * plan.cost)
    assert beaten.profile is None
    assert "cheap enough" in beaten.reason


def test_what_is_planned_touches_nobody():
    for seed in range(40):
        scene = random_scene(np.random.default_rng(seed), 6)
        plan, path = planned(scene, CAR, SETTINGS, 13.9)
        if plan.profile is None:
            continue
        ahead = scene.vehicles.prediction
        for k in range(0, 101, 2):
            d = plan.profile.distance[k]
            h = float(np.interp(d, path.distance, path.heading))
            body = Rectangle(
                float(np.interp(d, path.distance, path.x))
                + CAR.centre_offset * math.cos(h),
                float(np.interp(d, path.distance, path.y))
                + CAR.centre_offset * math.sin(h),
                h,
                CAR.length,
                CAR.width,
            )
            for v in range(len(scene.vehicles.ids)):
                other = Rectangle(
                    float(ahead.x[v, k]),
                    float(ahead.y[v, k]),
                    float(ahead.heading[v, k]),
                    4.8,
                    1.9,
                )
                assert distance(body, other) > 0.0, (seed, k, v)


def test_the_extreme_motions_bound_every_program():
    rng = np.random.default_rng(4)
    times = knot_times(SETTINGS)
    for _ in range(20):
        v0, a0 = rng.uniform(0.0, 19.0), rng.uniform(-2.0, 2.0)
        a0 = max(a0, -math.sqrt(10.0 * v0))
        least, greatest = reachable(v0, a0, LIMITS, 5.0, times)
        a, v, s = a0, v0, 0.0
        for k in range(1, 101):
            jerk = rng.uniform(-5.0, 5.0)
            after = min(max(a + 0.1 * jerk, -4.5), 3.0)
            ahead = min(max(v + 0.05 * (a + after), 0.0), 20.0)
            s, v, a = s + 0.05 * (v + ahead), ahead, after
            assert least[k] - 1e-9 <= s <= greatest[k] + 1e-9


def test_a_leader_is_followed_with_its_headway():
    leader = Car(100.0 + CAR.front_reach + 2.4 + 35.0, -1.75, 8.0)
    scene = on_lanes(speed=13.0, cars=[leader])
    plan, _ = following(scene)
    assert plan.order == (("car.0", Side.AFTER),)
    graph, profile = plan.graph, plan.profile
    on = graph.hit[0]
    gap = graph.lower[0] - profile.distance - SETTINGS.front_gap
    assert (gap - SETTINGS.front_headway * profile.speed)[on].min() > -1e-5
    assert plan.ahead == "car.0"
    assert plan.behind is None


def test_a_gap_that_is_short_already_is_opened_without_a_panic():
    leader = Car(100.0 + CAR.front_reach + 2.4 + 4.0, -1.75, 12.0)
    plan, _ = following(on_lanes(speed=12.0, cars=[leader]))
    assert plan.profile is not None
    assert plan.profile.acceleration.min() > -3.0


def test_the_end_of_the_way_is_not_passed():
    scene = on_lanes(speed=12.0)
    task = SpeedTask(12.0, 0.0, 13.9, end=60.0)
    nobody = np.zeros(0, np.bool_)
    plan = plan_speed(change_path(scene), CAR, moving(scene), nobody, task, SETTINGS)
    assert plan.profile is not None
    assert plan.profile.distance.max() <= 60.0 + 1e-6


def test_soft_bounds_when_nothing_else_is_left():
    leader = Car(100.0 + CAR.front_reach + 2.4 + 9.0, -1.75, 0.0)
    scene = on_lanes(speed=12.0, cars=[leader])
    plan, path = following(scene)
    assert plan.profile is None
    assert "none of" in plan.reason
    soft = soft_speed(path, CAR, plan.graph, SpeedTask(12.0, 0.0, 13.9), SETTINGS)
    assert soft.profile is not None
    assert soft.slack > 0.5
    assert soft.profile.acceleration.min() >= -CAR.limits.max_deceleration - 1e-6


def test_a_vehicle_that_brakes_to_a_stand_can_still_be_planned_for():
    for v, a in ((0.0, -3.0), (0.2, -4.4), (5.0, -8.0), (25.0, 2.0)):
        nobody = np.zeros(0, np.bool_)
        scene = on_lanes(speed=v)
        plan = plan_speed(
            change_path(on_lanes(speed=5.0)),
            CAR,
            moving(scene),
            nobody,
            SpeedTask(v, a, 13.9),
            SETTINGS,
        )
        assert plan.profile is not None, (v, a)


def test_orders_come_out_as_possible_ones():
    times, seen = knot_times(SETTINGS), 0
    for seed in range(20):
        scene = random_scene(np.random.default_rng(seed), 4)
        everyone = np.ones(4, np.bool_)
        graph = st_graph(change_path(scene), CAR, moving(scene), everyone, 1.0, 0.3)
        bounds = demands(graph, SETTINGS, scene.ego.speed, times)
        reach = reachable(scene.ego.speed, 0.0, LIMITS, 5.0, times)
        orders, nodes = possible_orders(graph, bounds, reach, 220.0, 64)
        assert len(orders) <= nodes < 2 ** (len(graph.ids) + 1)
        for order in orders:
            assert len(order.sides) == len(graph.ids)
            assert (order.lower[1:] <= order.upper[1:] + 1e-5).all()
        seen += len(orders)
    assert seen > 10
