import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from planner.interface import Indicator, PlanStatus
from planner.lane_change.lane_choice import bodies_on_road
from planner.lane_change.phases.memory import Phase
from planner.reference_path.path import ReferencePath
from planner.reference_path.segments import arc, clothoid, line
from planner.route import RouteSettings, proposed
from planner.route.gaps import gap_beside
from planner.route.lane_corridor import LaneCorridor, corridor
from planner.route.lane_frame import (
    KEPT_BEHIND,
    USED,
    in_frame,
    lane_frame,
    on_reference,
    seen_from,
)
from planner.route.lane_need import lane_ends, lanes_to_follow
from planner.route.memory import LaneManoeuvre
from planner.route.standing import has_no_way
from planner.scene import Lanes, RoadBounds
from planner.vehicle import Vehicle, VehicleLimits
from tests.planner.scenes import Car, bend, cars, ego_on, make_scene, road, straight

WIDTH = 3.5
END = 250.0  # of the right lane [m]


def two_lanes(path, end=math.inf):
    """The path is the middle of the left lane; the right one may end."""
    s = np.array([0.0, 400.0]) if math.isinf(end) else np.array([0.0, end, end + 0.1])
    right = np.full(s.size, WIDTH)
    right[s > end] = 0.0
    centre = np.array([np.full(s.size, -WIDTH), np.zeros(s.size)])
    return Lanes(s, centre, np.array([right, np.full(s.size, WIDTH)]))


def scene_on(path, ego, vehicles=(), end=math.inf):
    bounds = road(path, WIDTH / 2, -1.5 * WIDTH)
    made = make_scene(path, ego, vehicles=vehicles, bounds=bounds)
    return replace(made, lanes=two_lanes(path, end))


def rollout(scene, planner, n, traffic=(), vehicle=None):
    """Track each plan perfectly; the traffic keeps its speed and lane."""
    memory, plans = None, []
    path, cars = scene.path, list(traffic)
    for _ in range(n):
        plan = planner.plan(scene, memory)
        memory = plan.memory
        plans.append((scene, plan))
        cars = [replace(car, s=car.s + car.speed * scene.step) for car in cars]
        ego = plan.trajectory.at(scene.step)
        scene = scene_on(path, ego, cars, end=END)
        first = plans[0][0]
        scene = replace(
            scene,
            lanes=first.lanes,
            road=first.road,
            vehicle=vehicle or scene.vehicle,
        )
    return plans


def test_a_lane_that_ends_is_left_before_its_end():
    path = straight(500.0)
    plans = rollout(
        scene_on(path, ego_on(path, 60.0, -WIDTH), end=END), proposed(), 150
    )
    phases = [plan.memory.manoeuvre.phase for _, plan in plans]
    assert Phase.CHANGE in phases
    assert Phase.COMMITTED in phases
    last = plans[-1][0].ego_frenet
    assert abs(last.l) < 0.3
    crossed = next(scene.ego_frenet.s for scene, _ in plans if scene.ego_frenet.l > -1)
    assert crossed < END
    assert all("lane 0 ends" in p.stats.explanation for _, p in plans if _changes(p))
    for _, plan in plans:
        wants = plan.memory.manoeuvre.target is not None
        assert plan.indicator is (Indicator.LEFT if wants else Indicator.NONE)


def test_a_long_body_gets_over_from_a_crawl_although_no_plan_is_long_enough():
    path = straight(500.0)
    limits = VehicleLimits(max_acceleration=1.5, max_curvature=0.14)
    lorry = Vehicle(12.0, 2.5, 6.0, 3.0, limits)
    start = scene_on(path, ego_on(path, 215.0, -WIDTH, speed=2.0), end=END)
    plans = rollout(replace(start, vehicle=lorry), proposed(), 250, vehicle=lorry)
    assert abs(plans[-1][0].ego_frenet.l) < 0.5, plans[-1][1].stats.explanation


def _changes(plan):
    return plan.memory.manoeuvre.phase is Phase.CHANGE


def test_it_waits_before_the_end_while_the_lane_beside_is_full():
    path = straight(500.0)
    beside = [Car(20.0 + 9.0 * k, 0.0, speed=8.0) for k in range(40)]
    scene = scene_on(path, ego_on(path, 180.0, -WIDTH, speed=8.0), beside, end=END)
    plans = rollout(scene, proposed(), 120, beside)
    fronts = [s.ego_frenet.s + s.vehicle.front_reach for s, _ in plans]
    assert max(fronts) < END
    assert all(p.memory.manoeuvre.phase is Phase.SEEK for _, p in plans[5:])
    assert "no way over yet" in plans[-1][1].stats.explanation


def test_without_a_reason_it_keeps_its_lane():
    path = straight(400.0)
    scene = scene_on(path, ego_on(path, 50.0, -WIDTH))
    plan = proposed().plan(scene, None)
    assert plan.status is PlanStatus.OK
    assert plan.memory.manoeuvre.phase is Phase.KEEP
    assert np.abs(plan.trajectory.l + WIDTH).max() < 0.3


@given(st.floats(-60.0, 60.0), st.floats(0.0, 20.0))
def test_a_gap_is_safe_just_when_nobody_has_to_brake_too_hard(ahead, speed):
    path = straight(400.0)
    ego = ego_on(path, 150.0, -WIDTH, speed=10.0)
    scene = scene_on(path, ego, [Car(150.0 + ahead, 0.0, speed=speed)])
    settings = RouteSettings().manoeuvre
    gap = gap_beside(scene, bodies_on_road(scene), 1, settings)
    rear_gap = (150.0 - 1.0) - (150.0 + ahead + 2.3)
    front_gap = (150.0 + ahead - 2.3) - (150.0 + 3.8)
    if ahead < 1.4:
        need = speed * 0.6 + speed**2 / 9.0 - 100.0 / (2 * 4.5)
        left = rear_gap - max(need, 0.0)
    else:
        hard = scene.vehicle.limits.emergency_deceleration
        need = 10.0 * 0.1 + 100.0 / (2 * hard) - speed**2 / (2 * hard)
        left = front_gap - max(need, 0.0)
    if abs(left) > 0.6 and abs(ahead - 1.4) > 0.5:  # the car's length is drawn
        assert gap.is_safe == (left > 0.0)


def test_a_frame_is_made_for_a_stretch_and_made_anew_behind_it():
    path = straight(2000.0)
    ego_s = 400.0
    scene = scene_on(path, ego_on(path, ego_s, -WIDTH))
    scene = replace(scene, lanes=replace(scene.lanes, s=np.array([0.0, path.length])))
    frame = lane_frame(scene, 0)
    assert (frame.begin, frame.end) == (ego_s - KEPT_BEHIND, ego_s + USED)
    assert frame.path.length < 0.5 * path.length
    at = np.array([0.0, 300.0, 700.0, 1999.0])  # places beyond it too
    assert frame.to_reference(frame.to_s(at)) == pytest.approx(at)
    seen = seen_from(
        scene, frame, corridor(scene.lanes, frame, LaneCorridor.LANE, None), ()
    )
    left, right = seen.road.at(frame.to_s(np.array([1500.0])))
    assert (left[0], right[0]) == pytest.approx((WIDTH / 2, -WIDTH / 2), abs=0.05)
    plans = []
    for s in (ego_s, ego_s + USED + 20.0):
        there = replace(
            scene_on(path, ego_on(path, s, -WIDTH, 10.0)), lanes=scene.lanes
        )
        memory = plans[-1].memory if plans else None
        plans.append(proposed().plan(there, memory))
    first, later = (next(iter(plan.memory.frames.values())) for plan in plans)
    assert later.begin == pytest.approx(first.begin + USED + 20.0)
    assert plans[-1].status is PlanStatus.OK


@pytest.mark.parametrize("path", [straight(300.0), bend(60.0)])
def test_places_in_a_lane_s_frame_are_those_of_a_projection(path):
    at = np.linspace(0.0, path.length, 9)
    lanes = two_lanes(path)
    scene = replace(
        scene_on(path, ego_on(path, 80.0, -WIDTH)),
        lanes=replace(lanes, s=np.array([0.0, path.length])),
    )
    frame = lane_frame(scene, 0)
    points = path.at(at[1:-1])
    x = points.x + 2.0 * points.sin_heading
    y = points.y - 2.0 * points.cos_heading
    s, l = frame.path.project(x, y)
    assert frame.to_s(at[1:-1]) == pytest.approx(s, abs=0.15)
    assert l == pytest.approx(WIDTH - 2.0, abs=0.12)
    seen = seen_from(
        scene, frame, corridor(scene.lanes, frame, LaneCorridor.LANE, None), ()
    )
    assert abs(seen.ego_frenet.l) < 0.12
    left, right = seen.road.at(np.array([seen.ego_frenet.s]))
    assert left[0] == pytest.approx(WIDTH / 2, abs=0.15)  # the line between the lanes
    assert right[0] == pytest.approx(-WIDTH / 2, abs=0.15)


def test_a_trajectory_comes_back_from_a_lane_s_frame():
    path = bend(60.0)
    scene = replace(
        scene_on(path, ego_on(path, 80.0, -WIDTH)),
        lanes=replace(two_lanes(path), s=np.array([0.0, path.length])),
    )
    plan = proposed().plan(scene, None)
    frame = lane_frame(scene, 0)
    there = in_frame(frame, plan.trajectory)
    back = on_reference(frame, there)
    assert back.s == pytest.approx(plan.trajectory.s, abs=0.05)
    assert back.l == pytest.approx(plan.trajectory.l, abs=0.05)


def test_lanes_beside_a_turn_end_before_it():
    path = ReferencePath.from_segments(bend_of(8.0))
    scene = scene_on(path, ego_on(path, 10.0))
    followed = lanes_to_follow(scene)
    ends = lane_ends(followed, 10.0)
    assert ends[1] == math.inf
    assert 40.0 < ends[0] < 60.0


def test_a_lane_that_goes_straight_on_beside_a_winding_path_does_not_end():
    k = 0.09
    path = ReferencePath.from_segments(
        [line(50.0), arc(4.0, k), arc(8.0, -k), arc(4.0, k), line(60.0)]
    )
    assert np.abs(path.at(np.arange(0.0, path.length)).curvature).max() > 0.06
    s = np.arange(0.0, path.length, 0.5)
    at = path.at(s)
    beside = (-WIDTH - at.y) / at.cos_heading
    full = np.full(s.size, WIDTH)
    lanes = Lanes(s, np.array([beside, np.zeros(s.size)]), np.array([full, full]))
    scene = replace(make_scene(path, ego_on(path)), lanes=lanes)
    assert np.isinf(lane_ends(lanes_to_follow(scene), 0.0)).all()


def bend_of(radius):
    turn = 1.0 / radius
    return [
        line(40.0),
        clothoid(20.0, 0.0, turn),
        arc(5.0, turn),
        clothoid(20.0, turn, 0.0),
        line(40.0),
    ]


def test_a_plan_depends_on_scene_and_memory_alone():
    path = straight(500.0)
    scene = scene_on(path, ego_on(path, 60.0, -WIDTH), end=END)
    first, second = proposed().plan(scene, None), proposed().plan(scene, None)
    again = proposed().plan(scene, first.memory)
    other = proposed().plan(scene, second.memory)
    assert np.array_equal(again.trajectory.x, other.trajectory.x)
    assert again.stats.explanation == other.stats.explanation


def test_it_waits_at_a_lane_s_end_for_a_gap_however_long_it_takes():
    path = straight(500.0)
    front = END - 3.8
    # slow cars, bumper to bumper beside the ego: no room for its body
    beside = [Car(front - 60.0 + 8.0 * k, 0.0, speed=0.0) for k in range(20)]
    scene = scene_on(path, ego_on(path, END - 20.0, -WIDTH, speed=0.0), beside, end=END)
    plans = rollout(scene, proposed(), 250, beside)
    assert all(p.memory.manoeuvre.phase is Phase.SEEK for _, p in plans[1:])
    last = plans[-1][1].stats
    assert last.blocker in scene.vehicles.ids
    assert f"no way over yet, {last.blocker} is there" in last.explanation


@pytest.mark.parametrize("before", [5.0, 9.0, 12.5])
def test_who_stands_too_near_to_its_lane_s_end_to_change_tries_all_the_same(before):
    """The lane leads on nowhere, but the road is there: as where a junction begins."""
    path = straight()
    planner = proposed(RouteSettings())
    ego = ego_on(path, END - before - Vehicle().front_reach, -WIDTH, 0.0)
    s = np.array([0.0, END + 10.0, END + 25.0, path.length])
    right = -WIDTH * np.array([1.5, 1.5, 0.5, 0.5])
    bounds = RoadBounds(s, np.full(4, WIDTH / 2), right)
    start = replace(scene_on(path, ego, end=END), road=bounds)
    plans = rollout(start, planner, 150)
    scene = plans[-1][0]
    assert scene.ego_frenet.s > END + 20.0
    assert abs(scene.ego_frenet.l) < 0.5


def test_two_lanes_are_crossed_one_after_the_other_at_one_lane_s_end():
    """The middle lane ends where the right one does: it must leave room to go on."""
    path = straight()
    s = np.array([0.0, END, END + 0.1])
    ends = np.array([WIDTH, WIDTH, 0.0])
    centre = np.array([np.full(3, l) for l in (-2.0 * WIDTH, -WIDTH, 0.0)])
    lanes = Lanes(s, centre, np.array([ends, ends, np.full(3, WIDTH)]))
    planner = proposed(RouteSettings())
    front = Vehicle().front_reach
    ego = ego_on(path, END - 28.5 - front, -2.0 * WIDTH, 0.0)
    bounds = road(path, WIDTH / 2, -2.5 * WIDTH)
    scene = replace(make_scene(path, ego, bounds=bounds), lanes=lanes)
    plans = rollout(scene, planner, 200)
    assert plans[-1][0].ego_frenet.s > END + 20.0
    assert abs(plans[-1][0].ego_frenet.l) < 0.5


def memory_of(plan, phase, lane=0, target=1):
    manoeuvre = LaneManoeuvre(lane, phase, target, "lane 0 ends")
    return replace(plan.memory, manoeuvre=manoeuvre)


def test_a_change_binds_only_while_the_body_is_over_the_line():
    path = straight(500.0)
    full = [Car(150.0 + 8.0 * k, 0.0, speed=0.0) for k in range(20)]
    for l, phase in ((-WIDTH, Phase.SEEK), (-WIDTH + 1.2, Phase.COMMITTED)):
        scene = scene_on(path, ego_on(path, 200.0, l, speed=0.0), full, end=END)
        plan = proposed().plan(scene, None)
        plan = proposed().plan(scene, memory_of(plan, Phase.COMMITTED))
        assert plan.memory.manoeuvre.phase is phase


def test_who_stands_inside_the_new_lane_has_changed():
    path = straight(500.0)
    scene = scene_on(path, ego_on(path, 200.0, -0.6, speed=0.0), end=END)
    plan = proposed().plan(scene, None)
    plan = proposed().plan(scene, memory_of(plan, Phase.COMMITTED))
    assert (plan.memory.manoeuvre.lane, plan.memory.manoeuvre.target) == (1, None)


@pytest.mark.parametrize(("target", "origin"), [(1, 0), (0, 1)])
def test_a_change_has_both_lanes_up_to_where_the_old_one_must_be_left(target, origin):
    path = straight(400.0)
    scene = scene_on(path, ego_on(path, 100.0, -WIDTH * (1 - origin)))
    grid = np.arange(0.0, 400.0)
    scene = replace(
        scene,
        road=RoadBounds(grid, np.full(400, WIDTH / 2), np.full(400, -1.5 * WIDTH)),
    )
    frame = lane_frame(scene, target)
    bounds = corridor(
        scene.lanes, frame, LaneCorridor.CHANGE, origin, (150.0, math.inf)
    )
    own = -WIDTH * (1 - target)
    for s, others in ((120.0, True), (160.0, False)):
        left, right = bounds.at(np.array([s]))
        assert left[0] + own == pytest.approx(
            WIDTH / 2 if target or others else -WIDTH / 2, abs=0.01
        )
        assert right[0] + own == pytest.approx(
            -1.5 * WIDTH if others or not target else -WIDTH / 2, abs=0.01
        )


def test_the_lane_that_turns_is_kept_where_the_path_is_not_in_its_middle_yet():
    """A lane left of it ends before the turn, and is left in time."""
    path = bend(-9.0, 100.0, 0.5 * math.pi)
    s = np.array([0.0, 90.0, 110.0, 130.0])
    own = np.array([-0.8, -0.8, -0.4, 0.0])
    lanes = Lanes(s, np.array([own, own + WIDTH]), np.full((2, 4), WIDTH))
    scene = replace(scene_on(path, ego_on(path, 60.0, 2.7)), lanes=lanes)
    ends = lane_ends(lanes_to_follow(scene), 60.0)
    assert math.isinf(ends[0])
    assert 80.0 < ends[1] < 110.0


def test_the_lane_that_leads_on_does_not_end_where_the_path_moves_over_to_it():
    """On a short edge the path swings over sharply; its lanes are straight."""
    k = 0.09
    path = ReferencePath.from_segments(
        [line(30.0), arc(6.0, -k), arc(6.0, k), line(30.0)]
    )
    s = np.arange(0.0, path.length, 0.5)
    at = path.at(s)
    over = float(at.y[-1])  # the lane that leads on is so far to the right
    centre = np.array([(y - at.y) / at.cos_heading for y in (over, 0.0)])
    width = np.full((2, s.size), -over)
    width[1, s > path.length - 20.0] = 0.0
    lanes = Lanes(s, centre, width)
    scene = replace(make_scene(path, ego_on(path)), lanes=lanes)
    ends = lane_ends(lanes_to_follow(scene), 0.0)
    assert math.isinf(ends[0])
    assert ends[1] < path.length - 15.0


def test_a_line_that_may_not_be_crossed_is_not_crossed_for_the_speed():
    path = straight(500.0)
    slow = [Car(s=90.0, l=-WIDTH, speed=4.0)]
    scene = scene_on(path, ego_on(path, 60.0, -WIDTH), slow)
    plan = proposed().plan(scene, None)
    assert plan.memory.manoeuvre.target == 1
    solid = np.zeros((2, 2), dtype=bool)
    solid[0] = True
    held = replace(scene, lanes=replace(scene.lanes, solid_left=solid))
    assert proposed().plan(held, None).memory.manoeuvre.target is None


@pytest.mark.parametrize("begin", [120.0, 170.0])
def test_a_lane_that_ends_is_left_before_its_line_is_solid(begin):
    s = np.array([0.0, begin, END, END + 0.1])
    width = np.full((2, 4), WIDTH)
    width[0, 3] = 0.0
    centre = np.array([np.full(4, -WIDTH), np.zeros(4)])
    solid = np.zeros((2, 4), dtype=bool)
    solid[0, 1:] = True
    lanes = Lanes(s, centre, width, solid_left=solid)
    path = straight(500.0)
    made = replace(scene_on(path, ego_on(path, 20.0, -WIDTH)), lanes=lanes)
    plans = rollout(made, proposed(), 150)
    crossed = next(x.ego_frenet.s for x, _ in plans if x.ego_frenet.l > -WIDTH / 2)
    assert crossed < begin


@pytest.mark.parametrize(("dashed", "start"), [(100.0, 20.0), (140.0, 60.0)])
def test_a_lane_that_ends_is_left_behind_its_solid_line(dashed, start):
    s = np.array([0.0, dashed, END, END + 0.1])
    width = np.full((2, 4), WIDTH)
    width[0, 3] = 0.0
    centre = np.array([np.full(4, -WIDTH), np.zeros(4)])
    path = straight(500.0)
    for behind in (True, False):  # or the line is solid all the way: no choice
        solid = np.zeros((2, 4), dtype=bool)
        solid[0, 0] = True
        solid[0, 1:] = not behind
        lanes = Lanes(s, centre, width, solid_left=solid)
        made = replace(scene_on(path, ego_on(path, start, -WIDTH)), lanes=lanes)
        plans = rollout(made, proposed(), 150)
        over = [x.ego_frenet.s for x, _ in plans if x.ego_frenet.l > -WIDTH / 2]
        assert over, "the lane ends"
        assert over[0] > dashed or not behind


@pytest.mark.parametrize(
    ("changed", "follows"),
    [
        ({}, True),
        ({"stood": 0.5}, False),
        ({"before": 60.0}, False),  # far from the lane's end
        ({"queue": -WIDTH}, False),
        ({"queue": 0.0}, False),
        ({"line": 8.0}, False),  # a closed one
    ],
)
def test_a_change_without_a_way_follows_the_path_at_its_lane_s_end_only(
    changed, follows
):
    """Not out of a queue, and not towards a closed line."""
    case = {"stood": 3.0, "before": 13.0, "queue": None, "line": None, **changed}
    path, planner = straight(500.0), proposed()
    front = END - case["before"]
    cars = []
    if case["queue"] is not None:
        cars = [Car(front + 5.0, case["queue"], speed=0.0)]
    ego = ego_on(path, front - Vehicle().front_reach, -WIDTH, speed=0.0)
    scene = scene_on(path, ego, cars, end=END)
    if case["line"] is not None:
        scene = replace(scene, stop_lines=(front + case["line"],))
    before = memory_of(planner.plan(scene, None), Phase.CHANGE)
    look = planner._look(scene, replace(before, stood=case["stood"]))
    assert has_no_way(look, before.manoeuvre, planner.settings) is follows


def test_the_path_itself_is_driven_along_towards_the_next_lane():
    path, planner = straight(500.0), proposed()
    ego = ego_on(path, END - 13.0 - Vehicle().front_reach, -WIDTH, speed=0.0)
    scene = scene_on(path, ego, end=END)
    before = memory_of(planner.plan(scene, None), Phase.CHANGE)
    look = planner._look(scene, before)
    plan = planner._along(look, before, before.manoeuvre, 1, 10.0, by_path=True)
    assert plan.status is PlanStatus.OK
    assert "along the planned path" in plan.stats.explanation
    assert plan.trajectory.s[-1] - plan.trajectory.s[0] > 3.0
    assert plan.trajectory.l[-1] > -WIDTH + 0.3  # towards the path


def sharp_turn():
    """A narrow street that turns to the left as sharply as a junction does."""
    parts = [line(40.0), clothoid(9.0, 0.0, 0.15), arc(5.0, 0.15)]
    return ReferencePath.from_segments([*parts, clothoid(9.0, 0.15, 0.0), line(80.0)])


@pytest.mark.parametrize(
    ("s", "l", "error"), [(43.0, 0.23, 0.1), (45.0, 0.2, 0.12), (47.0, 0.3, 0.1)]
)
def test_whoever_stands_at_the_inner_side_of_a_bend_gets_out_of_it(s, l, error):
    path = sharp_turn()
    scene = make_scene(
        path,
        ego_on(path, s, l, speed=0.0, error=error),
        bounds=road(path, 1.6, -2.2),
        target_speed=8.0,
    )
    ends = np.array([0.0, path.length])
    lanes = Lanes(ends, np.zeros((1, 2)), np.full((1, 2), 3.2))
    plan = proposed().plan(replace(scene, lanes=lanes), None)
    assert plan.trajectory.s[-1] - plan.trajectory.s[0] > 3.0


@pytest.mark.parametrize(
    ("gap", "stood", "line_ahead", "passes"),
    [
        (0.45, 13.0, None, True),
        (0.15, 13.0, None, False),  # no room at all
        (0.45, 3.0, None, False),  # not yet
        (0.45, 13.0, 8.0, False),  # it waits at a line
    ],
)
def test_who_is_caught_beside_another_creeps_past_without_a_margin(
    gap, stood, line_ahead, passes
):
    """In a narrow street, once it has waited in vain, and not in a queue."""
    path, planner = straight(200.0), proposed()
    other = Car(56.0, 1.9 + gap, speed=0.0)
    scene = make_scene(
        path,
        ego_on(path, 50.0, speed=0.0),
        vehicles=[other],
        bounds=road(path, 4.0, -1.06),
    )
    s = np.array([0.0, 200.0])
    lanes = Lanes(s, np.zeros((1, 2)), np.full((1, 2), 2.12))
    scene = replace(scene, lanes=lanes)
    if line_ahead is not None:
        front = 50.0 + scene.vehicle.front_reach
        scene = replace(scene, stop_lines=(front + line_ahead,))
    before = replace(planner.plan(scene, None).memory, stood=stood)
    plan = planner.plan(scene, before)
    driven = plan.trajectory.s[-1] - plan.trajectory.s[0]
    assert bool(driven > 3.0) is passes
    assert ("closely" in plan.stats.explanation) is passes
    if passes:
        assert plan.trajectory.speed.max() < 2.1
        gone = planner.plan(replace(scene, vehicles=cars(path, ())), plan.memory)
        assert "closely" not in gone.stats.explanation  # nothing is there any more
        assert gone.trajectory.speed.max() > 3.0
        assert planner.plan(scene, plan.memory).trajectory.s[-1] > 53.0


def test_inside_a_junction_the_ego_keeps_to_its_lane():
    """However wide the junction is: what stands in its lane there is waited for."""
    path = straight(200.0)
    scene = make_scene(path, ego_on(path, 50.0), bounds=road(path, 8.0, -8.0))
    s = np.array([0.0, 200.0])
    lanes = Lanes(s, np.zeros((1, 2)), np.full((1, 2), WIDTH))
    scene = replace(scene, lanes=lanes)
    frame = lane_frame(scene, 0)
    for kind, half in ((LaneCorridor.LANE, WIDTH / 2 + 0.3), (LaneCorridor.ROAD, 8.0)):
        left, right = corridor(scene.lanes, frame, kind, None).at(
            np.array([60.0, 90.0])
        )
        assert left == pytest.approx(half, abs=0.02)
        assert right == pytest.approx(-half, abs=0.02)


@pytest.mark.parametrize(("end", "lane"), [(106.5, 1), (190.0, 2)])
def test_who_stands_half_over_where_both_lanes_end_goes_on_to_the_next_one(end, lane):
    """The first change cannot be ended any more; where there is way, it is."""
    path, planner = straight(300.0), proposed()
    s = np.array([0.0, end, end + 0.1, 300.0])
    centre = np.array([np.full(4, (k - 2) * WIDTH) for k in range(3)])
    width = np.full((3, 4), WIDTH)
    width[1:, 2:] = 0.0
    lanes = Lanes(s, centre, width)
    ego = ego_on(path, 100.0, -2.4, speed=0.0)
    made = make_scene(path, ego, bounds=road(path, WIDTH / 2, -2.5 * WIDTH))
    scene = replace(made, lanes=lanes)
    going = LaneManoeuvre(2, Phase.COMMITTED, 1, "it ends")
    before = planner.plan(scene, None).memory
    look = planner._look(scene, replace(before, manoeuvre=going, stood=3.0))
    now = planner._go_on(look, going, 1)
    assert now is not None
    assert now.lane == lane
