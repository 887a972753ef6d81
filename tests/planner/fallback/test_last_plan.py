"""The last plan without its driven step."""

import numpy as np
import pytest

from planner.fallback.last_plan import shifted_plan
from planner.states import Trajectory
from tests.planner.fallback.last_plans import COLUMNS, plan_along, scene_after
from tests.planner.scenes import STEP, ego_on, make_scene, straight

HORIZON = 5.0


@pytest.mark.parametrize(
    ("aside", "faster"), [(0.2, 0.0), (0.0, 0.5), (-0.2, 0.0), (0.0, -0.5)]
)
def test_a_plan_that_the_ego_is_not_on_is_not_shifted(aside, faster):
    path = straight()
    last = plan_along(path, 50.0, 10.0)
    ego = ego_on(path, 51.0, aside, 10.0 + faster)
    assert shifted_plan(make_scene(path, ego), last) is None


def test_a_plan_that_is_used_up_is_not_shifted():
    path = straight()
    last = plan_along(path, 50.0, 10.0)
    short = Trajectory(last.t[:2], *(getattr(last, name)[:2] for name in COLUMNS))
    assert shifted_plan(scene_after(path, last), short) is None


@pytest.mark.parametrize("time_step", [0.07, 0.3])
def test_a_plan_at_other_times_than_the_loop_begins_where_the_ego_is(time_step):
    path = straight(200.0)
    fine = plan_along(path, 10.0, 8.0)
    t = time_step * np.arange(8)
    columns = [np.interp(t, fine.t, getattr(fine, name)) for name in COLUMNS]
    last = Trajectory(t, *columns)
    scene = make_scene(path, last.at(STEP), near=10.0)
    shifted = shifted_plan(scene, last)
    later = t[t > STEP] - STEP
    np.testing.assert_allclose(shifted.t, [0.0, *later], atol=1e-12)
    assert shifted.t[0] == 0.0
    np.testing.assert_allclose(shifted.s, 10.0 + 8.0 * (shifted.t + STEP))
    np.testing.assert_allclose(shifted.x, [scene.ego.x, *last.x[t > STEP]])
    assert shifted.at(0.0) == last.at(STEP)


def test_a_plan_can_be_shifted_again_and_again():
    path = straight()
    plan = plan_along(path, 50.0, 10.0)
    first = plan
    for k in range(1, 20):
        plan = shifted_plan(make_scene(path, plan.at(STEP)), plan)
        np.testing.assert_allclose(plan.x, first.x[k:])
        assert plan.t[0] == pytest.approx(0.0, abs=1e-12)
