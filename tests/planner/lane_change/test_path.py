import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.interpolate import BSpline

from planner.lane_change.b_spline import LANE_CHANGE_KNOTS
from planner.lane_change.change_shapes import BASIS, control_points, prices, sample
from planner.lane_change.path import (
    ChangeTarget,
    KeptLane,
    best_change,
    lane_keeping_path,
)
from planner.lane_change.settings import PathSettings
from planner.reference_path.path import ReferencePath
from planner.states import Path
from planner.vehicle import Vehicle
from tests.planner.lane_change.roads import on_lanes
from tests.planner.scenes import bend, straight, winding

SETTINGS = PathSettings()
CAR = Vehicle()


def check_geometry(path: Path) -> None:
    """Heading and curvature are the derivatives of the points along the distance.

    The tolerance is that of the step in which a line meets an arc.
    """
    x, y, d = path.x, path.y, path.distance
    np.testing.assert_allclose(np.hypot(np.diff(x), np.diff(y)), np.diff(d), atol=7e-3)
    heading = np.unwrap(path.heading)
    middle = np.arctan2(np.diff(y), np.diff(x))
    mean = 0.5 * (heading[1:] + heading[:-1])
    np.testing.assert_allclose(np.sin(middle - mean), 0.0, atol=3e-3)
    turned = np.diff(heading) / np.diff(d)
    np.testing.assert_allclose(
        turned, 0.5 * (path.curvature[1:] + path.curvature[:-1]), atol=6e-3
    )


@pytest.mark.parametrize(
    "road",
    [straight(1500.0), bend(150.0, 80.0, 2.0), winding()],
    ids=["straight", "arc", "clothoids"],
)
@pytest.mark.parametrize(("offset", "error"), [(0.0, 0.0), (0.8, 0.05), (-0.5, -0.04)])
def test_a_change_starts_as_the_ego_drives_and_ends_along_the_lane(road, offset, error):
    scene = on_lanes(path=road, s=30.0, speed=6.0, offset=offset, error=error)
    found, _ = best_change(
        road, scene.ego_frenet, ChangeTarget(1.75, 0.0, 90.0), CAR, SETTINGS
    )
    assert found is not None
    path, ego = found.path, scene.ego
    assert (path.x[0], path.y[0]) == pytest.approx((ego.x, ego.y), abs=1e-9)
    assert math.sin(path.heading[0] - ego.heading) == pytest.approx(0.0, abs=1e-9)
    assert path.curvature[0] == pytest.approx(ego.curvature, abs=1e-9)
    done = path.distance >= found.end + 1.0
    np.testing.assert_allclose(path.l[done], 1.75, atol=1e-9)
    check_geometry(path)


@given(
    st.floats(-2.0, 2.0),
    st.floats(-0.1, 0.1),
    st.floats(-0.01, 0.01),
    st.floats(20.0, 100.0),
    st.sampled_from([0.15, 0.2, 0.3]),
)
def test_the_spline_is_that_of_scipy_and_starts_with_the_given_derivatives(
    l0, slope, curve, length, ratio
):
    points = control_points((l0, slope, curve), 1.75, [length], [ratio])[0]
    s, l, dl, ddl = sample(points, BASIS)
    assert (l[0], dl[0], ddl[0]) == pytest.approx((l0, slope, curve), abs=1e-9)
    assert (l[-1], dl[-1], ddl[-1]) == pytest.approx((1.75, 0.0, 0.0), abs=1e-9)
    c = ratio * length
    b = 0.5 * c
    along = [0.0, b, c, length / 2, length - c, length - b, length]
    third = l0 + c * slope + 3.0 * b * b * curve
    across = [l0, l0 + b * slope, third, (l0 + 1.75) / 2, 1.75, 1.75, 1.75]
    curve_of = BSpline(LANE_CHANGE_KNOTS, np.column_stack([along, across]), 3)
    u = np.linspace(0.0, 1.0, s.size)
    np.testing.assert_allclose(np.column_stack([s, l]), curve_of(u), atol=1e-9)
    inside = slice(2, -2)
    np.testing.assert_allclose(np.gradient(l, s)[inside], dl[inside], atol=5e-3)


def test_the_price_is_the_integral_of_squared_curvature_and_the_length():
    points = control_points((-1.75, 0.0, 0.0), 1.75, [40.0, 70.0], [0.2])
    costs, peaks = prices(points, BASIS, 4000.0, 0.02)
    for k, length in enumerate((40.0, 70.0)):
        curve = BSpline(LANE_CHANGE_KNOTS, points[k], 3)
        u = np.linspace(0.0, 1.0, 20001)
        (x1, y1), (x2, y2) = curve(u, 1).T, curve(u, 2).T
        bent = (x1 * y2 - y1 * x2) / np.hypot(x1, y1) ** 3
        whole = np.trapezoid(bent**2 * np.hypot(x1, y1), u)
        assert costs[k] == pytest.approx(4000.0 * whole + 0.02 * length, rel=1e-3)
        assert peaks[k] == pytest.approx(np.abs(bent).max(), rel=1e-3)


def test_a_later_change_keeps_the_offset_first():
    scene = on_lanes(speed=12.0)
    found, _ = best_change(
        scene.path, scene.ego_frenet, ChangeTarget(1.75, 30.0, 150.0), CAR, SETTINGS
    )
    assert found is not None
    before = found.path.distance <= found.begin
    assert found.begin == pytest.approx(30.0, abs=0.01)
    np.testing.assert_allclose(found.path.l[before], -1.75, atol=1e-9)


def test_limits_refuse_and_say_why():
    scene = on_lanes(speed=16.0)
    lazy = PathSettings(change_times=(1.0,), min_lengths=(5.0,))
    found, refused = best_change(
        scene.path, scene.ego_frenet, ChangeTarget(1.75, 0.0, 200.0), CAR, lazy
    )
    assert found is None
    assert refused == {"lateral acceleration": 3}
    slow = on_lanes(speed=1.0)
    found, refused = best_change(
        slow.path, slow.ego_frenet, ChangeTarget(1.75, 0.0, 60.0), CAR, lazy
    )
    assert found is None
    assert refused == {"curvature": 3}


def test_a_found_change_keeps_the_limits_it_was_given():
    for speed in (0.0, 3.0, 8.0, 16.0):
        scene = on_lanes(speed=speed)
        found, _ = best_change(
            scene.path, scene.ego_frenet, ChangeTarget(1.75, 0.0, 200.0), CAR, SETTINGS
        )
        assert found is not None
        peak = np.abs(found.path.curvature).max()
        assert peak <= 0.9 * CAR.limits.max_curvature
        assert speed**2 * peak <= 1.05 * SETTINGS.lateral_acceleration


def test_lane_keeping_settles_on_the_centre():
    scene = on_lanes(offset=0.7, error=0.03, speed=10.0)
    path = lane_keeping_path(scene.path, scene.ego_frenet, -1.75, 120.0, SETTINGS)
    assert path is not None
    assert path.l[-1] == pytest.approx(-1.75)
    assert path.curvature[0] == pytest.approx(scene.ego.curvature, abs=1e-9)
    check_geometry(path)


def test_outside_the_frame_there_is_no_path():
    tight = ReferencePath.from_segments(bend_segments())
    scene = on_lanes(path=straight(1500.0), speed=5.0)
    assert lane_keeping_path(tight, scene.ego_frenet, 30.0, 100.0, SETTINGS) is None


def bend_segments():
    from planner.reference_path.segments import arc, line

    return [line(100.0), arc(60.0, 0.05), line(200.0)]


@pytest.mark.parametrize("speed", [3.0, 10.0])
@pytest.mark.parametrize("error", [-0.3, 0.3])
def test_no_path_swings_out_from_a_steep_start(speed, error):
    scene = on_lanes(offset=1.0, error=error, speed=speed)
    state, low, high = scene.ego_frenet, -1.75, -0.75
    path = lane_keeping_path(scene.path, state, -1.75, 150.0, SETTINGS)
    assert path is not None
    assert low - 1.0 < path.l.min() <= path.l.max() < high + 1.5
    for begin in (0.0, 40.0):
        found, _ = best_change(
            scene.path, state, ChangeTarget(1.75, begin, 150.0), CAR, SETTINGS
        )
        if found is not None:
            assert found.path.l.min() > -0.75 - 0.31
            assert found.path.l.max() < 1.75 + 0.31


def test_keeping_a_lane_that_shifts_follows_its_centre_line():
    s = np.arange(0.0, 400.0, 1.0)
    share = np.clip((s - 100.0) / 50.0, 0.0, 1.0)
    centre = -3.2 * share**3 * (10.0 - 15.0 * share + 6.0 * share**2)
    scene = on_lanes(s=90.0, offset=1.75, speed=12.0, path=straight(1500.0))
    lane = KeptLane(s, centre)
    path = lane_keeping_path(scene.path, scene.ego_frenet, lane, 150.0, SETTINGS)
    assert path is not None
    check_geometry(path)
    off = path.l - np.interp(path.s, s, centre)
    assert np.abs(off).max() < 0.1
    assert path.l[-1] == pytest.approx(-3.2, abs=1e-6)


def test_keeping_a_lane_parallel_to_the_road_is_settling_on_its_offset():
    scene = on_lanes(s=90.0, offset=0.4, speed=12.0, path=straight(1500.0))
    road, state = scene.path, scene.ego_frenet
    lane = KeptLane(np.array([0.0, 1500.0]), np.array([-0.5, -0.5]))
    kept = lane_keeping_path(road, state, lane, 150.0, SETTINGS)
    settled = lane_keeping_path(road, state, -0.5, 150.0, SETTINGS)
    assert kept is not None
    assert settled is not None
    np.testing.assert_array_equal(kept.l, settled.l)
