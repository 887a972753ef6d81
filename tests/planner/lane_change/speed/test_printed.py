"""The thesis' speed planning as printed: by hand, and its faults on random scenes."""

from dataclasses import replace

import numpy as np
import pytest

from planner.lane_change import area, thesis
from planner.lane_change.path import lane_keeping_path
from planner.lane_change.settings import (
    OrderRule,
    PathSettings,
    PrintedPieces,
    SpeedSettings,
)
from planner.lane_change.speed.passing_orders import DriveLimits, Side
from planner.lane_change.speed.plan import plan_speed
from planner.lane_change.speed.printed import corner_graph, printed_order
from planner.lane_change.speed.program import SpeedTask, knot_times
from planner.lane_change.speed.st_graph import StGraph, in_time, st_graph
from planner.vehicle import Vehicle
from tests.planner.lane_change.roads import on_lanes
from tests.planner.lane_change.speed.test_plan import BARE, change_path, random_scene
from tests.planner.scenes import Car

CAR = Vehicle()
TIMES = knot_times(SpeedSettings())
OMEGA = 1.75
LIMITS = DriveLimits(-4.0, 3.0, 20.0)
AREA = replace(BARE, order_rule=OrderRule.AREA)


def straight_on(scene):
    return lane_keeping_path(scene.path, scene.ego_frenet, -1.75, 220.0, PathSettings())


def corners(scene, path):
    users = in_time(scene.vehicles, TIMES)
    everyone = np.ones(len(scene.vehicles.ids), np.bool_)
    return corner_graph(path, users, everyone, OMEGA)


def test_a_car_in_the_lane_is_projected_from_corner_to_corner():
    # its centre 40 m ahead of the rear axle, standing, 4.8 m long
    scene = on_lanes(cars=[Car(140.0, -1.75, 0.0)])
    graph = corners(scene, straight_on(scene))
    assert graph.hit.all()
    np.testing.assert_allclose(graph.lower, 40.0 - 2.4, atol=1e-9)
    np.testing.assert_allclose(graph.upper, 40.0 + 2.4, atol=1e-9)


def test_a_car_half_in_the_lane_is_not_there():
    # its left corners are 0.95 + 1 m from the path: more than omega
    scene = on_lanes(cars=[Car(140.0, -0.75, 0.0)])
    path = straight_on(scene)
    assert corners(scene, path).ids == ()
    users = in_time(scene.vehicles, TIMES)
    ours = st_graph(path, CAR, users, np.ones(1, np.bool_), 1.0, 0.3)
    assert ours.ids == ("car.0",)


def graph_of(first, low, high):
    """Return the graph of one vehicle that is on the path from a knot on."""
    hit = (np.arange(TIMES.size) >= first)[None]
    n = np.ones((1, TIMES.size))
    return StGraph(("a",), (0,), hit, low * n, high * n, np.zeros(1))


def test_bounds_before_the_first_contact_are_the_printed_parabolas():
    # v0 = 10 m/s, t0 = 2 s, ub = 24 m: 10 t + (24 - 20) / 4 t²; a 3, S_L 60
    order = printed_order(
        graph_of(20, 20.0, 24.0), (Side.BEFORE,), 10.0, LIMITS, 60.0, TIMES
    )
    assert order.lower[10] == pytest.approx(11.0)
    assert order.lower[20] == order.lower[50] == pytest.approx(24.0)
    assert order.upper[10] == pytest.approx(10.0 + 1.5)
    assert order.upper[-1] == 60.0
    # lb = 16 m: 10 t + (16 - 20) / 4 t² above, braking with 4 to a stand below
    order = printed_order(
        graph_of(20, 16.0, 24.0), (Side.AFTER,), 10.0, LIMITS, 60.0, TIMES
    )
    assert order.upper[10] == pytest.approx(9.0)
    assert order.upper[20] == pytest.approx(16.0)
    assert order.lower[10] == pytest.approx(10.0 - 2.0)
    assert order.lower[-1] == pytest.approx(10.0**2 / 8.0)
    assert np.isinf(order.headway).all()


def test_the_printed_objective_stops_the_car():
    scene = on_lanes(speed=10.0)
    path, task = straight_on(scene), SpeedTask(10.0, 0.0, 14.0)
    users, nobody = in_time(scene.vehicles, TIMES), np.zeros(0, np.bool_)
    printed = replace(AREA, printed=PrintedPieces(objective=True))
    stops = plan_speed(path, CAR, users, nobody, task, printed).profile
    goes = plan_speed(path, CAR, users, nobody, task, AREA).profile
    assert stops.speed[-1] < 0.1
    assert goes.speed[-1] > 12.0


def planned_with(scene, **pieces):
    path = change_path(scene)
    settings = replace(AREA, printed=PrintedPieces(**pieces))
    users = in_time(scene.vehicles, TIMES)
    everyone = np.ones(len(scene.vehicles.ids), np.bool_)
    task = SpeedTask(scene.ego.speed, scene.ego.acceleration, 13.9)
    return plan_speed(path, CAR, users, everyone, task, settings), path, users


def overlaps(plan, path, users):
    """Tell whether the plan drives into a rectangle at a knot."""
    everyone = np.ones(len(users.ids), np.bool_)
    graph = st_graph(path, CAR, users, everyone, 0.0, 0.0)
    driven = plan.profile.distance
    inside = graph.hit & (graph.lower < driven - 0.05) & (driven + 0.05 < graph.upper)
    return bool(inside.any())


def test_faults_of_the_printed_pieces_on_random_scenes():
    # of 60 scenes: plans that hit someone, and scenes without a plan
    hits, unsolved = {"corners": 0, "ours": 0}, {"bounds": 0, "ours": 0}
    for seed in range(60):
        scene = random_scene(np.random.default_rng(seed), 4)
        ours, path, users = planned_with(scene)
        literal, *_ = planned_with(scene, four_corners=True)
        bounded, *_ = planned_with(scene, region_bounds=True)
        for name, plan in (("corners", literal), ("ours", ours)):
            hits[name] += plan.profile is not None and overlaps(plan, path, users)
        unsolved["bounds"] += bounded.profile is None
        unsolved["ours"] += ours.profile is None
    assert hits["ours"] == 0
    assert hits["corners"] > 0
    assert unsolved["bounds"] > unsolved["ours"]


def test_the_planner_of_the_thesis_has_all_pieces_and_the_area_rule_none():
    pieces = thesis().settings.speed.printed
    assert pieces.four_corners
    assert pieces.region_bounds
    assert pieces.objective
    assert area().settings.speed.printed == PrintedPieces()
    rules = {p().settings.speed.order_rule for p in (thesis, area)}
    assert rules == {OrderRule.AREA}
