import math

import numpy as np
import pytest

from experiments.cosim.kinematic_world import (
    KinematicSettings,
    KinematicWorld,
    ScriptedSignal,
    ScriptedVehicle,
    constant_road,
)
from planner.errors import InvalidInputError
from planner.reference_path.path import ReferencePath
from planner.reference_path.segments import arc, line
from planner.states import CartesianState

STRAIGHT = ReferencePath.from_segments([line(200.0)])
NOWHERE = CartesianState(0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


def world(path=STRAIGHT, **changes) -> KinematicWorld:
    given = {"path": path, "road": constant_road(path, 5.0), "start_speed": 8.0}
    return KinematicWorld(KinematicSettings(**(given | changes)))


def after(scripted: KinematicWorld, steps: int):
    for _ in range(steps):
        scripted.advance(NOWHERE)
    return scripted.observe()


def test_ego_starts_beside_the_path():
    radius = 20.0
    path = ReferencePath.from_segments([arc(30.0, 1.0 / radius)])
    ego = world(path, start_s=10.0, start_offset=2.0).enter()
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
    assert traffic.x == pytest.approx([20.0, 50.0, 70.0])
    assert traffic.y == pytest.approx([-3.0, 1.0, 3.0])
    assert np.cos(traffic.heading) == pytest.approx([1.0, 1.0, -1.0])
    assert traffic.speed == pytest.approx([5.0, 0.0, 10.0])


def test_speed_changes_count_within_a_step():
    changes = ((0.25, 4.0), (0.5, 0.0))
    car = ScriptedVehicle("car", 0.0, 0.0, 10.0, speed_changes=changes)
    traffic = after(world(vehicles=(car,)), 10)
    assert traffic.x[0] == pytest.approx(10.0 * 0.25 + 4.0 * 0.25)
    assert traffic.speed[0] == 0.0


@pytest.mark.parametrize("first", [-5.0, 0.0])
def test_an_oncoming_car_at_rest_keeps_its_heading(first):
    changes = ((0.2, -3.0), (0.4, 0.0))
    car = ScriptedVehicle("car", 50.0, 0.0, first, speed_changes=changes)
    scripted = world(vehicles=(car,))
    for steps in (0, 3, 5):
        assert math.cos(after(scripted, steps).heading[0]) == pytest.approx(-1.0)


@pytest.mark.parametrize("l", [-4.0, 0.0, 4.0])
def test_speed_is_that_of_the_vehicle_not_of_its_foot_point(l):
    radius = 20.0
    path = ReferencePath.from_segments([arc(60.0, 1.0 / radius)])
    scripted = world(path, vehicles=(ScriptedVehicle("car", 5.0, l, 6.0),))
    traffic = after(scripted, 30)
    turned = math.atan2(traffic.x[0], radius - traffic.y[0])
    assert turned == pytest.approx(5.0 / radius + 6.0 * 3.0 / (radius - l), abs=1e-9)


def test_vehicles_do_not_wait_for_the_ego():
    cars = (ScriptedVehicle("car", 10.0, 0.0, 5.0),)
    one, other = world(vehicles=cars), world(vehicles=cars)
    one.advance(NOWHERE)
    other.advance(CartesianState(11.0, 0.0, 1.0, 0.1, 9.0, 3.0))
    assert one.observe().x == pytest.approx(other.observe().x)


@pytest.mark.parametrize(
    ("time", "state"), [(0.0, "G"), (2.9, "G"), (3.0, "y"), (4.0, "r"), (9.0, "G")]
)
def test_signals_run_through_their_cycle(time, state):
    light = ScriptedSignal("light", 60.0, ((3.0, "G"), (1.0, "y"), (5.0, "r")))
    assert light.at(time).state == state
    assert light.at(time).stop_s == 60.0


def test_signals_are_observed():
    light = ScriptedSignal("light", 60.0, ((0.3, "G"), (1.0, "r")))
    scripted = world(signals=(light,))
    assert scripted.observe().signals[0].state == "G"
    assert after(scripted, 4).signals[0].state == "r"


def test_bad_scripts_are_refused():
    with pytest.raises(InvalidInputError, match="must grow"):
        ScriptedVehicle("car", 0.0, 0.0, 1.0, speed_changes=((2.0, 1.0), (1.0, 0.0)))
    with pytest.raises(InvalidInputError, match="positive"):
        ScriptedSignal("light", 0.0, ())
