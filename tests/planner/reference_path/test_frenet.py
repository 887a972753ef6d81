import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planner.errors import OutsidePathDomainError
from planner.reference_path.frenet import (
    cartesian_to_frenet,
    cartesian_to_frenet_one,
    frenet_to_cartesian,
    frenet_to_cartesian_one,
    state_on_path,
)
from planner.reference_path.path import ReferencePath
from planner.reference_path.segments import arc, clothoid, line
from planner.states import CartesianState, CartesianStates, FrenetState, FrenetStates

ROADS = {
    "line": [line(200.0)],
    "arc": [arc(70.0, 1 / 25)],
    "clothoid": [clothoid(90.0, -0.03, 0.05)],
}
FRENET = ("s", "s_dot", "s_ddot", "l", "l_dot", "l_ddot", "l_prime", "l_second")
CARTESIAN = ("x", "y", "heading", "curvature", "speed", "acceleration")


def road(name, start=(3.0, -7.0, 0.6)):
    return ReferencePath.from_segments(ROADS[name], start)


def random_frenet(path, n, seed=0):
    rng = np.random.default_rng(seed)
    s_dot, l_prime = rng.uniform(0.0, 20.0, n), rng.uniform(-0.7, 0.7, n)
    unused = np.zeros(n)
    return FrenetStates(
        rng.uniform(2.0, path.length - 2.0, n),
        s_dot,
        rng.uniform(-5.0, 5.0, n),
        rng.uniform(-8.0, 8.0, n),
        unused,
        unused,
        l_prime,
        rng.uniform(-0.2, 0.2, n),
    )


class Motion:
    """A motion in the plane that knows nothing of the road: two cubics of time."""

    def __init__(self, path, s, l, angle, seed):
        rng = np.random.default_rng(seed)
        point = path.at(s)
        heading = float(point.heading) + angle
        speed, along, across = rng.uniform(4, 15), *rng.uniform(-3, 3, 2)
        cos, sin = math.cos(heading), math.sin(heading)
        x = float(point.x - l * point.sin_heading)
        y = float(point.y + l * point.cos_heading)
        jerk = rng.uniform(-2, 2, 2)
        self.x = np.polynomial.Polynomial(
            [x, speed * cos, (along * cos - across * sin) / 2, jerk[0] / 6]
        )
        self.y = np.polynomial.Polynomial(
            [y, speed * sin, (along * sin + across * cos) / 2, jerk[1] / 6]
        )

    def state(self, t):
        vx, vy = self.x.deriv()(t), self.y.deriv()(t)
        ax, ay = self.x.deriv(2)(t), self.y.deriv(2)(t)
        speed = math.hypot(vx, vy)
        return CartesianState(
            self.x(t),
            self.y(t),
            math.atan2(vy, vx),
            (vx * ay - vy * ax) / speed**3,
            speed,
            (vx * ax + vy * ay) / speed,
        )


@pytest.mark.parametrize("name", ROADS)
def test_transforms_invert_each_other(name):
    path = road(name)
    states = random_frenet(path, 3000)
    plane = frenet_to_cartesian(path, states)
    back = cartesian_to_frenet(path, plane)
    for column in ("s", "s_dot", "s_ddot", "l", "l_prime", "l_second"):
        np.testing.assert_allclose(
            getattr(back, column), getattr(states, column), atol=1e-10, err_msg=column
        )
    again = frenet_to_cartesian(path, back)
    for column in CARTESIAN:
        np.testing.assert_allclose(
            getattr(again, column), getattr(plane, column), atol=1e-10, err_msg=column
        )


@pytest.mark.parametrize("name", ROADS)
@pytest.mark.parametrize("seed", range(12))
def test_rates_match_finite_differences_of_a_motion(name, seed):
    path = road(name)
    rng = np.random.default_rng(100 + seed)
    motion = Motion(path, 30.0, rng.uniform(-7, 7), rng.uniform(-0.6, 0.6), seed)
    step = 1e-3
    times = step * np.arange(-2, 3)
    s, l = path.project([motion.x(t) for t in times], [motion.y(t) for t in times])
    first = np.array([1, -8, 0, 8, -1]) / (12 * step)  # five-point rules
    second = np.array([-1, 16, -30, 16, -1]) / (12 * step**2)
    state = cartesian_to_frenet_one(path, motion.state(0.0))
    assert state.s_dot == pytest.approx(first @ s, abs=1e-7)
    assert state.l_dot == pytest.approx(first @ l, abs=1e-7)
    assert state.s_ddot == pytest.approx(second @ s, abs=1e-6)
    assert state.l_ddot == pytest.approx(second @ l, abs=1e-6)
    # dl/ds and its derivative along the same motion, by the quotient rule
    s_dot, l_dot = first @ s, first @ l
    s_ddot, l_ddot = second @ s, second @ l
    assert state.l_prime == pytest.approx(l_dot / s_dot, abs=1e-7)
    bend = (l_ddot * s_dot - l_dot * s_ddot) / s_dot**3
    assert state.l_second == pytest.approx(bend, abs=1e-6)


@pytest.mark.parametrize("name", ROADS)
@pytest.mark.parametrize("seed", range(8))
def test_frenet_motion_has_the_curvature_and_speed_of_its_track(name, seed):
    path = road(name)
    rng = np.random.default_rng(seed)
    s_t = np.polynomial.Polynomial([30.0, *rng.uniform([4, -2], [15, 2])])
    l_s = np.polynomial.Polynomial(rng.uniform(-1, 1, 4) * [6, 0.4, 0.05, 0.005])
    step = 1e-3
    times = step * np.arange(-2, 3)
    s = s_t(times)
    road_points = path.at(s)
    l = l_s(s - 30.0)
    x = road_points.x - l * road_points.sin_heading
    y = road_points.y + l * road_points.cos_heading
    first = np.array([1, -8, 0, 8, -1]) / (12 * step)
    second = np.array([-1, 16, -30, 16, -1]) / (12 * step**2)
    vx, vy, ax, ay = first @ x, first @ y, second @ x, second @ y
    speed = math.hypot(vx, vy)
    state = FrenetState(
        30.0,
        s_t.deriv()(0.0),
        s_t.deriv(2)(0.0),
        l_s(0.0),
        0.0,
        0.0,
        l_s.deriv()(0.0),
        l_s.deriv(2)(0.0),
    )
    plane = frenet_to_cartesian_one(path, state)
    assert plane.x == pytest.approx(x[2], abs=1e-12)
    assert plane.y == pytest.approx(y[2], abs=1e-12)
    assert plane.speed == pytest.approx(speed, abs=1e-7)
    assert math.remainder(plane.heading - math.atan2(vy, vx), math.tau) == (
        pytest.approx(0.0, abs=1e-8)
    )
    assert plane.acceleration == pytest.approx((vx * ax + vy * ay) / speed, abs=1e-6)
    assert plane.curvature == pytest.approx((vx * ay - vy * ax) / speed**3, abs=1e-7)


def test_the_thesis_lacks_the_rotation_of_the_heading():
    # driving a circle along a straight road: l_ddot is v² k at the crossing point
    path = ReferencePath.from_segments([line(100.0)])
    state = cartesian_to_frenet_one(path, CartesianState(50, 0, 0.3, 0.1, 10.0, 0.0))
    assert state.l_ddot == pytest.approx(100.0 * 0.1 * math.cos(0.3))


@pytest.mark.parametrize("name", ROADS)
def test_batch_equals_loop_of_singles(name):
    path = road(name)
    states = random_frenet(path, 60, seed=5)
    plane = frenet_to_cartesian(path, states)
    frenet = cartesian_to_frenet(path, plane, near=states.s)
    for i in range(60):
        one = FrenetState(*(float(getattr(states, c)[i]) for c in FRENET))
        single = frenet_to_cartesian_one(path, one)
        assert [getattr(single, c) for c in CARTESIAN] == [
            getattr(plane, c)[i] for c in CARTESIAN
        ]
        back = cartesian_to_frenet_one(path, single, float(states.s[i]))
        assert [getattr(back, c) for c in FRENET] == [
            getattr(frenet, c)[i] for c in FRENET
        ]


def test_any_shape_is_kept():
    path = road("arc")
    flat = random_frenet(path, 24)
    cube = FrenetStates(*(getattr(flat, c).reshape(2, 3, 4) for c in FRENET))
    plane = frenet_to_cartesian(path, cube)
    assert plane.x.shape == (2, 3, 4)
    assert cartesian_to_frenet(path, plane, near=30.0, reach=80.0).s.shape == (2, 3, 4)
    np.testing.assert_array_equal(
        plane.curvature.ravel(), frenet_to_cartesian(path, flat).curvature
    )


@settings(max_examples=60, deadline=None)
@given(
    angle=st.floats(-math.pi, math.pi),
    x=st.floats(-500, 500),
    y=st.floats(-500, 500),
    l=st.floats(-6, 6),
    error=st.floats(-1.2, 1.2),
)
def test_frenet_state_moves_with_the_road(angle, x, y, l, error):
    here, there = road("clothoid", (0, 0, 0)), road("clothoid", (x, y, angle))
    point = here.at(40.0)
    state = CartesianState(
        float(point.x - l * point.sin_heading),
        float(point.y + l * point.cos_heading),
        float(point.heading) + error,
        0.03,
        9.0,
        -1.0,
    )
    cos, sin = math.cos(angle), math.sin(angle)
    moved = CartesianState(
        x + cos * state.x - sin * state.y,
        y + sin * state.x + cos * state.y,
        state.heading + angle,
        0.03,
        9.0,
        -1.0,
    )
    first = cartesian_to_frenet_one(here, state)
    second = cartesian_to_frenet_one(there, moved)
    for column in FRENET:
        assert getattr(second, column) == pytest.approx(
            getattr(first, column), abs=1e-7, rel=1e-8
        )


def test_mirrored_motion_has_mirrored_coordinates():
    left = ReferencePath.from_segments([clothoid(80.0, 0.0, 0.05)])
    right = ReferencePath.from_segments([clothoid(80.0, 0.0, -0.05)])
    first = cartesian_to_frenet_one(left, CartesianState(30, 5, 0.4, 0.02, 8.0, 1.0))
    second = cartesian_to_frenet_one(
        right, CartesianState(30, -5, -0.4, -0.02, 8.0, 1.0)
    )
    signs = (1, 1, 1, -1, -1, -1, -1, -1)
    for column, sign in zip(FRENET, signs, strict=True):
        assert getattr(second, column) == pytest.approx(sign * getattr(first, column))


def test_standing_vehicle_keeps_its_heading_and_curvature():
    path = road("arc")
    state = CartesianState(10.0, 0.0, 0.9, 0.1, 0.0, 0.0)
    back = frenet_to_cartesian_one(path, cartesian_to_frenet_one(path, state))
    assert back.heading == pytest.approx(0.9)
    assert back.curvature == pytest.approx(0.1)
    assert back.speed == 0.0


def test_heading_is_wrapped():
    path = ReferencePath.from_segments([arc(90.0, 0.1)])
    s = np.linspace(0.0, 90.0, 91)
    zero = np.zeros(91)
    plane = frenet_to_cartesian(
        path, FrenetStates(s, s + 1, zero, zero, zero, zero, zero, zero)
    )
    assert np.all(np.abs(plane.heading) <= math.pi)
    np.testing.assert_allclose(np.unwrap(plane.heading), 0.1 * s, atol=1e-12)


def test_outside_the_domain_names_the_place():
    path = ReferencePath.from_segments([arc(30.0, 0.1)])
    beyond = FrenetState(12.0, 1.0, 0.0, 10.5, 0.0, 0.0, 0.0, 0.0)
    message = r"s = 12\.000 m, l = 10\.500 m"
    with pytest.raises(OutsidePathDomainError, match=message):
        frenet_to_cartesian_one(path, beyond)
    states = FrenetStates(*(np.array([5.0, getattr(beyond, c)]) for c in FRENET))
    with pytest.raises(OutsidePathDomainError, match=message):
        frenet_to_cartesian(path, states)


@pytest.mark.parametrize("error", [math.pi / 2, -math.pi / 2, 3.0])
def test_heading_across_the_path_is_outside_the_domain(error):
    path = ReferencePath.from_segments([line(50.0)])
    state = CartesianState(20.0, 1.0, error, 0.0, 5.0, 0.0)
    with pytest.raises(OutsidePathDomainError, match=r"s = 20.*heading error"):
        cartesian_to_frenet_one(path, state)
    batch = CartesianStates(*(np.array([getattr(state, c)]) for c in CARTESIAN))
    with pytest.raises(OutsidePathDomainError, match=r"s = 20.*heading error"):
        cartesian_to_frenet(path, batch)


PARALLEL = ReferencePath.from_segments([line(100.0), arc(60.0, 0.05)])


@pytest.mark.parametrize(("s", "l"), [(30.0, 2.0), (130.0, -3.0), (130.0, 3.0)])
def test_state_on_path_has_the_frenet_state_of_a_parallel(s, l):
    ego = state_on_path(PARALLEL, s, l, 7.0)
    frenet = cartesian_to_frenet_one(PARALLEL, ego)
    assert (frenet.s, frenet.l) == pytest.approx((s, l), abs=1e-9)
    assert frenet.l_prime == pytest.approx(0.0, abs=1e-9)
    assert frenet.l_second == pytest.approx(0.0, abs=1e-9)
    assert -math.pi < ego.heading <= math.pi
