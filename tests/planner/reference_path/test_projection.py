import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import minimize_scalar

from planner.reference_path.path import ReferencePath
from planner.reference_path.segments import arc, clothoid, line

ROAD = [line(80.0), clothoid(30.0, 0.0, 0.04), arc(40.0, 0.04), arc(50.0, -0.025)]
U_TURN = ReferencePath.from_segments([line(60.0), arc(20 * math.pi, 1 / 20), line(60)])
EIGHT = ReferencePath.from_segments(
    [arc(2 * math.pi * 30, 1 / 30), arc(2 * math.pi * 30, -1 / 30)]
)
CROSSING = ReferencePath.from_segments(
    [line(40), arc(1.5 * math.pi * 15, 1 / 15), line(40)]
)


def beside(path, s, l):
    """Points at Frenet coordinates (s, l)."""
    road = path.at(s)
    return road.x - l * road.sin_heading, road.y + l * road.cos_heading


def least_distance(path, x, y):
    """Distance from the path itself: dense sampling, then golden section."""
    grid = np.linspace(0.0, path.length, 4000)
    road = path.at(grid)
    gaps = np.hypot(road.x - x, road.y - y)

    def gap(s):
        point = path.at(s)
        return math.hypot(point.x - x, point.y - y)

    found = [gaps.min()]
    for k in np.argsort(gaps)[:6]:
        bounds = (grid[max(k - 1, 0)], grid[min(k + 1, grid.size - 1)])
        fine = {"xatol": 1e-9}
        found.append(
            minimize_scalar(gap, bounds=bounds, method="bounded", options=fine).fun
        )
    return min(found)


def test_projection_inverts_the_offset():
    path = ReferencePath.from_segments(ROAD, start=(5.0, 6.0, 2.0))
    rng = np.random.default_rng(1)
    s, l = rng.uniform(-20.0, 220.0, 5000), rng.uniform(-10.0, 10.0, 5000)
    found_s, found_l = path.project(*beside(path, s, l))
    np.testing.assert_allclose(found_s, s, atol=1e-11)
    np.testing.assert_allclose(found_l, l, atol=1e-11)


def test_foot_is_perpendicular():
    path = ReferencePath.from_segments(ROAD)
    rng = np.random.default_rng(2)
    x, y = rng.uniform(-50.0, 250.0, 2000), rng.uniform(-100.0, 150.0, 2000)
    s, l = path.project(x, y)
    road = path.at(s)
    along = (x - road.x) * road.cos_heading + (y - road.y) * road.sin_heading
    across = (y - road.y) * road.cos_heading - (x - road.x) * road.sin_heading
    np.testing.assert_allclose(along, 0.0, atol=1e-11)
    np.testing.assert_allclose(across, l, atol=1e-11)


@settings(max_examples=60, deadline=None)
@given(x=st.floats(-40.0, 220.0), y=st.floats(-60.0, 120.0))
@pytest.mark.parametrize("road", ["road", "u_turn", "eight"])
def test_nearest_point_matches_brute_force(road, x, y):
    path = {
        "road": ReferencePath.from_segments(ROAD),
        "u_turn": U_TURN,
        "eight": EIGHT,
    }[road]
    s, _ = path.project_one(x, y)
    clamped = path.at(min(max(s, 0.0), path.length))
    found = math.hypot(clamped.x - x, clamped.y - y)
    assert found == pytest.approx(least_distance(path, x, y), abs=1e-6)


def test_batch_equals_loop_of_singles():
    rng = np.random.default_rng(3)
    x, y = rng.uniform(-30.0, 90.0, 400), rng.uniform(-20.0, 60.0, 400)
    near = rng.uniform(0.0, U_TURN.length, 400)
    batch = np.stack(U_TURN.project(x, y), axis=1)
    hinted = np.stack(U_TURN.project(x, y, near, reach=25.0), axis=1)
    for i in range(x.size):
        assert U_TURN.project_one(x[i], y[i]) == tuple(batch[i])
        assert U_TURN.project_one(x[i], y[i], near[i], 25.0) == tuple(hinted[i])


@pytest.mark.parametrize("lateral", [-25.0, -19.0, 15.0, 19.0, 25.0, 30.0])
def test_near_keeps_the_leg_of_a_u_turn(lateral):
    # the legs are 40 m apart: beyond 20 m to the left the other leg is nearer
    x, y = beside(U_TURN, 30.0, lateral)
    assert U_TURN.project_one(x, y, near=35.0) == pytest.approx((30.0, lateral))
    s, _ = U_TURN.project_one(x, y)
    assert (s > 60.0) == (lateral > 20.0)


def test_near_follows_a_self_crossing_route():
    # round the figure eight twice through its middle
    s = np.arange(0.0, EIGHT.length, 1.5)
    l = 3.0 * np.sin(0.05 * s)
    found_s, found_l = EIGHT.project(*beside(EIGHT, s, l), near=s - 2.0, reach=20.0)
    np.testing.assert_allclose(found_s, s, atol=1e-9)
    np.testing.assert_allclose(found_l, l, atol=1e-9)
    guess = s[0]
    for k in range(s.size):
        guess, _ = EIGHT.project_one(*beside(EIGHT, s[k], l[k]), near=guess, reach=20.0)
        assert guess == pytest.approx(s[k], abs=1e-9)


def test_only_feet_within_reach_are_taken():
    middle = 2 * math.pi * 30
    for near in (2.0, middle + 3.0, 2 * middle - 1.0):
        s, _ = EIGHT.project_one(0.1, 0.2, near, reach=10.0)
        assert abs(s - near) <= 10.0
    # no foot within reach: the nearest of all
    assert U_TURN.project_one(30.0, 0.0, near=100.0, reach=5.0)[0] == pytest.approx(30)


def test_heading_decides_at_a_crossing():
    legs = (25.0, CROSSING.length - 25.0)
    there = CROSSING.at(legs)
    np.testing.assert_allclose(there.x, 25.0, atol=1e-9)
    np.testing.assert_allclose(there.y, 0.0, atol=1e-9)
    for s, heading in zip(legs, there.heading, strict=True):
        # the other leg is nearer, but runs across
        x, y = beside(CROSSING, s + 0.1, 0.4)
        found, _ = CROSSING.project([x], [y], heading=float(heading))
        assert found[0] == pytest.approx(s + 0.1, abs=1e-9)
        assert abs(CROSSING.project_one(x, y)[0] - s) > 50.0


def test_points_beyond_the_ends_use_the_extensions():
    path = ReferencePath.from_segments([arc(15.0, 0.1)])
    s, l = np.array([-12.0, -0.5, 15.5, 40.0]), np.array([2.0, -3.0, 1.0, -4.0])
    found_s, found_l = path.project(*beside(path, s, l))
    np.testing.assert_allclose(found_s, s, atol=1e-12)
    np.testing.assert_allclose(found_l, l, atol=1e-12)


def test_an_extension_across_the_road_attracts_nothing():
    # the last heading points back at the first leg
    path = ReferencePath.from_segments(
        [line(100.0), arc(1.5 * math.pi * 10.0, 0.1), line(1.0)]
    )
    crossing_x = float(path.at(path.length).x)
    s, l = path.project_one(crossing_x - 0.2, 0.01)
    assert (s, l) == pytest.approx((crossing_x - 0.2, 0.01))


def test_projection_at_knots_and_jumps_of_curvature():
    path = ReferencePath.from_segments(ROAD)
    s = np.concatenate([path.s, [80.0, 110.0, 150.0]])
    found, l = path.project(*beside(path, s, np.full(s.size, 1.5)))
    np.testing.assert_allclose(found, s, atol=1e-11)
    np.testing.assert_allclose(l, 1.5, atol=1e-11)


@settings(max_examples=50, deadline=None)
@given(
    angle=st.floats(-math.pi, math.pi),
    shift=st.tuples(st.floats(-1e3, 1e3), st.floats(-1e3, 1e3)),
    s=st.floats(-20.0, 220.0),
    l=st.floats(-12.0, 12.0),
)
def test_frenet_coordinates_move_with_the_road(angle, shift, s, l):
    x, y = beside(ReferencePath.from_segments(ROAD), s, l)
    cos, sin = math.cos(angle), math.sin(angle)
    moved = ReferencePath.from_segments(ROAD, start=(*shift, angle))
    found = moved.project_one(
        shift[0] + cos * x - sin * y, shift[1] + sin * x + cos * y
    )
    assert found == pytest.approx((s, l), abs=1e-9)
    mirrored = ReferencePath.from_segments(
        [type(p)(p.kind, p.length, -p.curvature, -p.end_curvature) for p in ROAD]
    )
    assert mirrored.project_one(x, -y) == pytest.approx((s, -l), abs=1e-9)


def test_not_a_number_stays_not_a_number():
    s, l = U_TURN.project([1.0, math.nan], [0.5, 0.0])
    assert np.isnan(s).tolist() == [False, True]
    assert np.isnan(l).tolist() == [False, True]
    assert math.isnan(float(U_TURN.at(math.nan).x))


@pytest.mark.parametrize("width", [3.0, 30.0, 300.0])
@pytest.mark.parametrize(
    "path",
    [ReferencePath.from_segments(ROAD), U_TURN, EIGHT, CROSSING],
    ids=["road", "u_turn", "eight", "crossing"],
)
def test_many_points_at_once_have_the_feet_of_each_to_the_last_digit(path, width):
    rng = np.random.default_rng(5)
    s = rng.uniform(-30.0, path.length + 30.0, 1000)
    x, y = beside(path, s, rng.uniform(-width, width, s.size))
    x[100], y[200], x[300], y[300] = np.nan, np.inf, -np.inf, np.inf
    ends = path.at(np.array([0.0, path.length]))
    x[:2], y[:2] = ends.x, ends.y
    found = np.stack(path.project(x, y))
    each = np.array([path.project_one(*point) for point in zip(x, y, strict=True)])
    np.testing.assert_array_equal(found, each.T)
