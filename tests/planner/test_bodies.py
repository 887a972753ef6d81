import math
from dataclasses import replace

import numpy as np
import pytest

from planner.bodies import bodies_of, leader_of, touched_by
from planner.scene import Obstacles, Prediction
from planner.states import Trajectory
from tests.planner.scenes import (
    STEP,
    Car,
    Disc,
    bend,
    cars,
    ego_on,
    make_scene,
    place,
    straight,
)

N = 51


@pytest.fixture(scope="module")
def path():
    return straight()


def scene_at(path, s=100.0, l=0.0, **kwargs):
    return make_scene(path, ego_on(path, s, l, 10.0), **kwargs)


def test_static_bodies_come_first_and_stand_still(path):
    scene = scene_at(path, obstacles=[Disc(120.0, 1.0, 0.7)], vehicles=[Car(130, 0, 5)])
    bodies = bodies_of(scene, N)
    assert bodies.ids == ("disc.0", "car.0")
    assert bodies.table.n_static == 1
    np.testing.assert_array_equal(bodies.table.poses[0, 0], np.full(N, 120.0))
    np.testing.assert_allclose(bodies.table.poses[1, 0], 130.0 + 0.5 * np.arange(N))
    np.testing.assert_allclose(bodies.table.s, bodies.table.poses[:, 0], atol=1e-9)
    np.testing.assert_allclose(bodies.table.l, bodies.table.poses[:, 1], atol=1e-9)
    assert list(bodies.table.speed) == [0.0, 5.0]


def test_extents_and_circumscribed_circles(path):
    box = Obstacles(("box",), *(np.array([v]) for v in (120.0, 0, 0.3, 4.0, 3.0, 0.2)))
    scene = scene_at(path, obstacles=box, vehicles=[Car(130, 0, 5, 6.0, 8.0)])
    bodies = bodies_of(scene, N)
    np.testing.assert_allclose(bodies.table.extents, [[2.0, 1.5, 0.2], [3.0, 4.0, 0.0]])
    np.testing.assert_allclose(bodies.table.size, [2.7, 5.0])
    np.testing.assert_allclose(
        bodies.table.poses[0, 2:, 0], [math.cos(0.3), math.sin(0.3)]
    )


def test_a_shorter_prediction_is_held_at_its_end(path):
    scene = scene_at(path, vehicles=cars(path, [Car(130, 0, 5)], n_steps=11))
    bodies = bodies_of(scene, N)
    np.testing.assert_allclose(bodies.table.poses[0, 0, 10:], 135.0)


def test_a_prediction_on_a_finer_grid_is_read_at_the_planners_times(path):
    fine = cars(path, [Car(130, 0, 5)], n_steps=101, step=STEP / 2.0)
    bodies = bodies_of(scene_at(path, vehicles=fine), N)
    expected = 130.0 + 5.0 * STEP * np.arange(N)
    np.testing.assert_allclose(bodies.table.poses[0, 0], expected, atol=1e-9)


@pytest.mark.parametrize(
    ("car", "follows"),
    [
        (Car(85.0, 0.0, 12.0), True),
        (Car(85.0, 1.5, 12.0), True),  # overlaps the ego's width
        (Car(85.0, 3.5, 12.0), False),  # its own lane
        (Car(100.0, 0.0, 12.0), False),  # not behind
        (Car(115.0, 0.0, 12.0), False),
    ],
)
def test_followers_are_vehicles_behind_in_the_egos_corridor(path, car, follows):
    bodies = bodies_of(scene_at(path, vehicles=[car]), N)
    assert bool(bodies.table.follower[0]) is follows


def test_an_obstacle_never_follows(path):
    bodies = bodies_of(scene_at(path, obstacles=[Disc(85.0, 0.0, 1.0)]), N)
    assert not bodies.table.follower.any()


def test_the_corridor_moves_with_the_ego(path):
    bodies = bodies_of(scene_at(path, l=3.5, vehicles=[Car(85.0, 3.5, 12.0)]), N)
    assert bodies.table.follower[0]


def leader(scene):
    return leader_of(scene, bodies_of(scene, N))


def test_the_leader_is_the_nearest_body_ahead_in_the_corridor(path):
    vehicles = [Car(160, 0, 8), Car(130, 3.5, 5), Car(140, 0.4, 6), Car(90, 0, 9)]
    found = leader(scene_at(path, vehicles=vehicles))
    assert found.id == "car.2"
    np.testing.assert_allclose(found.s, 140.0 - 2.4 + 0.6 * np.arange(N))
    np.testing.assert_allclose(found.speed, 6.0)


def test_an_obstacle_can_lead(path):
    found = leader(scene_at(path, obstacles=[Disc(120.0, 0.5, 1.2)]))
    assert found.id == "disc.0"
    np.testing.assert_allclose(found.s, 118.8)
    np.testing.assert_allclose(found.speed, 0.0)


def test_nobody_leads_on_a_free_road(path):
    assert leader(scene_at(path)) is None
    beside = [Car(105.0, 3.5, 10.0), Car(85.0, 0.0, 10.0)]
    assert leader(scene_at(path, vehicles=beside)) is None


def test_the_speed_of_an_oncoming_leader_is_not_negative(path):
    found = leader(scene_at(path, vehicles=[Car(180.0, 0.0, -10.0)]))
    np.testing.assert_allclose(found.speed, 0.0)


def test_who_leaves_the_road_does_not_lead(path):
    vehicles = cars(path, [Car(120.0, 0.0, 5.0)])
    ahead = vehicles.prediction
    s = ahead.s.copy()
    s[0, 20:] = np.inf
    leaving = Prediction(ahead.step, ahead.x, ahead.y, ahead.heading, s, ahead.l)
    gone = replace(vehicles, prediction=leaving)
    assert leader(scene_at(path, vehicles=gone)) is None


def test_who_has_no_place_on_the_path_is_neither_leader_nor_follower(path):
    vehicles = cars(path, [Car(120.0, 0.0, 5.0)])
    ahead = vehicles.prediction
    nowhere = Prediction(
        ahead.step,
        ahead.x,
        ahead.y,
        ahead.heading,
        np.full_like(ahead.s, np.inf),
        np.zeros_like(ahead.l),
    )
    scene = scene_at(path, vehicles=replace(vehicles, prediction=nowhere))
    assert leader(scene) is None
    assert not bodies_of(scene, N).table.follower.any()


def test_in_a_bend_places_are_along_the_road():
    path = bend(30.0)
    scene = scene_at(path, s=70.0, vehicles=[Car(90.0, 0.0, 6.0)])
    found = leader(scene)
    assert math.isclose(found.s[0], 90.0 - 2.4, abs_tol=1e-6)
    np.testing.assert_allclose(found.speed, 6.0, rtol=1e-6)


@pytest.mark.parametrize("step", [0.05, 0.1, 0.2])
def test_a_trajectory_meets_bodies_where_they_are_at_its_own_times(path, step):
    scene = scene_at(path, s=100.0, vehicles=[Car(112.0, 0.0, 10.0)])
    bodies = bodies_of(scene, N)
    t = step * np.arange(round((N - 1) * bodies.step / step) + 1)

    def at_speed(speed):
        s = 100.0 + speed * t
        poses = [place(path, float(at), 0.0) for at in s]
        x, y, heading = (np.array(column) for column in zip(*poses, strict=True))
        still = np.zeros_like(t)
        return Trajectory(t, x, y, heading, still, still + speed, still, s, still)

    asked = (bodies, bodies.table.follower, (0.0, 1.4, 2.8), 1.1, 0.1)
    assert touched_by(at_speed(10.0), *asked) is None
    assert touched_by(at_speed(20.0), *asked) == "car.0"
