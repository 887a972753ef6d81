import math

import numpy as np
import pytest

from experiments.thesis.cruise.drives import (
    CAR,
    CONVENTIONAL,
    PROPOSED,
    Drive,
    car_clearance,
    drive,
    farthest_return,
)
from experiments.thesis.cruise.moving_obstacles import moving
from experiments.thesis.dense.study import RandomLayout, passed_left, study
from experiments.thesis.lane_change import solver_times as speed_times
from experiments.thesis.lane_change.claims import candidate_paths
from experiments.thesis.lane_change.random_scenes import (
    ALL_ORDERS,
    RULES,
    Asked,
    study_scene,
)
from experiments.thesis.lane_change.solver_times import time_case
from planner.dense.frenet_path import FrenetPath
from planner.scene import Obstacles
from planner.shapes.rectangles import Rectangle, distance
from planner.states import CartesianState


@pytest.mark.parametrize(("x", "y"), [(9.0, 3.0), (2.0, -4.0), (-6.0, 0.5), (1.0, 3.0)])
def test_the_clearance_of_a_car_is_that_of_its_rectangle(x, y):
    none = np.zeros(1)
    disc = Obstacles(("a",), np.array([x]), np.array([y]), none, none, none, none + 0.7)
    ego = CartesianState(0.3, -0.2, 0.4, 0.0, 5.0, 0.0)
    centre = CAR.centre_offset * np.array([math.cos(0.4), math.sin(0.4)])
    body = Rectangle(
        ego.x + centre[0], ego.y + centre[1], ego.heading, CAR.length, CAR.width
    )
    point = Rectangle(x, y, 0.0, 1e-9, 1e-9)
    expected = distance(body, point) - 0.7
    assert car_clearance(ego, disc) == pytest.approx(expected, abs=1e-6)


def test_the_return_is_the_worst_of_the_nearest():
    s = np.arange(0.0, 101.0)
    l = np.where(s < 50.0, 2.0 - 0.03 * s, 1.5)
    assert farthest_return(s, l, [20.0, 55.0], 100.0) == pytest.approx(1.5)
    assert farthest_return(s, l, [20.0], 50.0) == pytest.approx(2.0 - 0.03 * 49.0)
    assert farthest_return(s, l, [90.0], 100.0) == 0.0  # no room to come back
    assert farthest_return(s, l, [], 100.0) == 0.0


def test_the_straight_road_gives_both_published_signs():
    ours, theirs = (drive(Drive("straight", name)) for name in (PROPOSED, CONVENTIONAL))
    assert ours.arrived
    assert theirs.arrived
    assert ours.mean_offset < theirs.mean_offset
    assert ours.mean_jerk < theirs.mean_jerk
    assert len(ours.obstacles) == 3


def test_moving_vehicles_come_from_their_seed():
    assert moving(3) == moving(3)
    assert moving(3) != moving(4)


def test_a_layout_is_studied_with_every_method():
    found = study(RandomLayout(2, 5, same_size=True))
    assert set(found.methods) >= {"uniform", "adaptive", "sides"}
    assert found.waypoints["uniform"] == 105
    assert found.methods["uniform"].edges == 1365
    assert found.clearance >= 0.0


def test_sides_are_read_beside_the_obstacles():
    s = np.linspace(0.0, 60.0, 121)
    path = FrenetPath(s, 0.05 * (s - 30.0), np.full(121, 0.05), np.zeros(121))
    obstacles = np.array([[10.0, 0.0, 1.0], [50.0, 0.0, 1.0]])
    assert passed_left(path, obstacles) == (False, True)


def test_a_scene_is_planned_by_every_rule_and_the_tree_finds_the_best_order():
    tried = [study_scene(Asked(seed, 3, 1, brute_force=True)) for seed in range(4)]
    for found in tried:
        assert set(found.cost) == set(RULES)
        best = found.cost[ALL_ORDERS]
        assert found.brute_force == pytest.approx(best, rel=1e-6)
        assert all(cost >= best * (1.0 - 1e-6) for cost in found.cost.values())


def test_a_solver_that_is_not_there_has_a_line(monkeypatch):
    monkeypatch.setattr(speed_times, "ALL_SOLVERS", ("riccati", "nonesuch"))
    timed = time_case(9.0, 1)
    assert set(timed.qp) == {"riccati"}
    assert "nonesuch" in timed.missing["nonesuch"]


def test_the_candidates_of_figure_6_7_are_symmetric_and_of_their_lengths():
    for path in candidate_paths()[:5]:
        assert path.curve.x[-1] == pytest.approx(path.length)
        assert path.peak > 0.0
        half = np.abs(path.curve.curvature)
        assert half == pytest.approx(half[::-1], abs=1e-9)
