import numpy as np
import pytest

from experiments.cosim.kinematic_world import constant_bounds
from experiments.cosim.records import TrafficState
from experiments.cosim.road import EgoTask, Road
from experiments.cosim.scene_builder import Outlook, build_scene
from planner.reference_path.frenet import cartesian_to_frenet_one, state_on_path
from planner.reference_path.path import ReferencePath
from planner.reference_path.segments import arc, line
from planner.scene import COLUMNS, Prediction, RoadUsers
from planner.vehicle import Vehicle
from tests.experiments.road_users import road_users

PATH = ReferencePath.from_segments([line(100.0), arc(60.0, 0.05)])


ROAD = Road(PATH, constant_bounds(PATH, 5.0))
TASK = EgoTask(Vehicle(), 150.0, 12.0)
WIDE = RoadUsers(("a", "b", "c", "d"), *np.arange(32.0).reshape(8, 4))


def traffic(*x: float) -> TrafficState:
    cars = [(f"car.{k}", at, 0.0, 0.0, 5.0 + k) for k, at in enumerate(x)]
    return TrafficState(1.5, road_users(*cars))


def frozen(path, vehicles, times, lanes=None) -> Prediction:
    """Predict that all stay, and note the speed in l."""
    x, y, heading, speed = (
        row[:, None] * np.ones(times.size) for row in vehicles.table[:4]
    )
    return Prediction(float(times[1]), x, y, heading, x, speed)


def scene_of(given: TrafficState, *, horizon=2.0, lines=()):
    ego = state_on_path(PATH, 50.0, 0.0, 9.0)
    frenet = cartesian_to_frenet_one(PATH, ego)
    outlook = Outlook(0.1, horizon, frozen)
    return build_scene(ROAD, TASK, outlook, given, ego, frenet, lines)


def test_only_vehicles_within_the_radius_are_planned_with():
    given = traffic(-80.0, 45.0, 61.0, 171.0)
    scene = scene_of(given, lines=(70.0,))
    assert scene.vehicles.ids == ("car.1", "car.2")
    assert scene.vehicles.x == pytest.approx([45.0, 61.0])
    assert scene.vehicles.speed == pytest.approx([6.0, 7.0])
    assert scene.vehicles.width == pytest.approx([1.8, 1.8])
    assert scene.vehicles.prediction.l[:, -1] == pytest.approx([6.0, 7.0])
    assert scene.vehicles.prediction.x.shape == (2, 21)
    assert (scene.time, scene.stop_lines) == (1.5, (70.0,))


def test_the_scene_shares_the_table_of_the_traffic():
    given = traffic(20.0, 45.0, 61.0)
    scene = scene_of(given)
    assert scene.vehicles.ids == given.vehicles.ids
    assert np.shares_memory(scene.vehicles.x, given.vehicles.table)
    assert not scene.vehicles.table.flags.writeable


def test_a_subset_keeps_every_column():
    kept = WIDE.among(np.array([False, True, False, True]))
    assert kept.ids == ("b", "d")
    for name in COLUMNS:
        assert getattr(kept, name).tolist() == getattr(WIDE, name)[[1, 3]].tolist()
    assert kept.lateral_speed.tolist() == [21.0, 23.0]


def test_a_short_horizon_still_has_two_columns():
    assert scene_of(traffic(60.0), horizon=0.01).vehicles.prediction.x.shape == (1, 2)


def test_an_empty_road_is_a_scene():
    scene = scene_of(traffic())
    assert scene.vehicles.ids == ()
    assert scene.vehicles.prediction.x.shape == (0, 21)
