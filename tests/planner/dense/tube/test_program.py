"""The path program about the plane instead of the road."""

from dataclasses import replace

import numpy as np
import pytest

from planner.dense.field import Cover, FrenetObstacles, path_curvature, straight_field
from planner.dense.lattice.coarse_path import PathStart
from planner.dense.settings import SideSettings
from planner.dense.sides.sequences import plan_sides
from planner.reference_path.road_turn import road_turn
from planner.vehicle import Vehicle

ABOUT_ROAD = SideSettings(
    offset_weight=1.0, bend_weight=3e4, jerk_weight=1e6, max_curvature=0.18, margin=0.2
)
IN_PLANE = replace(ABOUT_ROAD, in_plane=True)
STILL = PathStart(0.0, 0.0, 0.0, 0.0)
BODY = Cover.of(Vehicle())


def bend_field(obstacles=((38.0, -2.0, 1.0),)):
    """Make a road that bends with 40 m radius from 20 m to 50 m on."""
    s = np.arange(-10.0, 90.0)
    curvature = np.where((s >= 20.0) & (s < 50.0), 1.0 / 40.0, 0.0)
    rows = np.array(obstacles).reshape(-1, 3)
    edge = np.full(s.size, 5.0)
    return FrenetObstacles(*rows.T, s, edge, -edge, curvature)


def plane_curvature(path, field):
    road = np.interp(path.s, field.road_s, field.curvature)
    columns = zip(
        path.l, path.slope, path.second, road, np.gradient(road, path.s), strict=True
    )
    return np.array([path_curvature(*column) for column in columns])


def test_the_turn_is_the_double_integral_of_the_curvature():
    s = np.linspace(0.0, 30.0, 61)
    turn = road_turn(s, 0.02 - 0.001 * s).turn
    want = 0.01 * s**2 - 0.001 * s**3 / 6.0
    assert turn[:, 0] == pytest.approx(want, abs=1e-9)
    assert turn[:, 1] == pytest.approx(0.02 * s - 0.0005 * s**2, abs=1e-12)


def test_a_path_in_the_plane_cuts_the_bend_and_turns_in_evenly():
    field = bend_field()
    bends, rates = [], []
    for settings in (ABOUT_ROAD, IN_PLANE):
        best = plan_sides(field, BODY, STILL, 70.0, settings).best
        curvature = plane_curvature(best.path, field)
        assert best.check.clearance >= 0.2 - 1e-3
        assert best.check.road_room >= -1e-3
        bends.append(np.abs(curvature).max())
        # over the time of half a second at 8 m/s
        rates.append(np.abs(curvature[8:] - curvature[:-8]).max())
    assert bends[1] < 0.9 * bends[0]
    assert rates[1] < 0.6 * rates[0]


def test_on_a_straight_road_both_are_the_same():
    field = straight_field([(25.0, 1.0, 1.5), (45.0, -1.0, 1.0)], 5.0, 60.0)
    road, plane = (
        plan_sides(field, BODY, STILL, 60.0, settings).best
        for settings in (ABOUT_ROAD, IN_PLANE)
    )
    assert plane.path.l.tobytes() == road.path.l.tobytes()
    assert plane.cost == road.cost
