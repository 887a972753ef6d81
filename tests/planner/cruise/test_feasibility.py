import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import quad

from planner.cruise.feasibility import (
    RoadBend,
    RoadBody,
    lateral_at,
    lateral_motion,
    lateral_over_distance,
    lateral_over_time,
    lateral_quintic,
    road_excess,
    squared_jerk,
)
from planner.reference_path.linear_curvature import CURVATURE, RATE, S
from planner.reference_path.path import ReferencePath
from planner.reference_path.road_turn import circle_to, turn_between, turn_of_pieces
from planner.reference_path.segments import arc, clothoid, line

offset = st.floats(-5.0, 5.0)
rate = st.floats(-2.0, 2.0)
bend = st.floats(-1.0, 1.0)
length = st.floats(1.0, 8.0)
HALF_WIDTH, FRONT, REAR = 0.95, 3.8, 1.0


@given(offset, rate, bend, offset, length)
def test_the_quintic_meets_its_boundary_values(l0, l1, l2, end, T):
    c = lateral_quintic((l0, l1, l2), end, T)
    value = np.polynomial.Polynomial(c)
    start = (value(0.0), value.deriv(1)(0.0), value.deriv(2)(0.0))
    np.testing.assert_allclose(start, (l0, l1, l2), atol=1e-12)
    stop = (value(T), value.deriv(1)(T), value.deriv(2)(T))
    np.testing.assert_allclose(stop, (end, 0.0, 0.0), atol=1e-9)


def speeding(t, speed, acceleration, jerk):
    """s and its derivatives of a motion with constant jerk."""
    s = speed * t + acceleration * t**2 / 2.0 + jerk * t**3 / 6.0
    return (
        s,
        speed + acceleration * t + jerk * t**2 / 2.0,
        acceleration + jerk * t,
        jerk,
    )


motion = (st.floats(2.0, 15.0), st.floats(-1.0, 1.0), st.floats(-0.5, 0.5))


def differences(function, t, h):
    """First, second and third derivative by central differences of fourth order."""
    f = [function(t + k * h) for k in range(-3, 4)]
    first = (f[1] - 8.0 * f[2] + 8.0 * f[4] - f[5]) / (12.0 * h)
    second = (-f[1] + 16.0 * f[2] - 30.0 * f[3] + 16.0 * f[4] - f[5]) / (12.0 * h**2)
    third = (f[0] - 8.0 * f[1] + 13.0 * f[2] - 13.0 * f[4] + 8.0 * f[5] - f[6]) / (
        8.0 * h**3
    )
    return first, second, third


start = st.tuples(offset, rate, bend)
gentle = st.tuples(offset, st.floats(-0.3, 0.3), st.floats(-0.05, 0.05))


@given(start, offset, st.floats(3.0, 8.0), *motion)
def test_motion_over_time_against_finite_differences(start, end, T, v, a, j):
    c = lateral_quintic(start, end, T)
    value = np.polynomial.Polynomial(c)
    t = 0.4 * T
    _, s_dot, s_ddot, _ = speeding(t, v + 10.0, a, j)
    l, slope, second, jerk = lateral_over_time(c, t, s_dot, s_ddot)
    l_dot, l_ddot, l_dddot = differences(value, t, 0.05)
    assert math.isclose(l, value(t), abs_tol=1e-9)
    assert math.isclose(slope * s_dot, l_dot, abs_tol=1e-4)
    # l_ddot = l'' s_dot² + l' s_ddot
    assert math.isclose(second * s_dot**2 + slope * s_ddot, l_ddot, abs_tol=1e-3)
    assert math.isclose(jerk, l_dddot, abs_tol=2e-3)


@given(gentle, offset, *motion)
def test_motion_over_distance_against_finite_differences(start, end, v, a, j):
    length = 40.0
    c = lateral_quintic(start, end, length)
    value = np.polynomial.Polynomial(c)
    t = 1.0
    s, s_dot, s_ddot, s_dddot = speeding(t, v, a, j)
    l, slope, second, jerk = lateral_over_distance(c, s, s_dot, s_ddot, s_dddot)
    l_prime, l_second, _ = differences(value, s, 0.05)
    assert math.isclose(l, value(s), abs_tol=1e-12)
    assert math.isclose(slope, l_prime, abs_tol=1e-6)
    assert math.isclose(second, l_second, abs_tol=1e-6)
    of_time = differences(lambda at: value(speeding(at, v, a, j)[0]), t, 0.01)[2]
    assert math.isclose(jerk, of_time, rel_tol=1e-3, abs_tol=1e-3)


@pytest.mark.parametrize("over_time", [True, False])
def test_after_its_length_the_motion_goes_straight_on(over_time):
    way = lateral_motion((1.0, 0.2, 0.0), -2.0, 4.0, 0.0)
    at_end = lateral_at(over_time, way, 4.0, 10.0, 0.0, 0.0)
    np.testing.assert_allclose(at_end[:3], (-2.0, 0.0, 0.0), atol=1e-12)
    after = lateral_at(over_time, way, 4.1, 10.0, 1.0, 1.0)
    assert after == (-2.0, 0.0, 0.0, 0.0)


def along(way, done, *rates):
    over_time = False
    return lateral_at(over_time, way, done, *(rates or (0.0, 0.0, 0.0)))


def led_offset(way, done, lead):
    l, slope, _, _ = along(way, done)
    return l + lead * slope


@given(gentle, offset, st.floats(5.0, 30.0), st.floats(2.0, 9.0))
def test_an_axle_follows_the_point_that_is_led(start, end, length, lead):
    way = lateral_motion(start, end, length, lead)
    np.testing.assert_allclose(along(way, 0.0)[:3], start, atol=1e-9)
    # the led point is on a quartic that ends flat at the offset, and stays there
    for done in (length, length + 0.5, 2.0 * length):
        assert led_offset(way, done, lead) == pytest.approx(end, abs=1e-8)
    places = np.linspace(0.0, 1.0, 6)
    part = [led_offset(way, share * length, lead) for share in places]
    quartic = np.polynomial.Polynomial.fit(places[:5], part[:5], 4)
    assert quartic(1.0) == pytest.approx(part[5], abs=1e-7)
    before, after = (along(way, length + d, 8.0, 0.5, 0.1) for d in (-1e-9, 1e-9))
    np.testing.assert_allclose(before, after, atol=1e-4)
    far = along(way, length + 40.0 * lead)
    np.testing.assert_allclose(far, (end, 0.0, 0.0, 0.0), atol=1e-9)


@given(gentle, offset, st.floats(0.05, 0.9))
def test_a_led_motion_that_is_planned_anew_on_its_way_is_the_same(start, end, share):
    length, lead = 20.0, 6.5
    way = lateral_motion(start, end, length, lead)
    here = along(way, share * length)[:3]
    anew = lateral_motion(here, end, (1.0 - share) * length, lead)
    for done in (0.95 * length, 1.5 * length):
        new = along(anew, done - share * length)
        np.testing.assert_allclose(new[:3], along(way, done)[:3], atol=1e-8)


def test_the_derivatives_of_a_led_motion_against_finite_differences():
    way = lateral_motion((0.3, 0.1, 0.01), -2.5, 18.0, 6.5)
    v, a, j, t = 6.0, 0.7, -0.3, 1.2
    s, s_dot, s_ddot, s_dddot = speeding(t, v, a, j)
    _, slope, second, jerk = along(way, s, s_dot, s_ddot, s_dddot)
    l_dot, l_ddot, l_dddot = differences(
        lambda at: along(way, speeding(at, v, a, j)[0])[0], t, 0.01
    )
    assert slope * s_dot == pytest.approx(l_dot, abs=1e-6)
    assert second * s_dot**2 + slope * s_ddot == pytest.approx(l_ddot, abs=1e-5)
    assert jerk == pytest.approx(l_dddot, abs=1e-3)


@given(offset, rate, bend, offset, length)
def test_squared_jerk_against_quadrature(l0, l1, l2, end, T):
    c = lateral_quintic((l0, l1, l2), end, T)
    third = np.polynomial.Polynomial(c).deriv(3)
    expected, _ = quad(lambda t: third(t) ** 2, 0.0, T)
    assert math.isclose(squared_jerk(c, T), expected, rel_tol=1e-7, abs_tol=1e-9)


def body_excess(path, s, l, error, left, right, body=(FRONT, REAR, HALF_WIDTH)):
    """The same by projecting the body's outline on the path."""
    front, rear, half_width = body
    x, y, heading = path.pose(s)
    x, y = x - l * math.sin(heading), y + l * math.cos(heading)
    along = np.linspace(-rear, front, 97)
    heading += error
    worst = -math.inf
    for across in (-half_width, half_width):
        _, offsets = path.project(
            x + along * math.cos(heading) - across * math.sin(heading),
            y + along * math.sin(heading) + across * math.cos(heading),
        )
        worst = max(
            worst, float(np.max(offsets - left)), float(np.max(right - offsets))
        )
    return worst


def excess(l, error, curvature, left, right):
    return road_excess(
        l,
        math.cos(error),
        math.sin(error),
        RoadBend(curvature, curvature, curvature),
        left,
        right,
        RoadBody(FRONT, REAR, HALF_WIDTH),
    )


curvatures = pytest.mark.parametrize(
    "curvature", [0.0, 1.0 / 15.0, -1.0 / 15.0, 0.01, -0.15]
)


def road_of(curvature):
    return ReferencePath.from_segments([arc(36.0, curvature or 0.0)])


@curvatures
@given(l=st.floats(-5.0, 5.0), error=st.floats(-0.6, 0.6))
def test_road_excess_near_an_edge_is_that_of_the_projected_body(curvature, l, error):
    expected = body_excess(road_of(curvature), 18.0, l, error, 5.0, -4.0)
    found = excess(l, error, curvature, 5.0, -4.0)
    if expected > -0.4:
        assert math.isclose(found, expected, abs_tol=1e-3)
    else:  # a bound will do
        assert expected - 1e-3 <= found < 0.0


@curvatures
def test_road_excess_of_a_body_along_the_middle(curvature):
    expected = body_excess(road_of(curvature), 18.0, 0.0, 0.0, 1.2, -1.2)
    found = excess(0.0, 0.0, curvature, 1.2, -1.2)
    assert math.isclose(found, expected, abs_tol=1e-3)


LORRY = (9.0, 3.0, 1.25)


def excess_along(path, s, l, error, left, right):
    """As `excess`, with the road's own turn under a lorry."""
    knots = path.table.knots
    turn = turn_of_pieces(knots[:, S], knots[:, CURVATURE], knots[:, RATE])
    front, rear, _ = LORRY
    axle = turn_between(s, turn)[2]
    bend = RoadBend(circle_to(s, front, turn)[0], axle, circle_to(s, -rear, turn)[0])
    cos, sin = math.cos(error), math.sin(error)
    return road_excess(l, cos, sin, bend, left, right, RoadBody(*LORRY))


@pytest.mark.parametrize("radius", [25.0, -60.0])
@pytest.mark.parametrize("entry", [0.0, 12.0])
@given(s=st.floats(30.0, 100.0), l=st.floats(-3.0, 3.0), error=st.floats(-0.25, 0.25))
def test_a_long_body_is_in_a_bend_before_its_axle(radius, entry, s, l, error):
    """By its front, and its tail after it: 0.5 m more than the axle says."""
    bent = 1.0 / radius
    pieces = [clothoid(entry, 0.0, bent)] if entry else []
    out = [clothoid(entry, bent, 0.0)] if entry else []
    ends = line(50.0), line(60.0)
    segments = ends[0], *pieces, arc(25.0, bent), *out, ends[1]
    path = ReferencePath.from_segments(segments)
    expected = body_excess(path, s, l, error, 3.5, -3.5, LORRY)
    found = excess_along(path, s, l, error, 3.5, -3.5)
    # where the curvature jumps, the circles are not those of one clothoid
    assert math.isclose(found, expected, abs_tol=0.06 if entry else 0.2)
