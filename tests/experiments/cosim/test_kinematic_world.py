import math

import numpy as np
import pytest

from experiments.cosim.kinematic_world import (
    KinematicWorld,
    ScriptedVehicle,
    constant_bounds,
)
from experiments.cosim.road import EgoTask, Road, Start
from planner.reference_path.path import ReferencePath
from planner.reference_path.segments import arc, line
from planner.states import CartesianState
from planner.vehicle import Vehicle

STRAIGHT = ReferencePath.from_segments([line(200.0)])
NOWHERE = CartesianState(0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


def world(path=STRAIGHT, vehicles=(), **start) -> KinematicWorld:
    road = Road(path, constant_bounds(path, 5.0))
    return KinematicWorld(
        road, EgoTask(Vehicle(), 100.0, 8.0, Start(**start)), vehicles
    )


def after(scripted: KinematicWorld, steps: int):
    for _ in range(steps):
        scripted.advance(NOWHERE)
    return scripted.observe()


def test_ego_starts_beside_the_path():
    radius = 20.0
    path = ReferencePath.from_segments([arc(30.0, 1.0 / radius)])
    ego = world(path, s=10.0, l=2.0).enter()
    angle = 10.0 / radius
    assert ego.x == pytest.approx((radius - 2.0) * math.sin(angle))
    assert ego.y == pytest.approx(radius - (radius - 2.0) * math.cos(angle))
    assert ego.heading == pytest.approx(angle)
    assert ego.curvature == pytest.approx(1.0 / (radius - 2.0))
    assert (ego.speed, ego.acceleration) == (8.0, 0.0)


def test_vehicles_drive_stand_and_come_towards():
    scripted = world(
        vehicles=(
            ScriptedVehicle("with", 10.0, -3.0, 5.0),
            ScriptedVehicle("still", 50.0, 1.0, 0.0),
            ScriptedVehicle("towards", 90.0, 3.0, -10.0),
        )
    )
    traffic = after(scripted, 20)
    assert traffic.time == pytest.approx(2.0)
    assert traffic.vehicles.x == pytest.approx([20.0, 50.0, 70.0])
    assert traffic.vehicles.y == pytest.approx([-3.0, 1.0, 3.0])
    assert np.cos(traffic.vehicles.heading) == pytest.approx([1.0, 1.0, -1.0])
    assert traffic.vehicles.speed == pytest.approx([5.0, 0.0, 10.0])


def test_the_ego_starts_as_fast_as_wanted():
    assert world(speed=3.0).enter().speed == 3.0


@pytest.mark.parametrize("l", [-4.0, 0.0, 4.0])
def test_speed_is_that_of_the_vehicle_not_of_its_foot_point(l):
    radius = 20.0
    path = ReferencePath.from_segments([arc(60.0, 1.0 / radius)])
    scripted = world(path, vehicles=(ScriptedVehicle("car", 5.0, l, 6.0),))
    traffic = after(scripted, 30)
    turned = math.atan2(traffic.vehicles.x[0], radius - traffic.vehicles.y[0])
    assert turned == pytest.approx(5.0 / radius + 6.0 * 3.0 / (radius - l), abs=1e-9)


def test_vehicles_do_not_wait_for_the_ego():
    cars = (ScriptedVehicle("car", 10.0, 0.0, 5.0),)
    one, other = world(vehicles=cars), world(vehicles=cars)
    one.advance(NOWHERE)
    other.advance(CartesianState(11.0, 0.0, 1.0, 0.1, 9.0, 3.0))
    assert one.observe().vehicles.x == pytest.approx(other.observe().vehicles.x)
