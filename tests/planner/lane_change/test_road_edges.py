"""How far a body reaches over the road's edges, against projections one by one."""

import itertools
from dataclasses import replace

import numpy as np
import pytest

from planner.interface import PlanStatus
from planner.lane_change import proposed
from planner.lane_change.path import (
    ChangeTarget,
    best_change,
    lane_keeping_path,
)
from planner.lane_change.road_edges import (
    reach_beyond_edges,
    stays_on_road,
    worst_reach,
)
from planner.lane_change.settings import PathSettings
from planner.scene import OFF_ROAD_TOLERANCE
from planner.states import Path
from planner.vehicle import Vehicle, body_scale
from tests.planner.lane_change.roads import on_lanes
from tests.planner.lane_change.test_planner import wall
from tests.planner.scenes import winding

LORRY = Vehicle(length=12.0, width=2.5, wheelbase=6.5, rear_overhang=3.0)
SHORT = PathSettings(change_times=(3.0,), min_lengths=(8.0,))


def with_lorry(scene):
    return replace(scene, vehicle=LORRY)


def change(scene, settings):
    found, _ = best_change(
        scene.path, scene.ego_frenet, ChangeTarget(1.75, 0.0, 150.0), LORRY, settings
    )
    assert found is not None
    return found.path


@pytest.mark.parametrize("road", [None, winding()])
def test_it_is_the_worst_of_six_projected_points(road):
    scene = with_lorry(on_lanes(speed=8.0, path=road))
    path = change(scene, PathSettings())
    n = path.distance.size
    worst = np.full(n, -np.inf)
    ends = (-3.0, 3.0, 9.0)
    for along, across in itertools.product(ends, (-1.25, 1.25)):
        cos, sin = np.cos(path.heading), np.sin(path.heading)
        s, l = scene.path.project(
            path.x + along * cos - across * sin,
            path.y + along * sin + across * cos,
            near=path.s + along,
        )
        left, right = scene.road.at(s)
        worst = np.maximum(worst, np.maximum(l - left, right - l))
    np.testing.assert_allclose(reach_beyond_edges(scene, path, n), worst, atol=2e-3)


def test_a_short_change_of_a_lorry_swings_over_the_edge_and_is_refused():
    scene = with_lorry(on_lanes(speed=1.0))
    tight = change(scene, SHORT)
    assert body_scale(LORRY) == pytest.approx(2.4)
    assert worst_reach(scene, tight) > OFF_ROAD_TOLERANCE
    assert not stays_on_road(scene, tight)


def test_who_is_over_the_edge_already_may_come_back():
    scene = on_lanes(speed=8.0, offset=-1.2)
    path = lane_keeping_path(scene.path, scene.ego_frenet, -1.75, 120.0, PathSettings())
    assert path is not None
    assert reach_beyond_edges(scene, path, 1)[0] > 0.1
    assert stays_on_road(scene, path)


@pytest.mark.parametrize("room", [15.0, 40.0, 80.0])
@pytest.mark.parametrize("speed", [0.0, 6.0])
def test_no_plan_called_ok_takes_a_lorry_off_the_road(room, speed):
    front = 100.0 + LORRY.front_reach
    scene = with_lorry(on_lanes(speed=speed, obstacles=wall(front + room + 2.0)))
    result = proposed().plan(scene, None)
    if result.status is not PlanStatus.OK:
        return
    plan = result.trajectory
    moves = np.diff(plan.s, prepend=-1.0) > 1e-9
    columns = (plan.x, plan.y, plan.heading, plan.curvature, plan.s, plan.l)
    rows = [column[moves] for column in columns]
    if rows[0].size < 2:
        return
    path = Path(rows[4] - rows[4][0], *rows)
    assert worst_reach(scene, path) <= OFF_ROAD_TOLERANCE
