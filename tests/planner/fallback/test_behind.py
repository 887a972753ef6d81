"""Who changes lanes behind the ego gives way to it."""

from dataclasses import replace

import numpy as np
import pytest

from planner.bodies import bodies_of
from planner.fallback.behind import behind
from planner.scene import Prediction
from tests.planner.scenes import Car, cars, ego_on, make_scene, straight

N, STEP = 51, 0.1


@pytest.fixture(scope="module")
def path():
    return straight(300.0)


def changing(path, s, speed, drift, turn=0.0):
    """A vehicle in the lane beside that moves over, `drift` to the left [m/s]."""
    now = cars(path, [Car(s, 3.5, speed)])
    ahead = now.prediction
    l = ahead.l + drift * STEP * np.arange(ahead.l.shape[1])
    y, heading = ahead.y + l - ahead.l, ahead.heading + turn
    moved = Prediction(ahead.step, ahead.x, y, heading, ahead.s, l)
    return replace(now, prediction=moved)


@pytest.mark.parametrize(
    ("s", "speed", "drift", "turn", "follows"),
    [
        (85.0, 12.0, -1.3, -0.1, True),  # comes in behind an ego that goes on
        (85.0, 12.0, 1.3, 0.1, False),  # to the other side
        (85.0, 25.0, -1.3, -0.1, False),  # is past the ego's rear by then
        (100.0, 12.0, -1.3, -0.1, False),  # beside the ego
        (97.0, 10.0, -1.3, -0.1, False),  # its front is beside the ego's rear
        (85.0, 12.0, -1.3, -0.9, False),  # crosses the road
    ],
)
def test_who_changes_into_the_egos_lane_behind_it_follows(
    path, s, speed, drift, turn, follows
):
    vehicles = changing(path, s, speed, drift, turn)
    scene = make_scene(path, ego_on(path, 100.0, 0.0, 10.0), vehicles=vehicles)
    bodies = bodies_of(scene, N)
    assert not bodies.table.follower[0]
    assert bool(behind(scene, bodies)[0]) is follows


def test_who_follows_already_is_behind(path):
    scene = make_scene(
        path, ego_on(path, 100.0, 0.0, 10.0), vehicles=[Car(85.0, 0.0, 12.0)]
    )
    bodies = bodies_of(scene, N)
    assert behind(scene, bodies).tolist() == bodies.table.follower.tolist() == [True]
