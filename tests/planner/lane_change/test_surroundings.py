import numpy as np
import pytest

from planner.lane_change.lane_choice import bodies_on_road
from planner.lane_change.surroundings import behind_ego, in_lane, road_users
from tests.planner.lane_change.roads import on_lanes
from tests.planner.scenes import Car, Disc


def test_obstacles_stand_before_the_vehicles_and_lose_nothing():
    scene = on_lanes(cars=[Car(150.0, 1.75, 8.0)], obstacles=[Disc(130.0, -1.75, 0.6)])
    users = road_users(scene)
    assert users.ids == ("disc.0", "car.0")
    assert users.length[0] == users.width[0] == pytest.approx(1.2)
    assert (users.prediction.s[0] == users.prediction.s[0, 0]).all()
    np.testing.assert_array_equal(users.prediction.x[1], scene.vehicles.prediction.x[0])


def test_without_obstacles_nothing_is_copied():
    scene = on_lanes(cars=[Car(150.0, 1.75, 8.0)])
    assert road_users(scene) is scene.vehicles


def test_behind_is_behind_the_rear_bumper():
    rows = [Car(94.0, -1.75, 8.0), Car(98.0, 1.75, 8.0), Car(120.0, -1.75, 8.0)]
    scene = on_lanes(s=100.0, cars=rows)
    np.testing.assert_array_equal(
        behind_ego(scene, bodies_on_road(scene)), [True, False, False]
    )


def test_a_car_on_its_way_out_is_in_neither_lane():
    rows = [Car(80.0, -1.75, 8.0), Car(70.0, 1.75, 8.0), Car(60.0, -1.0, 8.0)]
    scene = on_lanes(cars=rows)
    users = road_users(scene)
    drifting = users.prediction.l.copy()
    drifting[2] = np.minimum(-1.0 + 0.15 * np.arange(drifting.shape[1]), 1.0)
    moved = type(users.prediction)(
        users.prediction.step,
        users.prediction.x,
        users.prediction.y,
        users.prediction.heading,
        users.prediction.s,
        drifting,
    )
    users = type(users)(
        users.ids,
        users.x,
        users.y,
        users.heading,
        users.speed,
        users.acceleration,
        users.length,
        users.width,
        moved,
    )
    bodies = bodies_on_road(scene)
    np.testing.assert_array_equal(
        in_lane(scene, bodies, users, 0), [True, False, False]
    )
    np.testing.assert_array_equal(
        in_lane(scene, bodies, users, 1), [False, True, False]
    )
