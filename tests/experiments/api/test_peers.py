"""Planners of others drive as planners here."""

import math
import sys
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
import rearview
from hypothesis import given
from hypothesis import strategies as st
from rearview import peers

from experiments.api.peers import _from_centre, towed
from experiments.errors import ConfigError
from planner.interface import PlanStatus
from planner.vehicle import Vehicle
from tests.planner.scenes import Car, Disc, ego_on, make_scene, straight, winding

KINDS = ("fop", "fop_plus", "fiss", "fiss_plus")


def test_without_the_package_one_line_says_how_to_get_it(monkeypatch):
    monkeypatch.setitem(sys.modules, "fiss_planner", None)
    with pytest.raises(ConfigError, match=r"pip install fiss-planner==1\.0\.0"):
        peers.fiss_plus()


@given(
    radius=st.floats(5.0, 200.0),
    turn=st.sampled_from([-1.0, 1.0]),
    offset=st.floats(0.5, 3.0),
)
def test_on_a_circle_the_rear_axle_rolls_on_a_smaller_one(radius, turn, offset):
    angle = np.arange(0.0, 1.5, 0.02 / radius * 10.0)
    heading = turn * angle
    axle = radius * np.column_stack([np.sin(angle), turn * (1.0 - np.cos(angle))])
    led = axle + offset * np.column_stack([np.cos(heading), np.sin(heading)])
    found, askew = towed(led[:, 0], led[:, 1], 0.0, offset)
    assert found == pytest.approx(heading, abs=0.02)
    assert np.tan(askew[1:-1]) / offset == pytest.approx(turn / radius, rel=0.05)


@given(course=st.floats(-1.5, 1.5), offset=st.floats(0.5, 3.0), n=st.integers(2, 60))
def test_on_a_straight_line_a_body_turns_as_the_tractrix_says(course, offset, n):
    way = np.linspace(0.0, 8.0, n)
    heading, _ = towed(way * math.cos(course), way * math.sin(course), 0.0, offset)
    left = 2.0 * math.atan(math.tan(course / 2.0) * math.exp(-8.0 / offset))
    assert heading[-1] == pytest.approx(course - left, abs=1e-9)  # however many points
    assert heading[0] == 0.0


@given(
    along=st.lists(st.floats(-0.02, 0.15), min_size=50, max_size=50),
    across=st.lists(st.floats(-0.12, 0.12), min_size=50, max_size=50),
)
def test_what_crawls_sideways_and_back_is_held_and_bent_within_bounds(along, across):
    path = straight()
    ego = ego_on(path, 20.0, 0.0, 0.5)
    scene = make_scene(path, ego)
    offset = scene.vehicle.centre_offset
    x = 20.0 + offset + np.concatenate(((0.0,), np.cumsum(along)))
    y = np.concatenate(((0.0,), np.cumsum(across)))
    t = 0.1 * np.arange(x.size)
    speed = np.hypot(np.gradient(x, t), np.gradient(y, t))
    native = SimpleNamespace(t=t, x=x, y=y, s=x, v=speed, a=np.gradient(speed, t))
    plan, stands = _from_centre(scene, native)
    assert plan.is_finite()
    assert np.abs(plan.curvature).max() < 5.0 / offset
    rolled = np.diff(plan.x) * np.cos(plan.heading[:-1])
    rolled += np.diff(plan.y) * np.sin(plan.heading[:-1])
    assert rolled.min() > -0.02  # a chord of an arc, no way back
    assert (plan.speed[stands:] == 0.0).all()


def test_a_body_that_stands_keeps_its_heading():
    zero = np.zeros(5)
    heading, askew = towed(zero, zero, 0.7, 1.4)
    assert (heading == 0.7).all()
    assert (askew == 0.0).all()


def test_an_ego_that_stands_askew_moves_off_without_a_jump(planner):
    """Its course is the road's, its heading is not: the body turns as it rolls."""
    path = straight()
    ego = replace(ego_on(path, 20.0, 0.3, 0.0), heading=0.25)
    memory = None
    for _ in range(30):
        scene = make_scene(path, ego, target_speed=8.0)
        result = planner.plan(scene, memory)
        plan, memory = result.trajectory, result.memory
        assert (plan.x[0], plan.y[0]) == pytest.approx((ego.x, ego.y), abs=0.02)
        after = plan.at(scene.step)
        moved = math.hypot(after.x - ego.x, after.y - ego.y)
        assert moved <= max(ego.speed, after.speed) * scene.step + 0.03
        ego = after
    assert ego.speed > 1.0


@pytest.fixture(params=KINDS)
def planner(request):
    pytest.importorskip("fiss_planner")
    return getattr(peers, request.param)()


def test_plans_start_at_the_ego_and_go_on_from_each_other(planner):
    path = winding()
    ego, memory = ego_on(path, 5.0, 0.3, 6.0), None
    for _ in range(5):
        scene = make_scene(path, ego, target_speed=8.0)
        result = planner.plan(scene, memory)
        assert result.status is PlanStatus.OK
        plan, memory = result.trajectory, result.memory
        assert (plan.x[0], plan.y[0]) == pytest.approx((ego.x, ego.y), abs=0.02)
        assert plan.heading[0] == pytest.approx(ego.heading, abs=0.02)
        assert plan.speed[0] == pytest.approx(ego.speed, abs=0.05)
        moved = np.hypot(np.diff(plan.x), np.diff(plan.y))
        mean = 0.5 * (plan.speed[1:] + plan.speed[:-1])
        assert moved == pytest.approx(mean * scene.step, abs=0.05)
        ego = plan.at(scene.step)


def test_they_see_obstacles_vehicles_and_lines(planner):
    path = straight()
    ego = ego_on(path, 20.0, 0.0, 10.0)
    front = Vehicle().front_reach

    def ends(**scene):
        plan = planner.plan(make_scene(path, ego, **scene), None).trajectory
        return plan.s[-1], np.abs(plan.l).max(), plan.speed[-1]

    free, _, _ = ends()
    far, _, slow = ends(stop_lines=(60.0,))
    assert far + front < 60.0 < free
    assert slow < 8.0  # of 10: their end speeds are a quarter of the target apart
    _, aside, _ = ends(obstacles=[Disc(60.0, 0.0, 0.5)])
    behind, swerved, _ = ends(vehicles=[Car(45.0, 0.0, 3.0)])
    assert aside > 0.5 or ends(obstacles=[Disc(60.0, 0.0, 0.5)])[0] + front < 59.5
    assert swerved > 1.0 or behind + front < 45.0 + 5.0 * 3.0


def test_where_they_find_nothing_the_ego_brakes(planner):
    path = straight()
    scene = make_scene(path, ego_on(path, 20.0, 0.0, 10.0), stop_lines=(26.0,))
    result = planner.plan(scene, None)
    assert result.status is not PlanStatus.OK
    assert result.trajectory.speed[-1] == pytest.approx(0.0, abs=1e-6)
    assert "candidates" in result.stats.reason


def test_an_episode_is_the_same_again(tmp_path):
    pytest.importorskip("fiss_planner")
    scenario = rearview.Scenario.load("thesis_straight").with_(
        {"obstacles": "none", "ego.goal_m": 80}, planner="rearview.peers:fiss_plus"
    )
    first, again = (scenario.run(tmp_path / name) for name in "ab")
    assert first.status == "arrived", first.reason
    assert first.trace_hash == again.trace_hash
