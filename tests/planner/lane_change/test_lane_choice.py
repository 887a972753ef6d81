import numpy as np
import pytest

from planner.lane_change.lane_choice import (
    WORTH_TIME,
    bodies_on_road,
    lane_at,
    lane_end,
    lane_worths,
    wanted_lane,
)
from planner.scene import Lanes, Obstacles, Scene
from tests.planner.lane_change.roads import on_lanes, two_lanes
from tests.planner.scenes import Car

RIGHT, LEFT = 0, 1
GAP = 2.0


def worths(scene: Scene) -> np.ndarray:
    return lane_worths(scene, bodies_on_road(scene), GAP)


def test_the_nearest_lane_is_the_own_one():
    lanes = two_lanes()
    assert lane_at(lanes, 50.0, -1.0) == RIGHT
    assert lane_at(lanes, 50.0, 0.2) == LEFT
    assert lane_at(Lanes.none(), 50.0, 0.0) == -1


def test_a_free_lane_is_worth_the_target_speed():
    scene = on_lanes(lane=RIGHT)
    assert worths(scene) == pytest.approx([scene.target_speed] * 2)


def test_a_leader_is_worth_its_speed_and_the_room_before_it():
    scene = on_lanes(lane=RIGHT, s=100.0, cars=[Car(160.0, -1.75, 5.0)])
    room = 60.0 - 2.4 - scene.vehicle.front_reach - GAP
    expected = room / WORTH_TIME + 5.0
    assert worths(scene) == pytest.approx([expected, scene.target_speed])


def test_a_car_behind_and_one_on_the_line_beside_count_where_they_are():
    behind = on_lanes(lane=RIGHT, s=100.0, cars=[Car(80.0, -1.75, 5.0)])
    assert worths(behind)[RIGHT] == behind.target_speed
    astride = on_lanes(lane=RIGHT, s=100.0, cars=[Car(160.0, 0.0, 5.0)])
    assert (worths(astride) < astride.target_speed).all()


def test_a_blockage_is_worth_the_way_to_it():
    block = Obstacles(
        ("b",), *(np.array([v]) for v in (200.0, -1.75, 0.0, 4.0, 3.0)), np.zeros(1)
    )
    scene = on_lanes(lane=RIGHT, s=100.0, obstacles=block)
    room = 100.0 - 2.0 - scene.vehicle.front_reach - GAP
    assert worths(scene)[RIGHT] == pytest.approx(room / WORTH_TIME)


def test_a_lane_that_ends_is_worth_the_way_to_its_end():
    s = np.array([0.0, 200.0, 200.1, 1000.0])
    width = np.array([[3.5, 3.5, 0.0, 0.0], [3.5] * 4])
    lanes = Lanes(s, np.array([[-1.75] * 4, [1.75] * 4]), width)
    scene = on_lanes(lane=RIGHT, s=100.0, lanes=lanes)
    assert lane_end(lanes, RIGHT, 100.0, 300.0) == pytest.approx(205.0, abs=5.0)
    assert worths(scene)[RIGHT] < worths(scene)[LEFT] == scene.target_speed
    assert lane_end(lanes, LEFT, 100.0, 300.0) == np.inf


@pytest.mark.parametrize(
    ("values", "own", "wanted"),
    [
        ([5.0, 14.0], 0, 1),
        ([14.0, 5.0], 0, None),
        ([13.5, 14.0], 0, None),  # not worth it
        ([14.0, 5.0, 14.0], 1, 2),  # a tie goes to the left
        ([14.0, 5.0, 5.0], 1, 0),
        ([3.0, 4.5, 14.0], 0, 1),  # the neighbour on the way to the best
        ([3.0, -np.inf, 14.0], 0, None),  # no neighbour, no change
    ],
)
def test_the_wanted_lane(values: list[float], own: int, wanted: int | None):
    assert wanted_lane(np.array(values), own, 1.0) == wanted
