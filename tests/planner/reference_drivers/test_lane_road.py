import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from planner.reference_drivers import lane_road as lr
from planner.reference_path.path import ReferencePath
from planner.reference_path.segments import arc, line
from planner.scene import Lanes
from planner.vehicle import Vehicle
from tests.planner.reference_drivers.test_idm_mobil import EGO_S, ENDING, scene

VEHICLE = Vehicle()
PLACES = st.tuples(
    st.floats(-60, 60).filter(lambda gap: abs(gap) > 0.1),
    st.floats(-3, 6),
    st.floats(0, 20),
)


def test_obstacles_come_first_and_only_vehicles_move():
    road = lr.lane_road(scene(others=[(20.0, 3.5, 7.0)], walls=[(50.0, 0.0)]))
    assert road.ids == ("w0", "v0")
    assert road.static.tolist() == [True, False]
    assert road.speed.tolist() == [0.0, 7.0]
    np.testing.assert_allclose(road.half_length, [1.0, 2.4])
    np.testing.assert_allclose(road.half_width, [1.3, 0.95])


@given(st.lists(PLACES, min_size=1, max_size=5), st.integers(0, 1))
def test_bodies_in_a_lane_are_those_that_the_ego_would_touch_there(others, lane):
    seen = scene(others=others)
    marked = lr.in_lane(seen, lr.lane_road(seen), lane)
    centre = (0.0, 3.5)[lane]
    expected = [abs(l - centre) < 0.95 + VEHICLE.width / 2.0 for _, l, _ in others]
    assert marked.tolist() == expected


@given(st.lists(PLACES, min_size=1, max_size=5), st.floats(0.0, 10.0))
def test_bodies_beside_are_those_within_a_gap_of_both_bumpers(others, gap):
    seen = scene(others=others)
    marked = lr.beside(seen, lr.lane_road(seen), gap)
    for found, (away, _, _) in zip(marked, others, strict=True):
        assert found == (abs(away) <= gap) or abs(abs(away) - gap) < 1e-9


def test_on_its_way_the_ego_keeps_room_at_its_sides():
    seen = scene(others=[(20.0, 2.1, 0.0), (20.0, 2.3, 0.0)])
    offset = np.zeros(2)  # bodies touch at 1.9 m from centre to centre
    marked = lr.on_way(seen, lr.lane_road(seen), offset)
    assert marked.tolist() == [True, False]
    assert not lr.on_way(seen, lr.lane_road(seen), offset - 3.0).any()


@pytest.mark.parametrize(("l", "lane"), [(-3, 0), (0, 0), (1.7, 0), (1.8, 1), (9, 1)])
def test_the_lane_of_a_place_is_the_nearest_one(l, lane):
    assert lr.lane_at(scene(), l) == lane
    assert lr.lane_centre(scene(), lane) == (0.0, 3.5)[lane]


def test_lanes_that_are_not_marked_here_are_none():
    assert lr.lane_at(scene(lanes=Lanes.none()), 0.0) == -1
    thin = Lanes(np.zeros(1), np.array([[0.0], [3.5]]), np.array([[0.4], [3.5]]))
    assert lr.lane_at(scene(lanes=thin), 0.0) == 1


def test_a_lane_ends_where_it_is_too_narrow_for_a_car():
    assert lr.lane_end(scene(lanes=ENDING), 0) == pytest.approx(250.0, abs=2.0)
    assert lr.lane_end(scene(lanes=ENDING), 1) == math.inf


@given(st.floats(5.0, 30.0), st.floats(0.5, 4.0), st.floats(0.01, 0.1))
def test_before_a_bend_braking_reaches_the_speed_of_the_bend(target, braking, bend):
    path = ReferencePath.from_segments([line(EGO_S + 30.0), arc(60.0, bend)])
    seen = replace(scene(target=target), path=path)
    wished = lr.wished_speed(seen, braking)
    lateral = lr.BEND_SHARE * VEHICLE.limits.max_lateral_acceleration
    expected = math.sqrt(lateral / bend + 2.0 * braking * 30.0)
    # the road ahead is looked at every two metres
    within = math.sqrt(2.0 * braking * lr.BEND_STEP)
    assert min(target, expected) - 1e-9 <= wished <= min(target, expected + within)
    straight = scene(target=target)
    assert lr.wished_speed(straight, braking) == target
