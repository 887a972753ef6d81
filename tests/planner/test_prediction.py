import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from planner.errors import InvalidInputError
from planner.prediction import (
    FRENET_REACH,
    LATERAL_HOLD,
    constant_speed,
    held_braking,
)
from planner.reference_path.path import ReferencePath
from planner.reference_path.segments import arc, line
from planner.scene import Lanes, RoadUsers

STEP, N = 0.1, 51
T = STEP * np.arange(N)


def on_lane(path, s, l, *, against=False):
    x, y, heading = path.pose(s)
    turned = math.pi if against else 0.0
    return x - l * math.sin(heading), y + l * math.cos(heading), heading + turned


def predict(predictor, path, pose, speed, acceleration=0.0, lateral=0.0, step=STEP):
    one = users([pose], [speed], acceleration, lateral)
    return predictor(path, one, step * np.arange(round(5.0 / step) + 1))


def users(poses, speeds, acceleration=0.0, lateral=0.0) -> RoadUsers:
    x, y, heading = np.array(poses, float).reshape(-1, 3).T
    one = np.ones(x.size)
    ids = tuple(f"car.{k}" for k in range(x.size))
    rates = (np.array(speeds), acceleration * one, lateral * one)
    return RoadUsers(ids, x, y, heading, *rates, 4.6 * one, 1.8 * one)


@pytest.fixture(scope="module")
def straight():
    return ReferencePath.from_segments([line(300.0)])


@pytest.fixture(scope="module")
def u_turn():
    return ReferencePath.from_segments(
        [line(30.0), arc(15.0 * math.pi, 1.0 / 15.0), line(60.0)]
    )


@given(s=st.floats(0.0, 200.0), l=st.floats(-8.0, 8.0), speed=st.floats(0.0, 20.0))
def test_a_straight_is_followed_at_constant_speed(straight, s, l, speed):
    ahead = predict(constant_speed, straight, on_lane(straight, s, l), speed)
    np.testing.assert_allclose(ahead.s[0], s + speed * T, atol=1e-9)
    np.testing.assert_allclose(ahead.x[0], s + speed * T, atol=1e-9)
    np.testing.assert_allclose(ahead.y[0], l, atol=1e-9)
    np.testing.assert_allclose(ahead.heading[0], 0.0, atol=1e-12)


@pytest.mark.parametrize("curvature", [0.04, -0.04])
@given(l=st.floats(-6.0, 6.0), speed=st.floats(0.5, 12.0))
def test_in_a_bend_the_distance_is_that_along_the_offset_curve(curvature, l, speed):
    path = ReferencePath.from_segments([arc(150.0, curvature)])
    ahead = predict(constant_speed, path, on_lane(path, 20.0, l), speed)
    radius = abs(1.0 / curvature) - math.copysign(l, curvature * l or 1.0)
    turned = abs(ahead.heading[0] - ahead.heading[0, 0])
    np.testing.assert_allclose(turned * radius, speed * T, atol=1e-6)
    np.testing.assert_allclose(ahead.l[0], l, atol=1e-9)
    centre = np.array([0.0, 1.0 / curvature])
    apart = np.hypot(ahead.x[0] - centre[0], ahead.y[0] - centre[1])
    np.testing.assert_allclose(apart, radius, atol=1e-6)


@pytest.mark.parametrize("l", [-3.0, 0.0, 3.0, 7.0])
def test_through_a_u_turn_the_driven_distance_is_speed_times_time(u_turn, l):
    pose = on_lane(u_turn, 20.0, l)
    ahead = predict(constant_speed, u_turn, pose, 12.0, step=0.02)
    driven = np.hypot(np.diff(ahead.x[0]), np.diff(ahead.y[0])).sum()
    assert math.isclose(driven, 60.0, rel_tol=0.01)
    np.testing.assert_allclose(ahead.l[0], l, atol=1e-9)


def test_oncoming_traffic_goes_down_the_road(u_turn):
    pose = on_lane(u_turn, 90.0, 3.0, against=True)
    ahead = predict(constant_speed, u_turn, pose, 10.0)
    assert np.all(np.diff(ahead.s[0]) < 0.0)
    np.testing.assert_allclose(ahead.l[0], 3.0, atol=1e-9)
    moving = np.arctan2(np.diff(ahead.y[0]), np.diff(ahead.x[0]))
    off = np.remainder(moving - ahead.heading[0, :-1] + math.pi, 2 * math.pi) - math.pi
    assert np.abs(off).max() < 0.1


def test_who_crosses_the_road_keeps_the_heading_and_gets_a_projected_place(straight):
    ahead = predict(constant_speed, straight, (50.0, -20.0, math.pi / 2), 8.0)
    np.testing.assert_allclose(ahead.x[0], 50.0, atol=1e-9)
    np.testing.assert_allclose(ahead.y[0], -20.0 + 8.0 * T, atol=1e-9)
    np.testing.assert_allclose(ahead.s[0], 50.0, atol=1e-9)
    np.testing.assert_allclose(ahead.l[0], ahead.y[0], atol=1e-9)


def test_beyond_reach_there_is_no_place_on_the_path(straight):
    ahead = predict(constant_speed, straight, (50.0, 10.0, math.pi / 2), 10.0)
    far = ahead.y[0] >= FRENET_REACH
    assert far.any()
    assert np.isinf(ahead.s[0, far]).all()
    assert not ahead.l[0, far].any()
    np.testing.assert_allclose(ahead.s[0, ~far], 50.0, atol=1e-9)


def test_who_starts_far_away_never_has_a_place(straight):
    ahead = predict(constant_speed, straight, (50.0, 500.0, 1.0), 10.0)
    assert np.isinf(ahead.s).all()


def test_a_turning_vehicle_is_not_bent_along_the_road(straight):
    ahead = predict(constant_speed, straight, (50.0, 2.0, 0.8), 10.0)
    np.testing.assert_allclose(ahead.heading[0], 0.8)
    np.testing.assert_allclose(ahead.y[0], 2.0 + 10.0 * math.sin(0.8) * T, atol=1e-9)


@pytest.mark.parametrize(("against", "sign"), [(False, 1.0), (True, -1.0)])
def test_a_lateral_speed_is_held_for_a_while(straight, against, sign):
    pose = on_lane(straight, 100.0, 0.0, against=against)
    ahead = predict(constant_speed, straight, pose, 10.0, lateral=0.9)
    expected = sign * 0.9 * np.minimum(T, LATERAL_HOLD)
    np.testing.assert_allclose(ahead.l[0], expected, atol=1e-9)


@pytest.mark.parametrize(("speed", "braking"), [(10.0, 4.0), (6.0, 2.0), (14.0, 7.0)])
def test_held_braking_ends_after_the_stopping_distance(straight, speed, braking):
    pose = on_lane(straight, 30.0, 1.0)
    ahead = predict(held_braking, straight, pose, speed, -braking)
    driven = ahead.s[0] - 30.0
    assert math.isclose(driven[-1], speed**2 / (2.0 * braking), abs_tol=1e-9)
    assert np.all(np.diff(driven) >= -1e-12)
    moving = speed / braking >= T
    free = speed * T - 0.5 * braking * T**2
    np.testing.assert_allclose(driven[moving], free[moving], atol=1e-9)


def test_held_braking_does_not_hold_an_acceleration(straight):
    pose = on_lane(straight, 30.0, 1.0)
    held = predict(held_braking, straight, pose, 8.0, 2.0)
    even = predict(constant_speed, straight, pose, 8.0)
    np.testing.assert_allclose(held.s, even.s, atol=0.02)


@pytest.mark.parametrize("against", [False, True])
@given(askew=st.floats(-0.45, 0.45), speed=st.floats(0.5, 15.0))
def test_who_stands_askew_straightens_as_its_front_leads(
    straight, against, askew, speed
):
    """Its heading is that of its motion, and ends along the road after its length."""
    x, y, heading = on_lane(straight, 100.0, 3.0, against=against)
    ahead = predict(constant_speed, straight, (x, y, heading + askew), speed, step=0.02)
    off = np.sin(ahead.heading[0] - heading)
    driven = speed * 0.02 * np.arange(off.size)
    np.testing.assert_allclose(off[driven > 4.7], 0.0, atol=1e-9)
    np.testing.assert_allclose(off[0], math.sin(askew), atol=1e-9)
    moving = np.arctan2(np.diff(ahead.y[0]), np.diff(ahead.x[0]))
    between = 0.5 * (off[1:] + off[:-1])
    assert np.abs(np.sin(moving - heading) - between).max() < 0.02
    sign = -1.0 if against else 1.0
    assert sign * (ahead.l[0, -1] - 3.0) * askew >= 0.0


def test_who_has_changed_its_lane_stands_askew_no_longer(straight):
    x, y, heading = on_lane(straight, 100.0, 0.0)
    ahead = predict(constant_speed, straight, (x, y, heading + 0.1), 10.0, lateral=1.0)
    assert ahead.heading[0, 5] == pytest.approx(0.1)  # it still moves over
    assert ahead.l[0, -1] == pytest.approx(1.0 * LATERAL_HOLD)
    assert ahead.heading[0, -1] == pytest.approx(0.0)


def test_many_are_predicted_as_each_alone(u_turn):
    poses = [
        on_lane(u_turn, 10.0, 1.0),
        on_lane(u_turn, 50.0, -3.0, against=True),
        (5.0, 8.0, 1.5),
        (300.0, 300.0, 0.0),
    ]
    speeds = np.array([8.0, 12.0, 5.0, 1.0])
    together = constant_speed(u_turn, users(poses, speeds), T)
    assert together.x.shape == (4, N)
    for k, pose in enumerate(poses):
        alone = predict(constant_speed, u_turn, pose, speeds[k])
        for name in ("x", "y", "heading", "s", "l"):
            np.testing.assert_allclose(
                getattr(together, name)[k], getattr(alone, name)[0], atol=1e-9
            )


def test_nobody_is_predicted_as_nobody(straight):
    ahead = constant_speed(straight, users([], []), T)
    assert ahead.x.shape == (0, N)


def test_one_time_is_no_prediction(straight):
    with pytest.raises(InvalidInputError, match="two times"):
        constant_speed(straight, users([], []), T[:1])


def moved_over(lateral_speed, l, heading=0.0, speed=8.0, lanes=None):
    """A vehicle that changes its lane on a straight road along x."""
    path = ReferencePath.from_segments([line(300.0)])
    one = users([(20.0, l, heading)], [speed], lateral=lateral_speed)
    return constant_speed(path, one, T, lanes)


LANES = Lanes(
    np.array([0.0, 300.0]),
    np.array([[-3.2, -3.2], [0.0, 0.0], [3.2, 3.2]]),
    np.full((3, 2), 3.2),
)


@pytest.mark.parametrize(
    ("l", "rate", "aim"),
    [(-2.0, 1.0, 0.0), (0.5, 1.0, 3.2), (0.5, -1.0, 0.0), (3.0, -0.5, 0.0)],
)
def test_a_lane_change_ends_in_the_middle_of_a_lane(l, rate, aim):
    ahead = moved_over(rate, l, lanes=LANES)
    until = abs(aim - l) / abs(rate)
    expected = np.where(until > T, l + rate * T, aim)
    np.testing.assert_allclose(ahead.l[0], expected, atol=1e-6)


def test_a_lane_change_at_walking_speed_goes_on_though_the_car_stands_askew():
    ahead = moved_over(1.3, -2.0, heading=0.9, speed=0.2, lanes=LANES)
    assert ahead.l[0][-1] == pytest.approx(0.0, abs=1e-6)
    assert ahead.s[0][-1] - ahead.s[0][0] == pytest.approx(0.2 * T[-1], abs=1e-6)


def test_without_lanes_a_lateral_speed_is_held_for_a_while():
    ahead = moved_over(1.0, 0.5)
    assert ahead.l[0][-1] == pytest.approx(0.5 + LATERAL_HOLD)
