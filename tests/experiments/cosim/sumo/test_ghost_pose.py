import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from experiments.cosim.sumo import frames
from experiments.cosim.sumo.ghost_pose import (
    beside_lanes,
    corners,
    ghost_pose,
    rear_pose,
)
from experiments.cosim.sumo.lanes import Lane, Strip
from planner.states import CartesianState
from planner.vehicle import Vehicle

CAR = Vehicle()
WIDTH = 3.5


def road(angle: float = 0.0, lanes: int = 3) -> list[Lane]:
    """Three lanes of 100 m, the middle one through the origin, turned by `angle`."""
    cos, sin = math.cos(angle), math.sin(angle)
    strips = []
    for index in range(lanes):
        y = (index - 1) * WIDTH
        points = [(x * cos - y * sin, x * sin + y * cos) for x in (0.0, 40.0, 100.0)]
        strips.append(Lane(f"e_{index}", "e", index, WIDTH, np.array(points)))
    return strips


def ego(x: float, y: float, heading: float = 0.0, angle: float = 0.0) -> CartesianState:
    """Rear axle at (x, y) of a road turned by `angle`."""
    cos, sin = math.cos(angle), math.sin(angle)
    at = (x * cos - y * sin, x * sin + y * cos)
    return CartesianState(*at, heading + angle, 0.0, 10.0, 0.0)


def needed(lanes, state):
    front = frames.front_from_rear_axle(state, CAR)[:2]
    return ghost_pose(Strip(lanes), front, state, CAR)


def test_no_ghost_inside_the_lane():
    edge = (WIDTH - CAR.width) / 2.0
    assert needed(road(), ego(30.0, edge - 0.01)) is None
    assert needed(road(), ego(30.0, -edge + 0.01)) is None


def test_ghost_rides_abreast_in_the_lane_reached_into():
    pose = needed(road(), ego(30.0, 1.0))
    assert pose is not None
    assert (pose.edge, pose.lane) == ("e", 2)
    assert (pose.x, pose.y) == pytest.approx((30.0 + CAR.front_reach, WIDTH))
    assert pose.heading == pytest.approx(0.0)


def test_roles_swap_where_the_bumper_crosses_the_line():
    before = needed(road(), ego(30.0, WIDTH / 2.0 - 1e-6))
    after = needed(road(), ego(30.0, WIDTH / 2.0 + 1e-6))
    assert before is not None
    assert after is not None
    assert (before.lane, after.lane) == (2, 1)


def test_a_turned_body_reaches_over_with_its_nose():
    offset = 0.5
    nose = offset + CAR.front_reach * math.sin(0.1) + CAR.width / 2 * math.cos(0.1)
    assert nose > WIDTH / 2.0 > offset + CAR.width / 2.0
    pose = needed(road(), ego(30.0, offset, 0.1))
    assert pose is not None
    assert pose.lane == 2


def test_no_ghost_beyond_the_outer_lanes():
    assert needed(road(), ego(30.0, WIDTH + 1.5)) is None
    assert needed(road(), ego(30.0, -WIDTH - 1.5)) is None


@pytest.mark.parametrize("x", [-3.9, 96.6])
def test_a_ghost_stays_in_the_gap_between_two_lanes(x):
    """Where a lane ends and the next one turns, a bumper may be on none of them."""
    pose = needed(road(), ego(x, 1.0))
    assert pose is not None
    assert pose.lane == 2


@pytest.mark.parametrize("x", [-10.0, 97.0])
def test_no_ghost_before_and_beyond_the_edge(x):
    assert needed(road(), ego(x, 1.0)) is None


def test_a_rear_that_still_hangs_over_keeps_the_ghost():
    # The nose has come back to the lane's centre, the rear right corner has not.
    state = ego(30.0, -0.9, math.asin(0.9 / CAR.front_reach))
    pose = needed(road(), state)
    assert pose is not None
    assert pose.lane == 0


@given(
    st.floats(10.0, 80.0),
    st.floats(-5.0, 5.0),
    st.floats(-0.3, 0.3),
    st.floats(-math.pi, math.pi),
)
def test_a_turned_road_turns_the_ghost(x, y, heading, angle):
    plain = needed(road(), ego(x, y, heading))
    turned = needed(road(angle), ego(x, y, heading, angle))
    if plain is None or turned is None:
        assert plain is turned
        return
    cos, sin = math.cos(angle), math.sin(angle)
    assert plain.lane == turned.lane
    assert turned.x == pytest.approx(plain.x * cos - plain.y * sin, abs=1e-6)
    assert turned.y == pytest.approx(plain.x * sin + plain.y * cos, abs=1e-6)


@given(st.floats(10.0, 80.0), st.floats(-5.0, 5.0), st.floats(-0.5, 0.5))
def test_ghost_is_where_a_corner_is_and_the_bumper_is_not(x, y, heading):
    state = ego(x, y, heading)
    pose = needed(road(), state)
    front_y = y + CAR.front_reach * math.sin(heading)
    own = Strip(road()).lane_of(x + CAR.front_reach * math.cos(heading), front_y)
    if pose is not None:
        assert pose.lane != own
        low, high = (pose.lane - 1.5) * WIDTH, (pose.lane - 0.5) * WIDTH
        assert corners(state, CAR)[:, 1].min() < high
        assert corners(state, CAR)[:, 1].max() > low


def test_a_front_that_swings_out_in_a_junction_is_put_on_the_nearest_lane():
    def lane(name, *points):
        return Strip([Lane(f"{name}_0", name, 0, WIDTH, np.array(points))])

    strips = [
        lane("in", (0.0, 0.0), (20.0, 0.0)),
        lane(":turn", (20.0, 0.0), (26.0, -6.0)),
        lane("out", (26.0, -6.0), (26.0, -40.0)),
    ]
    far = np.full((4, 2), 500.0)  # nothing of the body is in a lane

    def beside(*front, outline=far):
        return beside_lanes(strips, front, outline)

    assert beside(22.0, 3.0) == pytest.approx((20.0, 0.0))  # beyond
    assert beside(26.0, 0.0) == pytest.approx((23.0, -3.0))
    assert beside(29.0, -4.0) == pytest.approx((26.0, -6.0))  # before
    for beside_a_road in (10.0, 4.0), (30.0, -20.0):
        assert beside(*beside_a_road) == beside_a_road
    # over the middle of the road behind the junction, the rear still in its lane
    outline = np.array([(26.5, -10.0), (24.8, -9.0), (28.5, -14.0), (30.2, -15.0)])
    assert beside(29.3, -14.5, outline=outline) == pytest.approx((26.0, -14.5))


def test_the_rear_of_one_that_swings_out_is_still_in_the_lane_before():
    before = Strip(road(lanes=1))  # its centre line is y = -3.5
    turned = rear_pose(before, ego(98.0, -3.5, math.pi / 2.0), CAR)
    assert turned is not None
    assert (turned.edge, turned.lane) == ("e", 0)
    assert turned.x == pytest.approx(100.0)
    assert turned.length == pytest.approx(2.0 + CAR.width / 2.0)
    behind = rear_pose(before, ego(102.0, -3.5), CAR)
    assert (behind.x, behind.length) == pytest.approx((100.0, 0.5))
    assert rear_pose(before, ego(105.0, -3.5), CAR) is None
    assert rear_pose(before, ego(98.0, 4.0, math.pi / 2.0), CAR) is None
