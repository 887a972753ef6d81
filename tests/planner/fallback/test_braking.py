"""Motions that brake to a stand, against closed forms and finite differences."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from planner.fallback.braking import (
    EMERGENCY_JERK,
    Brake,
    brake_down,
    braking_on_arc,
    stopping_trajectory,
)
from planner.states import CartesianState
from tests.planner.scenes import STEP, ego_on, make_scene, straight, winding

HORIZON = 5.0


@given(
    speed=st.floats(0.5, 20.0),
    l=st.floats(-3.0, 3.0),
    offset=st.floats(-3.0, 3.0),
    error=st.floats(-0.1, 0.1),
    deceleration=st.sampled_from([4.5, 8.0]),
)
def test_a_stop_on_a_straight_brakes_as_it_says(speed, l, offset, error, deceleration):
    path = straight()
    scene = make_scene(path, ego_on(path, 50.0, l, speed, error))
    stop = stopping_trajectory(scene, offset, deceleration, HORIZON)
    assert stop.t.size == 51
    assert math.isclose(stop.x[0], scene.ego.x, abs_tol=1e-9)
    assert math.isclose(stop.y[0], scene.ego.y, abs_tol=1e-9)
    assert math.isclose(stop.heading[0], scene.ego.heading, abs_tol=1e-9)
    assert math.isclose(stop.speed[0], speed, abs_tol=1e-9)
    assert np.all(np.diff(stop.s) >= -1e-12)
    assert stop.speed[-1] == 0.0
    slower = -np.diff(stop.speed) / STEP
    assert slower.max() < 1.25 * deceleration  # the way bends, the share of s is kept


@pytest.mark.parametrize("speed", [3.0, 8.0])
def test_a_stop_in_a_bend_follows_the_road_and_moves_as_it_says(speed):
    path = winding()
    scene = make_scene(path, ego_on(path, 40.0, 1.0, speed))
    stop = stopping_trajectory(scene, 1.0, 4.5, HORIZON)
    np.testing.assert_allclose(stop.l, 1.0, atol=1e-9)
    s, l = path.project(stop.x, stop.y)
    np.testing.assert_allclose(s, stop.s, atol=1e-6)
    np.testing.assert_allclose(l, stop.l, atol=1e-6)
    driven = np.hypot(np.diff(stop.x), np.diff(stop.y))
    mean = 0.5 * (stop.speed[1:] + stop.speed[:-1]) * STEP
    moving = stop.speed[1:] > 0.0
    # while the deceleration grows, the mean of the ends is too small by jerk · step³/12
    np.testing.assert_allclose(driven[moving], mean[moving], rtol=2e-3, atol=9e-4)


def test_a_standing_ego_stays_where_it_is():
    path = straight()
    scene = make_scene(path, ego_on(path, 50.0, 1.0, 0.0))
    stop = stopping_trajectory(scene, 0.0, 4.5, HORIZON)
    np.testing.assert_allclose(stop.x, 50.0)
    np.testing.assert_allclose(stop.y, 1.0)


@given(st.floats(0.0, 20.0), st.floats(-0.2, 0.2), st.floats(1.0, 9.0))
def test_braking_on_an_arc_in_closed_form(speed, curvature, deceleration):
    ego = CartesianState(3.0, -2.0, 0.7, curvature, speed, 1.0)
    stop = braking_on_arc(ego, deceleration, STEP, 25.0)
    driven, _, _ = brake_down(
        speed, Brake(1.0, deceleration, EMERGENCY_JERK), np.array([1e3])
    )
    driven = float(driven[0])
    assert math.isclose(stop.s[-1], driven, abs_tol=1e-9)
    assert math.isclose(stop.heading[-1], 0.7 + curvature * driven, abs_tol=1e-9)
    if abs(curvature) > 1e-3:
        heading = 0.7 + curvature * stop.s
        x = 3.0 + (np.sin(heading) - math.sin(0.7)) / curvature
        y = -2.0 - (np.cos(heading) - math.cos(0.7)) / curvature
        np.testing.assert_allclose(stop.x, x, atol=1e-6)
        np.testing.assert_allclose(stop.y, y, atol=1e-6)
    slower = -np.diff(stop.speed) / STEP
    assert slower.max(initial=0.0) <= deceleration + 1e-9


@given(
    speed=st.floats(0.0, 20.0),
    first=st.floats(-6.0, 3.0),
    deceleration=st.floats(1.0, 9.0),
    jerk=st.floats(5.0, 50.0),
)
def test_braking_keeps_its_jerk_and_drives_what_its_speed_says(
    speed, first, deceleration, jerk
):
    t = np.arange(0.0, 25.0, 1e-3)
    way, v, a = brake_down(speed, Brake(first, deceleration, jerk), t)
    assert np.all(v >= 0.0)
    assert v[-1] == 0.0
    assert (
        np.abs(way - np.concatenate([[0.0], np.cumsum(v[1:] + v[:-1]) * 5e-4])).max()
        < 1e-2
    )
    moving = v[1:] > 0.0
    assert np.abs(np.diff(a)[moving]).max(initial=0.0) <= jerk * 1e-3 + 1e-9
    assert a.min() >= min(first, -deceleration) - 1e-9
