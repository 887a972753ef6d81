"""Planning: one cycle of 231 candidates, whole and as printed; projection."""

import math
from dataclasses import replace

import numpy as np
import pytest

from planner import cruise
from planner.bodies import bodies_of
from planner.interface import PlanStatus
from planner.prediction import constant_speed
from planner.reference_path.path import ReferencePath
from planner.reference_path.segments import arc, clothoid, line
from planner.scene import RoadUsers
from tests.planner.scenes import Car, Disc, ego_on, make_scene, road

pytestmark = pytest.mark.bench

DISCS = [
    Disc(45.0 + 9.0 * k, (-1) ** k * (2.5 + 0.4 * k), 0.5 + 0.2 * k) for k in range(6)
]
CARS = [
    Car(70.0, 3.3, 9.0),
    Car(110.0, -3.3, -8.0),
    Car(95.0, 0.0, 8.0),
    Car(20.0, 3.3, 11.0),
]


def ten_bodies():
    """Ten bodies on a winding road that is wide enough for all 21 offsets."""
    k = 1.0 / 60.0
    path = ReferencePath.from_segments(
        [line(40.0), clothoid(20.0, 0.0, k), arc(50.0, k), line(150.0)]
    )
    ego = ego_on(path, 20.0, 0.3, 10.0, 0.01)
    return make_scene(path, ego, DISCS, CARS, bounds=road(path, 7.0, -7.0))


@pytest.fixture(scope="module")
def scene():
    return ten_bodies()


def closed_loop_231():
    """All cost terms; 11 profiles x 21 offsets x 51 points."""
    settings = replace(
        cruise.CruiseSettings(),
        times=tuple(1.0 + 0.4 * k for k in range(11)),
        speed_fractions=(0.95,),
        creep_speeds=(),
        stop_times=(),
        follow_times=(),
        drive_fractions=(),
        edge_offsets=False,
        horizon=5.0,
    )
    return cruise.CruisePlanner(settings)


PLANNERS = {
    "closed_loop_231": closed_loop_231(),
    "proposed": cruise.proposed(),
    "conventional": cruise.conventional(),
    "thesis_proposed": cruise.thesis_proposed(),
    "thesis_conventional": cruise.thesis_conventional(),
}


@pytest.mark.parametrize("name", PLANNERS)
def test_plan(benchmark, scene, name):
    planner = PLANNERS[name]
    memory = planner.plan(scene, None).memory
    result = benchmark(planner.plan, scene, memory)
    assert result.status is PlanStatus.OK
    benchmark.extra_info["candidates"] = result.stats.candidates
    benchmark.extra_info["points"] = int(result.trajectory.t.size)
    benchmark.extra_info["bodies"] = len(DISCS) + len(CARS)
    if name.endswith("231") or name.startswith("thesis"):
        assert result.stats.candidates == 231
    if name == "closed_loop_231":
        assert result.trajectory.t.size == 51
        assert result.stats.costs["safety"] >= 0.0


@pytest.mark.parametrize("name", ["closed_loop_231", "proposed"])
def test_plan_lazily(benchmark, scene, name):
    """As in a sweep: what cannot be the cheapest is not judged."""
    planner, scene = PLANNERS[name], replace(scene, full_statistics=False)
    memory = planner.plan(scene, None).memory
    result = benchmark(planner.plan, scene, memory)
    assert result.status is PlanStatus.OK
    assert result.stats.survivors is None


def test_gathering_the_bodies(benchmark, scene):
    found = benchmark(bodies_of, scene, 51)
    assert len(found.ids) == len(scene.vehicles.ids) + len(scene.obstacles.ids)


def test_predicting_thirty_vehicles(benchmark, scene):
    rng = np.random.default_rng(0)
    s, l, speed = (rng.uniform(*b, 30) for b in ((0, 250), (-4, 4), (3, 14)))
    points = scene.path.at(s)
    x, y = points.x - l * points.sin_heading, points.y + l * points.cos_heading
    none = np.zeros(30)
    benchmark.extra_info["vehicles"] = 30
    size = (np.full(30, 4.6), np.full(30, 1.8))
    ids = tuple(map(str, range(30)))
    users = RoadUsers(ids, x, y, points.heading, speed, none, none, *size)
    args = (scene.path, users, 0.1 * np.arange(51))
    assert benchmark(constant_speed, *args).x.shape == (30, 51)


def test_projection_on_a_path_of_300_points(benchmark):
    turn = np.linspace(0.0, 4.0 * math.pi, 300)
    polyline = np.stack([20.0 * turn, 15.0 * np.sin(turn)], axis=1)
    path = ReferencePath.from_polyline(polyline)
    rng = np.random.default_rng(1)
    n = 50_000
    points = path.at(rng.uniform(0.0, path.length, n))
    l = rng.uniform(-5.0, 5.0, n)
    x, y = points.x - l * points.sin_heading, points.y + l * points.cos_heading
    s, _ = benchmark(path.project, x, y)
    assert s.shape == (n,)
    benchmark.extra_info["path_points"] = 300
    benchmark.extra_info["path_knots"] = int(path.s.size)
    if benchmark.stats is not None:  # none with --benchmark-disable
        benchmark.extra_info["points_per_s"] = n / benchmark.stats.stats.median
