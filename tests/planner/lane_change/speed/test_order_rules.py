from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import quad

from planner.lane_change import area, conventional, proposed
from planner.lane_change.settings import OrderRule
from planner.lane_change.speed.area_rule import area_above, area_below
from planner.lane_change.speed.dynamic_programming import CourseWeights, search
from planner.lane_change.speed.passing_orders import DriveLimits, Side
from planner.vehicle import Vehicle
from tests.planner.lane_change.roads import on_lanes
from tests.planner.lane_change.speed.test_plan import (
    BARE,
    PUBLISHED,
    SETTINGS,
    planned,
    random_scene,
)
from tests.planner.scenes import Car

LIMITS, WEIGHTS = DriveLimits(-4.5, 3.0, 20.0), CourseWeights(0.05, 1.0, 2.0)
AREA = replace(SETTINGS, order_rule=OrderRule.AREA)
SEARCH = replace(SETTINGS, order_rule=OrderRule.DYNAMIC_PROGRAMMING)


@pytest.mark.parametrize(
    ("speed", "side"), [(9.0, Side.AFTER), (15.0, Side.BEFORE)], ids=["B", "A"]
)
@pytest.mark.parametrize("rule", [OrderRule.AREA, OrderRule.DYNAMIC_PROGRAMMING])
def test_the_published_cases_come_out_by_every_rule(speed, side, rule):
    rear = Car(100.0 + Vehicle().centre_offset - 12.0, 1.75, 14.0)
    scene = on_lanes(speed=speed, cars=[rear])
    plan, _ = planned(scene, PUBLISHED, replace(BARE, order_rule=rule), 11.0)
    assert plan.order == (("car.0", side),)


def test_areas_are_the_integrals():
    t0, v, a, b, high, low, end = 3.0, 10.0, 2.5, -4.0, 36.0, 20.0, 200.0
    times = np.linspace(0.0, t0, 3001)

    def above(t: float) -> float:
        return (
            min(v * t + 0.5 * a * t * t, end) - v * t - (high - v * t0) * (t / t0) ** 2
        )

    def below(t: float) -> float:
        moving = min(t, -v / b)
        floor = v * moving + 0.5 * b * moving**2
        return v * t + (low - v * t0) * (t / t0) ** 2 - floor

    assert area_above(times, v, a, high, end) == pytest.approx(
        quad(above, 0.0, t0)[0], abs=1e-4
    )
    assert area_below(times, v, b, low) == pytest.approx(
        quad(below, 0.0, t0)[0], abs=1e-4
    )


def test_no_rule_finds_a_cheaper_order_than_all_of_them():
    worse = {AREA: 0, SEARCH: 0}
    for seed in range(40):
        scene = random_scene(np.random.default_rng(seed), 4)
        best, _ = planned(scene, Vehicle(), SETTINGS, 13.9)
        for rule in worse:
            plan, _ = planned(scene, Vehicle(), rule, 13.9)
            assert plan.cost >= best.cost * (1.0 - 1e-5) - 1e-5
            worse[rule] += bool(plan.cost > best.cost * 1.001 + 1e-3)
    assert worse[AREA] > 0  # the area is a poor proxy


def test_the_search_keeps_free_of_what_is_covered():
    times, places = np.linspace(0.0, 10.0, 17), np.linspace(0.0, 200.0, 321)
    free = np.ones((17, 321), np.bool_)
    free[4:, 100:140] = False
    free[12:, 140:] = False
    course = search(times, places, free, 10.0, LIMITS, 12.0, WEIGHTS)
    assert all(free[k, i] for k, i in enumerate(course))
    assert (np.diff(course) >= 0).all()
    free[8] = False
    closed = search(times, places, free, 10.0, LIMITS, 12.0, WEIGHTS)
    assert closed[-1] == -1


def test_presets_differ_in_the_rule_alone():
    rules = [p().settings.speed.order_rule for p in (proposed, area, conventional)]
    assert rules == list(OrderRule)
    assert area().settings.path == proposed().settings.path
