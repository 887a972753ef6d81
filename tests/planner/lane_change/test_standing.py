import numpy as np
import pytest

from planner.lane_change.lane_choice import bodies_on_road
from planner.lane_change.standing import QUEUE, first_in_lane, stands_for_good
from planner.scene import Lanes, Obstacles
from tests.planner.lane_change.roads import on_lanes
from tests.planner.scenes import Car

REACH = 300.0
WALL = Obstacles(
    ("wall",), *(np.array([v]) for v in (200.0, -1.75, 0.0, 4.0, 3.0)), np.zeros(1)
)
ENDING = Lanes(
    np.array([0.0, 198.0, 199.0, 1500.0]),
    np.array([[-1.75] * 4, [1.75] * 4]),
    np.array([[3.5, 3.5, 0.0, 0.0], [3.5] * 4]),
)


@pytest.mark.parametrize(
    ("car", "waits"),
    [
        (Car(190.0, -1.75, 0.0), True),
        (Car(150.0, -1.75, 0.2), True),
        (Car(190.0, -1.75, 2.0), False),  # it drives
        (Car(190.0, 1.75, 0.0), False),  # in the open lane
        (Car(220.0, -1.75, 0.0), False),  # beyond the wall
        (Car(50.0, -1.75, 0.0), False),  # behind the ego
    ],
)
@pytest.mark.parametrize("closed_by", ["wall", "end"])
def test_who_stands_where_the_lane_is_closed_stands_for_good(car, waits, closed_by):
    if closed_by == "wall":
        scene = on_lanes(lane=0, s=100.0, cars=[car], obstacles=WALL)
    else:
        scene = on_lanes(lane=0, s=100.0, cars=[car], lanes=ENDING)
    bodies = bodies_on_road(scene)
    found = stands_for_good(scene, bodies, REACH)
    assert found[: bodies.n_static].all()
    assert found[-1] == waits
    first = first_in_lane(scene, bodies, found, 0)
    if waits:
        assert first == bodies.s.size - 1


def test_a_queue_without_a_wall_will_move():
    cars = [Car(150.0, -1.75, 0.0), Car(157.0, -1.75, 0.0)]
    scene = on_lanes(lane=0, s=100.0, cars=cars)
    assert not stands_for_good(scene, bodies_on_road(scene), REACH).any()


def test_far_before_a_wall_a_vehicle_stands_for_another_reason():
    far = Car(200.0 - QUEUE - 1.0, -1.75, 0.0)
    scene = on_lanes(lane=0, s=80.0, cars=[far], obstacles=WALL)
    assert stands_for_good(scene, bodies_on_road(scene), REACH).tolist() == [
        True,
        False,
    ]
