"""What every call of `plan` keeps, on sane and on odd scenes."""

import math
import pickle
from dataclasses import dataclass, fields, replace

import numpy as np
import pytest
from hypothesis import HealthCheck, example, given, reject, settings
from hypothesis import strategies as st

from planner import cruise
from planner.errors import OutsidePathDomainError
from planner.fallback.last_plan import SAME_PLACE
from planner.interface import PlanStatus
from planner.reference_path.frenet import cartesian_to_frenet_one
from planner.reference_path.path import ReferencePath
from planner.reference_path.segments import arc, line
from planner.scene import Obstacles, Prediction
from planner.shapes.rectangles import corners
from planner.states import FrenetState
from tests.planner.scenes import (
    STEP,
    Car,
    Disc,
    bend,
    cars,
    clearances,
    discs,
    ego_on,
    ego_rectangle,
    make_scene,
    road,
    straight,
    winding,
)

PLANNERS = {
    "proposed": cruise.proposed(),
    "conventional": cruise.conventional(),
    "thesis_proposed": cruise.thesis_proposed(),
    "thesis_conventional": cruise.thesis_conventional(),
}
CLOSED_LOOP = ("proposed", "conventional")
THESIS = ("thesis_proposed", "thesis_conventional")
every_planner = pytest.mark.parametrize("name", PLANNERS)
FRENET = FrenetState(50.0, 10.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


def check_contract(result, scene):
    """A finite trajectory that starts at the ego, or a reason why there is none."""
    stats = result.stats
    assert sum(stats.removed.values()) + stats.survivors == stats.candidates
    if result.status is not PlanStatus.OK:
        assert stats.reason
        assert stats.survivors == 0
    if result.trajectory is None:
        assert result.status is PlanStatus.INVALID_SCENE
        return
    trajectory = result.trajectory
    assert trajectory.is_finite()
    assert trajectory.t[0] == 0.0
    assert trajectory.duration >= scene.step
    assert np.all(trajectory.speed >= 0.0)
    off = math.hypot(trajectory.x[0] - scene.ego.x, trajectory.y[0] - scene.ego.y)
    # these may go on along the last plan, on which the ego is to some centimetres
    along = (PlanStatus.LAST_PLAN_SHIFTED, PlanStatus.FULL_STOP)
    assert off <= (
        SAME_PLACE if result.status in along else 1e-6 * (1.0 + abs(scene.ego.x))
    )


def check_start(result, scene):
    """For a consistent, forward moving ego also heading and speed agree."""
    trajectory = result.trajectory
    turn = math.remainder(trajectory.heading[0] - scene.ego.heading, 2.0 * math.pi)
    assert abs(turn) < 1e-6
    assert math.isclose(trajectory.speed[0], scene.ego.speed, abs_tol=1e-6)


def random_scene(seed, path, n_discs=4, n_cars=3, spread=4.5):
    """A consistent scene: the ego is free where it stands."""
    rng = np.random.default_rng(seed)
    bends = bool(np.any(path.curvature))
    s, speed = rng.uniform(5.0, 40.0), rng.uniform(1.0, 6.5 if bends else 13.0)
    l = rng.uniform(-2.0, 2.0)
    ego = ego_on(path, s, l, speed, rng.uniform(-0.03, 0.03))
    obstacles = [
        Disc(s + rng.uniform(10.0, 70.0), rng.uniform(-spread, spread), r)
        for r in rng.uniform(0.3, 1.5, n_discs)
    ]
    vehicles = [
        Car(
            s + rng.uniform(15.0, 80.0),
            rng.uniform(-spread, spread),
            rng.choice([rng.uniform(0.0, 14.0), -rng.uniform(5.0, 14.0)]),
        )
        for _ in range(n_cars)
    ]
    return make_scene(path, ego, obstacles, vehicles)


@every_planner
@pytest.mark.parametrize("seed", range(8))
def test_random_scenes_keep_the_contract(name, seed):
    scene = random_scene(seed, winding() if seed % 2 else straight())
    result = PLANNERS[name].plan(scene, None)
    check_contract(result, scene)
    check_start(result, scene)


def check_limits(trajectory, scene):
    """All limits of the vehicle at every point but the first, which is given."""
    limits = scene.vehicle.limits
    curvature, speed = trajectory.curvature[1:], trajectory.speed[1:]
    tolerance = 1e-4
    assert np.abs(curvature).max() <= limits.max_curvature + tolerance
    assert trajectory.acceleration[1:].max() <= limits.max_acceleration + tolerance
    assert trajectory.acceleration[1:].min() >= -limits.max_deceleration - tolerance
    sideways = speed**2 * np.abs(curvature)
    assert sideways.max() <= limits.max_lateral_acceleration + tolerance


def road_excess(trajectory, scene):
    """How far any corner of the body is over the road's edge, by projection [m]."""
    points = np.vstack(
        [
            corners(ego_rectangle(trajectory.at(float(t)), scene.vehicle))
            for t in trajectory.t
        ]
    )
    near = np.repeat(trajectory.s, 4)
    s, l = scene.path.project(points[:, 0], points[:, 1], near)
    left, right = scene.road.at(s)
    return float(np.max(np.maximum(l - left, right - l)))


@pytest.mark.parametrize("name", CLOSED_LOOP)
@pytest.mark.parametrize("seed", range(12))
def test_the_chosen_trajectory_keeps_every_limit_and_the_margin(name, seed):
    planner = PLANNERS[name]
    path = (straight(), winding(), bend(-20.0, before=30.0))[seed % 3]
    scene = random_scene(seed, path)
    result = planner.plan(scene, None)
    if result.status is not PlanStatus.OK:
        return  # the test below sees to it that this is rare
    trajectory = result.trajectory
    check_limits(trajectory, scene)
    assert road_excess(trajectory, scene) <= 0.0
    # Between two points the pose is interpolated: a_lat dt² / 8 = 5 mm at most.
    kept = clearances(scene, trajectory)
    assert kept.min() >= planner.settings.margin - 0.01


def test_enough_of_those_scenes_have_a_plan():
    paths = (straight(), winding(), bend(-20.0, before=30.0))
    planned = [
        PLANNERS["proposed"].plan(random_scene(seed, paths[seed % 3]), None).status
        for seed in range(12)
    ]
    assert planned.count(PlanStatus.OK) >= 8


@pytest.mark.parametrize("name", CLOSED_LOOP)
@pytest.mark.parametrize("seed", range(4))
def test_the_columns_of_a_trajectory_describe_one_motion(name, seed):
    scene = random_scene(seed, winding(), n_discs=2, n_cars=1)
    trajectory = PLANNERS[name].plan(scene, None).trajectory
    s, l = scene.path.project(trajectory.x, trajectory.y, trajectory.s)
    np.testing.assert_allclose(s, trajectory.s, atol=1e-6)
    np.testing.assert_allclose(l, trajectory.l, atol=1e-6)
    mean = 0.5 * (trajectory.speed[1:] + trajectory.speed[:-1])
    driven = np.hypot(np.diff(trajectory.x), np.diff(trajectory.y))
    np.testing.assert_allclose(driven, mean * STEP, atol=3e-3)
    turned = np.diff(np.unwrap(trajectory.heading))
    bent = 0.5 * (trajectory.curvature[1:] + trajectory.curvature[:-1]) * driven
    np.testing.assert_allclose(turned, bent, atol=2e-3)
    gained = np.diff(trajectory.speed)
    pushed = 0.5 * (trajectory.acceleration[1:] + trajectory.acceleration[:-1]) * STEP
    np.testing.assert_allclose(gained, pushed, atol=3e-2)


@every_planner
def test_planning_is_pure(name):
    planner = PLANNERS[name]
    scene = random_scene(3, winding())
    memory = planner.plan(scene, None).memory
    later = make_scene(
        scene.path,
        memory.trajectory.at(STEP),
        scene.obstacles,
        scene.vehicles,
        near=scene.ego_frenet.s,
    )
    before = pickle.dumps((memory.trajectory, later.obstacles, later.vehicles))
    first, second = planner.plan(later, memory), planner.plan(later, memory)
    for field in fields(first.trajectory):
        one, other = (getattr(r.trajectory, field.name) for r in (first, second))
        assert one.tobytes() == other.tobytes()
    assert first.stats == second.stats
    assert pickle.dumps((memory.trajectory, later.obstacles, later.vehicles)) == before


@pytest.mark.parametrize("name", THESIS)
@pytest.mark.parametrize("speed", [5.0, 50.0 / 3.6])
def test_the_thesis_has_exactly_231_candidates(name, speed):
    path = straight()
    scene = make_scene(path, ego_on(path, 20.0, 0.0, speed), [Disc(60.0, 0.0, 1.0)])
    result = PLANNERS[name].plan(scene, None)
    assert result.stats.candidates == 231


@pytest.mark.parametrize("name", THESIS)
def test_the_thesis_keeps_its_own_limits(name):
    path = straight()
    scene = make_scene(path, ego_on(path, 20.0), [Disc(60.0, 0.5, 1.0)])
    result = PLANNERS[name].plan(scene, None)
    assert result.status is PlanStatus.OK
    trajectory = result.trajectory
    assert 4.0 - 1e-9 <= trajectory.duration <= 5.0 + 1e-9
    assert np.abs(trajectory.curvature).max() <= 0.5
    assert np.abs(trajectory.acceleration).max() <= 3.0 + 1e-6
    # eq. 4.11 as corrected: the disc of 1 m about the rear axle stays outside
    apart = np.hypot(trajectory.x - 60.0, trajectory.y - 0.5)
    assert apart.min() >= 2.0 - 1e-6


@every_planner
@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
@pytest.mark.parametrize(
    "field", ["x", "y", "heading", "curvature", "speed", "acceleration"]
)
def test_an_ego_that_is_not_finite_is_an_invalid_scene(name, field, value):
    ego = replace(ego_on(straight(), 50.0), **{field: value})
    scene = make_scene(straight(), ego, frenet=FRENET)
    result = PLANNERS[name].plan(scene, None)
    assert result.status is PlanStatus.INVALID_SCENE
    assert result.trajectory is None
    assert field in result.stats.reason


@pytest.mark.parametrize("value", [math.nan, -math.inf])
@pytest.mark.parametrize("field", [f.name for f in fields(FrenetState)])
def test_a_frenet_state_that_is_not_finite_is_an_invalid_scene(field, value):
    scene = make_scene(straight(), frenet=replace(FRENET, **{field: value}))
    result = PLANNERS["proposed"].plan(scene, None)
    assert result.status is PlanStatus.INVALID_SCENE


@pytest.mark.parametrize("target", [math.nan, math.inf, -1.0])
def test_a_target_speed_that_is_none_is_an_invalid_scene(target):
    scene = make_scene(straight(), target_speed=target)
    result = PLANNERS["proposed"].plan(scene, None)
    assert result.status is PlanStatus.INVALID_SCENE


@pytest.mark.parametrize("step", [0.0, -0.1, math.nan])
def test_a_step_that_is_none_is_an_invalid_scene(step):
    scene = replace(make_scene(straight()), step=step)
    result = PLANNERS["proposed"].plan(scene, None)
    assert result.status is PlanStatus.INVALID_SCENE


@pytest.mark.parametrize("column", ["x", "y", "heading", "length", "radius"])
def test_an_obstacle_that_is_not_finite_is_an_invalid_scene_not_a_free_road(column):
    path = straight()
    obstacles = discs(path, [Disc(60.0, 0.0, 1.0)])
    broken = replace(obstacles, **{column: np.array([math.nan])})
    scene = make_scene(path, ego_on(path, 40.0), broken)
    result = PLANNERS["proposed"].plan(scene, None)
    assert result.status is PlanStatus.INVALID_SCENE


@pytest.mark.parametrize("column", ["x", "y", "heading", "length", "width"])
def test_a_vehicle_that_is_not_finite_is_an_invalid_scene_not_a_free_road(column):
    path = straight()
    broken = np.array([math.nan])
    vehicles = replace(cars(path, [Car(60.0, 0.0, 0.0)]), **{column: broken})
    if column in ("x", "y", "heading"):
        ahead = vehicles.prediction
        columns = {
            name: getattr(ahead, name).copy()
            for name in ("x", "y", "heading", "s", "l")
        }
        columns[column][:] = math.nan
        vehicles = replace(vehicles, prediction=Prediction(ahead.step, **columns))
    scene = make_scene(path, ego_on(path, 40.0), vehicles=vehicles)
    result = PLANNERS["proposed"].plan(scene, None)
    assert result.status is PlanStatus.INVALID_SCENE


@pytest.mark.parametrize("line_s", [math.nan, math.inf])
@every_planner
def test_a_stop_line_that_is_not_finite_does_not_raise(name, line_s):
    path = straight()
    scene = make_scene(path, ego_on(path, 40.0), stop_lines=(line_s,))
    check_contract(PLANNERS[name].plan(scene, None), scene)


@every_planner
@pytest.mark.parametrize("half_width", [2.0, 1.0, 0.8, 0.01])
def test_a_road_narrower_than_the_body_has_a_reason_not_an_error(name, half_width):
    path = straight()
    scene = make_scene(path, bounds=road(path, half_width, -half_width))
    check_contract(PLANNERS[name].plan(scene, None), scene)


@every_planner
def test_no_vehicles_and_no_columns_of_prediction(name):
    path = straight()
    empty = cars(path, [], n_steps=0)
    scene = make_scene(path, vehicles=empty)
    check_contract(PLANNERS[name].plan(scene, None), scene)


@every_planner
@pytest.mark.parametrize("n_steps", [1, 2, 10, 200])
def test_predictions_of_any_length_are_taken(name, n_steps):
    path = straight()
    vehicles = cars(path, [Car(60.0, 0.5, 5.0)], n_steps=n_steps)
    scene = make_scene(path, ego_on(path, 20.0), vehicles=vehicles)
    check_contract(PLANNERS[name].plan(scene, None), scene)


@every_planner
def test_two_hundred_obstacles(name):
    path = straight()
    rng = np.random.default_rng(5)
    rows = [
        Disc(s, l, r)
        for s, l, r in zip(
            rng.uniform(0.0, 150.0, 200),
            rng.uniform(-8.0, 8.0, 200),
            rng.uniform(0.1, 1.0, 200),
            strict=True,
        )
    ]
    scene = make_scene(path, ego_on(path, 20.0), rows)
    check_contract(PLANNERS[name].plan(scene, None), scene)


@every_planner
def test_an_obstacle_across_the_whole_road_is_stopped_for(name):
    path = straight()
    wall = Obstacles(
        ("wall",), *(np.array([v]) for v in (60.0, 0.0, math.pi / 2, 12.0, 0.5, 0.0))
    )
    scene = make_scene(path, ego_on(path, 20.0), wall)
    result = PLANNERS[name].plan(scene, None)
    check_contract(result, scene)
    assert clearances(scene, result.trajectory).min() > 0.0


def test_what_stands_in_the_way_of_the_cheapest_candidate_is_named():
    base = cruise.CruiseSettings()
    blind = replace(base, weights=replace(base.weights, safety=0.0, headway=0.0))
    planner = cruise.proposed(blind)  # would rather drive straight on
    path = straight()
    scene = make_scene(path, ego_on(path, 20.0), [Disc(50.0, 0.0, 1.0)])
    assert planner.plan(scene, None).stats.blocker == "disc.0"
    free = make_scene(path, ego_on(path, 20.0), [Disc(300.0, 0.0, 1.0)])
    assert planner.plan(free, None).stats.blocker is None


def test_the_blocker_is_named_when_no_candidate_survives():
    path = straight()
    wall = Obstacles(
        ("wall",), *(np.array([v]) for v in (60.0, 0.0, math.pi / 2, 12.0, 0.5, 0.0))
    )
    scene = make_scene(path, ego_on(path, 20.0), wall)
    result = PLANNERS["thesis_proposed"].plan(scene, None)
    assert result.status is not PlanStatus.OK
    assert result.stats.blocker == "wall"


def test_hits_are_seen_below_the_margin_even_if_the_costs_end_before_it():
    path = straight()
    base = cruise.CruiseSettings()
    wide = replace(base, margin=1.0, scales=replace(base.scales, clearance=0.2))
    scene = make_scene(path, ego_on(path, 20.0), [Disc(55.0, 2.5, 1.0)])
    result = cruise.proposed(wide).plan(scene, None)
    assert result.status is PlanStatus.OK
    assert clearances(scene, result.trajectory).min() >= 0.99


PATHS = {
    "straight": straight(),
    "winding": winding(),
    "tight": bend(6.0, before=20.0),
    "tiny": ReferencePath.from_segments([line(0.5)]),
    "tiny_arc": ReferencePath.from_segments([arc(3.0, -1.0 / 6.0)]),
}
numbers = st.floats(0.0, 1.0)
odd_discs = st.builds(
    Disc, st.floats(-20.0, 90.0), st.floats(-8.0, 8.0), st.floats(0.01, 4.0)
)
odd_cars = st.builds(
    Car,
    st.floats(-60.0, 90.0),
    st.floats(-30.0, 30.0),
    st.floats(-20.0, 20.0),
    turned=st.sampled_from([0.0, 0.2, 1.5]),
)


@dataclass(frozen=True)
class Oddity:
    """Few numbers that make an odd scene; places are relative to the ego's."""

    path: str
    along: float
    l: float
    speed: float
    error: float
    curvature: float | None
    acceleration: float
    discs: list[Disc]
    cars: list[Car]
    n_steps: int
    nowhere: bool
    half_width: float
    lines: list[float]
    target: float

    def scene(self):
        path = PATHS[self.path]
        s = -10.0 + self.along * (path.length + 30.0)
        kappa = float(path.at(s).curvature)
        l = self.l if 1.0 - kappa * self.l > 0.02 else 0.0
        ego = ego_on(
            path, s, l, self.speed, self.error, self.curvature, self.acceleration
        )
        traffic = [replace(car, s=s + car.s) for car in self.cars]
        vehicles = cars(path, traffic, self.n_steps)
        if self.nowhere:
            ahead = vehicles.prediction
            far, none = np.full_like(ahead.s, np.inf), np.zeros_like(ahead.l)
            gone = replace(ahead, s=far, l=none)
            vehicles = replace(vehicles, prediction=gone)
        try:  # beyond the centre of a bend the ego is nearer to another part, reversed
            cartesian_to_frenet_one(path, ego, s)
        except OutsidePathDomainError:
            reject()
        return make_scene(
            path,
            ego,
            [replace(disc, s=s + disc.s) for disc in self.discs],
            vehicles,
            bounds=road(path, self.half_width, -self.half_width),
            stop_lines=tuple(s + line_s for line_s in self.lines),
            target_speed=self.target,
            near=s,
        )


oddities = st.builds(
    Oddity,
    st.sampled_from(sorted(PATHS)),
    numbers,
    st.floats(-9.0, 9.0),
    st.one_of(st.just(0.0), st.floats(0.0, 25.0)),
    st.one_of(st.just(0.0), st.floats(-1.5, 1.5)),
    st.one_of(st.none(), st.floats(-0.4, 0.4)),
    st.floats(-10.0, 5.0),
    st.lists(st.one_of(st.just(Disc(0.0, 0.0, 1.0)), odd_discs), max_size=12),
    st.lists(odd_cars, max_size=6),
    st.sampled_from([1, 5, 51, 80]),
    st.booleans(),
    st.sampled_from([0.5, 1.05, 1.6, 5.0, 40.0]),
    st.lists(st.floats(-20.0, 80.0), max_size=2),
    st.sampled_from([0.0, 0.3, 13.9, 30.0]),
)


STOPS_ON_ITS_LINE = Oddity(
    path="straight",
    along=0.0,
    l=-0.125,
    speed=0.5,
    error=1.0,
    curvature=None,
    acceleration=2.0,
    discs=[Disc(0.0, 0.0, 1.0)],
    cars=[],
    n_steps=1,
    nowhere=False,
    half_width=0.5,
    lines=[],
    target=0.0,
)


@every_planner
@given(oddity=oddities)
@example(oddity=STOPS_ON_ITS_LINE)
@settings(max_examples=60, suppress_health_check=[HealthCheck.too_slow])
def test_odd_scenes_never_raise(name, oddity):
    planner, scene = PLANNERS[name], oddity.scene()
    result = planner.plan(scene, None)
    check_contract(result, scene)
    if result.trajectory is not None:
        check_contract(planner.plan(scene, result.memory), scene)


@every_planner
@given(
    speed=st.floats(-10.0, 10.0),
    s_dot=st.floats(-10.0, 10.0),
    error=st.floats(1.6, 4.6),
)
@settings(max_examples=20)
def test_an_ego_that_heads_backwards_never_raises(name, speed, s_dot, error):
    path = straight()
    frenet = replace(FRENET, s_dot=s_dot, l_dot=speed * math.sin(error))
    scene = make_scene(path, ego_on(path, 50.0, 0.0, speed, error), frenet=frenet)
    check_contract(PLANNERS[name].plan(scene, None), scene)
