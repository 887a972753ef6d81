import math
from dataclasses import replace

import numpy as np
import pytest

from planner.lane_change.path import ChangeTarget, best_change, lane_keeping_path
from planner.lane_change.settings import PathSettings, SpeedSettings
from planner.lane_change.speed.program import knot_times
from planner.lane_change.speed.st_graph import in_time, st_graph
from planner.scene import Scene
from planner.shapes.rectangles import Rectangle, distance
from planner.states import Path
from planner.vehicle import Vehicle
from tests.planner.lane_change.roads import on_lanes
from tests.planner.scenes import Car, Disc, bend

CAR = Vehicle()
ALONG, ACROSS = 1.0, 0.3
TIMES = knot_times(SpeedSettings())


def changing(scene: Scene) -> Path:
    found, _ = best_change(
        scene.path,
        scene.ego_frenet,
        ChangeTarget(1.75, 0.0, 200.0),
        CAR,
        PathSettings(),
    )
    assert found is not None
    return found.path


def graph_of(scene: Scene, path: Path):
    everyone = np.ones(len(scene.vehicles.ids), np.bool_)
    users = in_time(scene.vehicles, TIMES)
    return st_graph(path, CAR, users, everyone, ALONG, ACROSS)


def touching(scene: Scene, path: Path, v: int, k: int) -> np.ndarray:
    """Path points at which the grown footprint overlaps vehicle v at knot k."""
    x, y, cos, sin = in_time(scene.vehicles, TIMES[k : k + 1]).poses[v, 0].tolist()
    other = Rectangle(
        x,
        y,
        math.atan2(sin, cos),
        float(scene.vehicles.length[v]),
        float(scene.vehicles.width[v]),
    )
    hits = []
    for i in range(path.distance.size):
        h = path.heading[i]
        body = Rectangle(
            path.x[i] + CAR.centre_offset * np.cos(h),
            path.y[i] + CAR.centre_offset * np.sin(h),
            float(h),
            CAR.length + 2 * ALONG,
            CAR.width + 2 * ACROSS,
        )
        if distance(body, other) <= 0.0:
            hits.append(i)
    return np.array(hits)


@pytest.mark.parametrize("seed", range(4))
def test_the_graph_holds_every_overlap(seed):
    rng = np.random.default_rng(seed)
    road = bend(200.0, 120.0, 1.5) if seed % 2 else None
    cars = [
        Car(
            rng.uniform(60.0, 180.0),
            rng.choice([-1.75, 1.75]),
            rng.uniform(2.0, 16.0),
            turned=rng.uniform(-0.1, 0.1),
        )
        for _ in range(4)
    ]
    scene = on_lanes(path=road, cars=cars)
    path = changing(scene)
    graph = graph_of(scene, path)
    rows = dict(zip(graph.index, range(len(graph.ids)), strict=True))
    for v in range(4):
        for k in range(0, TIMES.size, 9):
            hits = touching(scene, path, v, k)
            if hits.size == 0:
                continue
            row = rows[v]
            assert graph.hit[row, k]
            assert graph.lower[row, k] <= path.distance[hits[0]]
            assert graph.upper[row, k] >= path.distance[hits[-1]]
            # and no more than a point on each side
            last = path.distance.size - 1
            assert graph.lower[row, k] >= path.distance[max(hits[0] - 2, 0)]
            assert graph.upper[row, k] <= path.distance[min(hits[-1] + 2, last)]


def test_a_car_in_the_other_lane_is_no_part_of_keeping_the_lane():
    scene = on_lanes(cars=[Car(120.0, 1.75, 10.0), Car(150.0, -1.75, 10.0)])
    path = lane_keeping_path(scene.path, scene.ego_frenet, -1.75, 200.0, PathSettings())
    assert path is not None
    graph = graph_of(scene, path)
    assert graph.ids == ("car.1",)
    free = 50.0 - 2.4 - CAR.front_reach - ALONG
    assert graph.lower[0, 0] == pytest.approx(free, abs=1.01)
    assert np.diff(graph.lower[0]).mean() == pytest.approx(1.0, abs=0.1)


def test_who_is_not_considered_is_not_there():
    scene = on_lanes(cars=[Car(150.0, -1.75, 10.0)])
    path = changing(scene)
    nobody = np.zeros(1, np.bool_)
    users = in_time(scene.vehicles, TIMES)
    graph = st_graph(path, CAR, users, nobody, ALONG, ACROSS)
    assert graph.ids == ()
    assert graph.hit.shape == (0, TIMES.size)


def test_a_stay_begins_a_knot_early_and_ends_a_knot_late():
    scene = on_lanes(cars=[Car(140.0, -1.75, 0.0)], speed=14.0)
    path = changing(scene)
    crossing = on_lanes(cars=[Car(100.0, 1.75, 14.0)], speed=14.0)
    graph = graph_of(crossing, path)
    first = int(np.argmax(graph.hit[0]))
    hits = [k for k in range(TIMES.size) if touching(crossing, path, 0, k).size]
    assert first == max(hits[0] - 1, 0)


def test_obstacles_stand_before_the_vehicles_and_lose_nothing():
    scene = on_lanes(cars=[Car(150.0, 1.75, 8.0)], obstacles=[Disc(130.0, -1.75, 0.6)])
    users = in_time(scene.vehicles, TIMES, scene.obstacles)
    assert users.ids == ("disc.0", "car.0")
    assert users.half_length[0] == users.half_width[0] == pytest.approx(0.6)
    assert (users.poses[0] == users.poses[0, 0]).all()
    np.testing.assert_array_equal(
        users.poses[1], in_time(scene.vehicles, TIMES).poses[0]
    )


def test_a_vehicle_without_a_prediction_stands():
    scene = on_lanes(cars=[Car(150.0, 1.75, 8.0)])
    ahead = scene.vehicles.prediction
    columns = ("x", "y", "heading", "s", "l")
    nothing = replace(ahead, **{name: np.empty((1, 0)) for name in columns})
    users = in_time(replace(scene.vehicles, prediction=nothing), TIMES)
    np.testing.assert_allclose(users.poses[0, :, 0], 150.0)
