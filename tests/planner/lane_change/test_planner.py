"""The manoeuvre in closed loop with traffic that keeps its speed, and odd scenes."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
import pytest

from planner.interface import Indicator, PlanResult, PlanStatus
from planner.lane_change import LaneChangePlanner, area, proposed, thesis
from planner.lane_change.phases.gap_safety import rss_distance
from planner.lane_change.phases.memory import Memory, Phase
from planner.reference_path.frenet import cartesian_to_frenet_one
from planner.scene import Lanes, Obstacles, Scene
from planner.shapes.rectangles import Rectangle, distance
from planner.states import CartesianState
from planner.vehicle import Vehicle
from tests.planner.lane_change.roads import WIDTH, on_lanes
from tests.planner.scenes import Car, winding

STEP = 0.1
PLANNER: LaneChangePlanner = proposed()
CAR = Vehicle()
WALL_HALF_LENGTH = 2.0  # [m]
Motion = Callable[[Car, int], Car]


def straight_on(car: Car, _: int) -> Car:
    return replace(car, s=car.s + car.speed * STEP)


def wall(s: float, lane: float = -1.75) -> Obstacles:
    columns = (np.array([v]) for v in (s, lane, 0.0, 4.0, 3.0))
    return Obstacles(("wall",), *columns, np.zeros(1))


@dataclass(frozen=True)
class Driven:
    scenes: list[Scene]
    plans: list[PlanResult]
    clearance: float

    @property
    def phases(self) -> list[Phase]:
        """Phases in the order in which they came."""
        seen: list[Phase] = []
        for plan in self.plans:
            assert isinstance(plan.memory, Memory)
            if not seen or seen[-1] is not plan.memory.phase:
                seen.append(plan.memory.phase)
        return seen

    @property
    def last(self) -> Scene:
        return self.scenes[-1]


def drive(
    n: int,
    cars: Sequence[Car] = (),
    obstacles: Obstacles | Sequence[object] = (),
    moves: Motion = straight_on,
    **ego: float,
) -> Driven:
    """Track every plan perfectly for n steps; nobody reacts to the ego."""
    rows = list(cars)
    scene = on_lanes(cars=rows, obstacles=obstacles, **ego)
    memory: object = None
    scenes, plans, least = [scene], [], math.inf
    for k in range(n):
        plan = PLANNER.plan(scene, memory)
        assert plan.trajectory is not None
        assert plan.trajectory.is_finite()
        why = plan.stats
        assert why.explanation if plan.status is PlanStatus.OK else why.reason
        memory = plan.memory
        state = plan.trajectory.at(STEP)
        rows = [moves(car, k) for car in rows]
        fresh = on_lanes(cars=rows, obstacles=obstacles, **ego)
        frenet = cartesian_to_frenet_one(fresh.path, state, scene.ego_frenet.s)
        scene = replace(fresh, ego=state, ego_frenet=frenet, time=STEP * (k + 1))
        scenes.append(scene)
        plans.append(plan)
        least = min(least, clearance(scene))
    return Driven(scenes, plans, least)


def clearance(scene: Scene) -> float:
    """Between true rectangles."""
    vehicle, ego = scene.vehicle, scene.ego
    reach = vehicle.centre_offset
    body = Rectangle(
        ego.x + reach * math.cos(ego.heading),
        ego.y + reach * math.sin(ego.heading),
        ego.heading,
        vehicle.length,
        vehicle.width,
    )
    least = math.inf
    for record in (scene.vehicles, scene.obstacles):
        for i in range(len(record.ids)):
            other = Rectangle(
                float(record.x[i]),
                float(record.y[i]),
                float(record.heading[i]),
                float(record.length[i]),
                float(record.width[i]),
            )
            least = min(least, distance(body, other))
    return least


def test_a_free_lane_is_kept_at_the_wished_speed():
    driven = drive(60, speed=8.0)
    assert driven.phases == [Phase.KEEP]
    assert driven.last.ego.speed > 11.0
    assert abs(driven.last.ego_frenet.l + 1.75) < 0.01


def test_a_wall_makes_it_change_and_settle():
    driven = drive(220, obstacles=wall(300.0))
    assert driven.phases[-1] is Phase.KEEP
    assert Phase.COMMITTED in driven.phases
    assert driven.last.ego_frenet.l == pytest.approx(1.75, abs=0.05)
    assert driven.clearance > 0.3
    assert all(plan.status is PlanStatus.OK for plan in driven.plans)


def test_a_slow_leader_is_overtaken():
    driven = drive(200, cars=[Car(160.0, -1.75, 5.0)])
    assert Phase.COMMITTED in driven.phases
    assert driven.last.ego_frenet.s > 250.0
    assert driven.clearance > 0.3


@pytest.mark.parametrize("gap", [9.0, 12.0, 16.0])
def test_it_does_not_brake_for_who_is_ahead_in_the_lane_it_leaves(gap):
    front = 100.0 + Vehicle().front_reach
    ahead = Car(front + gap + 2.25, -1.75, 13.1)  # its rear bumper is `gap` ahead
    driven = drive(130, cars=[ahead], speed=13.3, target_speed=16.67)
    assert Phase.COMMITTED in driven.phases
    assert driven.last.ego_frenet.l == pytest.approx(1.75, abs=0.05)
    assert min(scene.ego.acceleration for scene in driven.scenes) > -1.0
    assert driven.clearance > 0.8


def test_it_lets_a_fast_car_pass_first():
    driven = drive(300, cars=[Car(85.0, 1.75, 16.0)], obstacles=wall(450.0))
    assert driven.clearance > 0.5
    entered = next(s for s in driven.scenes if s.ego_frenet.l > -0.8)
    assert entered.vehicles.prediction.s[0, 0] > entered.ego_frenet.s


def test_without_a_gap_it_waits_before_the_wall():
    stream = [Car(-400.0 + 16.0 * k, 1.75, 12.0) for k in range(60)]
    driven = drive(330, cars=stream, obstacles=wall(300.0))
    assert driven.last.ego.speed < 0.3  # it may be about to try again
    assert driven.clearance > 0.3
    front = driven.last.ego_frenet.s + driven.last.vehicle.front_reach
    assert 10.0 < 298.0 - front < 30.0  # where it can still pull out
    assert driven.plans[-1].stats.blocker is not None
    assert driven.plans[-1].status is PlanStatus.OK
    said = {plan.stats.explanation for plan in driven.plans}
    assert any("no gap yet" in words or "waits" in words for words in said), said


def test_behind_a_car_that_stands_before_the_wall_it_can_still_pull_out():
    """That car leaves only if somebody lets it; the ego must not be locked in."""
    stream = [Car(-160.0 + 16.0 * k, 1.75, 12.0) for k in range(30)]
    stands = Car(284.3, -1.75, 0.0)  # its rear at 282.0 m
    driven = drive(440, cars=[stands, *stream], obstacles=wall(300.0))
    waited = min(driven.scenes, key=lambda scene: scene.ego.speed)
    assert waited.ego.speed < 3.0
    front = waited.ego_frenet.s + waited.vehicle.front_reach
    assert 282.0 - front > PLANNER.settings.manoeuvre.tight_room
    beside = next(s for s in driven.scenes if s.ego_frenet.s > 305.0)
    assert beside.ego_frenet.l == pytest.approx(1.75, abs=0.1)
    assert driven.clearance > 0.3


def test_it_pulls_out_from_a_stand_when_the_gap_comes():
    stream = [Car(-160.0 + 16.0 * k, 1.75, 12.0) for k in range(30)]
    driven = drive(440, cars=stream, obstacles=wall(300.0))
    assert min(s.ego.speed for s in driven.scenes) < 3.0
    beside = next(s for s in driven.scenes if s.ego_frenet.s > 305.0)
    assert beside.ego_frenet.l == pytest.approx(1.75, abs=0.1)
    assert driven.clearance > 0.3


def test_a_rear_car_faster_than_the_limit_is_waited_for():
    driven = drive(200, cars=[Car(20.0, 1.75, 30.0)], obstacles=wall(350.0))
    assert driven.clearance > 0.5
    assert {plan.status for plan in driven.plans} == {PlanStatus.OK}
    waits = [p.stats.explanation for p in driven.plans if p.stats.blocker == "car.0"]
    assert any("gap behind car.0" in words for words in waits)


def test_cars_that_overlap_in_prediction_are_kept_clear_of():
    # one is predicted through the other, and both into the gap beside the wall
    cars = [Car(150.0, 1.75, 6.0), Car(135.0, 1.75, 9.0), Car(128.0, 1.0, 11.0)]
    driven = drive(160, cars=cars, obstacles=wall(330.0))
    assert driven.clearance > 0.2
    assert {plan.status for plan in driven.plans} == {PlanStatus.OK}


def test_a_leader_that_brakes_to_a_stand_during_the_change():
    def braking(car: Car, k: int) -> Car:
        speed = max(car.speed - (4.5 * STEP if k > 25 else 0.0), 0.0)
        return replace(car, s=car.s + speed * STEP, speed=speed)

    driven = drive(
        260, cars=[Car(175.0, 1.75, 13.0)], obstacles=wall(320.0), moves=braking
    )
    assert driven.clearance > 0.2
    assert driven.last.ego.speed < 0.1  # behind it, or before the wall
    assert driven.plans[-1].status in (PlanStatus.OK, PlanStatus.FULL_STOP)


def test_someone_from_the_other_side_takes_the_gap():
    def cutting_in(car: Car, k: int) -> Car:
        l = max(car.l - (1.2 * STEP if k > 10 else 0.0), 0.0)
        return replace(car, s=car.s + car.speed * STEP, l=l)

    # three lanes, -3.5 0 3.5: the ego on the right, the other comes from the left
    driven = drive(
        200,
        cars=[Car(104.0, 3.5, 13.9)],
        obstacles=wall(330.0, -3.5),
        moves=cutting_in,
        n_lanes=3,
    )
    assert driven.clearance > 0.1


def test_a_wall_nearer_than_the_shortest_change_ends_in_a_stop():
    driven = drive(80, obstacles=wall(121.0), speed=10.0)
    assert driven.last.ego.speed < 0.1
    assert driven.clearance > 0.05
    assert "no speed plan on any path" in driven.plans[-1].stats.reason


def test_a_fallback_goes_on_indicating_the_change():
    driven = drive(120, obstacles=wall(300.0))
    k = next(k for k, p in enumerate(driven.plans) if p.memory.phase is Phase.COMMITTED)
    scene, last = driven.scenes[k + 1], driven.plans[k]
    assert last.indicator is Indicator.LEFT
    s = scene.ego_frenet.s + 12.0  # too near to stop
    ahead = on_lanes(cars=[Car(s, l, speed=0.0) for l in (-1.75, 1.75)]).vehicles
    plan = PLANNER.plan(replace(scene, vehicles=ahead), last.memory)
    assert plan.status is not PlanStatus.OK
    assert plan.indicator is Indicator.LEFT
    # and before it has begun to change
    plans = drive(80, obstacles=wall(121.0), speed=10.0).plans
    assert any(plan.status is not PlanStatus.OK for plan in plans)
    assert {plan.indicator for plan in plans} == {Indicator.LEFT}


def test_the_printed_objective_says_why_it_stands():
    standing = thesis().plan(on_lanes(speed=0.0), None)
    assert "eq. 6.20 as printed" in standing.stats.reason
    assert not area().plan(on_lanes(speed=0.0), None).stats.reason


def test_a_gap_without_neighbours_is_said_in_words():
    result = area().plan(on_lanes(obstacles=wall(200.0), speed=10.0), None)
    assert result.stats.explanation.endswith("gap behind nobody, ahead of nobody")


def test_the_target_lane_ends_and_is_not_taken():
    s = np.array([0.0, 170.0, 170.1, 1500.0])
    width = np.array([[3.5] * 4, [3.5, 3.5, 0.0, 0.0]])
    lanes = Lanes(s, np.array([[-1.75] * 4, [1.75] * 4]), width)
    driven = drive(60, cars=[Car(160.0, -1.75, 8.0)], lanes=lanes)
    assert set(driven.phases) == {Phase.KEEP}
    assert driven.clearance > 1.0
    assert {plan.stats.blocker for plan in driven.plans} == {"car.0"}


def test_plans_agree_from_cycle_to_cycle():
    driven = drive(120, obstacles=wall(300.0))
    for before, after in zip(driven.plans, driven.plans[1:], strict=False):
        if before.memory.phase is Phase.COMMITTED is after.memory.phase:
            here, there = before.trajectory, after.trajectory
            shared = np.interp(here.t[1:60], there.t + STEP, there.l)
            assert np.abs(shared - here.l[1:60]).max() < 0.1


def test_plan_is_a_function_of_scene_and_memory():
    scene = on_lanes(cars=[Car(80.0, 1.75, 14.0)], obstacles=wall(260.0))
    first, second = PLANNER.plan(scene, None), PLANNER.plan(scene, None)
    for name in ("x", "y", "speed", "acceleration"):
        one, other = getattr(first.trajectory, name), getattr(second.trajectory, name)
        assert one.tobytes() == other.tobytes()


def test_it_drives_a_winding_road():
    road = winding()
    scene = on_lanes(
        path=road, s=5.0, speed=8.0, target_speed=8.0, cars=[Car(40.0, -1.75, 3.0)]
    )
    plan = PLANNER.plan(scene, None)
    assert plan.status is PlanStatus.OK
    assert plan.trajectory is not None
    assert np.abs(plan.trajectory.curvature).max() <= 0.2
    lateral = plan.trajectory.speed**2 * np.abs(plan.trajectory.curvature)
    assert lateral.max() <= 4.0 + 0.3


ODD: dict[str, Scene] = {
    "no lanes": replace(on_lanes(), lanes=Lanes.none()),
    "a car on the ego": on_lanes(cars=[Car(101.0, -1.75, 5.0)]),
    "a car beside": on_lanes(cars=[Car(101.0, 1.75, 14.0)], obstacles=wall(200.0)),
    "the wall at the bumper": on_lanes(speed=3.0, obstacles=wall(106.5)),
    "askew": on_lanes(error=0.6, speed=4.0),
    "off its lane": on_lanes(offset=2.0),
    "off the road": on_lanes(offset=-6.0),
    "standing": on_lanes(speed=0.0),
    "too fast": on_lanes(speed=40.0),
    "braking hard": on_lanes(speed=2.0, acceleration=-8.0),
    "no wish": on_lanes(target_speed=0.0),
    "a crowd": on_lanes(
        cars=[
            Car(20.0 + 9.0 * k, 1.75 if k % 2 else -1.75, 9.0)
            for k in range(40)
            if not 70.0 < 20.0 + 9.0 * k < 115.0
        ]
    ),
    "no prediction": replace(
        on_lanes(),
        vehicles=replace(
            on_lanes(cars=[Car(130.0, -1.75, 5.0)]).vehicles,
            prediction=replace(
                on_lanes(cars=[Car(130.0, -1.75, 5.0)]).vehicles.prediction,
                x=np.empty((1, 0)),
                y=np.empty((1, 0)),
                heading=np.empty((1, 0)),
                s=np.empty((1, 0)),
                l=np.empty((1, 0)),
            ),
        ),
    ),
    "near the end of the path": on_lanes(s=1490.0),
    "nan": replace(on_lanes(), ego=CartesianState(math.nan, 0.0, 0.0, 0.0, 10.0, 0.0)),
}


@pytest.mark.parametrize("name", ODD)
def test_no_scene_raises(name):
    memory: object = None
    for _ in range(3):
        plan = PLANNER.plan(ODD[name], memory)
        memory = plan.memory
        if plan.status is PlanStatus.INVALID_SCENE:
            assert name in ("no lanes", "nan")
            assert plan.stats.reason
            continue
        assert plan.trajectory is not None
        assert plan.trajectory.is_finite()
        if plan.status is not PlanStatus.OK:
            assert plan.stats.reason


def test_rss_is_the_published_formula():
    # v²/2b of the follower and its way in the reaction, less the leader's v²/2b
    found = rss_distance(np.array([20.0]), np.array([10.0]), 0.5, 4.0, 5.0)
    assert found[0] == pytest.approx(10.0 + 50.0 - 10.0)
    assert rss_distance(np.array([5.0]), np.array([20.0]), 0.5, 4.0, 5.0)[0] == 0.0


@pytest.mark.parametrize("room", [6.5, 8.0, 12.0])
def test_from_a_stand_it_pulls_out_of_a_narrow_place(room):
    front = 100.0 + CAR.front_reach
    driven = drive(200, obstacles=wall(front + room + WALL_HALF_LENGTH), speed=0.0)
    assert driven.last.ego_frenet.l == pytest.approx(1.75, abs=0.05)
    assert driven.clearance > 0.3


@pytest.mark.parametrize("aside", [-0.15, 0.05, 0.15])
def test_a_binding_change_goes_on_from_where_the_ego_is(aside):
    driven = drive(120, obstacles=wall(300.0))
    k = next(k for k, p in enumerate(driven.plans) if p.memory.phase is Phase.COMMITTED)
    scene, memory = driven.scenes[k + 1], driven.plans[k].memory
    ego = replace(scene.ego, y=scene.ego.y + aside)
    frenet = cartesian_to_frenet_one(scene.path, ego, scene.ego_frenet.s)
    plan = PLANNER.plan(replace(scene, ego=ego, ego_frenet=frenet), memory)
    assert plan.status is PlanStatus.OK
    assert plan.memory.phase is Phase.COMMITTED
    begin = plan.trajectory.at(0.0)
    assert math.hypot(begin.x - ego.x, begin.y - ego.y) < 0.1
    assert plan.trajectory.l[-1] == pytest.approx(1.75, abs=0.05)


def test_bends_of_a_change_are_taken_slowly_from_a_standstill_too():
    """The bound of speed is read where the ego will be, not where it wishes to be."""
    driven = drive(150, obstacles=wall(118.0), speed=0.5)
    lateral = [scene.ego.speed**2 * abs(scene.ego.curvature) for scene in driven.scenes]
    assert max(lateral) < 2.5
    assert driven.last.ego_frenet.s > 130.0


@pytest.mark.parametrize("speed", [2.0, 2.6, 3.2])
@pytest.mark.parametrize("spare", [0.1, 0.2])
def test_a_softened_plan_does_not_end_the_braking_that_avoids_a_contact(speed, spare):
    """It took the brake off half a second before the stand, and touched."""
    way = speed**2 / 16.0
    front = 100.0 + Vehicle().front_reach
    car = Car(front + way + spare + 2.4, -WIDTH / 2.0, 0.0)
    scene = on_lanes(speed=speed, acceleration=-8.0, cars=[car])
    trajectory = proposed().plan(scene, None).trajectory
    reach = trajectory.x.max() + Vehicle().front_reach
    assert reach < car.s - 2.4
