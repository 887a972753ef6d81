import math
from dataclasses import replace

import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st

from experiments.cosim.goal import (
    BEYOND,
    BRAKING,
    LEAD,
    SPARE_WAY,
    SPEEDING_UP,
    GoalRegion,
    GoalWindow,
)
from planner.states import CartesianState
from planner.vehicle import Vehicle

VEHICLE = Vehicle()
AREA = shapely.box(90.0, -2.0, 110.0, 2.0)
WINDOW = GoalWindow(
    (5.0, 15.0), AREA, begin=90.0, end=110.0, speed=(4.0, 12.0), heading=(-0.3, 0.3)
)


def ego(centre=100.0, y=0.0, heading=0.0, speed=8.0):
    """An ego whose body has its centre there."""
    x = centre - VEHICLE.centre_offset * math.cos(heading)
    y -= VEHICLE.centre_offset * math.sin(heading)
    return CartesianState(x, y, heading, 0.0, speed, 0.0)


def region(*windows):
    return GoalRegion.of(windows or (WINDOW,), VEHICLE)


@pytest.mark.parametrize(
    ("state", "time", "reached"),
    [
        (ego(), 10.0, True),
        (ego(), 5.0 - 1e-7, True),
        (ego(), 4.9, False),
        (ego(), 15.1, False),
        (ego(speed=3.9), 10.0, False),
        (ego(speed=12.1), 10.0, False),
        (ego(centre=89.9), 10.0, False),
        (ego(y=2.1), 10.0, False),
        (ego(heading=0.31), 10.0, False),
        (ego(heading=0.29), 10.0, True),
        (ego(heading=0.29 - 2.0 * math.pi), 10.0, True),
    ],
)
def test_goal_is_reached_where_every_part_holds(state, time, reached):
    assert region().is_reached(state, VEHICLE, time) is reached


def test_one_state_of_several_is_enough():
    early = replace(WINDOW, time=(0.0, 1.0))
    assert region(early, WINDOW).is_reached(ego(), VEHICLE, 10.0)
    assert not region(early).is_reached(ego(), VEHICLE, 10.0)


@given(st.floats(-math.pi, math.pi), st.floats(0.01, 6.0), st.floats(0.0, 1.0))
def test_headings_count_by_turns(begin, width, share):
    window = GoalWindow((0.0, 1.0), heading=(begin, begin + width))
    inside = begin + min(max(share, 1e-6), 1.0 - 1e-6) * width
    for turns in (-1, 0, 2):
        state = CartesianState(0, 0, inside + turns * 2 * math.pi, 0, 0, 0)
        assert window.holds(0.0, 0.0, state, 0.5)
    gap = 2.0 * math.pi - width
    outside = begin + width + 0.5 * gap
    assert not window.holds(0.0, 0.0, CartesianState(0, 0, outside, 0, 0, 0), 0.5)


def test_way_to_the_area_has_a_sign():
    assert [WINDOW.way_to(place) for place in (80.0, 100.0, 113.0)] == [10.0, 0.0, -3.0]


@pytest.mark.parametrize(
    ("place", "state", "words"),
    [
        (80.0, ego(), "10.0 m before its area"),
        (113.0, ego(), "3.0 m behind its area"),
        (100.0, ego(speed=2.0), "drives 2.0 m/s, not 4.0 to 12.0"),
        (100.0, ego(heading=1.0), "heading is 1.00 rad; asked for is t = 5.0 to 15.0"),
        (100.0, ego(), "beside its area, or in it at another time"),
    ],
)
def test_what_is_lacking_is_said(place, state, words):
    assert words in WINDOW.lacking(place, state)


def test_a_goal_is_missed_by_time_or_beyond_its_area():
    goal = region()
    s = 100.0 - goal.centre
    assert goal.why_missed(s, ego(), 15.0) is None
    assert "not met by t = 15.0 s" in goal.why_missed(s, ego(), 15.1)
    far = 110.0 + BEYOND - goal.centre
    assert goal.why_missed(far - 0.1, ego(), 10.0) is None
    assert "drove past the goal's area" in goal.why_missed(far + 0.1, ego(), 10.0)
    farther = replace(WINDOW, begin=190.0, end=210.0)
    assert region(WINDOW, farther).why_missed(far + 0.1, ego(), 10.0) is None


speeds = st.floats(0.0, 20.0)


@given(st.floats(0.0, 60.0), st.floats(0.0, 14.0), speeds)
def test_a_constant_wish_arrives_before_the_time_is_over(place, time, speed):
    window = GoalWindow((0.0, 15.0), AREA, begin=90.0, end=110.0)
    goal = region(window)
    wanted = goal.wanted_speed(1.0, place - goal.centre, time, speed)
    assert wanted * (15.0 - time) >= 90.0 - place


@given(st.floats(91.0, 105.0), st.floats(0.0, 9.0), speeds, st.floats(0.0, 30.0))
def test_who_is_early_stays_in_the_area(place, time, speed, preferred):
    window = GoalWindow((10.0, 15.0), AREA, begin=90.0, end=110.0)
    goal = region(window)
    wanted = goal.wanted_speed(preferred, place - goal.centre, time, speed)
    assert 0.0 <= wanted * (10.0 - time) <= 110.0 - SPARE_WAY - place + 1e-9


@given(st.floats(0.0, 89.0), speeds, st.floats(0.0, 30.0))
def test_own_speed_of_a_goal_is_reached_with_the_stated_rates(place, speed, preferred):
    window = GoalWindow((0.0, 1e9), AREA, begin=90.0, end=110.0, speed=(6.0, 10.0))
    goal = region(window)
    wanted = goal.wanted_speed(preferred, place - goal.centre, 0.0, speed)
    way = max(90.0 - place - LEAD * speed, 0.0)
    assert wanted <= math.sqrt(9.0**2 + 2.0 * BRAKING * way) + 1e-9
    assert wanted**2 >= 7.0**2 - 2.0 * SPEEDING_UP * way - 1e-9
    if way == 0.0:
        assert 7.0 - 1e-9 <= wanted <= 9.0 + 1e-9
