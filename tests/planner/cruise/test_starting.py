"""How an ego that stands askew in a narrow turn gets out of where it stands."""

import math
from dataclasses import replace

import numpy as np
import pytest

from planner.cruise import proposed
from planner.cruise.planner import CruisePlanner
from planner.cruise.steering import wheels_turned
from planner.interface import PlanStatus
from planner.scene import OFF_ROAD_TOLERANCE, RoadBounds
from tests.planner.scenes import (
    drive,
    ego_on,
    make_scene,
    narrow_turn,
    over_the_edge,
)

# to the right, with the axle at s = 31.5 where the path begins to swing
TURN = narrow_turn(-0.15, 31.0, (7.0, 9.0))
S = np.array([0.0, 30.0, 34.0, 38.0, 43.0, 48.0, 100.0])
RIGHT = np.array([-1.7] * 2 + [-1.25] * 3 + [-1.7] * 2)
BOUNDS = RoadBounds(S, np.full(S.size, 2.0), RIGHT)
PLANNER = proposed()
EXCESS = 0.25  # [m]
MOVES = 5.0  # an ego that drives less stays [m]
ON_THE_ROAD = [(-0.1, -0.1), (-0.2, -0.05)]
OVER_THE_EDGE = [(-0.2, -0.15), (-0.3, -0.05), (-0.3, -0.1), (-0.35, -0.1)]


def askew(l, error, speed=0.0):
    ego = ego_on(TURN, 31.5, l, speed, error, curvature=0.0)
    return make_scene(TURN, ego, bounds=BOUNDS, target_speed=5.0)


def planner_with(**changes):
    return CruisePlanner(replace(PLANNER.settings, **changes))


def driven(planner, scene):
    plan = planner.plan(scene, None).trajectory
    return float(plan.s[-1] - plan.s[0])


@pytest.mark.parametrize(("l", "error"), ON_THE_ROAD)
def test_wheels_are_turned_first_where_no_other_motion_stays_on_the_road(l, error):
    scene = askew(l, error)
    assert driven(planner_with(starting_lengths=()), scene) < MOVES
    cycles = drive(PLANNER, scene, 60)
    assert all(cycle.plan.status is PlanStatus.OK for cycle in cycles)
    assert cycles[-1].scene.ego_frenet.s > 42.0
    assert over_the_edge(cycles) <= OFF_ROAD_TOLERANCE
    first = cycles[0].plan.trajectory
    assert abs(first.curvature[0]) <= scene.vehicle.limits.max_curvature


@pytest.mark.parametrize(("l", "error"), OVER_THE_EDGE)
def test_an_ego_that_is_allowed_to_gets_out_over_the_edge(l, error):
    scene = askew(l, error)
    assert driven(PLANNER, scene) < MOVES
    cycles = drive(planner_with(starting_excess=EXCESS), scene, 60)
    assert cycles[-1].scene.ego_frenet.s > 42.0
    assert over_the_edge(cycles) <= EXCESS + OFF_ROAD_TOLERANCE


def test_only_wheels_of_an_ego_that_stands_turn_freely():
    assert wheels_turned(askew(0.0, 0.0, speed=0.5)) == ()
    bends = wheels_turned(askew(0.0, 0.0))
    road = float(TURN.at(31.5).curvature)
    assert any(bend > 0.0 for bend in bends)
    assert any(bend < 0.0 for bend in bends)
    most = askew(0.0, 0.0).vehicle.limits.max_curvature
    assert all(math.isfinite(bend) and abs(road + bend) < most for bend in bends)
