import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from planner.bodies import bodies_of, leader_of
from planner.cruise import CruisePlanner, CruiseSettings, thesis_proposed
from planner.cruise.sampling.lateral import full_grid_size, terminal_offsets
from planner.cruise.sampling.longitudinal import longitudinal_profiles
from planner.cruise.sampling.reference_speed import reference_speed
from planner.interface import PlanStatus
from planner.scene import RoadBounds
from tests.planner.scenes import (
    TARGET,
    Car,
    bend,
    ego_on,
    make_scene,
    road,
    straight,
    winding,
)

SETTINGS = CruiseSettings()


def test_on_a_free_straight_the_reference_speed_is_the_target_speed():
    _, v = reference_speed(make_scene(straight()), SETTINGS)
    np.testing.assert_allclose(v, TARGET)


def test_the_reference_speed_against_a_double_loop():
    path = winding()
    scene = make_scene(path, ego_on(path, 5.0), stop_lines=(70.0,))
    s, v = reference_speed(scene, SETTINGS)
    limit = np.full(s.size, TARGET)
    for k, at in enumerate(s):
        kappa = abs(float(path.at(at).curvature))
        if kappa > 1e-6:
            fastest = math.sqrt(SETTINGS.comfort_lateral_acceleration / kappa)
            limit[k] = min(limit[k], fastest)
        if at >= 70.0 - SETTINGS.stop_gap - scene.vehicle.front_reach:
            limit[k] = 0.0
    for k in range(s.size):
        braked = limit[k:] ** 2 + 2.0 * SETTINGS.comfort_deceleration * (s[k:] - s[k])
        assert v[k] == pytest.approx(math.sqrt(braked.min()), abs=1e-9)


def test_a_curve_lowers_the_reference_speed_before_it_begins():
    path = bend(15.0)
    s, v = reference_speed(make_scene(path), SETTINGS)
    comfortable = math.sqrt(SETTINGS.comfort_lateral_acceleration * 15.0)
    np.testing.assert_allclose(v[(s > 62.0) & (s < 85.0)], comfortable)
    assert np.all(np.diff(v[s < 60.0]) <= 1e-9)
    deceleration = -np.diff(v**2) / (2.0 * np.diff(s))
    assert deceleration.max() <= SETTINGS.comfort_deceleration + 1e-9


@given(st.floats(1.1, 7.0), st.floats(1.1, 7.0))
def test_terminal_offsets_keep_the_body_on_the_road(left, right):
    bounds = road(straight(), left, -right)
    offsets = terminal_offsets(bounds, (0.0, 50.0), 1.05, SETTINGS)
    assert np.all(np.diff(offsets) > 0.0)
    assert offsets.min() >= max(-right + 1.05, -SETTINGS.lateral_limit) - 1e-9
    assert offsets.max() <= min(left - 1.05, SETTINGS.lateral_limit) + 1e-9
    assert np.any(np.abs(offsets) < 1e-9)


def test_where_the_road_widens_ahead_the_wider_part_is_sampled():
    bounds = RoadBounds(
        np.array([0.0, 40.0, 50.0]), np.array([2.0, 2.0, 6.0]), -np.ones(3)
    )
    near = terminal_offsets(bounds, (0.0, 30.0), 0.9, SETTINGS)
    far = terminal_offsets(bounds, (0.0, 60.0), 0.9, SETTINGS)
    assert near.max() < 1.2
    assert far.max() > 4.4


def offsets_between(left, right, **changes):
    bounds = road(straight(), left, right)
    settings = replace(SETTINGS, **changes)
    return terminal_offsets(bounds, (0.0, 50.0), 1.0, settings)


def test_the_outermost_places_of_the_body_are_sampled_too():
    expected = [-1.3, -1.0, -0.5, 0.0, 0.5, 0.7]
    np.testing.assert_allclose(offsets_between(1.7, -2.3), expected)
    np.testing.assert_allclose(
        offsets_between(1.7, -2.3, edge_offsets=False), expected[1:-1]
    )
    np.testing.assert_allclose(offsets_between(1.4, -0.9), [0.1, 0.4])


@pytest.mark.parametrize("miss", [0.0, 1e-12, -1e-12])
def test_an_outermost_place_at_a_multiple_of_the_step_is_sampled_once(miss):
    found = offsets_between(2.0 + miss, -2.0 - miss)
    np.testing.assert_allclose(found, [-1.0, -0.5, 0.0, 0.5, 1.0], atol=1e-9)


def test_on_a_road_narrower_than_the_body_there_is_no_offset():
    assert offsets_between(0.7, -0.7).size == 0


@pytest.mark.parametrize("limit", [2.0, 2.2])
@pytest.mark.parametrize("edges", [True, False])
def test_the_full_grid_is_what_a_wide_road_gives(limit, edges):
    changes = {"lateral_limit": limit, "edge_offsets": edges}
    found = offsets_between(20.0, -20.0, **changes)
    assert found.size == full_grid_size(replace(SETTINGS, **changes))


def test_on_a_wide_road_no_candidate_counts_as_off_it():
    path = straight()
    scene = make_scene(path, ego_on(path, 20.0), bounds=road(path, 20.0, -20.0))
    plan = CruisePlanner(SETTINGS).plan(scene, None)
    assert "road" not in plan.stats.removed


def test_whole_numbers_for_the_ego_are_numbers_too():
    path = straight()
    scene = make_scene(path, ego_on(path, 20.0, 0.0, 8.0))
    whole = replace(scene.ego_frenet, s=20, s_dot=8, s_ddot=0, l=0)
    ego = replace(scene.ego, x=20, y=0, speed=8)
    same = replace(scene, ego=ego, ego_frenet=whole, time=0, step=np.float32(0.5))
    # repr tells 1 from 1.0, for which kernels would be compiled anew
    assert repr((same.ego, same.ego_frenet)) == repr((scene.ego, scene.ego_frenet))
    assert (type(same.time), type(same.step)) == (float, float)
    plan = CruisePlanner(SETTINGS).plan(replace(scene, ego=ego, ego_frenet=whole), None)
    assert plan.status is PlanStatus.OK


def profiles(scene, settings=SETTINGS):
    ahead = reference_speed(scene, settings)
    leader = leader_of(scene, bodies_of(scene, 51))
    return longitudinal_profiles(scene, settings, ahead, leader).tracks


@pytest.mark.parametrize("acceleration", [-1.5, 0.0, 1.0])
def test_every_profile_starts_as_the_ego_moves_and_is_one_motion(acceleration):
    path = straight()
    ego = ego_on(path, 20.0, 0.0, 9.0, acceleration=acceleration)
    traffic = [Car(60.0, 0.0, 6.0)]
    scene = make_scene(path, ego, vehicles=traffic, stop_lines=(80.0,))
    made = profiles(scene)
    start = made.rows[:, :3, 0]
    np.testing.assert_allclose(start, [[20.0, 9.0, acceleration]] * len(start))
    s, s_dot, s_ddot, s_dddot = np.moveaxis(made.rows[:, :4], 1, 0)
    h = SETTINGS.step
    # Taylor to third order and half the change of the jerk: quintics have five
    np.testing.assert_allclose(
        np.diff(s_dot), 0.5 * h * (s_ddot[:, 1:] + s_ddot[:, :-1]), atol=0.1
    )
    predicted = 0.5 * h * (s_dot[:, 1:] + s_dot[:, :-1]) - h**2 / 12.0 * np.diff(s_ddot)
    np.testing.assert_allclose(np.diff(s), predicted, atol=5e-3)
    assert np.isfinite(s_dddot).all()


def test_some_profiles_end_at_the_stop_line_and_at_the_following_distance():
    path = straight()
    ego = ego_on(path, 20.0, 0.0, 8.0)
    stop = 60.0
    made = profiles(make_scene(path, ego, stop_lines=(stop,)))
    rest = stop - SETTINGS.stop_gap - 3.8
    standing = np.abs(made.rows[:, 1, -1]) < 1e-9
    assert np.any(np.abs(made.rows[standing, 0, -1] - rest) < 1e-6)

    made = profiles(make_scene(path, ego, vehicles=[Car(55.0, 0.0, 6.0)]))
    rear = 55.0 - 2.4 + 6.0 * 5.0
    target = rear - SETTINGS.standstill_gap - SETTINGS.time_headway * 6.0 - 3.8
    following = np.abs(made.rows[:, 1, -1] - 6.0) < 1e-9
    assert np.any(np.abs(made.rows[following, 0, -1] - target) < 1e-6)


def test_the_thesis_samples_eleven_times_and_one_speed():
    settings = thesis_proposed().settings
    made = profiles(make_scene(straight()), settings)
    np.testing.assert_allclose(made.duration, np.linspace(4.0, 5.0, 11))
    for p, count in enumerate(made.n_valid):
        assert count == round(made.duration[p] / settings.step) + 1
        assert made.rows[p, 1, count - 1] == pytest.approx(TARGET)
