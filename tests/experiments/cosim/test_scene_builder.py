import math

import numpy as np
import pytest

from experiments.cosim.kinematic_world import constant_road
from experiments.cosim.records import TrafficState
from experiments.cosim.scene_builder import SceneFrame, make_scene, state_on_path
from planner.reference_path.frenet import cartesian_to_frenet_one
from planner.reference_path.path import ReferencePath
from planner.reference_path.segments import arc, line
from planner.scene import Obstacles, Prediction
from planner.vehicle import Vehicle

PATH = ReferencePath.from_segments([line(100.0), arc(60.0, 0.05)])


def traffic(*x: float) -> TrafficState:
    n = len(x)
    ids = tuple(f"car.{i}" for i in range(n))
    rows = np.arange(5.0 * n).reshape(5, n)
    return TrafficState(1.5, ids, np.array(x), np.zeros(n), *rows)


def frozen(  # noqa: PLR0917 - the signature of a predictor
    path, x, y, heading, speed, acceleration, lateral_speed, step, n_steps
) -> Prediction:
    """Predict that everyone stays, and note the speed in l."""
    hold = np.ones((1, n_steps))
    return Prediction(
        step,
        x[:, None] * hold,
        y[:, None] * hold,
        heading[:, None] * hold,
        x[:, None] * hold,
        speed[:, None] * hold,
    )


def frame(radius: float) -> SceneFrame:
    return SceneFrame(
        step=0.1,
        vehicle=Vehicle(),
        path=PATH,
        road=constant_road(PATH, 5.0),
        obstacles=Obstacles.none(),
        target_speed=12.0,
        predictor=frozen,
        horizon=2.0,
        radius=radius,
    )


def test_only_vehicles_within_the_radius_are_planned_with():
    ego = state_on_path(PATH, 50.0, 0.0, 9.0)
    frenet = cartesian_to_frenet_one(PATH, ego)
    given = traffic(20.0, 45.0, 61.0, 95.0)
    scene = make_scene(frame(12.0), given, ego, frenet, (70.0,))
    assert scene.vehicles.ids == ("car.1", "car.2")
    assert scene.vehicles.x == pytest.approx([45.0, 61.0])
    assert scene.vehicles.speed == pytest.approx(given.speed[1:3])
    assert scene.vehicles.width == pytest.approx(given.width[1:3])
    assert scene.vehicles.prediction.l[:, -1] == pytest.approx(given.speed[1:3])
    assert scene.vehicles.prediction.x.shape == (2, 21)
    assert (scene.time, scene.stop_lines) == (1.5, (70.0,))
    everyone = make_scene(frame(1e3), given, ego, frenet, ())
    assert everyone.vehicles.ids == given.ids


def test_an_empty_road_is_a_scene():
    ego = state_on_path(PATH, 50.0, 0.0, 9.0)
    frenet = cartesian_to_frenet_one(PATH, ego)
    scene = make_scene(frame(50.0), traffic(), ego, frenet, ())
    assert scene.vehicles.ids == ()
    assert scene.vehicles.prediction.x.shape == (0, 21)


@pytest.mark.parametrize(("s", "l"), [(30.0, 2.0), (130.0, -3.0), (130.0, 3.0)])
def test_state_on_path_has_the_frenet_state_of_a_parallel(s, l):
    ego = state_on_path(PATH, s, l, 7.0)
    frenet = cartesian_to_frenet_one(PATH, ego)
    assert (frenet.s, frenet.l) == pytest.approx((s, l), abs=1e-9)
    assert frenet.l_prime == pytest.approx(0.0, abs=1e-9)
    assert frenet.l_second == pytest.approx(0.0, abs=1e-9)
    assert -math.pi < ego.heading <= math.pi
